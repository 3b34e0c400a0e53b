//! The USBL smoother held against the truth of dives: a sample of `examples/usbl`, with margins for few dives.

#[path = "../examples/usbl/judge.rs"]
#[allow(dead_code)] // what only tables tell
mod judge;

use judge::{ROWS, predicted, smoothed};
use trackfuse::estimate::usbl::causal::{Improved, ImprovedSettings, Paper, PaperSettings};

const DIVES: std::ops::Range<u64> = 1..25;

#[test]
fn tracks_and_bands_are_right_seen_and_through_silence() {
    let to_reach = [[1.5, 13.0], [1.8, 13.0], [1.8, 14.0], [3.0, 20.0], [2.6, 15.0]];
    for (row, [seen_m, silent_m]) in ROWS.iter().zip(to_reach) {
        let judged = smoothed(row, DIVES);
        let [seen, silent] = judged.sums;
        assert!(
            seen.rmse() < seen_m && silent.rmse() < silent_m,
            "{}: {} {}",
            row.name,
            seen.rmse(),
            silent.rmse()
        );
        let covered = [seen.coverage(), silent.coverage()];
        assert!(covered[0] > 0.93 && covered[0] < 0.99 && covered[1] > 0.86, "{}: {covered:?}", row.name);
        assert!(judged.wild == 0 || judged.recall() > 0.99, "{}: {}", row.name, judged.recall());
        assert!(judged.false_alarms() < 0.02, "{}: {}", row.name, judged.false_alarms());
        assert!(judged.worst_unwarned_m < 6.0, "{}: {}", row.name, judged.worst_unwarned_m);
    }
}

#[test]
fn without_wild_fixes_hardly_a_dive_warns() {
    assert!(smoothed(&ROWS[0], DIVES).warned <= 1);
}

#[test]
fn the_improved_causal_method_predicts_better_than_the_papers_and_knows_how_well() {
    for row in &ROWS[..2] {
        let paper = predicted(row, DIVES, || Paper::new(PaperSettings::default()));
        let improved = predicted(row, DIVES, || Improved::new(ImprovedSettings::default()));
        for (paper, improved) in paper.iter().zip(&improved) {
            assert!(
                improved.rmse() < 0.4 * paper.rmse(),
                "{}: {} {}",
                row.name,
                improved.rmse(),
                paper.rmse()
            );
            assert!(improved.coverage() > 0.93, "{}: {}", row.name, improved.coverage());
        }
    }
}
