//! What strikes the eye: what a person must read, and what is good to know.

use std::collections::{BTreeMap, BTreeSet};

use crate::log::Index;
use crate::printable::printable;
use crate::report::inspection::{ChannelReport, ClockReport, Inspection, Role, TimesReport};
use crate::resolve;
use crate::source::{Glimpse, Loaded, Recognised, SourceError};
use crate::time::Time;

/// How many topics a sentence names.
const NAMED: usize = 5;

/// What is wrong with the log, and what `fuse` would warn of or refuse.
pub(super) fn warn(
    inspection: &mut Inspection,
    index: &Index,
    recognised: Option<&Recognised>,
    glimpses: &BTreeMap<String, Glimpse>,
    damaged: impl Iterator<Item = String>,
) {
    // One damaged chunk is met on several ways.
    let mut seen = BTreeSet::new();
    let mut warnings: Vec<String> = damaged.filter(|what| seen.insert(what.clone())).collect();
    warnings.extend(miscounted(inspection, index));
    warnings.extend(undated(inspection));
    warnings.extend(recognised.map_or(&[][..], |r| r.warnings.as_slice()).iter().cloned());
    let mut loaded: Vec<Loaded> = Vec::new();
    let mut refusals = Vec::new();
    for channel in inspection.channels.iter().filter(|c| c.role == Role::Source) {
        let Some(glimpse) = glimpses.get(&channel.topic) else { continue };
        let all = channel.messages.is_some_and(|n| glimpse.messages as u64 >= n);
        let of =
            if all { String::new() } else { format!(" (of {} messages that were read)", glimpse.messages) };
        let lacks = glimpse.lacks.iter().map(SourceError::to_string);
        if glimpse.refused {
            refusals.extend(lacks.clone());
            warnings.extend(lacks);
        } else {
            warnings.extend(lacks.map(|lack| lack + &of));
        }
        // several channels may have one topic
        if let Some(seen) = &glimpse.seen
            && loaded.iter().all(|l| l.source.name != seen.source.name)
        {
            let warnings = seen.warnings.iter().map(|w| format!("{w}{of}")).collect();
            loaded.push(Loaded { warnings, ..seen.clone() });
        }
    }
    if let Some(datum) = loaded.first() {
        let shift_s = resolve::log_time_shift_s(datum);
        if let Err(error) = resolve::check_epochs(&loaded, 0) {
            refusals.push(error.to_string());
            warnings.push(error.to_string());
        } else {
            warnings.extend(resolve::warnings_of(&loaded, shift_s));
        }
    }
    inspection.fuse.refusals.extend(refusals);
    inspection.warnings = warnings;
}

/// What the summary says of the messages' numbers and times and is not so.
fn miscounted(inspection: &Inspection, index: &Index) -> Vec<String> {
    let Some(statistics) = &index.statistics else { return Vec::new() };
    if inspection.index.parts_without_times > 0 {
        return Vec::new();
    }
    let mut wrong = Vec::new();
    if !statistics.channel_message_counts.is_empty() {
        let numbers = inspection.channels.iter().filter_map(|channel| {
            let counted = channel.messages?;
            let claimed = statistics.channel_message_counts.get(&channel.id).copied().unwrap_or(0);
            (counted != claimed).then(|| format!("{}: {counted}, not {claimed}", name(channel)))
        });
        let numbers: Vec<String> = numbers.collect();
        if !numbers.is_empty() {
            let numbers = some_of(&numbers);
            wrong.push(format!("there are other numbers of messages than the summary says: {numbers}"));
        }
    }
    let ns = |text: &String| text.parse::<u64>().ok();
    let times = || inspection.channels.iter().filter_map(|c| c.times.as_ref());
    let first = times().filter_map(|t| ns(&t.first_ns)).min();
    let last = times().filter_map(|t| ns(&t.last_ns)).max();
    if let (Some(first), Some(last)) = (first, last)
        && (first, last) != (statistics.message_start_time, statistics.message_end_time)
    {
        let (start, end) = (statistics.message_start_time, statistics.message_end_time);
        wrong.push(format!(
            "messages are of {first} .. {last} ns, not of {start} .. {end} ns, as the summary says"
        ));
    }
    wrong
}

/// A log that holds dates, and log times that are none.
fn undated(inspection: &Inspection) -> Option<String> {
    let time = |ns: &str| ns.parse().ok().and_then(Time::from_log);
    let start = time(inspection.file.start_ns.as_ref()?)?;
    // past the year 2262 is no date either
    let end = time(inspection.file.end_ns.as_ref()?);
    if !start.is_date() && end.is_some_and(|end| !end.is_date()) || start.is_date() && end.is_some() {
        return None;
    }
    let undated =
        |t: &TimesReport| !time(&t.first_ns).is_some_and(Time::is_date) || time(&t.last_ns).is_none();
    let of_channel = |c: &ChannelReport| c.times.as_ref().filter(|t| undated(t)).map(|_| name(c));
    let topics: Vec<String> = inspection.channels.iter().filter_map(of_channel).collect();
    Some(format!("some log times are dates and others can't be: those of {}", some_of(&topics)))
}

/// What is good to know and harms nothing, or nothing for sure.
pub(super) fn notes(inspection: &Inspection) -> Vec<String> {
    let channels = || inspection.channels.iter();
    let times = || channels().filter_map(|c| Some((c, c.times.as_ref()?)));
    let mut notes = Vec::new();
    notes.extend(never_meet(inspection));
    for (channel, clock) in channels().filter_map(|c| Some((c, c.clock.as_ref()?))) {
        notes.extend(of_clock(channel, clock));
    }
    for (channel, times) in times().filter(|(c, _)| c.role != Role::Other) {
        notes.extend(of_gaps(channel, times).filter(|_| channel.role == Role::Source));
        notes.extend(of_bursts(channel, times));
    }
    let mut count = |what: &str, of: fn(&TimesReport) -> Option<String>| {
        let found = times().filter_map(|(c, t)| Some(format!("{}: {}", name(c), of(t)?)));
        let found: Vec<String> = found.collect();
        if !found.is_empty() {
            notes.push(format!("{what}: {}", some_of(&found)));
        }
    };
    count("messages out of the order of log time", |t| {
        (t.out_of_order > 0).then(|| format!("{}, by up to {}", t.out_of_order, duration(t.out_of_order_s)))
    });
    count("messages with the log time of the one before", |t| (t.equal > 0).then(|| t.equal.to_string()));
    let mut seen = BTreeSet::new();
    let twice: BTreeSet<String> = channels().filter(|c| !seen.insert(c.topic.as_str())).map(name).collect();
    if !twice.is_empty() {
        let twice: Vec<String> = twice.into_iter().collect();
        notes.push(format!("topics of more than one channel: {}", some_of(&twice)));
    }
    notes
}

/// Sources that are not recorded at the same time.
fn never_meet(inspection: &Inspection) -> Vec<String> {
    let span = |name: &str| {
        let of = inspection.channels.iter().filter(|c| c.source.as_deref() == Some(name));
        of.filter_map(|c| Some(c.times.as_ref()?.span_s)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    };
    let taken = &inspection.fuse.sources;
    let mut notes = Vec::new();
    for (i, first) in taken.iter().enumerate() {
        for second in &taken[i + 1..] {
            if let (Some(a), Some(b)) = (span(&first.name), span(&second.name))
                && (a.1 < b.0 || b.1 < a.0)
            {
                let [first, second] = [first, second].map(|s| printable(&s.name));
                notes.push(format!(
                    "{first} and {second} are never recorded at the same time: nobody can hold them against each other"
                ));
            }
        }
    }
    notes
}

/// Stamps that differ from the log's times more than a recorder's delay does.
fn of_clock(channel: &ChannelReport, clock: &ClockReport) -> Vec<String> {
    const AHEAD_S: f64 = 0.005;
    let name = name(channel);
    let mut notes = Vec::new();
    if !clock.clock.contains("stamp") {
        return notes;
    }
    if clock.delay_s.abs() > resolve::DIFFERENT_EPOCHS_S {
        if channel.role != Role::Source {
            let apart = clock.delay_s.abs();
            notes.push(format!("{name}: stamps and log times are of different epochs, {apart:.0} s apart"));
        }
        return notes;
    }
    if clock.delay_s < -AHEAD_S {
        let ahead = duration(-clock.delay_s);
        notes.push(format!("{name}: stamps are {ahead} ahead of the log's times: the two clocks differ"));
    }
    // An even growth makes the spread half of what it grows by from third to third.
    if clock.delay_growth_s.abs() > f64::max(2.0 * AHEAD_S, 1.5 * clock.delay_spread_s) {
        let verb = if clock.delay_growth_s > 0.0 { "grows" } else { "shrinks" };
        let by = duration(clock.delay_growth_s.abs());
        notes.push(format!(
            "{name}: log time less stamp {verb} by {by} from the first third to the last: a clock drifts, or \
             messages wait"
        ));
    }
    notes
}

/// When a source was silent.
fn of_gaps(channel: &ChannelReport, times: &TimesReport) -> Option<String> {
    let (length_s, at_s) = times.longest_gap_s.zip(times.longest_gap_at_s)?;
    Some(format!("{}: the longest gap is {} from {at_s:.2} s on", name(channel), duration(length_s)))
}

/// A median interval that says nothing of the whole.
fn of_bursts(channel: &ChannelReport, times: &TimesReport) -> Option<String> {
    let seen_s = times.span_s.1 - times.span_s.0 - times.longest_gap_s.unwrap_or(0.0);
    let on_the_whole = channel.messages?.checked_sub(1)? as f64 / seen_s;
    let rate = times.rate_hz?;
    (rate > 3.0 * on_the_whole && channel.messages? > 10).then(|| {
        format!(
            "{}: recorded in bursts: {rate:.3} Hz by the median interval, {on_the_whole:.3} Hz on the whole",
            name(channel)
        )
    })
}

fn name(channel: &ChannelReport) -> String {
    printable(&channel.topic).into_owned()
}

fn some_of(names: &[String]) -> String {
    let more = (names.len() > NAMED).then(|| format!("and {} more", names.len() - NAMED));
    names.iter().take(NAMED).cloned().chain(more).collect::<Vec<_>>().join("; ")
}

/// A length of time in the unit that suits it.
fn duration(s: f64) -> String {
    match s {
        s if s < 1e-6 => format!("{:.0} ns", 1e9 * s),
        s if s < 1e-3 => format!("{:.0} µs", 1e6 * s),
        s if s < 1.0 => format!("{:.1} ms", 1e3 * s),
        s => format!("{s:.1} s"),
    }
}
