//! What is wrong with a log, and where.

use std::fmt;

use super::LogError;

/// So many things are named one by one; who has more to repair than that knows enough.
const MOST_NAMED: usize = 50;

/// One thing that is wrong with a log. The rest of it can be used all the same.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Damage {
    /// Where, in bytes from the log's start.
    pub offset: u64,
    /// What was found, and what was expected.
    pub what: String,
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "damaged at offset {}: {}", self.offset, self.what)
    }
}

/// What was found so far, in the order in which it was found.
#[derive(Clone, Debug, Default)]
pub(super) struct Damages {
    pub(super) found: Vec<Damage>,
}

impl Damages {
    pub(super) fn push(&mut self, offset: u64, what: impl Into<String>) {
        let what = match self.found.len() {
            ..MOST_NAMED => what.into(),
            MOST_NAMED => "there is more damage, from here on or before".to_owned(),
            _ => return,
        };
        self.found.push(Damage { offset, what });
    }

    /// Takes damage down, and lets other errors pass: that a disk can't be read is no property of the log.
    pub(super) fn note<T>(&mut self, result: Result<T, LogError>) -> Result<Option<T>, LogError> {
        match result {
            Ok(value) => Ok(Some(value)),
            Err(LogError::Damaged { offset, what, .. }) => {
                self.push(offset, what);
                Ok(None)
            }
            Err(other) => Err(other),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_of_nothing_but_damage_is_not_listed_at_length() {
        let mut damages = Damages::default();
        (0..1_000_000).for_each(|i| damages.push(i, "bad"));
        assert_eq!(damages.found.len(), MOST_NAMED + 1);
        assert_eq!(damages.found[3].to_string(), "damaged at offset 3: bad");
        assert!(damages.found[MOST_NAMED].what.contains("more damage"));
    }
}
