//! MCAP at both ends, and nothing else knows MCAP.
//!
//! A recording is read through its summary: [`Log::open`] costs the same whatever the chunks hold.
//! Where the summary leaves something out, [`Log::open`] finds it in the data section instead.
//! New channels are put behind the old ones with an [`Appender`]:
//!
//! ```text
//! in.mcap    | magic, header, chunks ... | DataEnd | summary                 | footer |
//!            |  every byte, same offset  |
//! out.mcap   | magic, header, chunks ... | new chunks | DataEnd | old + new summary | footer |
//! ```
//!
//! Nothing that a file claims is believed before it is checked: lengths against the file before
//! memory is taken, checksums before content is handed on.

mod addition;
mod append;
mod by_index;
mod chunk;
pub mod decode;
mod error;
mod excerpt;
mod file;
#[cfg(test)]
mod fixture;
mod ids;
mod in_order;
mod index;
mod messages;
mod options;
mod output;
mod part;
mod summary;
mod survey;
mod times;
mod whole_part;

pub use addition::{Compression, NewChannel, NewMessage, NewMetadata};
pub use append::{Appender, Written};
pub use error::{LogError, Obstacle};
pub use excerpt::Excerpt;
pub use index::{Index, LeftOut, Log, Schema};
pub use mcap::records::{AttachmentIndex, Channel, ChunkIndex, MetadataIndex, Statistics};
pub use messages::{Message, MessagesRead, OwnedMessage, bad_chunks, passed_over};
pub use options::{Observer, Progress, ReadOptions, Work};
pub use output::write_new;
pub use times::TimesRead;
pub use whole_part::WholePart;
