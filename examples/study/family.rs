//! One family of climbs through every method, pooled.

use std::thread;

use trackfuse::config::{Auto, CharacteristicPoint, Config, Registration};
use trackfuse::estimate::{Coefficients, Estimator};
use trackfuse::fusion::{self, Fusion};
use trackfuse::log::Log;
use trackfuse::quality::{self, Comparison, Errors, Kind, Stretch};
use trackfuse::sample::Source;
use trackfuse::track::{Phase, Track};
use trackfuse::{estimate::characteristic_point::Height, resolve, source};

use super::climbs::Climb;

/// How a config asks for a method.
type Ask = fn(&mut Config);

/// The methods of the tables: the paper's, as it has them, without registration; and the default, with it.
pub(crate) const METHODS: [(&str, Ask); 7] = [
    ("GDF", |c| c.fusion.method = Estimator::Gdf),
    ("PCF 12", |c| c.fusion.method = Estimator::Pcf),
    ("average 16", |c| (c.fusion.method, c.fusion.window_points) = (Estimator::MovingAverage, 16)),
    ("average 32", |c| (c.fusion.method, c.fusion.window_points) = (Estimator::MovingAverage, 32)),
    ("SFF independent", |c| c.fusion.coefficients = Coefficients::Independent),
    ("SFF", |_| ()),
    ("registered", |c| c.fusion.estimate = Registration::Auto(Auto::Auto)),
];

/// Where a climb is seen, by whom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Tether,
    /// By both, or, where there is a gap instead, by neither.
    Overlap,
    Beacon,
    Unseen,
}

impl Part {
    fn of(kind: Kind) -> Self {
        match (kind.phase, kind.seen_by) {
            (Phase::Extrapolated, _) => Self::Unseen,
            (Phase::Overlap | Phase::Bridged, _) => Self::Overlap,
            (Phase::Single, 0b01) => Self::Tether,
            (Phase::Single, _) => Self::Beacon,
        }
    }
}

/// Squares and hits of one quantity, pooled over runs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pool {
    count: usize,
    squares: f64,
    banded: usize,
    inside: f64,
    normalised: f64,
    /// Root mean square of each run.
    pub(crate) rmses: Vec<f64>,
}

impl Pool {
    fn add(&mut self, errors: &Errors) {
        self.count += errors.count;
        self.squares += errors.rmse.powi(2) * errors.count as f64;
        self.rmses.push(errors.rmse);
        if let Some(bands) = &errors.bands {
            self.banded += bands.count;
            self.inside += bands.inside * bands.count as f64;
            self.normalised += bands.normalised_rmse.powi(2) * bands.count as f64;
        }
    }

    /// Root mean square over all instants of all runs.
    pub(crate) fn rmse(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.squares / self.count as f64).sqrt())
    }

    /// Root mean square of error over standard deviation: 1 where the bands are right.
    pub(crate) fn normalised(&self) -> Option<f64> {
        (self.banded > 0).then(|| (self.normalised / self.banded as f64).sqrt())
    }

    /// Share of the truth inside the 95 % bands.
    pub(crate) fn inside(&self) -> Option<f64> {
        (self.banded > 0).then(|| self.inside / self.banded as f64)
    }
}

/// What a method did over a family: position and velocity by part.
pub(crate) type Pools = [[Pool; 2]; 4];

/// A characteristic point over a family (Zhang 2025, eq. 13).
#[derive(Clone, Debug, Default)]
pub(crate) struct PointErrors {
    pub(crate) time: Vec<f64>,
    pub(crate) speed: Vec<f64>,
    /// Runs whose track never got there.
    pub(crate) missed: usize,
}

/// A family of climbs, judged.
pub(crate) struct Family {
    pub(crate) name: String,
    pub(crate) runs: usize,
    /// By method, in the order of [`METHODS`].
    pub(crate) pools: Vec<Pools>,
    /// Of the last method, the default.
    pub(crate) points: [PointErrors; 3],
    /// Runs in which the default method had something to warn of.
    pub(crate) warned: usize,
    /// The 3-D position error of the paper's plain extrapolation, each run's root mean square, m.
    pub(crate) plain_unseen_m: Vec<f64>,
}

/// What one run gives.
struct Run {
    /// By method.
    methods: Vec<Comparison>,
    /// Of the paper's plain extrapolation.
    plain: Comparison,
    warned: bool,
}

impl Family {
    /// Runs every method over every climb, on all cores.
    pub(crate) fn judge(name: &str, climbs: impl Iterator<Item = Climb>) -> Self {
        let climbs: Vec<Climb> = climbs.collect();
        let workers = thread::available_parallelism().map_or(1, usize::from);
        let share = climbs.len().div_ceil(workers).max(1);
        let runs: Vec<Run> = thread::scope(|scope| {
            let parts: Vec<_> = climbs
                .chunks(share)
                .map(|part| scope.spawn(move || part.iter().map(run).collect::<Vec<Run>>()))
                .collect();
            parts.into_iter().flat_map(|part| part.join().expect("no run panics")).collect()
        });
        let mut family = Self {
            name: name.into(),
            runs: runs.len(),
            pools: vec![Pools::default(); METHODS.len()],
            points: Default::default(),
            warned: runs.iter().filter(|run| run.warned).count(),
            plain_unseen_m: Vec::new(),
        };
        for run in &runs {
            for (pools, comparison) in family.pools.iter_mut().zip(&run.methods) {
                comparison.stretches.iter().for_each(|stretch| add(pools, stretch));
            }
            family.plain_unseen_m.extend(run.plain.all.position.as_ref().map(|e| e.rmse));
            let Some(default) = run.methods.last() else { continue };
            for (point, crossing) in family.points.iter_mut().zip(&default.crossings) {
                point.time.extend(crossing.time_error);
                point.speed.extend(crossing.speed_error);
                point.missed += usize::from(crossing.estimate.is_none());
            }
        }
        family
    }
}

fn add(pools: &mut Pools, stretch: &Stretch) {
    let Some(kind) = stretch.kind else { return };
    let part = &mut pools[Part::of(kind) as usize];
    for (pool, errors) in part.iter_mut().zip([&stretch.position, &stretch.velocity]) {
        errors.iter().for_each(|e| pool.add(e));
    }
}

fn run(climb: &Climb) -> Run {
    let judge = |track: &Track| {
        let heights = climb.heights_m.map(|z_m| Height { name: String::new(), z_m });
        quality::compare(track, climb.release, &climb.truth, &heights)
    };
    let fused: Vec<Fusion> = METHODS.iter().map(|(_, ask)| fuse(climb, *ask)).collect();
    let default = fused.last().expect("there is a method");
    Run {
        methods: fused.iter().map(|f| judge(&f.track)).collect(),
        plain: judge(&default.plain_pcf),
        warned: !default.warnings.is_empty(),
    }
}

/// The way of `trackfuse fuse`, up to the track.
fn fuse(climb: &Climb, ask: Ask) -> Fusion {
    let mut config = Config::default();
    // half as far again, so that a slow track still reaches the last height
    config.extrapolation.horizon_s = 1.5 * climb.unseen_s;
    let point = |z_m| CharacteristicPoint { name: String::new(), z_m };
    config.characteristic_point = climb.heights_m.map(point).to_vec();
    config.fusion.estimate = Registration::List(Vec::new());
    ask(&mut config);
    let log = Log::open(&climb.log).expect("a log");
    config.source = source::recognise(&log, &config.output.prefix).expect("sources").sources;
    let (loaded, origin, _) = source::load(&log, &config.source, false, None).expect("samples");
    let sources: Vec<Source> = loaded.iter().map(|l| l.source.clone()).collect();
    let datum = source::datum(&config.source);
    let plan = resolve::plan(&mut config, &loaded, &sources, datum, origin, &mut Vec::new()).expect("a plan");
    fusion::fuse(&sources, &plan).expect("a track")
}
