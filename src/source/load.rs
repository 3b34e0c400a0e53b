//! From the messages of the chosen channels to samples in order of time.

use std::collections::{BTreeMap, BTreeSet};

use super::gathered::Gathered;
use super::reading::Reader;
use super::{SourceError, is_datum_like};
use crate::config::SourceConfig;
use crate::log::{Index, Log, LogError, Message, MessagesRead, passed_over};
use crate::sample::{Quantity, Source};
use crate::time::Time;

/// Where a sigma comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SigmaOrigin {
    /// The config.
    Config,
    /// The covariances in the messages.
    Messages,
    /// The scatter of the samples.
    Estimated,
    /// Too few samples to tell: 1 m or 1 m/s.
    Assumed,
}

impl SigmaOrigin {
    /// Whether somebody said so.
    #[must_use]
    pub fn is_stated(self) -> bool {
        matches!(self, Self::Config | Self::Messages)
    }

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Config => "config",
            Self::Messages => "messages",
            Self::Estimated => "estimated",
            Self::Assumed => "assumed",
        }
    }
}

/// Which clock a source's samples are on.
#[derive(Clone, Debug, PartialEq)]
pub struct Timing {
    /// `stamp`, `publish` or `log`, or several with `+`.
    pub clock: String,
    /// Median of log time less the sample's time, s.
    pub delay_s: f64,
    /// Half the width of its middle 68 %, s.
    pub delay_spread_s: f64,
    /// How much its median grows from the first third of the messages to the last, s.
    pub delay_growth_s: f64,
}

/// A source with what is to be said of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The paths and choices that were used.
    pub config: SourceConfig,
    /// The samples.
    pub source: Source,
    /// The frame that its messages name first; empty where they don't. Of latitudes and longitudes `enu`.
    pub frame_id: String,
    /// Latitude and longitude, degrees, and altitude, m, from which its positions count; `None` where they were
    /// metres from the beginning.
    pub fix_origin: Option<[f64; 3]>,
    /// Its clock.
    pub timing: Timing,
    /// Of an acoustic system, the positions' order of coming: the first to come has 0. Empty for others.
    pub arrival: Vec<u32>,
    /// Median standard deviation over axes and samples, m and m/s, and where it comes from.
    pub sigma: [Option<(f64, SigmaOrigin)>; 2],
    /// What is worth knowing of how it was read, a sentence each.
    pub notes: Vec<String>,
    /// What a person must read, a sentence each.
    pub warnings: Vec<String>,
}

/// The sources of a log, and how they were read.
#[derive(Debug)]
pub struct Samples {
    /// The sources.
    pub loaded: Vec<Loaded>,
    /// What the samples' seconds count from: the median time of the [`datum`]'s.
    pub origin: Time,
    /// What is left out of them, a sentence each.
    pub left_out: Vec<String>,
    /// How the log was read.
    pub read: MessagesRead,
}

/// Loads `configs` in one pass over the log. Latitudes and longitudes become metres east, north and up of
/// `fix_origin` (degrees and m), by default the datum's first fix, else that of the first source that has one.
///
/// What gives nothing at all is an error where the user `named` the sources, and else left out while
/// something remains. Damaged parts of the log are left out.
///
/// # Errors
/// [`SourceError`] for a path or topic that doesn't fit, and for a source without a single sample.
pub fn load(
    log: &Log,
    configs: &[SourceConfig],
    named: bool,
    fix_origin: Option<[f64; 3]>,
) -> Result<Samples, SourceError> {
    let mut gathered = configs.iter().map(Gathered::new).collect::<Result<Vec<_>, _>>()?;
    let mut readers = Readers::default();
    for (i, source) in gathered.iter().enumerate() {
        readers.add(log.index(), i, source)?;
    }
    let read = log.for_each_message(&readers.channels(), |message| {
        readers.read(&message, &mut gathered);
        Ok::<(), SourceError>(())
    })?;
    let (mut left_out, mut first_error) = (passed_over(&read.damaged), None);
    for source in &mut gathered {
        while let Some((quantity, error)) = lack(source, &read.damaged) {
            if named {
                return Err(error);
            }
            left_out.push(format!("{} is left out: {error}", source.drop(quantity)));
            first_error.get_or_insert(error);
        }
    }
    gathered.retain(|source| !source.paths.is_empty());
    if let (true, Some(error)) = (gathered.is_empty(), first_error) {
        return Err(error);
    }
    let kept: Vec<SourceConfig> = gathered.iter().map(|g| g.config.clone()).collect();
    let of_datum = gathered.get(datum(&kept));
    let origin = of_datum.map_or(Time::from_ns(0), Gathered::median_time);
    let first_fix = || of_datum.into_iter().chain(&gathered).find_map(Gathered::first_fix);
    let fix_origin = fix_origin.or_else(first_fix);
    let loaded = gathered.into_iter().map(|g| g.finish(origin, fix_origin)).collect();
    Ok(Samples { loaded, origin, left_out, read })
}

/// What stands against using a source, and the quantity at fault where it is one; `damaged` is what can't be read of
/// the log.
pub(super) fn lack(source: &mut Gathered, damaged: &[LogError]) -> Option<(Option<Quantity>, SourceError)> {
    let (quantity, error) = source.lack()?;
    let error = match (error, damaged.first()) {
        (SourceError::Empty { name, topic }, Some(first)) if source.messages == 0 => {
            SourceError::Unreadable { name, topic, parts: damaged.len(), first: first.to_string() }
        }
        (error, _) => error,
    };
    Some((quantity, error))
}

/// Who reads the messages of which channel.
#[derive(Debug, Default)]
pub(super) struct Readers(BTreeMap<u16, Vec<(usize, Reader)>>);

impl Readers {
    /// Adds the readers of `source`, which is the `number`-th.
    pub(super) fn add(&mut self, index: &Index, number: usize, source: &Gathered) -> Result<(), SourceError> {
        let topics: BTreeSet<&str> = source.paths.iter().map(|(_, p)| p.topic.as_str()).collect();
        let mut readers = Vec::new();
        for topic in topics {
            let mut channels = index.channels_of(topic).peekable();
            if channels.peek().is_none() {
                let topics: BTreeSet<String> = index.channels.values().map(|c| c.topic.clone()).collect();
                return Err(SourceError::NoTopic {
                    name: source.config.name.clone(),
                    topic: topic.to_owned(),
                    topics: topics.into_iter().collect(),
                });
            }
            for channel in channels {
                readers.push((
                    channel.id,
                    Reader::new(&source.config, &source.paths, index, channel, source.kind)?,
                ));
            }
        }
        for (channel, reader) in readers {
            self.0.entry(channel).or_default().push((number, reader));
        }
        Ok(())
    }

    /// The channels that are read.
    pub(super) fn channels(&self) -> BTreeSet<u16> {
        self.0.keys().copied().collect()
    }

    /// Puts what a message says to those of the sources that it belongs to.
    pub(super) fn read(&self, message: &Message<'_>, sources: &mut [Gathered]) {
        for (i, reader) in self.0.get(&message.channel_id).into_iter().flatten() {
            let Some(source) = sources.get_mut(*i) else { continue };
            source.messages += 1;
            match reader.read(message) {
                Ok(Some(outcome)) => source.add(outcome),
                Ok(None) => source.untimed += 1,
                Err(error) => source.undecodable.get_or_insert((0, error)).0 += 1,
            }
        }
    }
}

/// The datum among `configs`: the one marked, else the one that its name or topic says, else the first.
#[must_use]
pub fn datum(configs: &[SourceConfig]) -> usize {
    let says = |c: &SourceConfig| {
        [Some(&c.name), c.position.as_ref(), c.velocity.as_ref()]
            .into_iter()
            .flatten()
            .any(|text| is_datum_like(text))
    };
    configs.iter().position(|c| c.datum).or_else(|| configs.iter().position(says)).unwrap_or(0)
}
