//! How far long work is, on a line of the terminal that goes again.

use std::io::{self, IsTerminal, Write};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::cli::Voice;
use crate::log::{Observer, Work};

/// Work that takes no longer isn't worth a line.
const PATIENCE: Duration = Duration::from_secs(1);
/// How often the line is painted.
const PACE: Duration = Duration::from_millis(200);

/// Shows what is going on while it lives; on a terminal only, and not where nobody wants to read.
pub(super) struct Bar {
    shared: Arc<Shared>,
    painter: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    now: Mutex<Option<Doing>>,
    changed: Condvar,
}

/// `None` in its place means that all is over.
struct Doing {
    what: &'static str,
    since: Instant,
    /// Bytes that are done, and of how many; 0 where nobody knows.
    done: u64,
    total: u64,
}

impl Bar {
    /// A bar that shows nothing before it is told something.
    pub(super) fn new(voice: Voice) -> Self {
        let shared = Arc::new(Shared::default());
        let shown = io::stderr().is_terminal() && !voice.quiet && !voice.json;
        let painter = shown.then(|| {
            shared.set("", 0, 0);
            let shared = Arc::clone(&shared);
            thread::spawn(move || paint(&shared))
        });
        Self { shared, painter }
    }

    /// Shows what a log's observer is told.
    pub(super) fn observer(&self) -> Observer {
        if self.painter.is_none() {
            return Observer::default();
        }
        let shared = Arc::clone(&self.shared);
        Observer::new(move |progress| {
            let what = match progress.work {
                Work::Scan => "scanning",
                Work::Read => "reading",
                Work::Copy => "copying",
            };
            shared.set(what, progress.done, progress.total);
        })
    }

    /// Shows work of which nobody knows how long it takes.
    pub(super) fn doing(&self, what: &'static str) {
        if self.painter.is_some() {
            self.shared.set(what, 0, 0);
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        if let Ok(mut now) = self.shared.now.lock() {
            *now = None;
        }
        self.shared.changed.notify_all();
        if let Some(painter) = self.painter.take() {
            let _ = painter.join();
        }
    }
}

impl Shared {
    fn set(&self, what: &'static str, done: u64, total: u64) {
        let Ok(mut now) = self.now.lock() else { return };
        let since = now.as_ref().filter(|doing| doing.what == what).map_or_else(Instant::now, |d| d.since);
        *now = Some(Doing { what, since, done, total });
    }
}

/// Paints until all is over, and leaves an empty line.
fn paint(shared: &Shared) {
    let Ok(mut now) = shared.now.lock() else { return };
    let mut painted = false;
    while let Some(doing) = now.as_ref() {
        let took = doing.since.elapsed();
        if took >= PATIENCE && !doing.what.is_empty() {
            let line = line(doing.what, doing.done, doing.total, took.as_secs_f64());
            let _ = write!(io::stderr(), "\r\x1b[K{line}");
            painted = true;
        }
        match shared.changed.wait_timeout(now, PACE) {
            Ok((next, _)) => now = next,
            Err(_) => return,
        }
    }
    if painted {
        let _ = write!(io::stderr(), "\r\x1b[K");
    }
}

/// Such as `reading 1.2 of 2.0 GB, 850 MB/s, 1 s left`.
fn line(what: &str, done: u64, total: u64, took_s: f64) -> String {
    if total == 0 {
        return format!("{what}, {took_s:.0} s");
    }
    let rate = done as f64 / took_s.max(1e-3);
    let left = match (total.saturating_sub(done)) as f64 / rate {
        left_s if left_s.is_finite() && left_s < 120.0 => format!("{left_s:.0} s left"),
        left_s if left_s.is_finite() => format!("{:.0} min left", left_s / 60.0),
        _ => "-".into(),
    };
    format!("{what} {:.1} of {:.1} GB, {:.0} MB/s, {left}", done as f64 / 1e9, total as f64 / 1e9, rate / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_has_rate_and_time_left() {
        assert_eq!(
            line("reading", 500_000_000, 2_000_000_000, 2.0),
            "reading 0.5 of 2.0 GB, 250 MB/s, 6 s left"
        );
        assert_eq!(
            line("copying", 1_000_000, 50_000_000_000, 1.0),
            "copying 0.0 of 50.0 GB, 1 MB/s, 833 min left"
        );
        assert_eq!(line("reading", 0, 7, 2.0), "reading 0.0 of 0.0 GB, 0 MB/s, -");
        assert_eq!(line("fitting", 0, 0, 12.3), "fitting, 12 s");
    }

    #[test]
    fn where_nobody_reads_nothing_is_painted() {
        let bar = Bar::new(Voice { json: true, quiet: false });
        assert!(bar.painter.is_none());
        bar.observer().tell(Work::Read, 1, 2);
        bar.doing("fitting");
        assert!(bar.shared.now.lock().unwrap().is_none());
    }
}
