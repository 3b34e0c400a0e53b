//! Zhang 2025, figures 3-7 and 9 and its sea trial: in numbers, held to what of them reproduces.

use std::sync::LazyLock;

use acceleration::Row as Jump;
use orders::Row as Order;
use remade::{acceleration, orders, raw_time, sea_trial, segments, trial};
use sea_trial::Maker;
use trial::Trial;

#[path = "../examples/paper/remade/mod.rs"]
#[allow(dead_code)] // other tests use the rest
mod remade;

// many climbs each, for several tests
static ORDERS: LazyLock<Vec<Order>> = LazyLock::new(orders::rows);
static SEA_TRIAL: LazyLock<Vec<sea_trial::Row>> = LazyLock::new(sea_trial::rows);

fn jumps() -> Vec<Jump> {
    acceleration::rows(&Trial::of_table_1())
}

fn jump(rows: &[Jump], method: &str) -> f64 {
    rows.iter().find(|row| row.method == method).expect("a method of the table").jump
}

#[test]
fn the_acceleration_of_gdf_and_of_the_moving_averages_jumps_and_that_of_sff_and_pcf_does_not() {
    let rows = jumps();
    let sensors = jump(&rows, "the sensors themselves");
    assert!(sensors < 2.5, "{sensors}");
    assert!(jump(&rows, "GDF") > 50.0);
    assert!(jump(&rows, "moving average, 5 pts") > 10.0);
    assert!(jump(&rows, "moving average, 16 pts") > 2.0 * sensors);
    assert!(jump(&rows, "moving average, 32 pts") > 1.2 * sensors);
    for smooth in ["SFF", "PCF (12)"] {
        assert!(jump(&rows, smooth) < sensors, "{smooth}: {}", jump(&rows, smooth));
    }
}

#[test]
fn sff_spreads_the_disagreement_and_does_not_remove_it() {
    let off = |method: &str| jumps().iter().find(|row| row.method == method).expect("a method").off;
    assert!(off("SFF") > 3.0 && off("SFF") < 0.2 * off("GDF"), "{} {}", off("SFF"), off("GDF"));
}

fn order(name: &str) -> &'static Order {
    ORDERS.iter().find(|row| row.name == name).expect("an order of the table")
}

#[test]
fn order_3_is_clearly_off_and_order_12_is_good() {
    let [third, fifth, twelfth] = ["order 3", "order 5", "order 12"].map(|name| order(name).rms);
    assert!(third[0] > 0.15 && third[1] > 0.5, "{third:?}");
    assert!(fifth[0] < 0.5 * third[0] && fifth[0] > 2.0 * twelfth[0], "{fifth:?}");
    assert!(twelfth[0] < 0.03 && twelfth[1] < 0.15, "{twelfth:?}");
}

#[test]
fn order_48_oscillates_at_the_ends_from_positions_alone_and_not_with_velocities() {
    let (alone, both) = (order("order 48, positions alone"), order("order 48"));
    assert!(
        alone.ends[0] > 0.4 && alone.ends[0] > 4.0 * alone.middle[0],
        "{:?} {:?}",
        alone.ends,
        alone.middle
    );
    assert!(alone.ends[1] > 50.0, "{:?}", alone.ends);
    assert!(both.ends[0] < 0.06 && both.ends[1] < 2.0, "{:?}", both.ends);
}

#[test]
fn equation_6_as_printed_holds_at_order_12_and_is_lost_at_48() {
    let ([twelfth, printed_12], printed_48) = (
        ["order 12", "order 12, eq. 6 as printed"].map(|n| order(n).rms),
        order("order 48, eq. 6 as printed").rms,
    );
    assert!(printed_12[0] < 1.5 * twelfth[0], "{printed_12:?}");
    assert!(printed_48[0] > 50.0, "{printed_48:?}"); // metres, on a track of 60
}

/// Golden numbers: tests/raw_time_condition.py, with mpmath and numpy.
#[test]
fn condition_numbers_are_those_of_an_exact_computation() {
    for (order, raw, sound) in [(12, 1.92254e10, 18.1077), (48, 1.08815e46, 380.581)] {
        let found = raw_time::conditions(order);
        assert!((found.raw / raw - 1.0).abs() < 1e-4, "order {order}: {:e}", found.raw);
        assert!((found.chebyshev / sound - 1.0).abs() < 1e-4, "order {order}: {}", found.chebyshev);
    }
}

#[test]
fn order_4_fits_each_segment_and_neighbours_do_not_join() {
    let trial = segments::trial();
    for row in segments::rows(&trial) {
        // of some 30 m and 15 m/s
        assert!(row.rmse[0] < 0.03 && row.rmse[1] < 0.2, "{}: {:?}", row.name, row.rmse);
        assert!(row.middle < row.ends, "{}: {} {}", row.name, row.middle, row.ends);
    }
    for join in segments::joins(&trial) {
        assert!(join.a.abs() > 2.0 && join.v.abs() > 0.05, "{}: {} m/s, {} m/s2", join.name, join.v, join.a);
    }
}

fn sea_trial_of(maker: Maker, errors: bool) -> &'static sea_trial::Row {
    let row = SEA_TRIAL.iter().find(|row| row.maker == maker && row.errors == errors);
    row.expect("a row of the table")
}

#[test]
fn speed_is_within_5_percent_where_somebody_sees_and_within_15_half_a_second_later() {
    for errors in [false, true] {
        let row = sea_trial_of(Maker::Paper, errors);
        let speed = row.percent.map(|[_, speed]| speed);
        assert!(speed[0] < 5.0 && speed[1] < 5.0 && speed[2] < 15.0, "{speed:?}");
    }
}

#[test]
fn with_systematic_errors_the_points_are_as_far_off_as_in_the_papers_sea_trial() {
    let row = sea_trial_of(Maker::Paper, true);
    for (ours, theirs) in row.percent.iter().zip(&sea_trial::PAPER_PERCENT) {
        for (ours, theirs) in ours.iter().zip(theirs) {
            assert!((1.0 / 3.0..3.0).contains(&(ours / theirs)), "{ours} % against {theirs} %");
        }
    }
}

#[test]
fn a_hundred_samples_ahead_the_paper_often_never_arrives_and_the_prior_does() {
    let (paper, library) = (sea_trial_of(Maker::Paper, false), sea_trial_of(Maker::Library, false));
    assert!(paper.never[4] >= 15, "{} of 50", paper.never[4]);
    assert!(paper.percent[3][1] > 25.0, "{:?}", paper.percent);
    assert_eq!(library.never, [0; 5]);
    assert!(library.percent[4][0] < 2.5 && library.percent[4][1] < 15.0, "{:?}", library.percent);
}

#[test]
fn order_4_goes_on_sanely_for_40_samples_and_order_12_diverges() {
    let [fourth, twelfth] = sea_trial::forty_ahead_m();
    assert!(fourth < 1.5, "{fourth} m");
    assert!(twelfth > 1e3, "{twelfth} m");
}
