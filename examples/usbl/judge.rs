//! Dives with known truth, and how far a track of their fixes is from it.

use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use trackfuse::estimate::usbl::causal::Predictor;
use trackfuse::estimate::usbl::{self, Cleaned, Verdict, Warning};
use trackfuse::sample::Sample;
use trackfuse::simulate::{DiveConstants, Trajectory, UsblConstants, UsblRecord, dive, watch_by_usbl};
use trackfuse::track::{Curve, State};

/// What is wild in a row of the tables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    pub(crate) name: &'static str,
    pub(crate) wild_fixes: f64,
    pub(crate) wild_cycles: f64,
    /// How much of the 3 m of noise all fixes of an exchange have in common, m.
    pub(crate) common_m: f64,
}

const NONE: Row = Row { name: "none", wild_fixes: 0.0, wild_cycles: 0.0, common_m: 0.0 };

pub(crate) const ROWS: [Row; 5] = [
    NONE,
    Row { name: "30 % single", wild_fixes: 0.3, ..NONE },
    Row { name: "10 % whole cycles", wild_cycles: 0.1, ..NONE },
    Row { name: "30 % whole cycles", wild_cycles: 0.3, ..NONE },
    Row {
        name: "30 % single, of 3 m noise 2.5 m common to an exchange",
        wild_fixes: 0.3,
        common_m: 2.5,
        ..NONE
    },
];

/// Instants at which tracks are held against the truth, s apart.
const STEP_S: f64 = 5.0;

/// The normal distribution's 97.5 % point.
const BAND: f64 = 1.959_963_984_540_054;

/// A dive and what was heard of it.
pub(crate) struct Heard {
    pub(crate) truth: Trajectory,
    pub(crate) record: UsblRecord,
    pub(crate) fixes: Vec<Sample>,
}

impl Heard {
    pub(crate) fn new(row: &Row, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let constants = DiveConstants::default();
        let truth = dive(&constants, &mut rng);
        let usual = UsblConstants::default();
        let watched = UsblConstants {
            sigma_m: (usual.sigma_m.powi(2) - row.common_m.powi(2)).sqrt(),
            common_sigma_m: row.common_m,
            wild_fixes: row.wild_fixes,
            wild_cycles: row.wild_cycles,
            ..usual
        };
        let record = watch_by_usbl(&truth, constants.duration_s, &watched, &mut rng);
        let fixes = record.fixes.iter().map(|f| f.sample).collect();
        Self { truth, record, fixes }
    }

    /// Whether an instant lies in the silence, with what the exchanges about it leave open.
    pub(crate) fn silent(&self, time_s: f64) -> bool {
        self.record.silence_s.is_some_and(|[from, to]| {
            let before = self.fixes.iter().rev().find(|f| f.time_s < from).map_or(from, |f| f.time_s);
            let after = self.fixes.iter().find(|f| f.time_s > to).map_or(to, |f| f.time_s);
            time_s > before && time_s < after
        })
    }

    fn instants(&self) -> impl Iterator<Item = f64> {
        let first = self.fixes.first().map_or(0.0, |f| f.time_s);
        let last = self.fixes.last().map_or(0.0, |f| f.time_s);
        (0..).map(move |i| first + STEP_S * f64::from(i)).take_while(move |t| *t <= last)
    }
}

/// Squares and hits of many instants.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sum {
    pub(crate) instants: f64,
    pub(crate) squares: f64,
    /// Components inside of their band.
    pub(crate) inside: f64,
}

impl Sum {
    pub(crate) fn add(&mut self, state: &State, truth: [f64; 3]) {
        self.instants += 1.0;
        for a in 0..3 {
            let error = state.position[a] - truth[a];
            self.squares += error * error;
            self.inside += f64::from(u8::from(error.abs() <= BAND * state.position_sigma[a]));
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.instants += other.instants;
        self.squares += other.squares;
        self.inside += other.inside;
    }

    /// 3-D root mean square error, m.
    pub(crate) fn rmse(&self) -> f64 {
        (self.squares / self.instants).sqrt()
    }

    /// Share of components inside of the 95 % band.
    pub(crate) fn coverage(&self) -> f64 {
        self.inside / (3.0 * self.instants)
    }
}

/// What a method did over many dives.
#[derive(Clone, Debug, Default)]
pub(crate) struct Judged {
    pub(crate) dives: usize,
    /// Seen, silent.
    pub(crate) sums: [Sum; 2],
    /// Root mean square error of each dive, seen and silent.
    pub(crate) each: Vec<[f64; 2]>,
    pub(crate) wild: usize,
    pub(crate) wild_found: usize,
    pub(crate) good: usize,
    pub(crate) good_lost: usize,
    /// Dives with a warning that the track may be wrong.
    pub(crate) warned: usize,
    /// Largest seen error of a dive that didn't warn: root mean square, m.
    pub(crate) worst_unwarned_m: f64,
}

impl Judged {
    pub(crate) fn recall(&self) -> f64 {
        self.wild_found as f64 / self.wild as f64
    }

    pub(crate) fn false_alarms(&self) -> f64 {
        self.good_lost as f64 / self.good as f64
    }

    fn add_curve(&mut self, heard: &Heard, curve: &impl Curve) -> [f64; 2] {
        let mut sums = [Sum::default(); 2];
        for t in heard.instants() {
            if let Some(state) = curve.at(t) {
                sums[usize::from(heard.silent(t))].add(&state, heard.truth.at(t).position.into());
            }
        }
        self.dives += 1;
        self.sums.iter_mut().zip(&sums).for_each(|(all, own)| all.merge(own));
        let rmse = [0, 1].map(|i| sums[i].rmse());
        self.each.push(rmse);
        rmse
    }

    pub(crate) fn add(&mut self, heard: &Heard, cleaned: &Cleaned) {
        let rmse = self.add_curve(heard, cleaned);
        for (fix, judged) in heard.record.fixes.iter().zip(&cleaned.judged) {
            let out = usize::from(judged.verdict != Verdict::Kept);
            if fix.wild {
                self.wild += 1;
                self.wild_found += out;
            } else {
                self.good += 1;
                self.good_lost += out;
            }
        }
        if cleaned.warnings.iter().any(|w| !matches!(w, Warning::Noise { .. })) {
            self.warned += 1;
        } else {
            self.worst_unwarned_m = self.worst_unwarned_m.max(rmse[0]);
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.dives += other.dives;
        self.sums.iter_mut().zip(&other.sums).for_each(|(all, own)| all.merge(own));
        self.each.extend(&other.each);
        self.wild += other.wild;
        self.wild_found += other.wild_found;
        self.good += other.good;
        self.good_lost += other.good_lost;
        self.warned += other.warned;
        self.worst_unwarned_m = self.worst_unwarned_m.max(other.worst_unwarned_m);
    }
}

/// The smoother over the dives of these seeds.
pub(crate) fn smoothed(row: &Row, seeds: Range<u64>) -> Judged {
    let all = over(seeds, |seed| {
        let heard = Heard::new(row, seed);
        let cleaned = usbl::clean(&heard.fixes, &[], &usbl::Settings::default()).expect("a track");
        let mut judged = Judged::default();
        judged.add(&heard, &cleaned);
        judged
    });
    let mut sum = Judged::default();
    all.iter().for_each(|judged| sum.merge(judged));
    sum
}

/// A causal method over the dives of these seeds: what it said at every instant of what had been heard by then.
pub(crate) fn followed<P: Predictor>(row: &Row, seeds: Range<u64>, new: impl Fn() -> P + Sync) -> [Sum; 2] {
    let all = over(seeds, |seed| {
        let heard = Heard::new(row, seed);
        let (mut method, mut next) = (new(), heard.fixes.iter().peekable());
        let mut sums = [Sum::default(); 2];
        for t in heard.instants() {
            while let Some(fix) = next.next_if(|fix| fix.time_s <= t) {
                method.push(fix);
            }
            method.advance(t);
            if let Some(state) = method.at(t) {
                sums[usize::from(heard.silent(t))].add(&state, heard.truth.at(t).position.into());
            }
        }
        sums
    });
    total(&all)
}

fn total<const N: usize>(all: &[[Sum; N]]) -> [Sum; N] {
    let mut total = [Sum::default(); N];
    all.iter().for_each(|own| total.iter_mut().zip(own).for_each(|(all, own)| all.merge(own)));
    total
}

/// `work` of every seed, in their order, on all cores.
pub(crate) fn over<T: Send>(seeds: Range<u64>, work: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let next = AtomicU64::new(seeds.start);
    let done = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= seeds.end {
                        break;
                    }
                    let made = work(seed);
                    done.lock().expect("no thread panicked").push((seed, made));
                }
            });
        }
    });
    let mut done = done.into_inner().expect("no thread panicked");
    done.sort_by_key(|(seed, _)| *seed);
    done.into_iter().map(|(_, made)| made).collect()
}

/// Times ahead at which a prediction is held against the truth, s.
pub(crate) const LEADS_S: [f64; 3] = [20.0, 60.0, 180.0];

/// What a causal method's predictions are worth, by time ahead.
pub(crate) fn predicted<P: Predictor>(row: &Row, seeds: Range<u64>, new: impl Fn() -> P + Sync) -> [Sum; 3] {
    let all = over(seeds, |seed| {
        let heard = Heard::new(row, seed);
        let mut method = new();
        let mut sums = [Sum::default(); 3];
        for (i, fix) in heard.fixes.iter().enumerate() {
            method.push(fix);
            if heard.fixes.get(i + 1).is_some_and(|next| next.time_s - fix.time_s < 5.0) {
                continue;
            }
            // the exchange is over; in the next one's absence this is what there is
            method.advance(fix.time_s + 6.0);
            for (sum, lead) in sums.iter_mut().zip(LEADS_S) {
                let t = fix.time_s + lead;
                if let Some(state) = method.at(t).filter(|_| t <= DiveConstants::default().duration_s) {
                    sum.add(&state, heard.truth.at(t).position.into());
                }
            }
        }
        sums
    });
    total(&all)
}
