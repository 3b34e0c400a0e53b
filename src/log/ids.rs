//! Ids for new schemas and channels.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use super::{Index, LogError, NewChannel};

/// The ids of a new channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ids {
    pub(super) schema: u16,
    pub(super) schema_is_new: bool,
    pub(super) channel: u16,
}

/// Ids that nothing in the log at `path` uses or refers to.
pub(super) fn assign_ids(index: &Index, path: &Path, channels: &[NewChannel]) -> Result<Vec<Ids>, LogError> {
    let exhausted = |kind| LogError::IdsExhausted { path: path.to_owned(), kind };
    let mut topics: BTreeSet<&str> = index.channels.values().map(|channel| channel.topic.as_str()).collect();
    let schema_ids = index.channels.values().map(|channel| channel.schema_id);
    // 0 means "no schema" and is no schema's id; it is a channel's id like any other.
    let mut free_schemas = free_ids(index.schemas.keys().copied().chain(schema_ids).collect(), 1);
    let used = index.chunks.iter().flat_map(|chunk| chunk.message_index_offsets.keys());
    let counted = index.statistics.iter().flat_map(|statistics| statistics.channel_message_counts.keys());
    let used = index.channels.keys().chain(used).chain(counted).chain(&index.reserved_ids);
    let mut free_channels = free_ids(used.copied().collect(), 0);

    let mut schemas = BTreeMap::new();
    let mut assigned = Vec::new();
    for channel in channels {
        if !topics.insert(&channel.topic) {
            return Err(LogError::TopicTaken { path: path.to_owned(), topic: channel.topic.clone() });
        }
        let key = (&channel.schema_name, &channel.schema_encoding, &channel.schema);
        let known = schemas.get(&key).copied();
        let schema = known.or_else(|| free_schemas.next()).ok_or_else(|| exhausted("schema"))?;
        schemas.insert(key, schema);
        let channel = free_channels.next().ok_or_else(|| exhausted("channel"))?;
        assigned.push(Ids { schema, schema_is_new: known.is_none(), channel });
    }
    Ok(assigned)
}

/// Ids above all used ones, then those between them.
fn free_ids(used: BTreeSet<u16>, lowest: u16) -> impl Iterator<Item = u16> {
    let above = used.last().map_or(lowest, |&greatest| greatest.saturating_add(1).max(lowest));
    (above..=u16::MAX).chain(lowest..above).filter(move |id| !used.contains(id))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_ids_come_above_the_old_ones_while_there_is_room() {
        assert_eq!(free_ids([].into(), 1).take(2).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(free_ids([].into(), 0).take(2).collect::<Vec<_>>(), [0, 1]);
        assert_eq!(free_ids([0, 7].into(), 0).take(2).collect::<Vec<_>>(), [8, 9]);
    }

    #[test]
    fn gaps_between_old_ids_are_used_before_giving_up() {
        let used = (0..=u16::MAX).filter(|id| ![3, 9].contains(id)).collect();
        assert_eq!(free_ids(used, 1).collect::<Vec<_>>(), [3, 9]);
        let used = [u16::MAX - 1].into();
        assert_eq!(free_ids(used, 1).take(3).collect::<Vec<_>>(), [u16::MAX, 1, 2]);
        assert_eq!(free_ids((0..=u16::MAX).collect(), 0).next(), None);
    }
}
