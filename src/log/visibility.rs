//! How readers find messages, and how they shall go on finding them when new channels come.
//!
//! Readers take one of two ways. With a chunk index they read the chunks that it names, and nothing else: messages
//! outside chunks, and chunks that it leaves out, aren't there for them (PyPI `mcap`, `@mcap/core`, the mcap
//! crate). `@mcap/core` reads through message indexes besides, and gives up at a chunk index without them.
//! Without a chunk index PyPI `mcap` and viewers read the whole file; viewers also where the summary has no channels. So a chunk index of the new chunks alone
//! would hide the old messages, and one of all chunks those that no index can name.

/// How readers find the messages of a log's successor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// A chunk index names all messages, old and new.
    Indexed,
    /// The log's chunk index names some of its messages only: the new ones are added to it, so that a reader sees
    /// what it saw before, and the new ones.
    Partly {
        /// The first part of the log that some readers don't see.
        offset: u64,
    },
    /// There is no chunk index, as there was none before: readers scan, and see all.
    Scanned {
        /// The first part of the log that couldn't be indexed.
        offset: u64,
        /// Whether there is a summary at all, as there was before.
        summary: bool,
    },
}

impl Visibility {
    /// What a person may want to know of it.
    #[must_use]
    pub fn note(self) -> Option<String> {
        match self {
            Self::Indexed => None,
            Self::Partly { offset } => Some(format!(
                "the log has messages that its index doesn't name, the first near offset {offset}: readers that go \
                 by the index don't see them, as before"
            )),
            Self::Scanned { offset, .. } => Some(format!(
                "the log has messages that no index can name (outside chunks, or in chunks without a message \
                 index), the first near offset {offset}: readers must scan the output, as they had to before"
            )),
        }
    }
}
