//! Runs cut off at each of their steps: the original is there, or can be had again.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::disk::Step;
use super::disk::cut::{Cut, during};
use super::fixture::{chunked, log, names_in, on_disk};
use super::{Appender, Compression, Destination, Log, LogError, NewChannel, NewMessage, put_back};

/// A new channel with enough in it for several writes.
fn add(path: &Path, topic: &str, destination: &Destination) -> Result<(), LogError> {
    let log = match destination {
        Destination::InPlace => Log::open_in_place(path)?,
        _ => Log::open(path)?,
    };
    let channels = [NewChannel::json(topic, "trackfuse.Test", "{}")];
    let mut appender = Appender::begin(&log, destination, &channels, Compression::None)?;
    for i in 0..200_u64 {
        let data = format!("{{\"i\":\"{i:060}\"}}");
        appender.write(NewMessage { channel: 0, time_ns: i * 1_000_000_000, data: data.as_bytes() })?;
    }
    appender.finish().map(|_| ())
}

/// Makes the log the original before the first addition.
fn take_off(path: &Path) -> Result<(), LogError> {
    let log = Log::open_in_place(path)?;
    let additions = log.additions()?;
    log.restore_in_place(&additions[0])
}

/// A log on the disk, and what it holds before and after an addition.
struct Trial {
    _dir: TempDir,
    path: PathBuf,
    original: Vec<u8>,
    added: Vec<u8>,
}

impl Trial {
    fn new() -> Self {
        let original = log(chunked());
        let (dir, path) = on_disk(&original);
        let out = dir.path().join("out.mcap");
        add(&path, "/x", &Destination::new_file(&out)).unwrap();
        let added = fs::read(&out).unwrap();
        fs::remove_file(out).unwrap();
        Self { _dir: dir, path, original, added }
    }

    fn now(&self) -> Vec<u8> {
        fs::read(&self.path).unwrap()
    }

    fn names(&self) -> Vec<String> {
        names_in(self.path.parent().unwrap())
    }

    fn is_pending(&self) -> bool {
        self.names().contains(&"in.mcap.trackfuse-undo".to_owned())
    }

    /// The log as `bytes`, and nothing beside it.
    fn reset(&self, bytes: &[u8]) {
        for name in self.names() {
            fs::remove_file(self.path.with_file_name(name)).unwrap();
        }
        fs::write(&self.path, bytes).unwrap();
    }
}

#[test]
fn in_place_gives_the_same_bytes_as_a_new_file() {
    let trial = Trial::new();
    add(&trial.path, "/x", &Destination::InPlace).unwrap();
    assert!(trial.now() == trial.added);
    assert_eq!(trial.names(), ["in.mcap"]);
}

#[test]
fn an_old_end_of_several_pieces_is_kept_while_it_is_overwritten() {
    let trial = Trial::new();
    let out = trial.path.with_file_name("out.mcap");
    let schema: String = (0..400_000).map(|i| format!("{i:07}")).collect();
    let channels = [NewChannel::json("/large", "Large", &schema)];
    let log = Log::open_in_place(&trial.path).unwrap();
    Appender::begin(&log, &Destination::InPlace, &channels, Compression::None).unwrap().finish().unwrap();
    drop(log);
    add(&trial.path, "/x", &Destination::new_file(&out)).unwrap();
    add(&trial.path, "/x", &Destination::InPlace).unwrap();
    assert!(trial.now() == fs::read(&out).unwrap());
    take_off(&trial.path).unwrap();
    assert!(trial.now() == trial.original);
}

/// What a power failure leaves depends on this order.
#[test]
fn the_old_end_is_on_the_disk_before_the_log_changes_and_the_log_before_the_old_end_is_removed() {
    let trial = Trial::new();
    let (done, steps) = during(None, || add(&trial.path, "/x", &Destination::InPlace));
    done.unwrap();
    let (saved, rest) = steps.split_at(6);
    assert_eq!(
        saved,
        [Step::Write, Step::Write, Step::Write, Step::Sync, Step::Rename, Step::SyncFolder],
        "the old end"
    );
    let (written, end) = rest.split_at(rest.len() - 3);
    assert!(written.len() >= 3 && written.iter().all(|step| *step == Step::Write), "{written:?}");
    assert_eq!(end, [Step::Sync, Step::Remove, Step::SyncFolder]);

    let (done, steps) = during(None, || take_off(&trial.path));
    done.unwrap();
    assert_eq!(&steps[..6], saved);
    assert_eq!(steps[6..], [Step::SetLen, Step::Write, Step::Sync, Step::Remove, Step::SyncFolder]);
    assert!(trial.now() == trial.original);
}

#[test]
fn a_run_in_place_that_dies_at_any_step_leaves_the_original_or_what_gives_it_back() {
    let trial = Trial::new();
    let (_, steps) = during(None, || add(&trial.path, "/x", &Destination::InPlace));
    let mut pending = 0;
    for at in 0..steps.len() {
        trial.reset(&trial.original);
        let (died, _) = during(Some(Cut::From(at)), || add(&trial.path, "/x", &Destination::InPlace));
        if !trial.is_pending() {
            let now = trial.now();
            assert!(now == trial.original || now == trial.added && died.is_ok(), "step {at}");
            put_back(&trial.path).unwrap();
            assert_eq!(trial.names(), ["in.mcap"], "step {at}");
            continue;
        }
        pending += 1;
        let error = died.unwrap_err();
        assert!(error.hint().is_some(), "{error}");
        assert!(matches!(Log::open(&trial.path), Err(LogError::Pending { .. })), "step {at}");
        // Putting back may be cut off at any step, too, and again and again.
        for again in 0..6 {
            let (put, _) = during(Some(Cut::From(again)), || put_back(&trial.path));
            assert_eq!(trial.is_pending(), again < 4, "step {at}, {again}: {put:?}");
        }
        put_back(&trial.path).unwrap();
        assert!(trial.now() == trial.original, "step {at}");
        assert_eq!(trial.names(), ["in.mcap"], "step {at}");
        add(&trial.path, "/x", &Destination::InPlace).unwrap();
        assert!(trial.now() == trial.added, "step {at}");
    }
    assert!(pending >= 6, "only {pending} of {} steps left the log changed", steps.len());
}

#[test]
fn a_run_in_place_that_fails_at_any_step_puts_the_original_back_at_once() {
    let trial = Trial::new();
    let (_, steps) = during(None, || add(&trial.path, "/x", &Destination::InPlace));
    for at in 0..steps.len() {
        trial.reset(&trial.original);
        let (failed, _) = during(Some(Cut::Once(at)), || add(&trial.path, "/x", &Destination::InPlace));
        // That the folder isn't synced at the very end is no failure.
        assert_eq!(failed.is_err(), at + 1 < steps.len(), "step {at}");
        assert!(trial.now() == if failed.is_err() { &trial.original[..] } else { &trial.added }, "step {at}");
        assert_eq!(trial.names(), ["in.mcap"], "step {at}");
    }
}

#[test]
fn an_appender_that_is_dropped_in_place_leaves_the_original() {
    let trial = Trial::new();
    let log = Log::open_in_place(&trial.path).unwrap();
    let channels = [NewChannel::json("/x", "trackfuse.Test", "{}")];
    let mut appender = Appender::begin(&log, &Destination::InPlace, &channels, Compression::None).unwrap();
    appender.write(NewMessage { channel: 0, time_ns: 1, data: &vec![b' '; 100_000] }).unwrap();
    appender.write(NewMessage { channel: 0, time_ns: u64::MAX, data: b"1" }).unwrap();
    assert!(trial.now() != trial.original && trial.is_pending());
    drop(appender);
    assert!(trial.now() == trial.original);
    assert_eq!(trial.names(), ["in.mcap"]);
}

#[test]
fn a_log_cut_off_within_any_write_is_put_back() {
    let trial = Trial::new();
    let data_end = Log::open(&trial.path).unwrap().index().data_end as usize;
    let (_, steps) = during(None, || add(&trial.path, "/x", &Destination::InPlace));
    trial.reset(&trial.original);
    during(Some(Cut::From(steps.len() - 2)), || add(&trial.path, "/x", &Destination::InPlace)).0.unwrap_err();
    let undo = trial.path.with_file_name("in.mcap.trackfuse-undo");
    let saved = fs::read(&undo).unwrap();
    for len in (data_end..=trial.added.len()).step_by(101) {
        // The new bytes so far, and what is left of the old ones behind them.
        let mut torn = trial.added[..len].to_vec();
        torn.extend(trial.original.get(len..).unwrap_or_default());
        fs::write(&trial.path, &torn).unwrap();
        fs::write(&undo, &saved).unwrap();
        assert_eq!(put_back(&trial.path).unwrap(), Some(trial.original.len() as u64));
        assert!(trial.now() == trial.original, "cut at {len}");
    }
}

#[test]
fn taking_an_addition_off_in_place_can_be_cut_off_at_any_step() {
    let trial = Trial::new();
    trial.reset(&trial.added);
    let (_, steps) = during(None, || take_off(&trial.path));
    for at in 0..steps.len() {
        trial.reset(&trial.added);
        let (died, _) = during(Some(Cut::From(at)), || take_off(&trial.path));
        if trial.is_pending() {
            assert!(died.is_err(), "step {at}");
            put_back(&trial.path).unwrap();
            assert!(trial.now() == trial.original, "step {at}");
        } else {
            assert!(trial.now() == if at < 6 { &trial.added[..] } else { &trial.original }, "step {at}");
            put_back(&trial.path).unwrap();
        }
        assert_eq!(trial.names(), ["in.mcap"], "step {at}");
    }
}

#[test]
fn a_new_file_that_is_cut_off_at_any_step_has_no_name_or_is_whole() {
    let trial = Trial::new();
    let out = trial.path.with_file_name("out.mcap");
    let run = || add(&trial.path, "/x", &Destination::new_file(&out));
    let (_, steps) = during(None, run);
    assert_eq!(steps[steps.len() - 3..], [Step::Sync, Step::Rename, Step::SyncFolder]);
    for cut in (0..steps.len()).flat_map(|at| [Cut::From(at), Cut::Once(at)]) {
        trial.reset(&trial.original);
        let (done, _) = during(Some(cut), run);
        assert_eq!(done.is_ok(), out.exists(), "{cut:?}");
        assert!(!out.exists() || fs::read(&out).unwrap() == trial.added, "{cut:?}");
        assert!(trial.now() == trial.original && trial.names().len() <= 2, "{cut:?}");
    }
}

#[test]
fn what_was_saved_of_another_log_or_is_damaged_is_not_put_back() {
    let trial = Trial::new();
    during(Some(Cut::From(8)), || add(&trial.path, "/x", &Destination::InPlace)).0.unwrap_err();
    let undo = trial.path.with_file_name("in.mcap.trackfuse-undo");
    let (saved, torn) = (fs::read(&undo).unwrap(), trial.now());
    let refused = |saved: &[u8], log: &[u8], why: &str| {
        fs::write(&undo, saved).unwrap();
        fs::write(&trial.path, log).unwrap();
        let error = put_back(&trial.path).unwrap_err();
        assert!(matches!(&error, LogError::BadUndo { .. }) && error.hint().is_some(), "{error}");
        assert!(error.to_string().contains(why), "{error}");
        assert!(trial.now() == log && fs::read(&undo).unwrap() == saved, "something was touched");
    };
    let mut other = torn.clone();
    other[100] ^= 1;
    refused(&saved, &other, "another one");
    refused(&saved, &torn[..200], "the log has 200 bytes");
    for at in [0, 50, 100, 104, 108, 112, saved.len() / 2, saved.len() - 1] {
        let mut damaged = saved.clone();
        damaged[at] ^= 1;
        refused(&damaged, &torn, "");
    }
    for len in [0, 1, 100, 120, saved.len() - 1] {
        refused(&saved[..len], &torn, "");
    }
    refused(&[&saved[..], b"more"].concat(), &torn, "its length");
    fs::write(&undo, &saved).unwrap();
    put_back(&trial.path).unwrap();
    assert!(trial.now() == trial.original);
}

/// What another program does that writes the log anew.
fn replace(path: &Path) {
    let other = path.with_file_name("other.mcap");
    fs::write(&other, "another file").unwrap();
    fs::rename(other, path).unwrap();
}

#[cfg(unix)]
#[test]
fn a_log_whose_name_another_file_took_is_not_said_to_be_added_to() {
    let trial = Trial::new();
    let log = Log::open_in_place(&trial.path).unwrap();
    let appender = Appender::begin(&log, &Destination::InPlace, &[], Compression::None).unwrap();
    replace(&trial.path);
    let error = appender.finish().unwrap_err();
    assert!(matches!(&error, LogError::Write { .. }), "{error}");
    assert_eq!((trial.now().as_slice(), trial.names()), (&b"another file"[..], vec!["in.mcap".to_owned()]));

    trial.reset(&trial.original);
    let log = Log::open_in_place(&trial.path).unwrap();
    replace(&trial.path);
    let refused = Appender::check(&log, &Destination::InPlace, &[]).unwrap_err();
    assert!(matches!(&refused, LogError::NotInPlace { .. }), "{refused}");
}

#[test]
fn a_file_that_another_run_changes_in_place_is_not_replaced() {
    let trial = Trial::new();
    let [input, output] = ["input", "output"].map(|name| trial.path.with_file_name(name));
    fs::write(&input, &trial.original).unwrap();
    fs::write(&output, &trial.original).unwrap();
    let log = Log::open(&input).unwrap();
    let to = Destination::New { out: output.clone(), force: true };
    let begin = || Appender::begin(&log, &to, &[], Compression::None).unwrap();

    let appender = begin();
    let changed = Log::open_in_place(&output).unwrap();
    assert!(matches!(appender.finish(), Err(LogError::InUse { .. })));
    drop(changed);

    let appender = begin();
    during(Some(Cut::From(8)), || add(&output, "/x", &Destination::InPlace)).0.unwrap_err();
    assert!(matches!(appender.finish(), Err(LogError::Pending { .. })));
    put_back(&output).unwrap();
    assert!(fs::read(&output).unwrap() == trial.original);
    begin().finish().unwrap();
}
