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

/// What holds for climbs of either simulator.
fn check(families: &[Family]) {
    for family in families {
        let name = &family.name;
        let seen = [Part::Tether, Part::Overlap, Part::Beacon].map(|part| method(family, "SFF", part));
        let [unseen, _] = method(family, "SFF", Part::Unseen);
        let positions = || seen.iter().map(|[position, _]| position);
        let worst_m = positions().filter_map(Pool::rmse).fold(0.0, f64::max);
        let least = positions().filter_map(Pool::inside).fold(1.0, f64::min);
        if ["single", "no_error"].contains(&name.as_str()) {
            assert_eq!(family.warned, 0, "{name}");
            assert!(worst_m < 0.06, "{name}: {worst_m} m");
            assert!(unseen.rmse().expect("carried on") < 1.5, "{name} unseen: {:?} m", unseen.rmse());
            assert!(least > 0.9, "{name}: {least} inside the bands");
        } else {
            // a bias may happen to be below its noise
            assert!(
                4 * family.warned >= 3 * family.runs,
                "{name}: {} of {} runs warn",
                family.warned,
                family.runs
            );
            assert!(worst_m < 3.5, "{name}: {worst_m} m");
            assert!(least > 0.85, "{name}: {least} inside the bands");
        }
        assert!(unseen.inside().is_none_or(|share| share > 0.9), "{name} unseen: {:?}", unseen.inside());
        // The tether's noise of 0.1 m an axis is all that the weighted mean has where it alone sees; with
        // outliers, and where the second sensor of `single` is the only one, it is another.
        let [gdf, _] = method(family, "GDF", Part::Tether);
        let plain = !["outliers", "single"].contains(&name.as_str());
        let gdf_m = gdf.rmse().expect("seen");
        assert!(!plain || (0.15..0.19).contains(&gdf_m), "{name}: GDF {gdf_m} m");
    }
}

#[test]
fn honest_sensors_give_centimetres_and_no_warning_and_biased_ones_a_warning_and_bands_that_hold() {
    let families = trackfuse::simulate::FAMILIES.map(|name| Family::judge(name, climbs::simulated(name, 8)));
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
