//! The copy of a log's data section into a new file: at once, or while other work is done.

use std::fs::File;
use std::io::{self, Read, Seek};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use super::file::LogFile;
use super::{LogError, Observer, Work, interrupt};

/// So much is copied before somebody who wants it to end is heard. A multiple of any file system's block, so
/// that blocks can be shared.
const PIECE: u64 = 64 << 20;

/// A copy that gets on beside other work, to the disk: the kernel does it. Given up when dropped.
#[derive(Debug)]
pub(super) struct Copying {
    stop: Arc<AtomicBool>,
    /// `None` once it was waited for.
    thread: Option<JoinHandle<Result<(), LogError>>>,
}

impl Copying {
    /// Begins to copy the first `len` bytes of `log` to the start of `file`, which will be `out`. What stands behind
    /// them in `file` can be written meanwhile, at its place.
    pub(super) fn begin(log: &LogFile, len: u64, file: &File, out: &Path) -> Result<Self, LogError> {
        let written = |source| LogError::Write { path: out.to_owned(), source };
        let stop = Arc::new(AtomicBool::new(false));
        let mut copy = Copy {
            from: log.file.try_clone().map_err(written)?,
            to: file.try_clone().map_err(written)?,
            log: log.path.clone(),
            out: out.to_owned(),
            observer: log.options.observer.clone(),
            stop: Arc::clone(&stop),
        };
        let thread = std::thread::Builder::new().spawn(move || copy.run(len)).map_err(written)?;
        Ok(Self { stop, thread: Some(thread) })
    }

    /// Waits until all is copied.
    pub(super) fn finish(&mut self) -> Result<(), LogError> {
        match self.thread.take().map(JoinHandle::join) {
            Some(Err(panic)) => std::panic::resume_unwind(panic),
            Some(Ok(done)) => done,
            None => Ok(()),
        }
    }
}

impl Drop for Copying {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // nobody wants the copy any more, whatever became of it
            let _ = thread.join();
        }
    }
}

/// The first `len` bytes of a log, at the start of `file`, which will be `out`.
pub(super) fn copy_start(log: &LogFile, len: u64, file: &File, out: &Path) -> Result<(), LogError> {
    Copying::begin(log, len, file, out)?.finish()
}

/// Both are plain files, so that the kernel copies, and shares blocks where it can.
struct Copy {
    from: File,
    to: File,
    log: PathBuf,
    out: PathBuf,
    observer: Observer,
    stop: Arc<AtomicBool>,
}

impl Copy {
    fn run(&mut self, len: u64) -> Result<(), LogError> {
        let written = |source| LogError::Write { path: self.out.clone(), source };
        self.from.rewind().map_err(written)?;
        self.to.rewind().map_err(written)?;
        let mut copied = 0;
        while copied < len && !self.stop.load(Ordering::Relaxed) {
            interrupt::check(&self.out)?;
            let mut piece = (&self.from).take(PIECE.min(len - copied));
            let read = io::copy(&mut piece, &mut self.to).map_err(written)?;
            if read == 0 {
                let what = format!("only {copied} bytes of the data section are left, expected {len}");
                return Err(LogError::Damaged { path: self.log.clone(), offset: copied, what });
            }
            copied += read;
            self.observer.tell(Work::Copy, copied, len);
        }
        // the disk, too, has time now, and the sync at the end little left to do
        if self.stop.load(Ordering::Relaxed) { Ok(()) } else { self.to.sync_data().map_err(written) }
    }
}
