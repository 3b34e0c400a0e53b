//! What the paper claims, beside what became of it here: the page's first table.

use super::sea_trial::Maker;
use super::table_1::Row;
use super::trial::Trial;
use super::{acceleration, markdown, orders, sea_trial, segments, table_1};

/// Claim, verdict, their number, ours.
type Claim = [String; 4];

/// The page's table.
pub(crate) fn table() -> String {
    let claims = [of_table_1(), of_accelerations(), of_orders(), of_segments(), of_the_sea_trial()].concat();
    markdown::table(["claim", "verdict", "theirs", "ours"], claims)
}

fn claim(claim: &str, verdict: &str, theirs: String, ours: String) -> Claim {
    [claim.into(), verdict.into(), theirs, ours]
}

fn of_table_1() -> Vec<Claim> {
    let trial = Trial::of_table_1();
    let (ours, shared) = (table_1::rows(&trial), table_1::row_shared(&trial));
    let overlap = |row: &Row| format!("{:.3} m, {:.3} m/s", row.rmse[1], row.rmse[4]);
    let outside = |row: &Row| {
        let [a, _, b, c, _, d] = row.rmse;
        format!("{a:.3}, {b:.3} m; {c:.3}, {d:.3} m/s")
    };
    let both = |of: &dyn Fn(&Row) -> String, i: usize| (of(&table_1::PAPER[i]), of(&ours[i]));
    let ((gdf, our_gdf), (sff, our_sff)) = (both(&overlap, 0), both(&outside, 2));
    let (average, our_average) = both(&outside, 3);
    vec![
        claim(
            "GDF keeps to the samples outside the overlap, and lies between them in it",
            "reproduces",
            gdf,
            our_gdf,
        ),
        claim(
            "SFF outside the overlap, phases 1 and 2",
            "reproduces, with position and velocity fitted apart",
            sff,
            our_sff,
        ),
        claim(
            "SFF's velocity is consistent with its position",
            "**not in Table 1**: it isn't the position's derivative there; with one that is the table doesn't reproduce",
            outside(&table_1::PAPER[2]),
            outside(&shared),
        ),
        claim(
            "order of the methods outside the overlap",
            "reproduces, wherever theirs differ by more than 0.01",
            String::new(),
            String::new(),
        ),
        claim(
            "moving average of 5 outside the overlap",
            "position reproduces, **velocity doesn't**",
            average,
            our_average,
        ),
    ]
}

fn of_accelerations() -> Vec<Claim> {
    let rows = acceleration::rows(&Trial::of_table_1());
    let jumps = [1, 4, 5, 6, 3].map(|i| rows[i].jump);
    vec![claim(
        "GDF's acceleration has spikes at the overlap's ends, the moving averages still show them, SFF doesn't",
        "reproduces",
        String::new(),
        format!(
            "jumps of {:.0}; {:.0}, {:.0}, {:.0}; {:.0} m/s²",
            jumps[0], jumps[1], jumps[2], jumps[3], jumps[4]
        ),
    )]
}

fn of_orders() -> Vec<Claim> {
    let rows = orders::rows();
    let of = |name: &str| rows.iter().find(|row| row.name == name);
    let rms = |name| of(name).map_or(f64::NAN, |row| row.rms[1]);
    let ends = |name| of(name).map_or(f64::NAN, |row| row.ends[0]);
    vec![
        claim(
            "PCF of order 3 is clearly off, of order 12 good",
            "reproduces",
            String::new(),
            format!("{:.2}, {:.2} m/s rms", rms("order 3"), rms("order 12")),
        ),
        claim(
            "PCF of order 48 oscillates at both ends",
            "reproduces with position and velocity fitted apart",
            String::new(),
            format!("{:.2} m off at the ends", ends("order 48, position and velocity apart")),
        ),
        claim(
            "",
            "**doesn't** with the velocities in the same fit (eq. 5) and a sound basis",
            String::new(),
            format!("{:.2} m", ends("order 48")),
        ),
    ]
}

fn of_segments() -> Vec<Claim> {
    let joins = segments::joins(&segments::trial());
    vec![claim(
        "PCF of order 4 fits segments A and C and the middle of B, and doesn't join at B's ends",
        "reproduces",
        String::new(),
        format!("steps of {:.1} and {:.1} m/s²", joins[0].a.abs(), joins[1].a.abs()),
    )]
}

fn of_the_sea_trial() -> Vec<Claim> {
    let rows = sea_trial::rows();
    let percent = |errors: bool, point: usize| {
        let row = rows.iter().find(|row| row.maker == Maker::Paper && row.errors == errors);
        row.map_or(f64::NAN, |row| row.percent[point][1])
    };
    let never = rows.iter().filter(|row| row.maker == Maker::Paper).map(|row| row.never[4]).max();
    let [fourth, twelfth] = sea_trial::forty_ahead_m();
    let [first, second, third] = sea_trial::PAPER_PERCENT.map(|[_, speed]| speed);
    vec![
        claim(
            "PCF of order 4 goes on sanely for 40 samples, of order 12 diverges",
            "reproduces",
            String::new(),
            format!("{fourth:.1} m, {twelfth:.0e} m off"),
        ),
        claim(
            "speed at a characteristic point within 5 % where somebody sees",
            "reproduces",
            format!("{first:.1}, {second:.1} %"),
            format!("{:.1}, {:.1} %", percent(true, 0), percent(true, 1)),
        ),
        claim(
            "within 15 % where nobody does",
            "reproduces for half a second",
            format!("{third:.1} %"),
            format!("{:.1} %", percent(true, 2)),
        ),
        claim(
            "... over 100 samples",
            "**doesn't**",
            String::new(),
            format!(
                "{:.0} % after 50; {} of 50 climbs never get there after 100",
                percent(true, 3),
                never.unwrap_or(0)
            ),
        ),
    ]
}
