//! A part of a log that is read in its stead, spread evenly over it.

use std::collections::BTreeSet;

use super::chunk::Block;
use super::part::Wanted;
use super::{Log, LogError, Message, MessagesRead};

/// How much of the parts that hold the wanted channels was read.
#[derive(Debug, Default)]
pub struct Excerpt {
    /// Chunks, and runs of messages outside chunks, that may hold one of the channels.
    pub parts: usize,
    /// How many of them were read.
    pub read: usize,
    /// How many of those are chunks, and were checked where they have a checksum.
    pub chunks_read: usize,
    /// Why some of them could not be.
    pub damaged: Vec<LogError>,
}

/// Of each channel's parts at least so many are read: the first, the middle and the last.
const LEAST_PARTS: usize = 3;

impl Log {
    /// Hands messages of `channels` to `f`, in file order: all of them where the parts of the log that hold
    /// them are no larger than `budget_bytes` together (uncompressed), else those of an excerpt of about that
    /// size. Of every channel some parts are read that are spread over all of its parts, the first and the
    /// last among them. What is damaged is passed over.
    pub fn for_each_message_of_excerpt(
        &self,
        channels: &BTreeSet<u16>,
        budget_bytes: u64,
        mut f: impl FnMut(Message<'_>),
    ) -> Excerpt {
        let blocks = self.blocks_of(channels);
        let chosen = choose(&blocks, channels, budget_bytes);
        let parts = blocks.len();
        let chosen: Vec<Block<'_>> = chosen.into_iter().filter_map(|i| blocks.get(i).cloned()).collect();
        let wanted = Wanted { channels: Some(channels), by_index: false };
        let mut read = MessagesRead::default();
        let done = self.for_each_wanted(&chosen, wanted, &mut read, |message| {
            f(message);
            Ok::<_, LogError>(())
        });
        read.damaged.extend(done.err());
        Excerpt {
            parts,
            read: chosen.len(),
            chunks_read: chosen.iter().filter(|block| matches!(block, Block::Chunk(_))).count(),
            damaged: read.damaged,
        }
    }
}

/// Which of `blocks` are read.
fn choose(blocks: &[Block<'_>], channels: &BTreeSet<u16>, budget_bytes: u64) -> BTreeSet<usize> {
    let total = blocks.iter().fold(0_u64, |sum, block| sum.saturating_add(block.size()));
    if total <= budget_bytes {
        return (0..blocks.len()).collect();
    }
    let affordable = blocks.len() as f64 * (budget_bytes as f64 / total as f64);
    let each = ((affordable / channels.len().max(1) as f64) as usize).max(LEAST_PARTS);
    let of_channel = |&id: &u16| {
        let holding: Vec<usize> = (0..blocks.len()).filter(|&i| blocks[i].may_hold(id)).collect();
        spread(holding.len(), each).map(move |i| holding[i]).collect::<Vec<_>>()
    };
    channels.iter().flat_map(of_channel).collect()
}

/// About `count` of the numbers below `len`, evenly, with both ends.
fn spread(len: usize, count: usize) -> impl Iterator<Item = usize> {
    let count = count.min(len);
    let last = count.saturating_sub(1).max(1);
    (0..count).map(move |i| i * len.saturating_sub(1) / last)
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{chunked, log, on_disk};
    use super::*;

    #[test]
    fn an_excerpt_has_both_ends_and_steps_evenly_between() {
        assert_eq!(spread(100, 4).collect::<Vec<_>>(), [0, 33, 66, 99]);
        assert_eq!(spread(2, 4).collect::<Vec<_>>(), [0, 1]);
        assert_eq!(spread(5, 1).collect::<Vec<_>>(), [0]);
        assert_eq!(spread(0, 3).count(), 0);
    }

    fn numbers(log: &Log, channel: u16, budget_bytes: u64) -> (Vec<u32>, Excerpt) {
        let mut numbers = Vec::new();
        let excerpt =
            log.for_each_message_of_excerpt(&[channel].into(), budget_bytes, |m| numbers.push(m.sequence));
        (numbers, excerpt)
    }

    #[test]
    fn a_small_log_is_read_whole_and_of_a_large_one_the_ends_and_the_middle() {
        let (_dir, path) = on_disk(&log(chunked()));
        let log = Log::open(path).unwrap();
        let (all, whole) = numbers(&log, 1, u64::MAX);
        assert_eq!((all.len(), whole.read), (15, whole.parts));
        let (some, excerpt) = numbers(&log, 1, 1);
        assert_eq!((excerpt.parts, excerpt.read), (whole.parts, 3));
        assert!(excerpt.damaged.is_empty());
        assert_eq!((some.first(), some.last()), (Some(&0), Some(&18)));
        assert!(some.len() < all.len() && some.iter().all(|i| all.contains(i)));
    }

    #[test]
    fn a_damaged_part_is_passed_over_and_named() {
        let mut bytes = log(chunked());
        let payload = bytes.windows(7).position(|window| window == b"{\"i\":0}").unwrap();
        bytes[payload + 5] = b'7';
        let (_dir, path) = on_disk(&bytes);
        let (rest, excerpt) = numbers(&Log::open(path).unwrap(), 1, u64::MAX);
        assert!(!rest.is_empty() && !rest.contains(&0));
        assert!(matches!(excerpt.damaged.as_slice(), [LogError::BadChunk { .. }]), "{excerpt:?}");
    }
}
