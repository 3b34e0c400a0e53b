//! One number over time, such as a depth or a heading, as its messages come.

use std::collections::{BTreeMap, BTreeSet};

use super::SourceError;
use super::reading::Timed;
use crate::log::decode::{Decoder, MessagePath};
use crate::log::{Index, Message};
use crate::time::Time;

/// Numbers in order of time, s, and what was left out, a sentence.
pub(super) type Finished = (Vec<(f64, f64)>, Option<String>);

/// The numbers at one message path.
#[derive(Debug)]
pub(super) struct Numbers {
    name: &'static str,
    path: MessagePath,
    readers: BTreeMap<u16, (Decoder, Timed)>,
    values: Vec<(Time, f64)>,
    count: usize,
}

impl Numbers {
    /// Nothing yet; `name` is for the errors.
    ///
    /// # Errors
    /// [`SourceError::Path`], [`SourceError::NoTopic`], [`SourceError::Decode`] and [`SourceError::Miss`] for a path that
    /// doesn't fit.
    pub(super) fn new(index: &Index, name: &'static str, path: &str) -> Result<Self, SourceError> {
        let path =
            MessagePath::parse(path).map_err(|error| SourceError::Path { name: name.into(), error })?;
        let mut readers = BTreeMap::new();
        for channel in index.channels_of(&path.topic) {
            let schema = index.schema_of(channel);
            let (encoding, schema_name, data) = schema
                .map_or(("", "", &[][..]), |s| (s.encoding.as_str(), s.name.as_str(), s.data.as_slice()));
            let whole =
                Decoder::new(&channel.message_encoding, encoding, schema_name, data).map_err(|error| {
                    SourceError::Decode { name: name.into(), topic: path.topic.clone(), error }
                })?;
            let timing = Timed::new(&whole, &path.topic, None);
            let mut wanted = timing.stamps.clone();
            wanted.push(path.clone());
            let decoder =
                whole.select(&wanted).map_err(|miss| SourceError::Miss { name: name.into(), miss })?;
            readers.insert(channel.id, (decoder, timing));
        }
        if readers.is_empty() {
            let topics: BTreeSet<String> = index.channels.values().map(|c| c.topic.clone()).collect();
            let (topic, topics) = (path.topic, topics.into_iter().collect());
            return Err(SourceError::NoTopic { name: name.into(), topic, topics });
        }
        Ok(Self { name, path, readers, values: Vec::new(), count: 0 })
    }

    /// The channels that are read.
    pub(super) fn channels(&self) -> impl Iterator<Item = u16> {
        self.readers.keys().copied()
    }

    /// Takes the number of a message, if it is of one of the channels and has one.
    pub(super) fn read(&mut self, message: &Message<'_>) {
        let Some((decoder, timing)) = self.readers.get(&message.channel_id) else { return };
        self.count += 1;
        let value = || {
            let value = decoder.decode(message.data).ok()?;
            let number = self.path.resolve(&value).ok()??.as_f64().filter(|n| n.is_finite())?;
            Some((timing.of(&value, message)?.1, number))
        };
        self.values.extend(value());
    }

    /// The finite numbers in order of time, s since `origin`, and a sentence on what was left out.
    ///
    /// # Errors
    /// [`SourceError::NoNumber`] where there is none.
    pub(super) fn finish(mut self, origin: Time) -> Result<Finished, SourceError> {
        if self.values.is_empty() {
            let (name, path) = (self.name.into(), self.path.to_string());
            return Err(SourceError::NoNumber { name, path, count: self.count });
        }
        let left_out = self.count - self.values.len();
        let said = (left_out > 0).then(|| {
            let name = self.name;
            format!("{name}: {left_out} messages are left out: no finite number at the path, or no time")
        });
        self.values.sort_by_key(|(time, _)| *time);
        Ok((self.values.iter().map(|&(time, v)| (time.seconds_since(origin), v)).collect(), said))
    }
}
