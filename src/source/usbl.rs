//! Which topic holds a USBL system's fixes.

use super::SourceError;
use super::candidate::{Candidate, Judged, Unfit, judge, quoted};
use crate::log::{Log, LogError};

/// The message path of the fixes of the one topic with `usbl` in its name that holds a position, and what could not be
/// read of the parts of the log that were looked into.
///
/// # Errors
/// [`SourceError::NoUsbl`] where there is none or several; [`SourceError::Log`] instead where a part that was looked into
/// is damaged.
pub fn usbl_fix(log: &Log) -> Result<(String, Vec<LogError>), SourceError> {
    let mut judgement = judge(log);
    // what only `usbl` can place has its path too
    let placed = |channel: Judged| match channel.verdict {
        Err(Unfit::Polar) => {
            let position = Some(quoted(&channel.topic));
            Some(Candidate { topic: channel.topic, position, velocity: None })
        }
        verdict => verdict.ok(),
    };
    let fit = judgement.channels.into_iter().filter_map(placed);
    let mut fit: Vec<Candidate> = fit.filter(|candidate| candidate.position.is_some()).collect();
    fit.sort_by(|a, b| a.topic.cmp(&b.topic));
    fit.dedup();
    let named = |c: &&Candidate| c.topic.to_ascii_lowercase().contains("usbl");
    let named: Vec<Candidate> = fit.iter().filter(named).cloned().collect();
    if let ([Candidate { position: Some(path), .. }], damaged) = (&named[..], &mut judgement.damaged) {
        return Ok((path.clone(), std::mem::take(damaged)));
    }
    // what was not found may be what can't be read
    match judgement.damaged.into_iter().next() {
        Some(error) if named.is_empty() => Err(error.into()),
        _ if named.is_empty() => Err(SourceError::NoUsbl { several: false, candidates: fit }),
        _ => Err(SourceError::NoUsbl { several: true, candidates: named }),
    }
}
