//! The method of Liu 2023 as it is printed.

use super::{Open, Predictor, Rls, distance, mean, quadratic};
use crate::sample::Sample;
use crate::track::State;

/// What the paper leaves to its user.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperSettings {
    /// Time from one acoustic exchange to the next, s; the paper's is 20.
    pub cycle_s: f64,
    /// A fix is wild that would need a higher speed since the last exchange, m/s. 2.5: the paper gives none.
    pub rate_limit_m_s: f64,
    /// P_0 over the identity; the paper has it "large".
    pub large: f64,
    /// Time in which a point's weight falls by a factor e, s, t then counting from the newest exchange. The paper
    /// forgets nothing: `None`.
    pub memory_s: Option<f64>,
}

impl Default for PaperSettings {
    fn default() -> Self {
        Self { cycle_s: 20.0, rate_limit_m_s: 2.5, large: 1e6, memory_s: None }
    }
}

/// Rate gate, means, Lagrange alignment, one quadratic for the whole dive.
#[derive(Clone, Debug)]
pub struct Paper {
    settings: PaperSettings,
    open: Open,
    /// The last three exchanges: mean time and position.
    last: Vec<(f64, [f64; 3])>,
    /// The first points on the cycle's times.
    first: Vec<(f64, [f64; 3])>,
    begin_s: Option<f64>,
    rls: Option<Rls>,
}

impl Paper {
    /// Before the first fix.
    #[must_use]
    pub fn new(settings: PaperSettings) -> Self {
        Self {
            settings,
            open: Open::default(),
            last: Vec::new(),
            first: Vec::new(),
            begin_s: None,
            rls: None,
        }
    }

    /// An exchange is over: aligns it to the cycle and takes it in.
    fn close(&mut self, fixes: &[Sample]) {
        let centre = mean(fixes);
        let begin_s = *self.begin_s.get_or_insert(centre.0);
        self.last.push(centre);
        if self.last.len() > 3 {
            self.last.remove(0);
        }
        let Some(three) = self.last.first_chunk::<3>() else { return };
        let cycle = ((centre.0 - begin_s) / self.settings.cycle_s).round();
        let due_s = begin_s + cycle * self.settings.cycle_s;
        let point = (due_s, quadratic(three, due_s));
        if let Some(rls) = &mut self.rls {
            let mut keep = 1.0;
            if let Some(memory_s) = self.settings.memory_s {
                let passed_s = (due_s - rls.origin_s()).max(0.0);
                keep = (-passed_s / memory_s).exp().max(1e-6);
                rls.count_from(due_s);
            }
            rls.update(point.0, point.1, 1.0, keep);
            return;
        }
        if self.first.last().is_none_or(|last| last.0 < due_s) {
            self.first.push(point);
        }
        if let Some(points) = self.first.first_chunk::<3>() {
            self.rls = Rls::start(points, begin_s, Some(self.settings.large));
        }
    }
}

impl Predictor for Paper {
    fn push(&mut self, fix: &Sample) {
        self.advance(fix.time_s);
        let too_fast = self.last.last().is_some_and(|(time_s, position)| {
            let dt = fix.time_s - time_s;
            dt <= 0.0 || distance(fix.value, *position) > self.settings.rate_limit_m_s * dt
        });
        if !too_fast {
            self.open.push(fix);
        }
    }

    fn advance(&mut self, now_s: f64) {
        if let Some(fixes) = self.open.over(now_s, self.settings.cycle_s) {
            self.close(&fixes);
        }
    }

    fn at(&self, time_s: f64) -> Option<State> {
        let (position, velocity) = self.rls.as_ref()?.at(time_s);
        let unknown = [f64::NAN; 3];
        Some(State {
            position,
            velocity,
            acceleration: None,
            position_sigma: unknown,
            velocity_sigma: unknown,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadratic_without_noise_is_predicted_through_silence() {
        let at = |t: f64| [0.5 * t - 1e-4 * t * t, 20.0 + 0.1 * t, -0.7 * t];
        let mut paper = Paper::new(PaperSettings::default());
        for i in 0..30 {
            for k in 0..3 {
                let time_s = 20.0 * f64::from(i) + 0.5 * f64::from(k);
                paper.push(&Sample { time_s, value: at(time_s), sigma: [3.0; 3] });
            }
        }
        paper.advance(590.0);
        let state = paper.at(820.0).expect("a track");
        // the mean of three points of a curve lies off the curve by a little
        assert!(distance(state.position, at(820.0)) < 0.05, "{state:?}");
    }

    #[test]
    fn a_fix_that_would_need_too_high_a_speed_is_gated() {
        let fix = |time_s, x| Sample { time_s, value: [x, 0.0, 0.0], sigma: [3.0; 3] };
        let mut paper = Paper::new(PaperSettings::default());
        for i in 0..10 {
            paper.push(&fix(20.0 * f64::from(i), 0.0));
            paper.push(&fix(20.0 * f64::from(i) + 0.5, if i == 5 { 200.0 } else { 0.0 }));
        }
        paper.advance(300.0);
        assert!(distance(paper.at(200.0).expect("a track").position, [0.0; 3]) < 1e-6);
    }
}
