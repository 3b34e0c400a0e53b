//! What a sensor says: vectors with their times and noise, in SI units, ready for an estimator.

use std::cmp::Ordering;

/// One measured vector: a position, m, or a velocity, m/s, in the track's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Seconds since the track's origin, on the datum's clock.
    pub time_s: f64,
    /// The measured vector.
    pub value: [f64; 3],
    /// Standard deviation of its noise, one an axis.
    pub sigma: [f64; 3],
}

/// Everything that one sensor measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// What the user calls it.
    pub name: String,
    /// Positions, m, in order of time.
    pub positions: Vec<Sample>,
    /// Velocities, m/s, in order of time; the times need not be those of the positions.
    pub velocities: Vec<Sample>,
}

/// Which of a source's two series.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Position, m.
    Position,
    /// Velocity, m/s.
    Velocity,
}

impl Quantity {
    /// Both, in the order in which they are reported.
    pub const ALL: [Self; 2] = [Self::Position, Self::Velocity];

    /// The quantity's name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Velocity => "velocity",
        }
    }

    /// Its unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Position => "m",
            Self::Velocity => "m/s",
        }
    }
}

impl Source {
    /// The series of one quantity.
    #[must_use]
    pub fn series(&self, quantity: Quantity) -> &[Sample] {
        match quantity {
            Quantity::Position => &self.positions,
            Quantity::Velocity => &self.velocities,
        }
    }

    /// The series of one quantity, to change.
    pub fn series_mut(&mut self, quantity: Quantity) -> &mut Vec<Sample> {
        match quantity {
            Quantity::Position => &mut self.positions,
            Quantity::Velocity => &mut self.velocities,
        }
    }

    /// First and last time of anything that it measured, s; `None` when it measured nothing.
    #[must_use]
    pub fn span_s(&self) -> Option<(f64, f64)> {
        let ends = Quantity::ALL.iter().filter_map(|&q| {
            let series = self.series(q);
            Some((series.first()?.time_s, series.last()?.time_s))
        });
        ends.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// Number of sampling instants: that of the longer series.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len().max(self.velocities.len())
    }

    /// Whether it measured nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The part of it within `[from_s, to_s]`.
    #[must_use]
    pub fn within(&self, from_s: f64, to_s: f64) -> Self {
        Self {
            name: self.name.clone(),
            positions: slice(&self.positions, from_s, to_s).to_vec(),
            velocities: slice(&self.velocities, from_s, to_s).to_vec(),
        }
    }
}

impl Source {
    /// All samples in order of time, a position and a velocity of one instant together.
    #[inline(always)]
    pub fn instants(&self) -> impl Iterator<Item = (Option<&Sample>, Option<&Sample>)> {
        let (mut positions, mut velocities) =
            (self.positions.iter().peekable(), self.velocities.iter().peekable());
        std::iter::from_fn(move || {
            let order = match (positions.peek(), velocities.peek()) {
                (None, None) => return None,
                (Some(_), None) => Ordering::Less,
                (None, Some(_)) => Ordering::Greater,
                (Some(p), Some(v)) => p.time_s.total_cmp(&v.time_s),
            };
            let position = if order.is_le() { positions.next() } else { None };
            let velocity = if order.is_ge() { velocities.next() } else { None };
            Some((position, velocity))
        })
    }
}

/// The samples of an ordered series within `[from_s, to_s]`.
#[must_use]
pub fn slice(series: &[Sample], from_s: f64, to_s: f64) -> &[Sample] {
    let start = series.partition_point(|s| s.time_s < from_s);
    let end = series.partition_point(|s| s.time_s <= to_s);
    &series[start..end.max(start)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instants_pair_what_was_measured_together() {
        let at = |t: f64| Sample { time_s: t, value: [t; 3], sigma: [1.0; 3] };
        let source = Source {
            positions: [1.0, 2.0, 4.0].map(at).to_vec(),
            velocities: [0.5, 2.0, 3.0, 4.0, 5.0].map(at).to_vec(),
            ..Source::default()
        };
        let times: Vec<_> =
            source.instants().map(|(p, v)| (p.map(|p| p.time_s), v.map(|v| v.time_s))).collect();
        let both = |t| (Some(t), Some(t));
        assert_eq!(
            times,
            [
                (None, Some(0.5)),
                (Some(1.0), None),
                both(2.0),
                (None, Some(3.0)),
                both(4.0),
                (None, Some(5.0))
            ]
        );
    }

    #[test]
    fn a_slice_holds_both_of_its_ends_and_survives_a_reversed_interval() {
        let series: Vec<Sample> =
            (0..5).map(|i| Sample { time_s: f64::from(i), value: [0.0; 3], sigma: [1.0; 3] }).collect();
        assert_eq!(slice(&series, 1.0, 3.0).len(), 3);
        assert_eq!(slice(&series, 3.5, 0.5).len(), 0);
        let source = Source { positions: series, ..Source::default() };
        assert_eq!(source.span_s(), Some((0.0, 4.0)));
        assert_eq!(source.within(1.5, 9.0).len(), 3);
    }
}
