//! What a bounded part of a source's messages shows of it.

use super::SourceError;
use super::gathered::Gathered;
use super::load::{Loaded, Readers};
use crate::config::SourceConfig;
use crate::log::{Excerpt, Log};

/// What an excerpt of a source's messages shows.
#[derive(Debug)]
pub struct Glimpse {
    /// How many messages were read.
    pub messages: usize,
    /// What they say; `None` where it is nothing.
    pub seen: Option<Loaded>,
    /// What they lack of what the source's paths ask for; the rest of the log may have it.
    pub lacks: Vec<SourceError>,
    /// Whether no message could be read, since the paths don't fit the channel.
    pub refused: bool,
}

/// Reads of each of `configs` what lies in an excerpt of about `budget_bytes` of the log: see
/// [`Log::for_each_message_of_excerpt`].
#[must_use]
pub fn glimpse(log: &Log, configs: &[SourceConfig], budget_bytes: u64) -> (Vec<Glimpse>, Excerpt) {
    let mut readers = Readers::default();
    let mut gathered = Vec::new();
    // Of those that can't even be begun, why.
    let mut refused: Vec<Option<SourceError>> = Vec::new();
    for config in configs {
        let source = Gathered::new(config).and_then(|source| {
            readers.add(log.index(), gathered.len(), &source)?;
            Ok(source)
        });
        match source {
            Ok(source) => {
                gathered.push(source);
                refused.push(None);
            }
            Err(error) => refused.push(Some(error)),
        }
    }
    let excerpt = log.for_each_message_of_excerpt(&readers.channels(), budget_bytes, |message| {
        readers.read(&message, &mut gathered);
    });
    let mut gathered = gathered.into_iter();
    let glimpses = refused.into_iter().filter_map(|error| match error {
        Some(error) => Some(Glimpse { messages: 0, seen: None, lacks: vec![error], refused: true }),
        None => gathered.next().map(Glimpse::of),
    });
    (glimpses.collect(), excerpt)
}

impl Glimpse {
    fn of(mut source: Gathered) -> Self {
        let messages = source.messages;
        let mut lacks = Vec::new();
        while let Some((quantity, error)) = source.lack() {
            source.drop(quantity);
            lacks.push(error);
        }
        let seen = (!source.paths.is_empty()).then(|| {
            let origin = source.median_time();
            let fix_origin = source.first_fix();
            source.finish(origin, fix_origin)
        });
        Self { messages, seen, lacks, refused: false }
    }
}
