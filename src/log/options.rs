//! How a log is read: what it may take, and who is told how far it is.

use std::fmt;
use std::sync::Arc;

/// What one record or one chunk may take in memory, where nobody says otherwise. Recorders write chunks of 1 to
/// 8 MB; the largest single messages (point clouds, images) have some hundred MB.
const MEMORY_LIMIT: u64 = 1 << 30;

/// How a log is read.
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// What one record or one chunk may take in memory, bytes. Default: 1 GiB.
    pub memory_limit: u64,
    /// Whether chunks are always read whole, so that their checksums are checked. Else messages that lie far
    /// apart in uncompressed chunks are read where the message indexes say they stand. Default: false.
    pub whole_chunks: bool,
    /// Who is told how far long work is. Default: nobody.
    pub observer: Observer,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { memory_limit: MEMORY_LIMIT, whole_chunks: false, observer: Observer::default() }
    }
}

/// Long work on a log's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// What the summary lacks is looked up in the data section.
    Scan,
    /// Messages are read.
    Read,
    /// The data section is copied.
    Copy,
}

/// How far long work is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// What is done.
    pub work: Work,
    /// How many of the file's bytes are done with.
    pub done: u64,
    /// Of how many.
    pub total: u64,
}

type Tell = dyn Fn(Progress) + Send + Sync;

/// Is told how far long work is, some times a second or more often.
#[derive(Clone, Default)]
pub struct Observer(Option<Arc<Tell>>);

impl Observer {
    /// One that calls `tell`.
    #[must_use]
    pub fn new(tell: impl Fn(Progress) + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(tell)))
    }

    /// Tells it.
    pub fn tell(&self, work: Work, done: u64, total: u64) {
        if let Some(tell) = &self.0 {
            tell(Progress { work, done, total });
        }
    }
}

impl fmt::Debug for Observer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "Observer" } else { "nobody" })
    }
}
