//! What verifying found, as part of an inspection.

use crate::log::verify::Verification;
use crate::report::inspection::{FindingReport, Inspection, VerificationReport};

/// More is for programs, which find it in the JSON.
const MOST_WARNINGS: usize = 20;

/// Puts `found` into the inspection: what is wrong is a warning too.
pub fn add(inspection: &mut Inspection, found: Verification) {
    inspection.warnings.extend(warnings(&found));
    let checked = found.checked;
    let sums = &mut inspection.checksums;
    for (sum, state) in [(&mut sums.summary, checked.summary), (&mut sums.data_section, checked.data_section)]
    {
        if let Some(right) = state {
            *sum = if right { "right" } else { "wrong" }.into();
        }
    }
    sums.chunks_without = checked.chunks_without_checksum as usize;
    sums.chunks_right = checked.chunk_checksums_right as usize;
    let findings = found.findings.into_iter();
    inspection.verification = Some(VerificationReport {
        findings: findings.map(|f| FindingReport { offset: f.offset, what: f.what }).collect(),
        findings_left_out: found.left_out,
        not_checkable: found.not_checkable,
        bytes: checked.bytes,
        chunks: checked.chunks,
        messages: checked.messages,
        index_entries: checked.index_entries,
        attachments: checked.attachments,
        metadata_records: checked.metadata,
    });
}

/// What is wrong, a line each, as many as a person reads.
#[must_use]
pub fn warnings(found: &Verification) -> Vec<String> {
    let listed = found.findings.iter().take(MOST_WARNINGS);
    let mut lines: Vec<String> = listed.map(|f| format!("at byte {}: {}", f.offset, f.what)).collect();
    let more = (found.findings.len() - lines.len()) as u64 + found.left_out;
    if more > 0 {
        lines.push(format!("{more} more things are wrong; `--json` lists up to a hundred"));
    }
    lines
}
