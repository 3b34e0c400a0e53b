//! The study's tables, as Markdown.

use super::climbs::LAWLESS;
use super::family::{CARRIED_ON, Family, Judged, PLAIN, REGISTERED};
use super::flight::Flight;
use super::peers::{PEERS, Rows};
use super::pool::{Part, Pool, quantile};

/// What the default method is to reach: overlap, phase 2, velocity in phase 2.
const TARGETS: [(&str, [f64; 3]); 9] = [
    ("nominal", [0.025, 0.09, 0.11]),
    ("async", [0.02, 0.11, 0.15]),
    ("outliers", [0.02, 0.09, 0.12]),
    ("dropout", [0.025, 0.12, 0.16]),
    ("gap", [0.035, 0.25, 0.27]),
    ("bigtau", [0.02, 0.09, 0.13]),
    ("drift", [0.025, 0.20, 0.12]),
    ("single", [0.035, 0.04, 0.08]),
    ("no_error", [0.02, 0.04, 0.09]),
];

/// The families that no outlier is in, on which smoothers are to be equal.
const CLEAN: [&str; 7] = ["nominal", "async", "gap", "bigtau", "drift", "single", "no_error"];

/// The parts and quantities of the targets.
const JUDGED: [(Part, usize); 3] = [(Part::Overlap, 0), (Part::Phase2, 0), (Part::Phase2, 1)];

fn table(columns: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let head = format!("| {} |\n|{}\n", columns.join(" | "), "---|".repeat(columns.len()));
    let rows: String = rows.into_iter().map(|row| format!("| {} |\n", row.join(" | "))).collect();
    head + &rows
}

fn short(value: Option<f64>) -> String {
    value.map_or("-".into(), |v| match v {
        v if v < 0.0995 => format!("{v:.3}"),
        v if v < 9.95 => format!("{v:.2}"),
        v => format!("{v:.0}"),
    })
}

fn percent(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".into(), |v| format!("{:.digits$}", 100.0 * v))
}

/// Overlap / phase 2 / velocity in phase 2 of the default method, the targets, the methods `others` and the peers.
pub(crate) fn targets(families: &[Family], peers: Option<&Rows>, others: &[&str]) -> String {
    let mut columns = vec!["family", "to reach", REGISTERED.0];
    columns.extend(others);
    columns.extend(peers.iter().flat_map(|_| PEERS));
    let row = |family: &Family| {
        let target = TARGETS.iter().find(|t| t.0 == family.name);
        let mut cells = vec![family.name.clone()];
        cells.push(target.map_or("-".into(), |t| t.1.map(|v| v.to_string()).join(" / ")));
        for method in [REGISTERED.0].iter().chain(others) {
            cells.push(JUDGED.map(|(part, q)| short(family.pool(method, part, q).rmse())).join(" / "));
        }
        for peer in PEERS.iter().filter(|_| peers.is_some()) {
            cells.push(JUDGED.map(|judged| short(of_peer(peers, family, peer, judged))).join(" / "));
        }
        cells
    };
    table(&columns, families.iter().map(row))
}

fn of_peer(peers: Option<&Rows>, family: &Family, peer: &str, (part, q): (Part, usize)) -> Option<f64> {
    let key = (family.name.clone(), peer.to_owned(), (part as usize).to_string());
    peers?.get(&key).map(|errors| errors[q])
}

/// Errors of the default method over those of the smoother with the same unknowns, where there is no outlier.
pub(crate) fn equivalence(families: &[Family], peers: &Rows) -> String {
    let columns = ["family", "phase 1", "overlap", "phase 2", "velocity, phase 1", "overlap", "phase 2"];
    let row = |family: &Family| {
        let mut cells = vec![family.name.clone()];
        for quantity in [0, 1] {
            for part in [Part::Phase1, Part::Overlap, Part::Phase2] {
                let own = family.pool(REGISTERED.0, part, quantity).rmse();
                let its = of_peer(Some(peers), family, "RTS + errors", (part, quantity));
                cells.push(own.zip(its).map_or("-".into(), |(own, its)| format!("{:.2}", own / its)));
            }
        }
        cells
    };
    let clean = families.iter().filter(|f| CLEAN.contains(&f.name.as_str()));
    table(&columns, clean.map(row))
}

/// Errors by part: position and velocity, phase 1 / overlap / phase 2.
pub(crate) fn errors(families: &[Family], methods: &[&str]) -> String {
    let mut columns = vec!["family"];
    let names: Vec<String> = methods.iter().flat_map(|m| [format!("{m}, m"), format!("{m}, m/s")]).collect();
    columns.extend(names.iter().map(String::as_str));
    let row = |family: &Family| {
        let mut cells = vec![family.name.clone()];
        for method in methods {
            for quantity in [0, 1] {
                let parts = [Part::Phase1, Part::Overlap, Part::Phase2];
                cells.push(parts.map(|part| short(family.pool(method, part, quantity).rmse())).join(" / "));
            }
        }
        cells
    };
    table(&columns, families.iter().map(row))
}

/// What the default method's 95 % bands cover, position · velocity, and its worst run.
pub(crate) fn bands(families: &[Family]) -> String {
    let columns = [
        "family",
        "runs",
        "phase 1",
        "overlap",
        "phase 2",
        "unseen",
        "worst run in phase 2, m",
        "runs that warn",
    ];
    let cell = |pools: [Pool; 2]| pools.map(|pool| percent(pool.inside(), 1)).join(" · ");
    let of = |family: &Family, part: Part| [0, 1].map(|q| family.pool(REGISTERED.0, part, q));
    let row = |family: &Family| {
        let mut cells = vec![family.name.clone(), family.runs.to_string()];
        cells.extend(Part::ALL.map(|part| cell(of(family, part))));
        cells.push(short(family.pool(REGISTERED.0, Part::Phase2, 0).worst()));
        cells.push(family.of(REGISTERED.0).map_or(0, |judged| judged.warned).to_string());
        cells
    };
    let mut rows: Vec<Vec<String>> = families.iter().map(row).collect();
    let mut seen = [Pool::default(), Pool::default()];
    for family in families {
        for part in [Part::Phase1, Part::Overlap, Part::Phase2] {
            seen.iter_mut().zip(of(family, part)).for_each(|(all, own)| all.merge(&own));
        }
    }
    let mut all = vec!["all, seen".into(), families.iter().map(|f| f.runs).sum::<usize>().to_string()];
    all.push(cell(seen));
    all.resize(columns.len(), String::new());
    rows.push(all);
    table(&columns, rows)
}

/// The unseen phase by each law: median over the runs of the 3-D RMSE (a tenth is worse), and what the bands cover.
pub(crate) fn unseen(families: &[Family]) -> String {
    let laws = [REGISTERED.0, CARRIED_ON[0].0, CARRIED_ON[1].0];
    let columns = [
        "family",
        "default, m",
        "inside, %",
        "sigma / error",
        "drag, m",
        "inside, %",
        "auto, m",
        "inside, %",
    ];
    let columns = columns.into_iter().chain([PLAIN]).map(|c| if c == PLAIN { "plain PCF, m" } else { c });
    let row = |family: &Family| {
        let mut cells = vec![family.name.clone()];
        let error = |pool: &Pool| {
            format!("{} ({})", short(quantile(&pool.rmses, 0.5)), short(quantile(&pool.rmses, 0.9)))
        };
        for law in laws {
            let [position, velocity] = [0, 1].map(|q| family.pool(law, Part::Unseen, q));
            cells.push(error(&position));
            cells.push([&position, &velocity].map(|pool| percent(pool.inside(), 1)).join(" · "));
            if law == REGISTERED.0 {
                cells.push(position.sigma_over_error().map(short).join(" / "));
            }
        }
        cells.push(error(&family.pool(PLAIN, Part::Unseen, 0)));
        cells
    };
    table(&columns.collect::<Vec<_>>(), families.iter().map(row))
}

/// Characteristic points (Zhang 2025, eq. 13): median error of time · speed, %, and runs that never get there.
pub(crate) fn points(families: &[Family]) -> String {
    let columns =
        ["family", "first", "second", "third: default", "third: drag", "third: auto", "third: plain PCF"];
    let cell = |judged: Option<&Judged>, point: usize| {
        let Some(point) = judged.map(|j| &j.points[point]) else { return "-".into() };
        let median = |runs: &[f64]| percent(quantile(runs, 0.5), 2);
        let missed = if point.missed > 0 { format!(", {} never", point.missed) } else { String::new() };
        format!("{} · {}{missed}", median(&point.time), median(&point.speed))
    };
    let row = |family: &Family| {
        let mut cells = vec![family.name.clone()];
        // where no law of drag holds, only what nobody sees is told
        let seen = |point| {
            if LAWLESS.contains(&family.name.as_str()) {
                "-".into()
            } else {
                cell(family.of(REGISTERED.0), point)
            }
        };
        cells.extend([0, 1].map(seen));
        let methods = [REGISTERED.0, CARRIED_ON[0].0, CARRIED_ON[1].0, PLAIN];
        cells.extend(methods.map(|method| cell(family.of(method), 2)));
        cells
    };
    table(&columns, families.iter().map(row))
}

/// The flight: what was found beside what is true, and how far the track is off.
pub(crate) fn flight(flight: &Flight) -> String {
    let mut rows = Vec::new();
    for found in &flight.unknowns {
        let axis = found.axis.map_or("", |axis| [" x", " y", " z"][axis]);
        let value = format!("{:.3} ± {:.3}", found.value, found.sigma);
        rows.push(vec![
            format!("{}{axis}, {}", found.kind.name(), found.kind.unit()),
            value,
            found.truth.to_string(),
        ]);
    }
    for (errors, by) in flight.errors.iter().zip(["the gauge sees", "the beacon alone does"]) {
        let inside = percent(errors.bands.as_ref().map(|b| b.inside), 1);
        let what = format!("position where {by}: RMSE, m (inside the bands, %)");
        rows.push(vec![what, format!("{:.3} ({inside})", errors.rmse), String::new()]);
    }
    table(&["what", "found", "true"], rows)
}
