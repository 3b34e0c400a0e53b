//! Fusion held against the truth of climbs: a sample of the study in `examples/study`, and logs that another
//! simulator made.

#[path = "../examples/study/climbs.rs"]
mod climbs;
#[path = "../examples/study/family.rs"]
mod family;

use std::path::PathBuf;

use family::{Family, METHODS, Part, Pool};

fn method(family: &Family, name: &str, part: Part) -> [Pool; 2] {
    let index = METHODS.iter().position(|(n, _)| *n == name).expect("a method of the tables");
    family.pools[index][part as usize].clone()
}

/// Largest position errors where both see, or neither, and where the beacon alone does, m: half as much again as over
/// 200 runs, which a model without one of its errors exceeds.
const MOST_M: [(&str, f64, f64); 9] = [
    ("nominal", 0.032, 0.12),
    ("async", 0.025, 0.16),
    ("outliers", 0.025, 0.13),
    ("dropout", 0.09, 0.17),
    ("gap", 0.06, 0.32),
    ("bigtau", 0.025, 0.16),
    ("drift", 0.035, 0.32),
    ("single", 0.0, 0.0),
    ("no_error", 0.022, 0.07),
];

/// What holds for climbs of either simulator.
fn check(families: &[Family]) {
    for family in families {
        let name = &family.name;
        let seen = [Part::Tether, Part::Overlap, Part::Beacon].map(|part| method(family, "registered", part));
        let (_, overlap_m, beacon_m) = MOST_M.iter().find(|m| m.0 == name).expect("a family");
        let [tether, overlap, beacon] = seen.each_ref().map(|[position, _]| position.rmse().unwrap_or(0.0));
        assert!(tether < 0.055, "{name}, tether: {tether} m");
        assert!(overlap <= *overlap_m && beacon <= *beacon_m, "{name}: {overlap} m, {beacon} m");
        for (pool, what) in seen.iter().flatten().zip(0..) {
            // few runs, in which errors are correlated: far less than a table of 200 would allow
            let inside = pool.inside().unwrap_or(0.95);
            assert!(inside > 0.75, "{name}, {what}: {inside} inside the bands");
        }
        let [unseen, _] = method(family, "registered", Part::Unseen);
        let (inside, scaled) =
            (unseen.inside().expect("carried on"), unseen.normalised().expect("carried on"));
        assert!(inside > 0.85 && (0.3..1.5).contains(&scaled), "{name} unseen: {inside}, {scaled}");
        assert!(unseen.rmse().expect("carried on") < 3.5, "{name} unseen: {:?} m", unseen.rmse());
        // a gap may leave the clock open, which is said
        assert!(4 * family.warned <= family.runs || name == "gap", "{name}: {} runs warn", family.warned);
        // The tether's noise of 0.1 m an axis is all that the weighted mean has where it alone sees; with
        // outliers, and where the second sensor of `single` is the only one, it is another.
        let [gdf, _] = method(family, "GDF", Part::Tether);
        let plain = !["outliers", "single"].contains(&name.as_str());
        let gdf_m = gdf.rmse().expect("seen");
        assert!(!plain || (0.15..0.19).contains(&gdf_m), "{name}: GDF {gdf_m} m");
    }
}

#[test]
fn registered_sources_give_centimetres_and_bands_that_hold() {
    let families =
        trackfuse::simulate::FAMILIES.map(|name| Family::judge(name, climbs::simulated(name, 1, 8)));
    check(&families);
}

#[test]
fn climbs_of_another_simulator_give_the_same() {
    let Some(data) = std::env::var_os("TRACKFUSE_TEST_DATA").map(PathBuf::from) else {
        // past the test runner, which would keep it to itself
        let _ =
            std::io::Write::write_all(&mut std::io::stderr(), b"skipped: TRACKFUSE_TEST_DATA is not set\n");
        return;
    };
    let recorded = |name: &str| Family::judge(name, climbs::recorded(&data.join("climbs"), name));
    let families = trackfuse::simulate::FAMILIES.map(recorded);
    assert!(families.iter().all(|family| family.runs == 4));
    check(&families);
}
