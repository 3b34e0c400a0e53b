//! MCAP at both ends, and nothing else knows MCAP.
//!
//! A recording is read through its summary: [`Log::open`] costs the same whatever the chunks hold.
//! Where the summary leaves something out, [`Log::open`] finds it in the data section instead.
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
//! memory is taken, checksums before content is handed on.

mod addition;
mod append;
mod chunk;
#[cfg(test)]
mod crash;
pub mod decode;
mod disk;
mod error;
mod excerpt;
mod file;
#[cfg(test)]
mod fixture;
mod ids;
mod index;
mod interrupt;
mod messages;
mod new_file;
mod old_tail;
mod output;
mod restore;
mod summary;
mod survey;
mod times;
mod undo;
mod whole_part;

pub use addition::{Compression, NewChannel, NewMessage, NewMetadata};
pub use append::{Appender, Written};
pub use error::{LogError, Obstacle};
pub use excerpt::Excerpt;
pub use index::{Index, LeftOut, Log, Schema};
pub use interrupt::{INTERRUPTION, Interruption};
pub use mcap::records::{AttachmentIndex, Channel, ChunkIndex, MetadataIndex, Statistics};
pub use messages::{Message, OwnedMessage};
pub use new_file::write_new;
pub use output::Destination;
pub use restore::{Addition, restore_pending_to};
pub use times::TimesRead;
pub use undo::put_back;
pub use whole_part::WholePart;
