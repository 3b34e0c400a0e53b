//! Parts of a log decoded by several threads, and handed on in file order.

use std::collections::VecDeque;
use std::num::NonZero;
use std::sync::{Mutex, mpsc};
use std::thread;

use super::chunk::{Block, Scratch};
use super::file::LogFile;
use super::part::{Part, Wanted};

/// More threads than this decode faster than one can use the messages.
const MOST_THREADS: usize = 4;
/// What parts in flight may hold together, bytes; one may be larger.
const IN_FLIGHT: u64 = 32 << 20;
/// Memory of a part that is kept for the next, bytes.
const KEPT: usize = 16 << 20;

/// A part that is to be read, and where it goes then.
struct Job<'a, 'b> {
    block: &'a Block<'b>,
    part: Part,
    reply: mpsc::SyncSender<Part>,
}

/// Reads the wanted messages of `blocks` and hands each block to `f`, in order, on the caller's thread. Some are
/// read ahead; when `f` fails, no more are begun.
pub(super) fn for_each_part<'b, E>(
    file: &LogFile,
    blocks: &[Block<'b>],
    wanted: Wanted<'_>,
    mut f: impl FnMut(&Block<'b>, &mut Part) -> Result<(), E>,
) -> Result<(), E> {
    let threads = thread::available_parallelism().map_or(1, NonZero::get).min(MOST_THREADS).min(blocks.len());
    if threads < 2 {
        let (mut part, mut scratch) = (Part::default(), Scratch::default());
        for block in blocks {
            part.read(file, block, wanted, &mut scratch);
            f(block, &mut part)?;
        }
        return Ok(());
    }
    let (jobs, todo) = mpsc::channel::<Job<'_, '_>>();
    let todo = Mutex::new(todo);
    thread::scope(|scope| {
        // Theirs to drop: without it they wait for ever.
        let jobs = jobs;
        for _ in 0..threads {
            scope.spawn(|| work(file, wanted, &todo));
        }
        let mut ahead = VecDeque::new();
        let (mut to_begin, mut spare, mut in_flight) = (blocks.iter(), Vec::<Part>::new(), 0);
        let mut next = to_begin.next();
        loop {
            while let Some(block) = next
                && (ahead.is_empty() || ahead.len() < 2 * threads && has_room(in_flight, block.size()))
            {
                let (reply, answer) = mpsc::sync_channel(1);
                in_flight += block.size();
                ahead.push_back((block, answer));
                // That nobody takes it shows when no answer comes.
                let _ = jobs.send(Job { block, part: spare.pop().unwrap_or_default(), reply });
                next = to_begin.next();
            }
            let Some((block, answer)) = ahead.pop_front() else { return Ok(()) };
            // A thread that panicked gives none; its panic goes on when the scope ends.
            let Ok(mut part) = answer.recv() else { return Ok(()) };
            f(block, &mut part)?;
            in_flight -= block.size();
            if part.bytes.capacity() > KEPT {
                part.bytes = Vec::new();
            }
            spare.push(part);
        }
    })
}

/// Whether a further part of `size` bytes may be in memory; sizes may be anything that an index claims.
fn has_room(in_flight: u64, size: u64) -> bool {
    in_flight.saturating_add(size) <= IN_FLIGHT
}

/// Does one job after the other until there are no more to come.
fn work(file: &LogFile, wanted: Wanted<'_>, todo: &Mutex<mpsc::Receiver<Job<'_, '_>>>) {
    let mut scratch = Scratch::default();
    loop {
        let job = todo.lock().map(|todo| todo.recv());
        let Ok(Ok(Job { block, mut part, reply })) = job else { return };
        part.read(file, block, wanted, &mut scratch);
        let _ = reply.send(part);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::super::fixture::{chunked, log, on_disk};
    use super::super::{Log, LogError, Observer, Progress, ReadOptions, Work};
    use super::{IN_FLIGHT, has_room};

    #[test]
    fn sizes_that_overflow_together_are_not_in_memory_together() {
        assert!(has_room(0, IN_FLIGHT) && !has_room(1, IN_FLIGHT));
        assert!(!has_room(1 << 63, 1 << 63) && !has_room(1, u64::MAX));
    }

    fn opened(bytes: &[u8], options: ReadOptions) -> Log {
        let (_dir, path) = on_disk(bytes);
        Log::open_with(path, options).unwrap()
    }

    #[test]
    fn messages_come_in_file_order_whatever_decodes_them() {
        for compression in [None, Some(mcap::Compression::Zstd), Some(mcap::Compression::Lz4)] {
            let log = opened(&log(chunked().compression(compression)), ReadOptions::default());
            for _ in 0..20 {
                let mut found = Vec::new();
                let read = log.for_each_message(&[1, 2].into(), |message| {
                    found.push(message.sequence);
                    Ok::<_, LogError>(())
                });
                assert!(read.unwrap().damaged.is_empty());
                assert_eq!(found, (0..20).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn an_error_of_the_receiver_ends_the_reading() {
        let log = opened(&log(chunked()), ReadOptions::default());
        let mut count = 0;
        let read = log.for_each_message(&[1].into(), |_| {
            count += 1;
            if count < 3 { Ok(()) } else { Err(LogError::OutputExists { path: "x".into() }) }
        });
        assert!(matches!(read, Err(LogError::OutputExists { .. })));
        assert_eq!(count, 3);
    }

    #[test]
    fn the_observer_hears_of_every_part_up_to_the_last() {
        let told = Arc::new(Mutex::new(Vec::<Progress>::new()));
        let ear = Arc::clone(&told);
        let observer = Observer::new(move |progress| ear.lock().unwrap().push(progress));
        let log = opened(&log(chunked()), ReadOptions { observer, ..ReadOptions::default() });
        let read = log.for_each_message(&[1].into(), |_| Ok::<_, LogError>(())).unwrap();
        let told = told.lock().unwrap();
        let told: Vec<_> = told.iter().filter(|p| p.work == Work::Read).collect();
        assert_eq!(told.len(), read.parts);
        assert!(told.is_sorted_by_key(|p| p.done) && told.last().is_some_and(|p| p.done == p.total));
    }

    #[test]
    fn a_chunk_above_the_limit_is_named_and_a_higher_limit_takes_it() {
        let bytes = log(chunked().compression(Some(mcap::Compression::Zstd)));
        for (memory_limit, whole) in [(150, false), (1 << 20, true)] {
            let mut log = opened(&bytes, ReadOptions::default());
            log.file.options.memory_limit = memory_limit;
            let read = log.for_each_message(&[1].into(), |_| Ok::<_, LogError>(())).unwrap();
            assert_eq!(read.damaged.is_empty(), whole, "{read:?}");
            assert!(
                read.damaged.iter().all(|e| matches!(e, LogError::TooLarge { .. }) && e.hint().is_some())
            );
        }
    }
}
