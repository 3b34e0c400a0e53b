//! What was found to be wrong: as much as a person can read, and the count of the rest.

use std::fmt::Display;

/// A file that is broken all over would fill the memory with what is said about it.
const MOST_KEPT: usize = 100;
/// Names longer than this are shortened.
const LONGEST_NAME: usize = 60;

/// Something that is wrong with a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Where in the file: the record that it is about begins here.
    pub offset: u64,
    /// What was found, and what was expected.
    pub what: String,
}

/// The findings so far.
#[derive(Debug, Default)]
pub(super) struct Findings {
    pub(super) kept: Vec<Finding>,
    /// How many more there were.
    pub(super) left_out: u64,
}

impl Findings {
    pub(super) fn wrong(&mut self, offset: u64, what: impl Display) {
        if self.kept.len() < MOST_KEPT {
            self.kept.push(Finding { offset, what: what.to_string() });
        } else {
            self.left_out += 1;
        }
    }
}

/// A name out of a log, in quotes, the end of a long one left out.
pub(super) fn quoted(name: &str) -> String {
    if name.chars().count() <= LONGEST_NAME {
        return format!("{name:?}");
    }
    let begin: String = name.chars().take(LONGEST_NAME).collect();
    format!("{begin:?}...")
}
