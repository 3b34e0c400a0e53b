//! An inspection as a page of text, 120 columns wide: what the file is, the channels, what was noticed.

use std::fmt::{self, Write};

use super::super::amount::{bytes, clock_time, counted};
use super::{ChecksumReport, FileReport, FuseReport, IndexReport, Inspection, VerificationReport, table};
use crate::printable::printable;
use crate::time::Time;

/// The inspection as text.
#[must_use]
pub fn render_inspection(inspection: &Inspection) -> String {
    let mut page = String::new();
    // writing to a String can't fail
    let _ = write_page(&mut page, inspection);
    page
}

fn write_page(out: &mut String, inspection: &Inspection) -> fmt::Result {
    let Inspection { file, index, checksums, fuse, .. } = inspection;
    write!(out, "{}   {}", printable(&inspection.input), bytes(file.bytes))?;
    for (what, text) in [("profile", &file.profile), ("written by", &file.library)] {
        if !text.is_empty() {
            write!(out, ", {what} \"{}\"", printable(text))?;
        }
    }
    writeln!(out)?;
    writeln!(out, "recorded    {}", recorded(file))?;
    writeln!(out, "content     {}", content(file, inspection.channels.len()))?;
    writeln!(out, "index       {}", index_state(index, file.chunks))?;
    let verification = inspection.verification.as_ref();
    writeln!(out, "checksums   {}", checksum_state(checksums, file.chunks, verification.is_some()))?;
    if let Some(verification) = verification {
        writeln!(out, "verified    {}", printable(&verified(verification)))?;
    }
    if !inspection.earlier_results.is_empty() {
        writeln!(out, "results     {}", printable(&inspection.earlier_results.join(", ")))?;
    }
    writeln!(out, "fuse        {}", verdict(fuse))?;
    if !inspection.channels.is_empty() {
        writeln!(out)?;
        table::write(out, inspection)?;
    }
    if !(inspection.notes.is_empty() && inspection.warnings.is_empty() && fuse.hint.is_none()) {
        writeln!(out)?;
    }
    for note in &inspection.notes {
        writeln!(out, "note: {}", printable(note))?;
    }
    for warning in &inspection.warnings {
        writeln!(out, "warning: {}", printable(warning))?;
    }
    if let Some(hint) = &fuse.hint {
        writeln!(out, "hint: {}", printable(hint))?;
    }
    Ok(())
}

/// First and last log time, the day once where it is the same.
fn recorded(file: &FileReport) -> String {
    let (Some(start), Some(end), Some(duration_s)) = (&file.start_ns, &file.end_ns, file.duration_s) else {
        return "nothing".into();
    };
    let times = [start, end].map(|ns| ns.parse().ok().and_then(Time::from_log));
    let [Some(first), Some(last)] = times else {
        return format!("{start} .. {end} ns, which are no dates");
    };
    if !last.is_date() {
        return format!("{first} .. {last}, which are no dates; {}", clock_time(duration_s));
    }
    let [start, end] = [first, last].map(Time::utc);
    let end = match (start.split_once(' '), end.split_once(' ')) {
        (Some((day, _)), Some((same, time))) if day == same => time.to_owned(),
        _ => end,
    };
    format!("{start} .. {end} UTC, {}", clock_time(duration_s))
}

fn content(file: &FileReport, channels: usize) -> String {
    let counts = [
        (file.messages as usize, "message"),
        (channels, "channel"),
        (file.chunks, "chunk"),
        (file.attachments, "attachment"),
        (file.metadata_records, "metadata record"),
    ];
    let always = 2;
    let named = counts.iter().enumerate().filter(|(i, (n, _))| *i < always || *n > 0);
    let mut text: Vec<String> = named.map(|(_, (n, what))| counted(*n, what)).collect();
    for packed in &file.compressions {
        let of =
            if file.compressions.len() > 1 { format!("{} of them ", packed.chunks) } else { String::new() };
        text.push(match packed.name.as_str() {
            "none" => format!("{of}not compressed"),
            name => {
                let sizes = [packed.uncompressed_bytes, packed.compressed_bytes].map(bytes);
                format!("{of}{} ({} in {})", printable(name), sizes[0], sizes[1])
            }
        });
    }
    text.join(", ")
}

fn index_state(index: &IndexReport, chunks: usize) -> String {
    let mut state = Vec::new();
    let left_out = [
        (index.schemas_left_out, "schema"),
        (index.channels_left_out, "channel"),
        (index.chunks_left_out, "chunk"),
        (index.attachments_left_out, "attachment"),
        (index.metadata_left_out, "metadata record"),
    ];
    let left_out: Vec<String> =
        left_out.iter().filter(|(n, _)| *n > 0).map(|(n, what)| counted(*n, what)).collect();
    if !index.summary {
        state.push("no summary".into());
    } else if !left_out.is_empty() {
        state.push(format!("the summary leaves out {}", left_out.join(", ")));
    } else if !index.statistics {
        state.push("no statistics".into());
    }
    if index.scanned {
        state.push("all of the log was read to make up for that".into());
    }
    if index.chunks_with_message_index < chunks {
        state.push(format!("{} of {chunks} chunks have message indexes", index.chunks_with_message_index));
    }
    if index.parts_without_times > 0 {
        state.push("too much to be read for that, or damaged: times below are not of all messages".into());
    }
    if state.is_empty() { "complete".into() } else { state.join("; ") }
}

/// What was checked, what was not, and what can't be. After all was checked, what is not right is wrong.
fn checksum_state(sums: &ChecksumReport, chunks: usize, verified: bool) -> String {
    let (mut right, mut unchecked, mut missing) = (Vec::new(), Vec::new(), Vec::new());
    for (what, state) in [("summary", &sums.summary), ("data section", &sums.data_section)] {
        let list = match state.as_str() {
            "right" => &mut right,
            "none" => &mut missing,
            _ => &mut unchecked,
        };
        list.push(what.to_owned());
    }
    let with = chunks.saturating_sub(sums.chunks_without);
    let unread = with.saturating_sub(sums.chunks_right);
    let counts = [(&mut right, sums.chunks_right), (&mut unchecked, unread), (&mut missing, chunks - with)];
    for (list, n) in counts {
        if n > 0 {
            list.push(if n == chunks { "all chunks".to_owned() } else { counted(n, "chunk") });
        }
    }
    let parts = [
        ("right", right),
        (if verified { "not right" } else { "not checked" }, unchecked),
        ("none", missing),
    ];
    let parts = parts.iter().filter(|(_, list)| !list.is_empty());
    parts.map(|(what, list)| format!("{what}: {}", list.join(", "))).collect::<Vec<_>>().join("; ")
}

/// How much was held against each other, and how that ended.
fn verified(verification: &VerificationReport) -> String {
    let counts = [
        (verification.chunks, "chunk"),
        (verification.messages, "message"),
        (verification.attachments, "attachment"),
        (verification.metadata_records, "metadata record"),
    ];
    let counts = counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| counted(*n as usize, what));
    let mut parts: Vec<String> = std::iter::once(bytes(verification.bytes)).chain(counts).collect();
    match verification.index_entries {
        0 => {}
        1 => parts.push("1 index entry".into()),
        n => parts.push(format!("{n} index entries")),
    }
    let wrong = verification.findings.len() as u64 + verification.findings_left_out;
    let verdict = match wrong {
        0 => "nothing is wrong".into(),
        1 => "1 thing is wrong".into(),
        n => format!("{n} things are wrong"),
    };
    let mut text = format!("{}: {verdict}", parts.join(", "));
    if !verification.not_checkable.is_empty() {
        text += "; not checkable: ";
        text += &verification.not_checkable.join(", ");
    }
    text
}

/// What `fuse` would do, the first thing that one wants to know.
fn verdict(fuse: &FuseReport) -> String {
    if !fuse.refusals.is_empty() {
        let refusals: Vec<_> = fuse.refusals.iter().map(|r| printable(r)).collect();
        return format!("would refuse: {}", refusals.join(";\n            "));
    }
    let names = fuse.sources.iter().map(|s| {
        let mark = if s.datum { " (datum)" } else { "" };
        format!("{}{mark}", printable(&s.name))
    });
    format!("would run, with {}", names.collect::<Vec<_>>().join(", "))
}
