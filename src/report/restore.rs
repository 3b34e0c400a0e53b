//! The report of `restore`.

use schemars::JsonSchema;
use serde::Serialize;

/// The report of `restore`: what was written where.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RestoreReport {
    /// Version of the program.
    pub version: String,
    /// The log that was added to.
    pub log: String,
    /// The log that was written; the same where it was restored in place.
    pub output: String,
    /// Length of the output in bytes.
    pub bytes: String,
    /// Whether a run had been cut off while it added to the log, and only that was undone.
    pub cut_off_run: bool,
    /// How many additions were taken off.
    pub additions_taken_off: usize,
    /// How many earlier ones are still in the output.
    pub additions_left: usize,
    /// Whether the original's data section is as its checksum says: `right` or `wrong`; `not checked` where it has
    /// none, in place, and after a run that was cut off.
    pub data_section: String,
    /// What a person must read.
    pub warnings: Vec<String>,
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_schema_in_the_tree_is_the_one_of_this_code() {
        super::super::tests::assert_schema(&schemars::schema_for!(super::RestoreReport), "restore");
    }
}
