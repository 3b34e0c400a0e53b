//! Ctrl-C while an output is being written: the output is taken back before the program ends.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::LogError;

/// How many outputs are open.
static OPEN: AtomicUsize = AtomicUsize::new(0);

/// What a signal handler needs to know and to tell. This library installs none.
#[derive(Debug)]
pub struct Interruption {
    /// Whether the program may end at once: nothing is being written, or this is not the first signal.
    pub at_once: AtomicBool,
    /// Set it, and the writing of every output ends with [`LogError::Interrupted`].
    pub asked: AtomicBool,
}

/// The one of this process.
pub static INTERRUPTION: Interruption =
    Interruption { at_once: AtomicBool::new(true), asked: AtomicBool::new(false) };

/// While it lives, an output is being written.
#[derive(Debug)]
pub(super) struct Writing;

impl Writing {
    pub(super) fn begin() -> Self {
        OPEN.fetch_add(1, Ordering::SeqCst);
        INTERRUPTION.at_once.store(false, Ordering::SeqCst);
        Self
    }
}

impl Drop for Writing {
    fn drop(&mut self) {
        if OPEN.fetch_sub(1, Ordering::SeqCst) == 1 {
            INTERRUPTION.at_once.store(true, Ordering::SeqCst);
        }
    }
}

/// An error when somebody wants the writing of `path` to end.
pub(super) fn check(path: &std::path::Path) -> Result<(), LogError> {
    if INTERRUPTION.asked.load(Ordering::SeqCst) {
        return Err(LogError::Interrupted { path: path.to_owned() });
    }
    Ok(())
}
