//! What the page of a dive with wild fixes, a late one and a silence shows.

use super::*;
use crate::config::SourceConfig;
use crate::estimate::usbl::Settings;
use crate::fusion::usbl::{Causal, DivePlan, clean};
use crate::report::UsblParts;
use crate::report::html::{Plot, Style, Table};
use crate::sample::Sample;
use crate::source::{Loaded, SigmaOrigin, Timing};

/// An hour's third at 1 m/s, an exchange of three fixes every 20 s; one fix of every fifth exchange is 300 m off, the
/// 15th exchange as a whole, nothing is heard from 600 s to 800 s, and one fix is there twice.
fn fixes() -> Vec<Sample> {
    let heard = (0..180_u32).filter(|i| !(90..120).contains(i));
    let fix = |i: u32| {
        let time_s = 20.0 * f64::from(i / 3) + 0.5 * f64::from(i % 3);
        let noise = |k: u32| f64::from((7 * i + k) % 11) - 5.0;
        let off = if i / 3 == 14 || i % 15 == 1 { 300.0 } else { 0.0 };
        let value = [time_s + 0.4 * noise(0) + off, 0.4 * noise(3), -50.0 + 0.4 * noise(5)];
        Sample { time_s, value, sigma: [1.5; 3] }
    };
    let mut fixes: Vec<Sample> = heard.map(fix).collect();
    fixes.insert(6, fixes[5]);
    fixes
}

/// A report of the dive, of fixes with a sigma of 1.5 m from the config.
fn report_of(dive: &Dive, fixes: &Source, plan: &DivePlan, t0: Time) -> UsblReport {
    let loaded = Loaded {
        config: SourceConfig { position: Some("/usbl.p".into()), ..SourceConfig::default() },
        source: Source::default(),
        frame_id: plan.frame_id.clone(),
        fix_origin: None,
        timing: Timing { clock: "stamp".into(), delay_s: 0.0, delay_spread_s: 0.0, delay_growth_s: 0.0 },
        arrival: Vec::new(),
        sigma: [Some((1.5, SigmaOrigin::Config)), None],
        notes: Vec::new(),
        warnings: Vec::new(),
    };
    UsblReport::new(&UsblParts {
        input: "trials/in.mcap",
        output: "out.mcap",
        t0,
        origin: None,
        loaded: &loaded,
        fixes,
        depth: None,
        plan,
        dive,
        notes: &[],
        warnings: &[],
    })
}

fn page_of(causal: Causal) -> Page {
    let fixes = Source { name: "usbl".into(), positions: fixes(), velocities: Vec::new() };
    let origin = Time::from_ns(0);
    // the 31st comes after the one that follows it
    let mut arrival: Vec<u32> = (0..).take(fixes.positions.len()).collect();
    arrival.swap(30, 31);
    let plan = DivePlan {
        origin,
        frame_id: "enu".into(),
        rate_hz: 1.0,
        bridge_max_s: 1800.0,
        settings: Settings::default(),
        cycle_s: None,
        causal,
        sigma_is_guess: false,
    };
    let dive = clean(&fixes, &arrival, &[], &plan).expect("a track");
    let t0 = dive.fusion.track.points[0].time;
    let report = report_of(&dive, &fixes, &plan, t0);
    page(Parts { report: &report, dive: &dive, origin, t0 }, &[], "")
}

fn plots(page: &Page) -> Vec<&Plot> {
    let parts = page.sections.iter().flat_map(|s| &s.parts);
    let plots = parts.filter_map(|p| if let Part::Plots(_, plots) = p { Some(plots) } else { None });
    plots.flatten().collect()
}

fn table<'a>(page: &'a Page, caption: &str) -> &'a Table {
    let mut parts = page.sections.iter().flat_map(|s| &s.parts);
    let wanted = |p: &&Part| matches!(p, Part::Table(t) if t.caption.starts_with(caption));
    match parts.find(wanted) {
        Some(Part::Table(table)) => table,
        _ => panic!("no table {caption:?}"),
    }
}

#[test]
fn wild_fixes_have_the_sign_of_their_reason_and_kept_ones_are_dots() {
    let page = page_of(Causal::Improved);
    for title in ["x position", "Distance of the fixes from the track in sigmas"] {
        let plots = plots(&page);
        let plot = plots.iter().find(|p| p.title == title).expect("a plot");
        let drawn = |label: &str, style: Style| {
            let series = plot.series.iter().find(|s| s.label == label).expect("a series");
            assert_eq!(series.style, style, "{title}: {label}");
            page.tables[series.table].len()
        };
        assert_eq!(drawn("off by itself", Style::Outliers), 10, "{title}");
        assert_eq!(drawn("off with its exchange", Style::Outliers), 3, "{title}");
        assert_eq!(drawn("kept", Style::Dots), 137, "{title}");
    }
}

#[test]
fn the_strip_has_a_row_for_every_verdict_that_there_is() {
    let page = page_of(Causal::Improved);
    let plots = plots(&page);
    let strip = plots.iter().find(|p| !p.names.is_empty()).expect("a strip");
    assert_eq!(strip.names, ["late", "repeated", "exchange", "by itself", "kept"]);
    assert_eq!(strip.y_range, Some((-0.6, 4.6)));
    assert_eq!(table(&page, "What became").rows.len(), 6, "what there is none of has no row");
}

#[test]
fn a_silence_tells_its_length_its_sigma_and_how_far_the_prediction_was_off() {
    let page = page_of(Causal::Improved);
    let rows = &table(&page, "Silences").rows;
    assert_eq!(rows.len(), 1);
    assert_eq!(rows[0][2], "219 s");
    for cell in &rows[0][3..] {
        assert!(cell.parse::<f64>().is_ok_and(|metres| metres > 0.1), "{rows:?}");
    }
}

#[test]
fn a_prediction_without_a_sigma_has_no_band() {
    let bands =
        |page: &Page| plots(page).iter().flat_map(|p| &p.series).filter(|s| s.style == Style::Band).count();
    let (improved, paper) = (page_of(Causal::Improved), page_of(Causal::Paper));
    assert_eq!((bands(&improved), bands(&paper)), (3, 0));
    let held = |page: &Page| table(page, "Prediction less track").rows[0][5].clone();
    assert!(held(&improved).ends_with(" %"), "{}", held(&improved));
    assert_eq!(held(&paper), "–");
}

#[test]
fn the_answer_says_how_well_the_place_is_known_before_it_counts_fixes() {
    let [known, counted] = &page_of(Causal::Improved).answer[..] else { panic!("two paragraphs") };
    assert!(known.starts_with("19.7 min of track: the position is known to ± "), "{known}");
    assert!(known.contains(" m where fixes come, ± ") && known.contains("of silence"), "{known}");
    assert!(
        counted.starts_with("Of 151 fixes 13 (9 %) were thrown out as wild; 1 of 50 exchanges"),
        "{counted}"
    );
}
