//! Who sees the vehicle when: tether alone, both, beacon alone, nobody.

/// The instants that part a climb, s after release.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phases {
    /// The spacing of frames that the phases are counted in, s.
    pub frame_s: f64,
    /// T0, the release: 0.
    pub t0_s: f64,
    /// T1, the end of the powered phase: the middle of the overlap, or of the gap.
    pub t1_s: f64,
    /// T2, the last frame that anybody sees.
    pub t2_s: f64,
    /// T3, the end of the unseen phase, just below the surface.
    pub t3_s: f64,
    /// The first frame of the beacon.
    pub overlap_begin_s: f64,
    /// The last frame of the tether; before `overlap_begin_s` where a gap stands in the overlap's place.
    pub overlap_end_s: f64,
}

/// How many frames each phase has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frames {
    /// Seen by the tether alone.
    pub tether: u32,
    /// Seen by both.
    pub overlap: u32,
    /// Seen by the beacon alone.
    pub beacon: u32,
    /// Seen by nobody.
    pub unseen: u32,
}

impl Phases {
    /// The phases of a climb of so many frames, `frame_s` apart.
    ///
    /// A `gap_s` above zero takes the overlap's place: nobody sees the `gap_s` seconds around T1.
    #[must_use]
    pub fn new(frames: &Frames, frame_s: f64, gap_s: f64) -> Self {
        let at = |frame: u32| f64::from(frame) * frame_s;
        let tethered = frames.tether.saturating_add(frames.overlap);
        let seen = tethered.saturating_add(frames.beacon);
        let (begin, end) = (at(frames.tether), at(tethered.saturating_sub(1)));
        let t1_s = 0.5 * (begin + end);
        let (overlap_begin_s, overlap_end_s) =
            if gap_s > 0.0 { (t1_s + 0.5 * gap_s, t1_s - 0.5 * gap_s) } else { (begin, end) };
        let t2_s = at(seen.saturating_sub(1));
        Self {
            frame_s,
            t0_s: 0.0,
            t1_s,
            t2_s,
            t3_s: t2_s + at(frames.unseen),
            overlap_begin_s,
            overlap_end_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAMES: Frames = Frames { tether: 80, overlap: 30, beacon: 75, unseen: 100 };

    fn assert_close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-12, "{a} is not {b}");
    }

    #[test]
    fn the_steep_climb_is_seen_for_3_7_s_and_unseen_for_2_s() {
        let phases = Phases::new(&FRAMES, 0.02, 0.0);
        assert_close(phases.t1_s, 1.89);
        assert_close(phases.t2_s, 3.68);
        assert_close(phases.t3_s, 5.68);
        assert_close(phases.overlap_begin_s, 1.6);
        assert_close(phases.overlap_end_s, 2.18);
    }

    #[test]
    fn a_gap_stands_around_t1() {
        let phases = Phases::new(&FRAMES, 0.02, 0.3);
        assert_close(phases.overlap_begin_s, 2.04);
        assert_close(phases.overlap_end_s, 1.74);
    }
}
