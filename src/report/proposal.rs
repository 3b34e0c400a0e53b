//! What is to be said of a config that was made for a log.

use schemars::JsonSchema;
use serde::Serialize;

use super::inspection::TakenSource;

/// The report of `init`.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct InitReport {
    /// Version of the program.
    pub version: String,
    /// The log.
    pub input: String,
    /// The file that the config was written to; null for stdout.
    pub output: Option<String>,
    /// The sources that the config names, the datum first; empty where a person must choose.
    pub sources: Vec<TakenSource>,
    /// What a person must decide before `fuse` takes the config.
    pub undecided: Option<String>,
    /// The config's text.
    pub config: String,
    /// What a person must read.
    pub warnings: Vec<String>,
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_schema_in_the_tree_is_the_one_of_this_code() {
        super::super::tests::assert_schema(&schemars::schema_for!(super::InitReport), "init");
    }
}
