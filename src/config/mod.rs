//! What the user asked for: the TOML config, every key with a default that suits a normal log.
//!
//! Sigmas, times and lengths carry their unit in the key. The resolved values go into the output's
//! metadata, so that a track can be made again.

mod check;
#[cfg(test)]
mod guide;
mod template;
mod usbl;

pub use template::{SourceTable, template};
pub use usbl::{AngleUnit, Causal, Usbl};

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::estimate::registration::{Kind, Priors};
use crate::estimate::{Coefficients, Estimator};
use crate::log::{Compression, Encoding};

/// Why a config can't be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file can't be read.
    #[error("config {path}: {}", why_unread(source))]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The text is not a config.
    #[error("config {path}: {message}")]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, key, and what was expected there.
        message: String,
        /// The nearest key that exists, where one is near.
        nearest: Option<String>,
    },
    /// A value is out of its range.
    #[error("config: {key} is {value}, expected {expected}")]
    Range {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// What it should be.
        expected: &'static str,
    },
}

impl ConfigError {
    /// What to do about it.
    #[must_use]
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Read { .. } => {
                Some("a config is a TOML file: `trackfuse init LOG -o CONFIG` writes one".into())
            }
            Self::Syntax { nearest: Some(key), .. } => Some(format!("did you mean `{key}`?")),
            Self::Syntax { message, .. } if message.ends_with("expected a list of tables") => {
                Some("two brackets begin an entry of a list: `[[source]]`, `[[characteristic_point]]`".into())
            }
            _ => None,
        }
    }
}

/// Why a file gave no text.
pub(crate) fn why_unread(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::InvalidData => "it is no text".into(),
        std::io::ErrorKind::IsADirectory => "it is a directory".into(),
        _ => error.to_string(),
    }
}

/// A config: what to fuse, how, and where the result goes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// The new topics and their chunks.
    pub output: Output,
    /// The sources; without any, they are recognised by their topics' names.
    pub source: Vec<SourceConfig>,
    /// How they are fused.
    pub fusion: Fusion,
    /// Standard deviations of the sources' errors before anything is known.
    pub registration: Priors,
    /// How the track is carried on behind the last sample.
    pub extrapolation: Extrapolation,
    /// Heights whose first upward crossing is reported.
    pub characteristic_point: Vec<CharacteristicPoint>,
    /// The fixes that `trackfuse usbl` cleans, and how.
    pub usbl: Usbl,
}

/// The output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Prefix of the new topics; default: `/fused`, of `trackfuse usbl` `/usbl`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"/fused")]
    pub prefix: Option<String>,
    /// Points of the track a second; default: the fastest source's rate.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 50.0)]
    pub rate_hz: Option<f64>,
    /// Frame of the track; default: the datum's.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"enu")]
    pub frame_id: Option<String>,
    /// Latitude and longitude, degrees, and altitude, m, of the track's zero (WGS 84): from there latitudes and longitudes
    /// become metres east, north and up; default: the datum's first fix.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = [42.3758, -71.1474, 7.3])]
    pub origin: Option<[f64; 3]>,
    /// What the new messages are encoded in; default: `cdr` where the log's profile is `ros2`, else `json`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"protobuf")]
    pub encoding: Option<Encoding>,
    /// Compression of the new chunks.
    pub compression: Compression,
    /// T0, from which times count, ns; default: the datum's first sample.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 1_731_000_000_000_000_000_i64)]
    pub t0_ns: Option<i64>,
    /// Whether z = 0 is the sea surface, so that points carry a depth; default: when every observed position
    /// lies below z = 2 m and some below -2 m, unless the datum's heights count from the altitude of a fix.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = true)]
    pub surface_at_zero: Option<bool>,
}

impl Output {
    /// The usual prefix of a fused track's topics.
    pub const FUSED: &str = "/fused";
    /// The usual prefix of a USBL track's topics.
    pub const USBL: &str = "/usbl";

    /// The prefix of the new topics.
    #[must_use]
    pub fn prefix(&self) -> &str {
        self.prefix.as_deref().unwrap_or(Self::FUSED)
    }
}

impl Default for Output {
    fn default() -> Self {
        Self {
            prefix: None,
            rate_hz: None,
            frame_id: None,
            origin: None,
            encoding: None,
            compression: Compression::Zstd,
            t0_ns: None,
            surface_at_zero: None,
        }
    }
}

/// One sensor.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SourceConfig {
    /// What to call it.
    #[schemars(example = &"tether")]
    pub name: String,
    /// Message path of its position: an object with x, y, z or an array of three, m, or one with latitude, longitude,
    /// degrees, and altitude, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"/tether/track.position")]
    pub position: Option<String>,
    /// Message path of its velocity, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"/tether/track.velocity")]
    pub velocity: Option<String>,
    /// Whether its bias and clock are zero by definition; default: the tether's are, else the first source's.
    pub datum: bool,
    /// Directions of its x, y and z; of no meaning for latitudes.
    pub axes: Axes,
    /// Standard deviation of its position, m; default: from the messages, else estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 0.2)]
    pub position_sigma_m: Option<f64>,
    /// Standard deviation of its velocity, m/s; default: from the messages, else estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 0.2)]
    pub velocity_sigma_m_s: Option<f64>,
    /// What counts as a sample's time; default: its stamp, else the publish time, else the log time.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"log")]
    pub time: Option<TimeChoice>,
    /// How long before its time a sample was taken, s.
    pub latency_s: f64,
    /// Lever arm, added to every position, m: the vector from what is measured to what is tracked, along the axes of the
    /// vehicle's body, turned by the orientation beside the position; along the track's axes where there is none. A
    /// velocity is taken as it is: what the vehicle's turning adds to it along the lever arm is not taken off.
    pub offset_m: [f64; 3],
    /// Frame of its velocities; default: `body` for `nav_msgs/Odometry` and `foxglove.Odometry`, else `world`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"world")]
    pub velocity_frame: Option<VelocityFrame>,
}

/// Directions of x, y and z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Axes {
    /// East, north, up.
    #[default]
    Enu,
    /// North, east, down.
    Ned,
}

/// What counts as a sample's time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum TimeChoice {
    /// The stamp in the message.
    Stamp,
    /// The log's publish time.
    Publish,
    /// The log's log time.
    Log,
}

/// Frame of a velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum VelocityFrame {
    /// The frame of the positions.
    World,
    /// The vehicle's, to be turned by the orientation beside the position.
    Body,
}

/// How sources are fused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Fusion {
    /// The estimator.
    pub method: Estimator,
    /// Whether the velocity is the derivative of the position (`shared`), or both are fitted apart.
    pub coefficients: Coefficients,
    /// What is registered between sources: "auto" for all that the program can, [] for nothing.
    pub estimate: Registration,
    /// SFF: knot spacing, s; default: the fastest source's median interval, but at least 0.08 s.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 0.1)]
    pub knot_spacing_s: Option<f64>,
    /// PCF: order of the polynomial; 12 is the paper's best.
    pub order: usize,
    /// Moving average: points; an even number counts as one less.
    pub window_points: usize,
    /// The longest silence of all sources that the track bridges, s. A guess.
    pub bridge_max_s: f64,
}

impl Default for Fusion {
    fn default() -> Self {
        Self {
            method: Estimator::Sff,
            coefficients: Coefficients::Shared,
            estimate: Registration::Auto(Auto::Auto),
            knot_spacing_s: None,
            order: 12,
            window_points: 16,
            bridge_max_s: 5.0,
        }
    }
}

/// What is registered between sources.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Registration {
    /// All that the program can.
    Auto(Auto),
    /// These kinds of errors; none for no registration.
    List(Vec<Kind>),
}

/// The word "auto".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Auto {
    /// "auto".
    Auto,
}

/// How the track is carried on after the last sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Extrapolation {
    /// The method.
    pub method: ExtrapolationMethod,
    /// How far, s; 0 for none.
    pub horizon_s: f64,
    /// Order of the polynomial.
    pub order: usize,
    /// Length of the stretch that it is fitted to, s; default: 1.4 (drag: 0.9), or 12 median intervals of the slowest
    /// source.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 1.4)]
    pub window_s: Option<f64>,
    /// Whether the polynomial's acceleration dies away; without, it is the paper's plain least squares.
    pub prior: bool,
    /// Height at which it stops, m: the surface, say; default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 0.0)]
    pub stop_z_m: Option<f64>,
}

impl Default for Extrapolation {
    fn default() -> Self {
        Self {
            method: ExtrapolationMethod::Pcf,
            horizon_s: 2.0,
            order: 4,
            window_s: None,
            prior: true,
            stop_z_m: None,
        }
    }
}

/// How the track is carried on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ExtrapolationMethod {
    /// A constrained polynomial.
    #[default]
    Pcf,
    /// Constant force and quadratic drag.
    Drag,
    /// Whichever of both does better from earlier instants of the same log.
    Auto,
}

/// A height whose first upward crossing is reported.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CharacteristicPoint {
    /// What to call it.
    #[schemars(example = &"exit")]
    pub name: String,
    /// The height, m, Z up.
    #[schemars(example = -2.0)]
    pub z_m: f64,
}

impl Config {
    /// Reads and checks a config file.
    ///
    /// # Errors
    /// [`ConfigError`] when it can't be read, is no config, or holds a value out of range.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| ConfigError::Read { path: path.to_owned(), source })?;
        Self::parse(&text, path)
    }

    /// Parses and checks a config's text; `path` is for the messages.
    ///
    /// # Errors
    /// [`ConfigError`] when it is no config or holds a value out of range.
    pub fn parse(text: &str, path: &Path) -> Result<Self, ConfigError> {
        let config: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map(|s| 1 + text[..s.start].matches('\n').count());
            let message = plain_words(&error.message().replace('\n', " "));
            let nearest = nearest_key(&message);
            let message = line.map_or(message.clone(), |line| format!("line {line}: {message}"));
            ConfigError::Syntax { path: path.to_owned(), message, nearest }
        })?;
        config.check()?;
        Ok(config)
    }
}

/// The parser's message without the words of its trade.
fn plain_words(message: &str) -> String {
    if message.contains("untagged enum Registration") {
        let kinds: Vec<_> = Kind::ALL.map(Kind::key).map(|key| format!("{key:?}")).to_vec();
        return format!("expected \"auto\", [], or a list of {}", kinds.join(", "));
    }
    let words = [
        ("invalid type: map, expected a sequence", "found one table, expected a list of tables"),
        ("expected f64", "expected a number"),
        ("expected usize", "expected a whole number"),
        ("expected i64", "expected a whole number"),
    ];
    words.iter().fold(message.to_owned(), |text, (trade, plain)| text.replace(trade, plain))
}

/// Of an unknown key's message "unknown field `x`, expected one of `a`, `b`": the expected one nearest to x.
fn nearest_key(message: &str) -> Option<String> {
    let mut quoted = message.split('`').skip(1).step_by(2);
    let unknown = message.starts_with("unknown").then(|| quoted.next()).flatten()?;
    let score = |known: &&str| strsim::jaro_winkler(unknown, known);
    let best = quoted.max_by(|a, b| score(a).total_cmp(&score(b)))?;
    (score(&best) > 0.7).then(|| best.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Config, ConfigError> {
        Config::parse(text, Path::new("trial.toml"))
    }

    #[test]
    fn an_empty_config_is_the_default_and_defaults_survive_a_round_trip() {
        let config = parse("").expect("all keys have defaults");
        assert_eq!(config, Config::default());
        let text = toml::to_string(&config).expect("a config is TOML");
        assert_eq!(parse(&text).expect("its own text"), config);
    }

    #[test]
    fn an_unknown_key_names_its_line_and_the_nearest_known_one() {
        let error = parse("[output]\nrate = 50.0\n").expect_err("no such key");
        assert_eq!(error.hint().as_deref(), Some("did you mean `rate_hz`?"));
        assert!(error.to_string().contains("trial.toml: line 2: unknown field `rate`"), "{error}");
        let error = parse("[fusion]\nmethod = \"spf\"\n").expect_err("no such method");
        assert_eq!(error.hint().as_deref(), Some("did you mean `sff`?"));
    }

    #[test]
    fn the_schema_in_the_tree_is_the_one_of_this_code() {
        let schema = serde_json::to_string_pretty(&schemars::schema_for!(Config)).expect("a schema is JSON");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas/config.schema.json");
        if std::env::var_os("TRACKFUSE_UPDATE_SCHEMAS").is_some() {
            std::fs::write(&path, format!("{schema}\n")).expect("the tree can be written");
        }
        let stored = std::fs::read_to_string(&path).expect("schemas/config.schema.json");
        assert!(stored.trim_end() == schema, "it differs; TRACKFUSE_UPDATE_SCHEMAS=1 writes it anew");
    }
}
