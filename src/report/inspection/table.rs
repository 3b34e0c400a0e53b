//! The table of channels: sources first, then those that could be, then the others.

use std::collections::BTreeMap;
use std::fmt::{self, Write};

use super::super::amount::{brief, milliseconds, rate};
use super::{ChannelReport, Inspection, Role};
use crate::printable::printable;

const WIDTH: usize = 120;

/// What the columns behind the type take.
const NUMBERS_WIDTH: usize = 70;

/// What a type is cut to where topics are long.
const TYPE_WIDTH: usize = 27;

/// How many channels are listed that can't be sources; all of them stand in the JSON.
const OTHERS_LISTED: usize = 40;

/// How many reasons are spelled out.
const REASONS_LISTED: usize = 5;

struct Layout {
    topic_width: usize,
    type_width: usize,
    /// The encoding of all channels, where it is one.
    encoding: Option<String>,
}

/// Writes the table and what belongs below it.
pub(super) fn write(out: &mut String, inspection: &Inspection) -> fmt::Result {
    let (speaking, silent): (Vec<_>, Vec<_>) =
        inspection.channels.iter().partition(|c| c.role != Role::Other || c.messages != Some(0));
    if !speaking.is_empty() {
        let layout = Layout::of(&speaking);
        layout.head(out)?;
        rows(out, inspection, &layout, &speaking)?;
    }
    if !silent.is_empty() {
        let topics: Vec<_> = silent.iter().map(|c| printable(&c.topic)).collect();
        wrapped(out, "without messages: ", &topics.join(", "))?;
    }
    reasons(out, inspection)?;
    let clocks = inspection.clocks_read;
    if clocks.parts < clocks.of {
        let (read, of) = (clocks.parts, clocks.of);
        writeln!(out, "log - stamp is of {read} of {of} chunks with these channels, spread over the log")?;
    }
    Ok(())
}

impl Layout {
    fn of(channels: &[&ChannelReport]) -> Self {
        let first = &channels[0].message_encoding;
        let encoding =
            channels.iter().all(|c| c.message_encoding == *first).then(|| printable(first).into_owned());
        let mut layout = Self { topic_width: 0, type_width: 0, encoding };
        let longest =
            |text: &dyn Fn(&ChannelReport) -> usize| channels.iter().map(|c| text(c)).max().unwrap_or(0);
        // Types may take what topics leave, and no more than they need is taken from topics.
        let room = WIDTH - NUMBERS_WIDTH;
        let (topic, kind) =
            (longest(&|c| printable(&c.topic).chars().count()), longest(&|c| layout.kind(c).chars().count()));
        let kind = kind.clamp(11, TYPE_WIDTH.max(room.saturating_sub(topic.max(5))));
        layout.topic_width = topic.clamp(5, room - kind);
        layout.type_width = kind;
        layout
    }

    /// A channel's type, and its encoding where the others have other ones.
    fn kind(&self, channel: &ChannelReport) -> String {
        let encoding = if self.encoding.is_some() { "" } else { &channel.message_encoding };
        let text = format!("{} {encoding}", channel.schema.replace("/msg/", "/"));
        printable(text.trim()).into_owned()
    }

    fn head(&self, out: &mut String) -> fmt::Result {
        let (topic, kind) = (self.topic_width, self.type_width);
        let title = self.encoding.as_ref().map_or("type".into(), |e| format!("type ({e})"));
        writeln!(
            out,
            "  {:<topic$} {title:<kind$} {:>8} {:>6} {:>6} {:>15} {:>11}  log - stamp ms",
            "topic", "messages", "Hz", "± ms", "from .. to s", "gaps, max s"
        )
    }

    fn row(&self, out: &mut String, channel: &ChannelReport) -> fmt::Result {
        let (topic, width) = (self.topic_width, self.type_width);
        let name = printable(&channel.topic);
        if name.chars().count() > topic {
            write!(out, "  {name}\n  {:<topic$} ", "")?;
        } else {
            write!(out, "  {name:<topic$} ")?;
        }
        let times = channel.times.as_ref();
        let rate_hz = channel.clock.as_ref().and_then(|c| c.rate_hz).or(times.and_then(|t| t.rate_hz));
        let text = |value: Option<String>| value.unwrap_or_else(|| "-".into());
        writeln!(
            out,
            "{:<width$} {:>8} {:>6} {:>6} {:>15} {:>11}  {}",
            end_of(&self.kind(channel), width),
            channel.messages.map_or("?".into(), |n| n.to_string()),
            text(rate_hz.map(rate)),
            text(times.and_then(|t| t.jitter_s).map(milliseconds)),
            text(times.map(|t| span(t.span_s))),
            text(times.and_then(|t| Some(format!("{}, {}", t.gaps, brief(t.longest_gap_s?))))),
            last_column(channel)
        )
    }
}

fn rows(
    out: &mut String,
    inspection: &Inspection,
    layout: &Layout,
    channels: &[&ChannelReport],
) -> fmt::Result {
    let others = channels.iter().filter(|c| c.role == Role::Other).count();
    let (mut listed, mut group) = (0, None);
    for channel in channels {
        let own_group = Some((channel.role, channel.source.as_deref()));
        if group != own_group {
            writeln!(out, "{}", heading(inspection, channel))?;
            group = own_group;
        }
        if channel.role == Role::Other {
            if listed == OTHERS_LISTED && others > OTHERS_LISTED + 1 {
                return writeln!(out, "  and {} more, see `--json`", others - listed);
            }
            listed += 1;
        }
        layout.row(out, channel)?;
    }
    Ok(())
}

fn heading(inspection: &Inspection, channel: &ChannelReport) -> String {
    let taken = inspection.fuse.sources.iter().find(|s| Some(&s.name) == channel.source.as_ref());
    match (channel.role, taken) {
        (Role::Source, Some(source)) => {
            let datum = if source.datum { " (datum)" } else { "" };
            let frame = channel.clock.as_ref().map_or("", |c| c.frame_id.as_str());
            let frame =
                if frame.is_empty() { String::new() } else { format!(", frame \"{}\"", printable(frame)) };
            let paths: Vec<_> =
                [&source.position, &source.velocity].into_iter().flatten().map(|p| printable(p)).collect();
            format!("source {}{datum}{frame}: {}", printable(&source.name), paths.join(", "))
        }
        (Role::Candidate, _) => "could be sources, where a config names them".into(),
        _ => "can't be sources".into(),
    }
}

fn last_column(channel: &ChannelReport) -> String {
    match (&channel.clock, &channel.unusable) {
        (_, Some(why)) => why.short.clone(),
        (Some(clock), _) if clock.clock.contains("stamp") => {
            format!("{} ± {}", milliseconds(clock.delay_s), milliseconds(clock.delay_spread_s))
        }
        (Some(_), _) => "no stamp".into(),
        (None, None) => "not read".into(),
    }
}

/// Why channels can't be decoded, with how many it befalls.
fn reasons(out: &mut String, inspection: &Inspection) -> fmt::Result {
    let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
    let unusable =
        inspection.channels.iter().filter(|c| c.messages != Some(0)).filter_map(|c| c.unusable.as_ref());
    for why in unusable.filter(|why| why.short.contains("decode")) {
        *reasons.entry(&why.reason).or_default() += 1;
    }
    for (reason, count) in reasons.iter().take(REASONS_LISTED) {
        let channels = if *count == 1 { "1 channel".to_owned() } else { format!("{count} channels") };
        writeln!(out, "can't decode {channels}: {}", printable(reason))?;
    }
    if reasons.len() > REASONS_LISTED {
        writeln!(
            out,
            "can't decode others for {} more reasons, see `--json`",
            reasons.len() - REASONS_LISTED
        )?;
    }
    Ok(())
}

/// The end of a name that is too long, which tells more than its beginning.
fn end_of(text: &str, width: usize) -> String {
    let count = text.chars().count();
    if count <= width {
        return text.to_owned();
    }
    std::iter::once('…').chain(text.chars().skip(count + 1 - width)).collect()
}

fn span((from, to): (f64, f64)) -> String {
    let digits = if to < 100.0 { 2 } else { usize::from(to < 10_000.0) };
    format!("{from:.digits$} .. {to:.digits$}")
}

/// Text broken at its spaces, the lines after the first indented.
fn wrapped(out: &mut String, title: &str, text: &str) -> fmt::Result {
    let mut line = title.to_owned();
    for word in text.split(' ') {
        if line.chars().count() + word.chars().count() > WIDTH && line.len() > 2 {
            writeln!(out, "{}", line.trim_end())?;
            "  ".clone_into(&mut line);
        }
        line += word;
        line.push(' ');
    }
    writeln!(out, "{}", line.trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_keep_their_ends_and_long_lists_break_at_spaces() {
        assert_eq!(end_of("sensor_msgs/NavSatFix", 10), "…NavSatFix");
        assert_eq!(end_of("ünï", 3), "ünï");
        let topics: Vec<String> = (0..40).map(|i| format!("/topic/{i}")).collect();
        let mut out = String::new();
        wrapped(&mut out, "list: ", &topics.join(", ")).expect("a String");
        assert!(out.lines().count() > 3 && out.lines().all(|l| l.chars().count() <= WIDTH), "{out}");
        assert!(out.lines().skip(1).all(|l| l.starts_with("  /topic/")), "{out}");
    }
}
