//! What is added to a log: channels, messages, metadata, and how they are packed.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::{
    collections::BTreeMap,
    io::{self, Write},
};

/// A channel to be added.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewChannel {
    /// Its name, new to the log.
    pub topic: String,
    /// Such as `json`.
    pub message_encoding: String,
    /// Such as `trackfuse.TrackPoint`.
    pub schema_name: String,
    /// Such as `jsonschema`.
    pub schema_encoding: String,
    /// The definition itself. Channels with the same name, encoding and definition share a schema.
    pub schema: Vec<u8>,
    /// For people and other programs.
    pub metadata: BTreeMap<String, String>,
}

impl NewChannel {
    /// A channel of JSON messages that follow a JSON Schema.
    #[must_use]
    pub fn json(topic: &str, schema_name: &str, schema: &str) -> Self {
        Self::new(topic, "json", [schema_name, "jsonschema"], schema.as_bytes())
    }

    /// A channel of protobuf messages; `descriptors` are a serialized `FileDescriptorSet` of all that they use.
    #[must_use]
    pub fn protobuf(topic: &str, schema_name: &str, descriptors: &[u8]) -> Self {
        Self::new(topic, "protobuf", [schema_name, "protobuf"], descriptors)
    }

    /// A channel of ROS 2 messages in CDR, with their definition and those of all that it uses.
    #[must_use]
    pub fn ros2(topic: &str, schema_name: &str, definition: &str) -> Self {
        let channel = Self::new(topic, "cdr", [schema_name, "ros2msg"], definition.as_bytes());
        // the profile wants it; empty: whoever plays it chooses
        let metadata = [("offered_qos_profiles".to_owned(), String::new())].into();
        Self { metadata, ..channel }
    }

    fn new(topic: &str, encoding: &str, [schema_name, schema_encoding]: [&str; 2], schema: &[u8]) -> Self {
        Self {
            topic: topic.to_owned(),
            message_encoding: encoding.to_owned(),
            schema_name: schema_name.to_owned(),
            schema_encoding: schema_encoding.to_owned(),
            schema: schema.to_vec(),
            metadata: BTreeMap::new(),
        }
    }
}

/// What new messages are encoded in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// Foxglove's messages and ours as JSON.
    #[default]
    Json,
    /// The same as protobuf, which Rerun draws too.
    Protobuf,
    /// ROS 2 messages, such as `nav_msgs/Odometry`, in CDR.
    Cdr,
}

impl Encoding {
    /// The encoding of a log of this profile unless somebody wants another one: `ros2` allows CDR alone.
    #[must_use]
    pub fn of_profile(profile: &str) -> Self {
        if profile == "ros2" { Self::Cdr } else { Self::Json }
    }

    /// What a person may want to know of messages in this encoding in a log whose profile makes another one usual.
    #[must_use]
    pub fn note(self, usual: Self) -> Option<String> {
        let lost = "the log's profile is ros2, which has messages in CDR only: tools that go by it may not read the log \
                    with the new ones";
        (usual == Self::Cdr && self != usual).then(|| lost.to_owned())
    }
}

/// A message to be added.
#[derive(Clone, Copy, Debug)]
pub struct NewMessage<'a> {
    /// Which of the new channels, counted from 0.
    pub channel: usize,
    /// Both its log time and its publish time, in ns.
    pub time_ns: u64,
    /// The payload, in the channel's encoding.
    pub data: &'a [u8],
}

/// A metadata record to be added. Some tools refuse a name that is in a log twice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewMetadata {
    /// Its name.
    pub name: String,
    /// Its content.
    pub entries: BTreeMap<String, String>,
}

/// How new chunks are compressed; old ones stay as they are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Compression {
    /// Small, and fast to read.
    #[default]
    Zstd,
    /// Larger, and faster still.
    Lz4,
    /// As the messages are.
    None,
}

impl Compression {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Zstd => "zstd",
            Self::Lz4 => "lz4",
            Self::None => "",
        }
    }

    pub(super) fn compress(self, bytes: &[u8]) -> io::Result<Vec<u8>> {
        match self {
            Self::Zstd => zstd::bulk::compress(bytes, zstd::DEFAULT_COMPRESSION_LEVEL),
            Self::Lz4 => {
                let mut encoder = lz4::EncoderBuilder::new().build(Vec::new())?;
                encoder.write_all(bytes)?;
                let (compressed, finished) = encoder.finish();
                finished.map(|()| compressed)
            }
            Self::None => Ok(bytes.to_vec()),
        }
    }
}
