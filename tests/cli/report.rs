//! `--report`: the page for the browser, as it lies on the disk.

use std::fs;

use serde_json::Value;

use super::trial::{Trial, assert_says, trackfuse};
use super::trial_log::two_sensors;

const POINT: &str = "[[characteristic_point]]\nname = \"half <b>way</b>\"\nz_m = -30.0\n";

/// The JSON in the page's element of this id.
fn embedded(page: &str, id: &str) -> Value {
    let (_, rest) = page.split_once(&format!("<script type=\"application/json\" id=\"{id}\">")).unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

#[test]
fn report_has_the_numbers_of_json_and_its_tables_need_no_script() {
    let trial = Trial::of(two_sensors()).config(POINT);
    let ran = trial.fuse(&["--json", "--report", "dive.html"]);
    assert_eq!(ran.code, 0, "{ran:#?}");
    let page = fs::read_to_string(trial.path("dive.html")).unwrap();
    let json: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(embedded(&page, "report"), json);
    let number = |pointer: &str| json.pointer(pointer).unwrap().as_f64().unwrap();
    let sigma = |pointer: &str, decimals: usize| format!("{:.decimals$}", number(pointer));
    let (text, scripts) = page.split_once("<script").unwrap();
    assert_says(
        text,
        &[
            &format!("<td class=\"number\">{}</td>", sigma("/phases/1/position_sigma_m", 3)),
            &format!(
                "{} ± {}",
                sigma("/characteristic_points/0/time_s", 3),
                sigma("/characteristic_points/0/time_sigma_s", 3)
            ),
            "half &lt;b&gt;way&lt;/b&gt;",
            "trackfuse fuse in.mcap --config trial.toml --json --report dive.html",
            "name = &quot;tether&quot;",
        ],
    );
    assert!(!text.contains("NaN") && !text.contains("inf<") && !scripts.contains("<b>way"));
    let drawings = embedded(&page, "drawings");
    assert!(drawings["plots"].as_array().unwrap().len() > 20);
    assert_eq!(page.matches("<div class=\"plot\">").count(), drawings["plots"].as_array().unwrap().len());
}

#[test]
fn report_is_the_same_each_time_and_stays_small() {
    let trial = Trial::of(two_sensors());
    let made = || {
        assert_eq!(trial.fuse(&["--force", "--report", "a.html"]).code, 0);
        fs::read(trial.path("a.html")).unwrap()
    };
    let page = made();
    assert!(page == made());
    assert!(page.len() < 500_000, "{} bytes", page.len());
}

#[test]
fn report_comes_with_every_kind_of_output_and_changes_none() {
    let trial = Trial::of(two_sensors());
    assert_eq!(trial.fuse(&["-o", "plain.mcap"]).code, 0);
    assert_eq!(trial.fuse(&["-o", "with.mcap", "--report", "with.html"]).code, 0);
    assert!(fs::read(trial.path("plain.mcap")).unwrap() == fs::read(trial.path("with.mcap")).unwrap());
    assert_eq!(trial.fuse(&["--sidecar", "track.mcap", "--report", "sidecar.html"]).code, 0);
    fs::copy(trial.path("in.mcap"), trial.path("own.mcap")).unwrap();
    let ran = trackfuse(trial.folder(), &["fuse", "own.mcap", "--in-place", "--report", "own.html"]);
    assert_eq!(ran.code, 0, "{ran:#?}");
    assert!(ran.stdout.starts_with("own.mcap, in place, own.html\n"), "{}", ran.stdout);
    for name in ["with.html", "sidecar.html", "own.html"] {
        assert_says(&fs::read_to_string(trial.path(name)).unwrap(), &["<h1>", "Provenance"]);
    }
}

#[test]
fn report_that_cannot_be_written_leaves_no_log_either() {
    let trial = Trial::of(two_sensors());
    fs::write(trial.path("there.html"), "mine").unwrap();
    for (name, code, says) in [
        ("there.html", 2, "\"there.html\" exists"),
        ("in.mcap", 2, "is the input itself"),
        ("in.fused.mcap", 2, "can't both be \"in.fused.mcap\""),
        ("./in.fused.mcap", 2, "can't both be"),
        ("nowhere/a.html", 1, "there is no folder"),
        (".", 1, "it is a directory"),
    ] {
        let ran = trial.fuse(&["--report", name]);
        assert_eq!(ran.code, code, "{name}: {ran:#?}");
        assert_says(&ran.stderr, &[says]);
    }
    assert_eq!(fs::read(trial.path("there.html")).unwrap(), b"mine");
    assert_eq!(trial.fuse(&["--report", "there.html", "--force"]).code, 0);
    assert!(fs::read(trial.path("there.html")).unwrap().starts_with(b"<!DOCTYPE html>"));
}

#[test]
fn report_holds_what_is_missing_as_a_dash() {
    let config = "[fusion]\nmethod = \"gdf\"\nestimate = []\n[extrapolation]\nhorizon_s = 0\n";
    let trial = Trial::of(two_sensors()).config(config);
    let ran = trial.fuse(&["--report", "gdf.html"]);
    assert!(matches!(ran.code, 0 | 3), "{ran:#?}");
    let page = fs::read_to_string(trial.path("gdf.html")).unwrap();
    let text = page.split_once("<script").unwrap().0;
    assert_says(text, &["No error of a source was estimated", "it was not carried on"]);
    assert!(!text.contains("NaN"));
}
