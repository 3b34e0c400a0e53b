//! The seam between what messages say and how they are encoded.
//!
//! Each kind of message is one struct: serde writes it as JSON, `prost` by the numbers of `schemas/proto` as
//! protobuf. ROS has messages of its own for most kinds; what a kind becomes there stands in [`super::ros`].

use serde::Serialize;

use crate::log::Encoding;

/// A kind of message.
pub(super) trait Payload: Serialize + prost::Message + Sized {
    /// What it is in ROS.
    type Ros: Serialize + From<Self>;

    /// The message in an encoding.
    fn encode_as(self, encoding: Encoding) -> Vec<u8> {
        match encoding {
            // a struct of numbers and text always is JSON
            Encoding::Json => serde_json::to_vec(&self).unwrap_or_default(),
            Encoding::Protobuf => self.encode_to_vec(),
            Encoding::Cdr => cdr(&Self::Ros::from(self)),
        }
    }
}

/// Little-endian CDR behind the four bytes that say so.
pub(crate) fn cdr(message: &impl Serialize) -> Vec<u8> {
    let mut data = vec![0, 1, 0, 0];
    // only a writer that fails, or a map, could be an error
    let written = cdr_encoding::to_writer::<_, byteorder::LittleEndian, _>(&mut data, message);
    debug_assert!(written.is_ok(), "memory takes any message");
    data
}
