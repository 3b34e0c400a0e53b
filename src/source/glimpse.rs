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
    /// What they say, or what stands against using the source as far as they tell: the rest of the log may
    /// have what they lack.
    pub seen: Result<Loaded, SourceError>,
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
        Some(error) => Some(Glimpse { messages: 0, seen: Err(error) }),
        None => gathered.next().map(seen),
    });
    (glimpses.collect(), excerpt)
}

fn seen(mut source: Gathered) -> Glimpse {
    let messages = source.messages;
    let seen = if let Some((_, error)) = source.lack() {
        Err(error)
    } else {
        let origin = source.median_time();
        Ok(source.finish(origin))
    };
    Glimpse { messages, seen }
}
