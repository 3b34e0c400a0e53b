//! Dives with known truth.
mod judge;
use judge::{ROWS, smoothed, predicted};
use trackfuse::estimate::usbl::causal::*;

pub fn main() {
    let runs: u64 = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(20);
    let first: u64 = std::env::args().nth(2).and_then(|a| a.parse().ok()).unwrap_or(1);
    let show = |name: &str, s: [judge::Sum; 3]| println!("   {name:10} {:.1} / {:.1} / {:.1}   cov {:.1} {:.1} {:.1}  n {}", s[0].rmse(), s[1].rmse(), s[2].rmse(), 100.0*s[0].coverage(), 100.0*s[1].coverage(), 100.0*s[2].coverage(), s[0].instants);
    if std::env::var_os("CAUSAL").is_some() {
        for row in &ROWS[..4] {
            println!("{}", row.name);
            show("paper", predicted(row, first..runs + first, || Paper::new(PaperSettings::default())));
            show("improved", predicted(row, first..runs + first, || Improved::new(ImprovedSettings::default())));
            for m in [60.0, 100.0, 200.0] { show(&format!("memory {m}"), predicted(row, first..runs + first, || Paper::new(PaperSettings { memory_s: Some(m), ..Default::default() }))); }
        }
        return;
    }
    for row in &ROWS[..4] {
        let t = std::time::Instant::now();
        let j = smoothed(row, first..runs + first);
        println!(
            "{:18} {:.2} / {:.2}  cov {:.1} / {:.1}  recall {:.2} fa {:.2} warned {} worst unwarned {:.1}  {:.1} ms/dive",
            row.name, j.sums[0].rmse(), j.sums[1].rmse(), 100.0 * j.sums[0].coverage(), 100.0 * j.sums[1].coverage(),
            100.0 * j.recall(), 100.0 * j.false_alarms(), j.warned, j.worst_unwarned_m, t.elapsed().as_secs_f64() * 1e3 / runs as f64
        );
        let mut seen: Vec<_> = j.each.iter().map(|e| e[0]).collect();
        seen.sort_by(f64::total_cmp);
        println!("    seen median {:.2} max {:.2?}", seen[seen.len() / 2], &seen[seen.len().saturating_sub(4)..]);
    }
}
