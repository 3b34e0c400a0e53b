//! A scenario file: of a climb or of a dive.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::dive::DiveScenario;
use super::error::SimulateError;
use super::scenario::Scenario;

/// What a scenario file asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum ScenarioFile {
    /// A climb, seen by a tether and a beacon.
    Climb(Box<Scenario>),
    /// A dive, seen by a USBL system: the file has a table `[dive]`.
    Dive(Box<DiveScenario>),
}

impl ScenarioFile {
    /// Reads a scenario file.
    ///
    /// # Errors
    ///
    /// Those of [`Scenario::from_toml`] and [`DiveScenario::from_toml`].
    pub fn from_toml(text: &str) -> Result<Self, SimulateError> {
        let table: toml::Table = toml::from_str(text).map_err(Box::new)?;
        if table.contains_key("dive") {
            Ok(Self::Dive(Box::new(DiveScenario::from_toml(text)?)))
        } else {
            Ok(Self::Climb(Box::new(Scenario::from_toml(text)?)))
        }
    }
}

/// Reads a scenario, whose tables keep their own defaults where they are given in part.
pub(super) fn read<T: Default + Serialize + DeserializeOwned>(text: &str) -> Result<T, SimulateError> {
    // Strictly and from the text first, so that what is wrong is named with its line.
    toml::from_str::<T>(text).map_err(Box::new)?;
    let mut keys = toml::Table::try_from(T::default()).map_err(Box::new)?;
    overlay(&mut keys, toml::from_str(text).map_err(Box::new)?);
    Ok(keys.try_into().map_err(Box::new)?)
}

/// Puts the keys of `top` over those of `base`, table by table.
fn overlay(base: &mut toml::Table, top: toml::Table) {
    for (key, value) in top {
        match (base.get_mut(&key), value) {
            (Some(toml::Value::Table(base)), toml::Value::Table(top)) => overlay(base, top),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}
