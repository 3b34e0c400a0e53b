//! One family of climbs through every method, pooled.

use trackfuse::config::{Auto, CharacteristicPoint, Config, ExtrapolationMethod, Registration};
use trackfuse::estimate::Estimator;
use trackfuse::estimate::characteristic_point::Height;
use trackfuse::estimate::coverage::{interpolate, max_gap_s};
use trackfuse::fusion::{self, Fusion};
use trackfuse::quality::{self, CrossingErrors, Errors};
use trackfuse::sample::{Sample, Source};
use trackfuse::track::{State, Track};
use trackfuse::{resolve, source};

use super::climbs::{Climb, Recording, on_all_cores};
use super::pool::{Part, Pool, Typical, quantile};

/// A method's name, and how a config asks for it.
pub(crate) type Method = (&'static str, fn(&mut Config));

/// The paper's methods, as it has them, without registration.
pub(crate) const PAPERS: [Method; 4] = [
    ("GDF", |c| c.fusion.method = Estimator::Gdf),
    ("PCF 12", |c| c.fusion.method = Estimator::Pcf),
    ("average 16", |c| (c.fusion.method, c.fusion.window_points) = (Estimator::MovingAverage, 16)),
    ("SFF", |_| ()),
];

/// What `trackfuse fuse` does by itself.
pub(crate) const REGISTERED: Method = ("registered", registered);

/// The same, carried on otherwise.
pub(crate) const CARRIED_ON: [Method; 2] = [
    ("drag", |c| {
        registered(c);
        c.extrapolation.method = ExtrapolationMethod::Drag;
    }),
    ("auto", |c| {
        registered(c);
        c.extrapolation.method = ExtrapolationMethod::Auto;
    }),
];

/// The paper's plain extrapolation, which every run of [`REGISTERED`] gives too.
pub(crate) const PLAIN: &str = "plain PCF";

fn registered(config: &mut Config) {
    config.fusion.estimate = Registration::Auto(Auto::Auto);
}

/// A characteristic point over a family (Zhang 2025, eq. 13).
#[derive(Clone, Debug, Default)]
pub(crate) struct PointErrors {
    pub(crate) time: Vec<f64>,
    pub(crate) speed: Vec<f64>,
    /// Runs whose track never got there.
    pub(crate) missed: usize,
}

/// What a method did over a family.
#[derive(Clone, Debug, Default)]
pub(crate) struct Judged {
    /// Position and velocity, by part.
    pub(crate) pools: [[Pool; 2]; 4],
    pub(crate) points: [PointErrors; 3],
    /// Runs in which it had something to warn of.
    pub(crate) warned: usize,
}

/// A family of climbs, judged.
pub(crate) struct Family {
    pub(crate) name: String,
    pub(crate) runs: usize,
    methods: Vec<(&'static str, Judged)>,
}

/// Errors of a part, and its typical ones: horizontal, vertical.
type PartErrors = (Errors, [Typical; 2]);

/// A track of one run against the truth.
struct Judgement {
    method: &'static str,
    /// Of position and velocity, by part.
    parts: [[Option<PartErrors>; 2]; 4],
    crossings: Vec<CrossingErrors>,
    warned: bool,
}

impl Family {
    /// Runs every one of `methods` over every climb, on all cores.
    pub(crate) fn judge(name: &str, climbs: &[Climb], methods: &[Method]) -> Self {
        let mut family = Self { name: name.into(), runs: climbs.len(), methods: Vec::new() };
        for judgement in on_all_cores(climbs, |climb| run(climb, methods)).into_iter().flatten() {
            let known = family.methods.iter().position(|(method, _)| *method == judgement.method);
            let index = known.unwrap_or_else(|| {
                family.methods.push((judgement.method, Judged::default()));
                family.methods.len() - 1
            });
            family.methods[index].1.add(&judgement);
        }
        family
    }

    /// What a method did.
    pub(crate) fn of(&self, method: &str) -> Option<&Judged> {
        self.methods.iter().find(|(name, _)| *name == method).map(|(_, judged)| judged)
    }

    /// What a method did to a quantity, 0 for position and 1 for velocity, in a part.
    pub(crate) fn pool(&self, method: &str, part: Part, quantity: usize) -> Pool {
        self.of(method).map_or_else(Pool::default, |judged| judged.pools[part as usize][quantity].clone())
    }
}

impl Judged {
    fn add(&mut self, judgement: &Judgement) {
        for (pool, found) in self.pools.iter_mut().flatten().zip(judgement.parts.iter().flatten()) {
            found.iter().for_each(|(errors, typical)| pool.add(errors, *typical));
        }
        for (point, crossing) in self.points.iter_mut().zip(&judgement.crossings) {
            point.time.extend(crossing.time_error);
            point.speed.extend(crossing.speed_error);
            point.missed += usize::from(crossing.estimate.is_none());
        }
        self.warned += usize::from(judgement.warned);
    }
}

fn run(climb: &Climb, methods: &[Method]) -> Vec<Judgement> {
    let mut judgements = Vec::new();
    for &(method, ask) in methods {
        // half as far again, so that a slow track still reaches the last height
        let horizon_s = 1.5 * (climb.unseen_s.1 - climb.unseen_s.0);
        let fusion = fuse(&climb.recording, horizon_s, &climb.heights_m, ask);
        judgements.push(judge(climb, method, &fusion.track, !fusion.warnings.is_empty()));
        if method == REGISTERED.0 {
            judgements.push(judge(climb, PLAIN, &fusion.plain_pcf, false));
        }
    }
    judgements
}

fn judge(climb: &Climb, method: &'static str, track: &Track, warned: bool) -> Judgement {
    let heights = climb.heights_m.map(|z_m| Height { name: String::new(), z_m });
    let parts = Part::ALL.map(|part| {
        let wanted = |time_s| {
            time_s <= climb.unseen_s.1 && Part::at(time_s, climb.overlap_s, climb.unseen_s.0) == part
        };
        let part = within(track, wanted, climb);
        let found = quality::compare(&part, climb.release, &climb.truth, &[]).all;
        let (positions, velocities) = (&climb.truth.positions, &climb.truth.velocities);
        [
            found.position.map(|e| (e, typical(&part, climb, positions, |s| (s.position, s.position_sigma)))),
            found
                .velocity
                .map(|e| (e, typical(&part, climb, velocities, |s| (s.velocity, s.velocity_sigma)))),
        ]
    });
    let crossings = quality::compare(track, climb.release, &climb.truth, &heights).crossings;
    Judgement { method, parts, crossings, warned }
}

/// Of a part of a track against its truth: horizontal, vertical.
fn typical(
    part: &Track,
    climb: &Climb,
    truth: &[Sample],
    of: fn(&State) -> ([f64; 3], [f64; 3]),
) -> [Typical; 2] {
    let gap_s = max_gap_s(truth);
    [0..2, 2..3].map(|axes| {
        let (mut errors, mut sigmas) = (Vec::new(), Vec::new());
        for point in &part.points {
            let time_s = point.time.seconds_since(climb.release);
            let Some(truth) = interpolate(truth, time_s, gap_s) else { continue };
            let (value, sigma) = of(&point.state);
            errors.extend(axes.clone().map(|axis| (value[axis] - truth.value[axis]).abs()));
            sigmas.extend(axes.clone().map(|axis| sigma[axis]));
        }
        let median = |values: &[f64]| quantile(values, 0.5).unwrap_or(f64::NAN);
        Typical { error: median(&errors), sigma: median(&sigmas) }
    })
}

/// The points whose instant, s after the release, is wanted.
fn within(track: &Track, wanted: impl Fn(f64) -> bool, climb: &Climb) -> Track {
    let wanted = |p: &&_| {
        let point: &trackfuse::track::TrackPoint = p;
        wanted(point.time.seconds_since(climb.release))
    };
    Track { frame_id: track.frame_id.clone(), points: track.points.iter().filter(wanted).copied().collect() }
}

/// The way of `trackfuse fuse`, from the samples to the track.
pub(crate) fn fuse(recording: &Recording, horizon_s: f64, heights_m: &[f64], ask: fn(&mut Config)) -> Fusion {
    let mut config = Config::default();
    config.extrapolation.horizon_s = horizon_s;
    let point = |&z_m| CharacteristicPoint { name: String::new(), z_m };
    config.characteristic_point = heights_m.iter().map(point).collect();
    config.fusion.estimate = Registration::List(Vec::new());
    ask(&mut config);
    config.source = recording.loaded.iter().map(|l| l.config.clone()).collect();
    let sources: Vec<Source> = recording.loaded.iter().map(|l| l.source.clone()).collect();
    let datum = source::datum(&config.source);
    let (loaded, origin) = (&recording.loaded, recording.origin);
    let plan = resolve::plan(&mut config, loaded, &sources, datum, origin, &mut Vec::new()).expect("a plan");
    fusion::fuse(&sources, &plan).expect("a track")
}
