//! Dives with known truth.
mod judge;
use judge::{ROWS, smoothed};

pub fn main() {
    let runs: u64 = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(20);
    for row in &ROWS {
        let t = std::time::Instant::now();
        let j = smoothed(row, 1..runs + 1);
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
