//! The readings of one source as they come, what was wrong with them, and at last its samples.

use std::collections::BTreeMap;

use super::SourceError;
use super::load::{Loaded, SigmaOrigin, Timing};
use super::reading::{Clock, Fault, Measured, Outcome, Reading, sum};
use crate::config::{AngleUnit, SourceConfig};
use crate::estimate::noise;
use crate::log::decode::{DecodeError, MessagePath};
use crate::math::geodesy::{Geodetic, LocalFrame};
use crate::math::robust;
use crate::printable::printable;
use crate::sample::{Quantity, Sample, Source};
use crate::time::Time;

/// A stamp that lies this much before its predecessor is worth a warning.
const BACKWARD_S: f64 = 1.0;

/// Readings of one source as they come.
pub(super) struct Gathered {
    pub(super) config: SourceConfig,
    pub(super) paths: Vec<(Quantity, MessagePath)>,
    readings: [Vec<Reading>; 2],
    delays_s: Vec<f64>,
    clocks: [usize; 3],
    /// The frames that the messages of positions and of velocities name first.
    frame_ids: [Option<String>; 2],
    pub(super) messages: usize,
    pub(super) undecodable: Option<(usize, DecodeError)>,
    faults: BTreeMap<&'static str, usize>,
    first_fault: [Option<Fault>; 2],
    farthest_back_s: f64,
    pub(super) untimed: usize,
    pub(super) kind: Kind,
}

/// What a source's messages may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Those of a sensor that follows the vehicle.
    Track,
    /// Those of an acoustic system, which may come late, and may be ranges, bearings and depressions in this unit.
    Acoustic(Option<AngleUnit>),
}

impl Gathered {
    pub(super) fn new(config: &SourceConfig) -> Result<Self, SourceError> {
        let given = [(Quantity::Position, &config.position), (Quantity::Velocity, &config.velocity)];
        let parse = |(quantity, text): (Quantity, &Option<String>)| {
            let text = text.as_ref()?;
            let path = MessagePath::parse(text);
            Some(
                path.map(|p| (quantity, p))
                    .map_err(|error| SourceError::Path { name: config.name.clone(), error }),
            )
        };
        Ok(Self {
            config: config.clone(),
            paths: given.into_iter().filter_map(parse).collect::<Result<_, _>>()?,
            readings: [Vec::new(), Vec::new()],
            delays_s: Vec::new(),
            clocks: [0; 3],
            frame_ids: [None, None],
            messages: 0,
            undecodable: None,
            faults: BTreeMap::new(),
            first_fault: [None, None],
            farthest_back_s: 0.0,
            untimed: 0,
            kind: Kind::Track,
        })
    }

    pub(super) fn add(&mut self, outcome: Outcome) {
        self.clocks[match outcome.clock {
            Clock::Stamp => 0,
            Clock::Publish => 1,
            Clock::Log => 2,
        }] += 1;
        self.delays_s.push(outcome.delay_s);
        for (quantity, result) in outcome.vectors {
            let q = quantity as usize;
            if self.frame_ids[q].is_none() {
                self.frame_ids[q].clone_from(&outcome.frame_id);
            }
            match result {
                Ok(reading) => {
                    if let Some(last) = self.readings[q].last() {
                        let back = last.time.seconds_since(reading.time);
                        self.farthest_back_s = self.farthest_back_s.max(back);
                    }
                    self.readings[q].push(reading);
                }
                Err(fault) => {
                    if let Some(what) = fault.description() {
                        *self.faults.entry(what).or_default() += 1;
                        self.first_fault[q].get_or_insert(fault);
                    }
                }
            }
        }
    }

    /// What stands against using it, and the quantity at fault where it is one: a path that gave nothing at
    /// all, or samples that are all of one instant.
    pub(super) fn lack(&mut self) -> Option<(Option<Quantity>, SourceError)> {
        let name = self.config.name.clone();
        if let Some((count, _)) = self.undecodable
            && count == self.messages
            && let Some((_, error)) = self.undecodable.take()
        {
            let topic = self.paths.first().map_or(String::new(), |(_, p)| p.topic.clone());
            return Some((None, SourceError::Decode { name, topic, error }));
        }
        if self.untimed > 0 && self.clocks == [0; 3] {
            let (choice, count) = (self.config.time, self.untimed);
            return Some((None, SourceError::NoTime { name, choice, count }));
        }
        for (quantity, path) in &self.paths {
            let q = *quantity as usize;
            if !self.readings[q].is_empty() {
                continue;
            }
            let (found, fits) = match self.first_fault[q].take() {
                Some(Fault::Miss(miss)) => return Some((Some(*quantity), SourceError::Miss { name, miss })),
                Some(Fault::NoOrientation) => {
                    let path = path.to_string();
                    return Some((Some(*quantity), SourceError::NoOrientation { name, path }));
                }
                Some(Fault::NoUnit) => {
                    let path = path.to_string();
                    return Some((Some(*quantity), SourceError::NoUnit { name, path }));
                }
                Some(Fault::NoAngle) => {
                    let (path, count) = (path.to_string(), self.messages);
                    return Some((Some(*quantity), SourceError::NotAngles { name, path, count }));
                }
                Some(Fault::NoVector { kind, fits }) => (kind, fits),
                Some(fault) => (fault.description().unwrap_or_default(), Vec::new()),
                None => {
                    let topic = path.topic.clone();
                    return Some((Some(*quantity), SourceError::Empty { name, topic }));
                }
            };
            let spare = self.paths.len() > 1 && *quantity == Quantity::Velocity;
            let (path, count) = (path.to_string(), self.messages);
            let error = SourceError::NoVector { name, path, found, fits, spare, count };
            return Some((Some(*quantity), error));
        }
        let times = || self.readings.iter().flatten().map(|r| r.time);
        match (times().min(), times().max(), times().count()) {
            (Some(time), Some(last), count) if count > 2 && time == last => {
                Some((None, SourceError::OneInstant { name, time, count }))
            }
            _ => None,
        }
    }

    /// Leaves out one of the quantities, or all of the source, and says which.
    pub(super) fn drop(&mut self, quantity: Option<Quantity>) -> &'static str {
        match quantity {
            Some(Quantity::Velocity) if self.paths.len() > 1 => {
                self.config.velocity = None;
                self.paths.retain(|(q, _)| *q != Quantity::Velocity);
                "a velocity"
            }
            _ => {
                self.paths.clear();
                self.readings = [Vec::new(), Vec::new()];
                "a source"
            }
        }
    }

    pub(super) fn median_time(&self) -> Time {
        let mut times: Vec<Time> = self.readings.iter().flatten().map(|r| r.time).collect();
        let middle = times.len() / 2;
        if times.is_empty() { Time::from_ns(0) } else { *times.select_nth_unstable(middle).1 }
    }

    /// The earliest latitude, longitude and altitude: degrees and m.
    pub(super) fn first_fix(&self) -> Option<[f64; 3]> {
        let fixes = self.readings.iter().flatten().filter_map(|reading| match reading.value {
            Measured::Fix(place) => Some((reading.time, place)),
            Measured::Vector(_) | Measured::Polar(_) => None,
        });
        fixes.min_by_key(|(time, _)| *time).map(|(_, place)| place.to_degrees())
    }

    /// Whether its positions are ranges, bearings and depressions; what is of the rarer kind is left out.
    pub(super) fn one_kind(&mut self) -> bool {
        let positions = &mut self.readings[Quantity::Position as usize];
        let is_polar = |reading: &Reading| matches!(reading.value, Measured::Polar(_));
        let (all, polar) = (positions.len(), positions.iter().filter(|r| is_polar(r)).count());
        let mostly = 2 * polar > all;
        positions.retain(|reading| is_polar(reading) == mostly);
        let left_out = if mostly { all - polar } else { polar };
        if left_out > 0 {
            self.faults.insert("a position of another kind than most", left_out);
        }
        mostly
    }

    /// The samples; latitudes and longitudes count from `fix_origin` (degrees and m).
    pub(super) fn finish(mut self, origin: Time, fix_origin: Option<[f64; 3]>) -> Loaded {
        let notes: Vec<String> = self.turn_offsets().into_iter().collect();
        let warnings = self.warnings();
        let fix_origin = fix_origin.filter(|_| self.first_fix().is_some());
        let local = LocalFrame::new(Geodetic::from_degrees(fix_origin.unwrap_or_default()));
        let offset_m = self.config.offset_m;
        let mut source = Source { name: self.config.name.clone(), ..Source::default() };
        let mut sigma = [None, None];
        let positions = &self.readings[Quantity::Position as usize];
        let arrival = if self.kind == Kind::Track { Vec::new() } else { arrival(positions) };
        for quantity in Quantity::ALL {
            let readings = std::mem::take(&mut self.readings[quantity as usize]);
            let value = |reading: &Reading| {
                let value = match reading.value {
                    Measured::Vector(value) | Measured::Polar(value) => value,
                    Measured::Fix(place) => local.to_enu(place),
                };
                let is_whole = quantity == Quantity::Velocity || reading.offset_is_turned;
                if is_whole { value } else { sum(value, offset_m) }
            };
            let configured = match quantity {
                Quantity::Position => self.config.position_sigma_m,
                Quantity::Velocity => self.config.velocity_sigma_m_s,
            };
            (*source.series_mut(quantity), sigma[quantity as usize]) =
                samples(readings, value, origin, configured);
        }
        let names = ["stamp", "publish", "log"];
        let used: Vec<&str> =
            names.iter().zip(self.clocks).filter(|(_, n)| *n > 0).map(|(name, _)| *name).collect();
        let quantile = |delays: &mut Vec<f64>, share| robust::quantile(delays, share).unwrap_or(0.0);
        let third = self.delays_s.len() / 3;
        let median = |delays: &[f64]| robust::median(&mut delays.to_vec()).unwrap_or(0.0);
        let last_third = self.delays_s.len() - third;
        let delay_growth_s = median(&self.delays_s[last_third..]) - median(&self.delays_s[..third]);
        let frame_id = self.frame_ids.iter_mut().find_map(Option::take);
        let timing = Timing {
            clock: used.join("+"),
            delay_growth_s,
            delay_s: quantile(&mut self.delays_s, 0.5),
            delay_spread_s: 0.5 * (quantile(&mut self.delays_s, 0.84) - quantile(&mut self.delays_s, 0.16)),
        };
        Loaded {
            config: self.config.clone(),
            source,
            // the frame that a fix names is the receiver's, not the one its metres are in
            frame_id: fix_origin.map_or(frame_id.unwrap_or_default(), |_| "enu".to_owned()),
            fix_origin,
            timing,
            arrival,
            sigma,
            notes,
            warnings,
        }
    }

    /// Leaves out positions without an orientation to turn their offset by where others have one; where none has, says
    /// that it is added as it is.
    fn turn_offsets(&mut self) -> Option<String> {
        let positions = &mut self.readings[Quantity::Position as usize];
        if self.config.offset_m == [0.0; 3] || positions.is_empty() {
            return None;
        }
        let before = positions.len();
        if positions.iter().any(|reading| reading.offset_is_turned) {
            positions.retain(|reading| reading.offset_is_turned);
            let lost = before - positions.len();
            if lost > 0 {
                self.faults.insert("no orientation of unit length to turn `offset_m` by", lost);
            }
            return None;
        }
        let name = printable(&self.config.name);
        Some(format!(
            "{name}: `offset_m` is added as it is, along the track's axes: the positions come without an orientation to \
             turn it by"
        ))
    }

    fn warnings(&self) -> Vec<String> {
        let name = printable(&self.config.name);
        let mut warnings = Vec::new();
        if let Some((count, error)) = &self.undecodable {
            warnings.push(format!("{name}: {count} of {} messages can't be decoded: {error}", self.messages));
        }
        for (what, count) in &self.faults {
            warnings.push(format!("{name}: {count} samples are left out: {what}"));
        }
        if self.untimed > 0 {
            warnings
                .push(format!("{name}: {} messages are left out: they have no usable time", self.untimed));
        }
        if let ([Some(of_position), Some(of_velocity)], None) = (&self.frame_ids, self.config.velocity_frame)
            && of_position != of_velocity
            && self.first_fix().is_none()
        {
            warnings.push(format!(
                "{name}: its positions are in {of_position:?}, its velocities in {of_velocity:?}: they are taken as if along the \
                 same axes; `velocity_frame = \"world\"` says that they are"
            ));
        }
        if self.clocks.iter().filter(|n| **n > 0).count() > 1 {
            let [stamp, publish, log] = self.clocks;
            warnings.push(format!(
                "{name}: {stamp} samples are timed by stamp, {publish} by publish time, {log} by log time: set \
                 `time` for this source"
            ));
        }
        if self.farthest_back_s > BACKWARD_S && self.kind == Kind::Track {
            warnings.push(format!(
                "{name}: times go back by up to {:.1} s from one message to the next",
                self.farthest_back_s
            ));
        }
        warnings
    }
}

impl Fault {
    /// What is wrong; `None` where nothing is.
    pub(super) fn description(&self) -> Option<&'static str> {
        match self {
            Self::Miss(_) => Some("the path leads nowhere in them"),
            Self::NoVector { .. } => Some("no vector at the path"),
            Self::NotFinite => Some("NaN or infinite"),
            Self::NoFix => Some("their status is that there is no fix"),
            Self::OffEarth => Some("a latitude beyond 90 degrees or a longitude beyond 360"),
            Self::NoOrientation => Some("no orientation of unit length to turn the velocity by"),
            Self::NoUnit => Some("angles of which nothing tells whether they are degrees or radians"),
            Self::NoRange => Some("a range that is not positive"),
            Self::NoAngle => Some("a bearing of more than a turn, or a depression beyond the vertical"),
            Self::Filtered => None,
        }
    }
}

/// In order of time, which of the readings came first, second and so on.
fn arrival(readings: &[Reading]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..u32::try_from(readings.len()).unwrap_or(u32::MAX)).collect();
    order.sort_by_key(|&i| readings[i as usize].time);
    order
}

type Sigma = Option<(f64, SigmaOrigin)>;

/// Readings in order of time with a sigma each, and the median sigma with its origin.
fn samples(
    mut readings: Vec<Reading>,
    value: impl Fn(&Reading) -> [f64; 3],
    origin: Time,
    configured: Option<f64>,
) -> (Vec<Sample>, Sigma) {
    readings.sort_by_key(|r| r.time);
    let from_messages = readings.iter().any(|r| r.sigma.is_some());
    let mut samples: Vec<Sample> = readings
        .iter()
        .map(|r| Sample {
            time_s: r.time.seconds_since(origin),
            value: value(r),
            sigma: configured.map_or(r.sigma.unwrap_or([f64::NAN; 3]), |s| [s; 3]),
        })
        .collect();
    if samples.is_empty() {
        return (samples, None);
    }
    let origin = match (configured, from_messages) {
        (Some(_), _) => SigmaOrigin::Config,
        (None, true) => {
            // messages without one take the median of the others
            let mut known: Vec<f64> = readings.iter().filter_map(|r| r.sigma).flatten().collect();
            let median = robust::median(&mut known).unwrap_or(1.0);
            for sample in samples.iter_mut().filter(|s| s.sigma[0].is_nan()) {
                sample.sigma = [median; 3];
            }
            SigmaOrigin::Messages
        }
        (None, false) => {
            let estimated = noise::estimate_sigma(&samples);
            samples.iter_mut().for_each(|s| s.sigma = [estimated.unwrap_or(1.0); 3]);
            if estimated.is_some() { SigmaOrigin::Estimated } else { SigmaOrigin::Assumed }
        }
    };
    let mut all: Vec<f64> = samples.iter().flat_map(|s| s.sigma).collect();
    let median = robust::median(&mut all).map(|m| (m, origin));
    (samples, median)
}
