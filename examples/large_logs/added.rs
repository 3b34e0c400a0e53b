//! A track of 70,000 points, and its way into a log.

use std::path::Path;

use trackfuse::log::{Appender, Compression, Destination, Encoding, Log};
use trackfuse::log::{LogError, NewMessage};
use trackfuse::publish::{Context, Topic, track_messages};
use trackfuse::sample::Source;
use trackfuse::time::Time;
use trackfuse::track::{Method, Phase, State, Track, TrackPoint};

/// At 100 Hz from `start_ns` on.
pub(crate) fn track(start_ns: i64) -> Track {
    let point = |i: i64| {
        let t = i as f64 * 0.01;
        let state = State {
            position: [t.sin(), t.cos(), -60.0 + 0.01 * t],
            velocity: [t.cos(), -t.sin(), 0.01],
            acceleration: Some([-t.sin(), -t.cos(), 0.0]),
            position_sigma: [0.1; 3],
            velocity_sigma: [0.1; 3],
        };
        let time = Time::from_ns(start_ns + i * 10_000_000);
        TrackPoint { time, state, phase: Phase::Single, method: Method::Spline, seen_by: 1 }
    };
    Track { frame_id: "enu".into(), points: (0..70_000).map(point).collect() }
}

/// Adds the track to the log as `/added/track`.
pub(crate) fn add(input: &Path, to: &Destination, track: &Track) -> Result<(), LogError> {
    let sources = [Source { name: "tether".into(), ..Source::default() }];
    let zero = Time::from_ns(0);
    let context = Context {
        sources: &sources,
        origin: zero,
        rate_hz: 100.0,
        t0: zero,
        surface_at_zero: true,
        log_start: None,
        encoding: Encoding::Json,
        geodetic: None,
    };
    let log = if matches!(to, Destination::InPlace) { Log::open_in_place(input) } else { Log::open(input) }?;
    let mut appender =
        Appender::begin(&log, to, &[Topic::Track.channel("/added", Encoding::Json)], Compression::Zstd)?;
    for message in track_messages(Topic::Track, track, context) {
        let (time_ns, data) = (message.time.to_log(), &message.data[..]);
        appender.write(NewMessage { channel: 0, time_ns, data })?;
    }
    appender.finish()?;
    Ok(())
}
