//! MCAP at both ends, and nothing else knows MCAP.
//!
//! A recording is read through its summary: [`Log::open`] costs the same whatever the chunks hold.
//! Where the summary leaves something out or is damaged, [`Log::open`] finds it in the data section instead:
//!
//! | what | where |
//! |---|---|
//! | the end of the data section, the summary behind it | `ending` |
//! | the summary's entries held against the records that they name | `extents` |
//! | records that it doesn't name | `gaps` |
//! | what chunks hold, where nothing else tells | `contents`, `survey` |
//! | what is left of a log that is cut off | `rescue` |
//! | how readers shall find old and new messages | [`Visibility`] |
//!
//! New channels are put behind the old ones with an [`Appender`]:
//!
//! ```text
//! in.mcap    | magic, header, chunks ... | DataEnd, summary, footer |
//!            |  every byte, same offset  |        = old tail        |
//! out.mcap   | magic, header, chunks ... | old tail, attached | new chunks | DataEnd | old + new summary | footer |
//! ```
//!
//! So the original can be had out of the output again, bit for bit: [`Log::additions`].
//!
//! Nothing that a file claims is believed before it is checked: lengths against the file before
//! memory is taken, checksums before content is handed on. What is wrong stands in [`Log::damage`].

mod addition;
mod append;
mod by_index;
mod checksum;
mod chunk;
mod contents;
mod copying;
#[cfg(test)]
mod crash;
mod damage;
pub mod decode;
mod disk;
mod ending;
mod error;
mod excerpt;
mod extents;
mod file;
#[cfg(test)]
mod fixture;
mod gaps;
mod ids;
mod in_order;
mod index;
mod interrupt;
mod messages;
mod nearby;
mod new_chunk;
mod new_file;
mod old_tail;
mod open;
mod options;
mod output;
mod part;
mod rescue;
mod restore;
mod summary;
mod survey;
mod times;
mod undo;
pub mod verify;
mod visibility;

pub use addition::{Compression, Encoding, NewChannel, NewMessage, NewMetadata};
pub use append::{Appender, Written};
pub use damage::Damage;
pub use error::LogError;
pub use excerpt::Excerpt;
pub use index::{Index, LeftOut, Schema};
pub use interrupt::{INTERRUPTION, Interruption};
pub use mcap::records::{AttachmentIndex, Channel, ChunkIndex, MetadataIndex, Statistics};
pub use messages::{Message, MessagesRead, OwnedMessage, bad_chunks, passed_over};
pub use new_file::{Prepared, check_name, write_new};
pub use open::Log;
pub use options::{Observer, Progress, ReadOptions, Work};
pub use output::Destination;
pub use restore::{Addition, restore_pending_to};
pub use times::TimesRead;
pub use undo::put_back;
pub use visibility::Visibility;
