//! One number over time, such as a depth.

use std::collections::BTreeMap;

use super::SourceError;
use super::reading::Timed;
use crate::config::TimeChoice;
use crate::log::decode::{Decoder, MessagePath};
use crate::log::{Log, LogError};
use crate::time::Time;

/// A number over time.
#[derive(Debug)]
pub struct Scalar {
    /// Instants and values, in order of time.
    pub values: Vec<(Time, f64)>,
    /// Messages that gave none.
    pub left_out: usize,
    /// What could not be read of the log.
    pub damaged: Vec<LogError>,
}

/// The numbers at a message path; `name` is for the errors. What is no finite number is left out.
///
/// # Errors
/// [`SourceError::Path`], [`SourceError::NoTopic`], [`SourceError::Decode`] and [`SourceError::Miss`] for a path that
/// doesn't fit; [`SourceError::NoNumber`] where no message has one.
pub fn load_scalar(
    log: &Log,
    name: &str,
    path: &str,
    time: Option<TimeChoice>,
) -> Result<Scalar, SourceError> {
    let name = name.to_owned();
    let parsed = MessagePath::parse(path).map_err(|error| SourceError::Path { name: name.clone(), error })?;
    let (index, topic) = (log.index(), parsed.topic.clone());
    let mut readers = BTreeMap::new();
    for channel in index.channels_of(&topic) {
        let schema = index.schema_of(channel);
        let (encoding, schema_name, data) =
            schema.map_or(("", "", &[][..]), |s| (s.encoding.as_str(), s.name.as_str(), s.data.as_slice()));
        let of_topic = |error| SourceError::Decode { name: name.clone(), topic: topic.clone(), error };
        let whole = Decoder::new(&channel.message_encoding, encoding, schema_name, data).map_err(of_topic)?;
        let timing = Timed::new(&whole, &topic, time);
        let mut wanted = timing.stamps.clone();
        wanted.push(parsed.clone());
        let decoder = whole.select(&wanted).map_err(|miss| SourceError::Miss { name: name.clone(), miss })?;
        readers.insert(channel.id, (decoder, timing));
    }
    if readers.is_empty() {
        let mut topics: Vec<String> = index.channels.values().map(|c| c.topic.clone()).collect();
        topics.sort();
        topics.dedup();
        return Err(SourceError::NoTopic { name, topic, topics });
    }
    let (mut values, mut count) = (Vec::new(), 0);
    let read = log.for_each_message(&readers.keys().copied().collect(), |message| {
        count += 1;
        let value = readers.get(&message.channel_id).and_then(|(decoder, timing)| {
            let value = decoder.decode(message.data).ok()?;
            let number = parsed.resolve(&value).ok()??.as_f64().filter(|n| n.is_finite())?;
            Some((timing.of(&value, &message)?.1, number))
        });
        values.extend(value);
        Ok::<(), SourceError>(())
    })?;
    if values.is_empty() {
        return Err(SourceError::NoNumber { name, path: path.to_owned(), count });
    }
    let left_out = count - values.len();
    values.sort_by_key(|(time, _)| *time);
    Ok(Scalar { values, left_out, damaged: read.damaged })
}
