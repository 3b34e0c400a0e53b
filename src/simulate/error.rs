//! What can be wrong with a scenario, and with writing its log.

/// Why a scenario can't be simulated or its log can't be written.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// The scenario's text isn't TOML, has a key that doesn't exist, or a value of the wrong type.
    #[error("scenario: {0}")]
    Parse(#[from] Box<toml::de::Error>),
    /// The scenario can't be written as TOML (a number that TOML can't hold).
    #[error("scenario: can't be written as TOML: {0}")]
    Serialize(#[from] Box<toml::ser::Error>),
    /// A number is outside of the range in which the model makes sense, or isn't a number.
    #[error("scenario key \"{key}\": got {value}, expected {low} to {high}")]
    OutOfRange {
        /// The key with its table, such as `beacon.rate_hz`.
        key: String,
        /// The value found, in the unit that the key names.
        value: f64,
        /// The least value allowed, same unit.
        low: f64,
        /// The greatest value allowed, same unit.
        high: f64,
    },
    /// A low end lies above its high end.
    #[error("scenario key \"{key}\": got {low}, expected at most {high}, the value of \"{high_key}\"")]
    Reversed {
        /// The key of the low end, with its table.
        key: String,
        /// The key of the high end, with its table.
        high_key: String,
        /// The low end, in the unit that the key names.
        low: f64,
        /// The high end, same unit.
        high: f64,
    },
    /// The numbers are in range one by one, but together ask for more than a log should hold.
    #[error("scenario table \"{table}\": asks for {value:.0} {what}, expected at most {limit:.0}")]
    TooLarge {
        /// The table whose keys ask for it.
        table: String,
        /// What there would be too many of.
        what: &'static str,
        /// How many are asked for.
        value: f64,
        /// How many are allowed.
        limit: f64,
    },
    /// The equations of motion left the range of numbers.
    #[error(
        "scenario table \"climb\": the track isn't finite at {t_s:.3} s; hint: lower the thrust or the drag"
    )]
    Diverged {
        /// Time since release, s.
        t_s: f64,
    },
    /// No family of that name.
    #[error("family \"{name}\": unknown, expected one of {}", crate::simulate::FAMILIES.join(", "))]
    UnknownFamily {
        /// The name asked for.
        name: String,
    },
    /// The log could not be written.
    #[error("simulated log: {0}")]
    Log(#[from] mcap::McapError),
}
