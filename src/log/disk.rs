//! Each step that changes something on the disk, so that tests can cut a run off at any of them.

use std::{
    ffi::OsStr,
    fs::{self, File},
    io,
    path::Path,
};

/// What one step does, by name: the order of steps is what a crash leaves behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Bytes are written, with this much of them on the disk when it is cut off: half.
    Write,
    /// A file's length is set.
    SetLen,
    /// A file's bytes and length are on the disk.
    Sync,
    /// A file has another name.
    Rename,
    /// A file is gone.
    Remove,
    /// A folder's names are on the disk.
    SyncFolder,
}

/// Writes all of `bytes` at `offset`.
pub(super) fn write_at(file: &File, bytes: &[u8], offset: u64) -> io::Result<()> {
    if let Err(cut) = take(Step::Write) {
        put(file, bytes.get(..bytes.len() / 2).unwrap_or_default(), offset)?;
        return Err(cut);
    }
    put(file, bytes, offset)
}

fn put(file: &File, mut bytes: &[u8], mut offset: u64) -> io::Result<()> {
    while !bytes.is_empty() {
        #[cfg(unix)]
        let written = std::os::unix::fs::FileExt::write_at(file, bytes, offset);
        #[cfg(windows)]
        let written = std::os::windows::fs::FileExt::seek_write(file, bytes, offset);
        let written = match written {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
            other => other?,
        };
        bytes = bytes.get(written..).unwrap_or_default();
        offset += written as u64;
    }
    Ok(())
}

pub(super) fn set_len(file: &File, len: u64) -> io::Result<()> {
    take(Step::SetLen)?;
    file.set_len(len)
}

pub(super) fn sync(file: &File) -> io::Result<()> {
    take(Step::Sync)?;
    file.sync_all()
}

pub(super) fn rename(from: &Path, to: &Path) -> io::Result<()> {
    take(Step::Rename)?;
    fs::rename(from, to)
}

pub(super) fn remove(path: &Path) -> io::Result<()> {
    take(Step::Remove)?;
    fs::remove_file(path)
}

/// Waits until the names in the folder of `path` are on the disk, where the system can do that.
pub(super) fn sync_folder(path: &Path) -> io::Result<()> {
    take(Step::SyncFolder)?;
    #[cfg(unix)]
    match File::open(folder(path)).and_then(|folder| folder.sync_all()) {
        // some network file systems have no such thing
        Err(e) if matches!(e.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => {}
        done => done?,
    }
    Ok(())
}

pub(super) fn folder(path: &Path) -> &Path {
    path.parent().filter(|dir| !dir.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The path with `suffix` behind its name.
pub(super) fn with_suffix(path: &Path, suffix: &str) -> std::path::PathBuf {
    let mut name = path.file_name().unwrap_or(OsStr::new("")).to_owned();
    name.push(suffix);
    path.with_file_name(name)
}

#[cfg(not(test))]
#[expect(clippy::unnecessary_wraps, reason = "in tests it can fail")]
pub(super) fn take(_: Step) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
pub(super) use cut::take;

/// Cuts a run off in this thread.
#[cfg(test)]
pub(super) mod cut {
    use std::cell::{Cell, RefCell};
    use std::io;

    use super::Step;

    /// At which step, counted from 0, a run fails.
    #[derive(Clone, Copy, Debug)]
    pub(in super::super) enum Cut {
        /// This step fails, as on a full disk; the rest works.
        Once(usize),
        /// From this step on nothing works: the process is dead, or the disk.
        From(usize),
    }

    thread_local! {
        static CUT: Cell<Option<Cut>> = const { Cell::new(None) };
        static STEPS: RefCell<Vec<Step>> = const { RefCell::new(Vec::new()) };
    }

    pub(in super::super) fn take(step: Step) -> io::Result<()> {
        let n = STEPS.with_borrow_mut(|steps| {
            steps.push(step);
            steps.len() - 1
        });
        match CUT.get() {
            Some(Cut::Once(at)) if n == at => Err(io::ErrorKind::StorageFull.into()),
            Some(Cut::From(at)) if n >= at => Err(io::Error::other("cut off")),
            _ => Ok(()),
        }
    }

    /// What `run` gives when it is cut off, and the steps that it took or tried.
    pub(in super::super) fn during<T>(cut: Option<Cut>, run: impl FnOnce() -> T) -> (T, Vec<Step>) {
        STEPS.with_borrow_mut(Vec::clear);
        CUT.set(cut);
        let result = run();
        CUT.set(None);
        (result, STEPS.with_borrow_mut(std::mem::take))
    }
}
