//! The truth's numbers: two profiles, and what a scenario changes of them.

use serde::{Deserialize, Serialize};

use super::climb::{ClimbConstants, Start};
use super::phases::{Frames, Phases};

/// The shape of a climb: which numbers hold where the scenario gives none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Profile {
    /// Nearly upright: 3.7 s seen, 2 s unseen, about 17 m/s, from about 60 m.
    #[default]
    Steep,
    /// Shallow: 9 s seen, 5 s unseen, about 20 m/s, from about 63 m, over 165 m of ground.
    Oblique,
}

impl Profile {
    /// The profile's spacing of frames, s.
    #[must_use]
    pub fn frame_s(self) -> f64 {
        match self {
            Self::Steep => 0.02,
            Self::Oblique => 0.05,
        }
    }

    /// The profile's constants: of a vehicle with a short strong pulse, and of one with a long weak pulse.
    ///
    /// The modulation's frequency and the surface's force are guesses, held against recordings of another
    /// simulator.
    #[must_use]
    pub fn constants(self) -> ClimbConstants {
        match self {
            Self::Steep => ClimbConstants {
                thrust_m_s2: 10.9,
                ramp_s: 0.30,
                burn_s: 1.85,
                tail_s: 0.45,
                modulation: 0.10,
                modulation_hz: 1.0,
                drag_vertical_per_m: 0.020,
                drag_horizontal_per_m: 0.030,
                buoyancy_m_s2: 0.35,
                tilt_deg: 7.0,
                carrier_m_s: 3.0,
                random_m_s2: 0.35,
                random_low_hz: 0.25,
                random_high_hz: 1.3,
                surface_m_s2: 1.0,
                surface_depth_m: 8.0,
            },
            Self::Oblique => ClimbConstants {
                thrust_m_s2: 5.6,
                ramp_s: 0.8,
                burn_s: 4.6,
                tail_s: 1.1,
                modulation: 0.10,
                modulation_hz: 0.4,
                drag_vertical_per_m: 0.010,
                drag_horizontal_per_m: 0.010,
                buoyancy_m_s2: 0.25,
                tilt_deg: 70.0,
                carrier_m_s: 5.0,
                random_m_s2: 0.20,
                random_low_hz: 0.1,
                random_high_hz: 0.5,
                surface_m_s2: 1.0,
                surface_depth_m: 8.0,
            },
        }
    }
}

/// The truth's numbers; those not given are the profile's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClimbScenario {
    /// The set of defaults.
    pub profile: Profile,
    /// How much the constants vary from seed to seed: 1 for 5 % (one sigma), 0 for not at all.
    pub vary: f64,
    /// The spacing of frames, s; default 0.02 (steep) or 0.05 (oblique).
    pub frame_s: Option<f64>,
    /// Frames seen by the tether alone.
    pub tether_frames: u32,
    /// Frames seen by both.
    pub overlap_frames: u32,
    /// Frames seen by the beacon alone.
    pub beacon_frames: u32,
    /// Frames seen by nobody.
    pub unseen_frames: u32,
    /// Where above 0, a time around T1 that nobody sees, in the overlap's place, s.
    pub gap_s: f64,
    /// The highest point up to T3, m: the depth of release is chosen so.
    pub arrival_z_m: f64,
    /// Z at release, m; overrides `arrival_z_m`.
    pub release_z_m: Option<f64>,
    /// See [`ClimbConstants::thrust_m_s2`].
    pub thrust_m_s2: Option<f64>,
    /// See [`ClimbConstants::ramp_s`].
    pub ramp_s: Option<f64>,
    /// See [`ClimbConstants::burn_s`].
    pub burn_s: Option<f64>,
    /// See [`ClimbConstants::tail_s`].
    pub tail_s: Option<f64>,
    /// See [`ClimbConstants::modulation`].
    pub modulation: Option<f64>,
    /// See [`ClimbConstants::modulation_hz`].
    pub modulation_hz: Option<f64>,
    /// See [`ClimbConstants::drag_vertical_per_m`].
    pub drag_vertical_per_m: Option<f64>,
    /// See [`ClimbConstants::drag_horizontal_per_m`].
    pub drag_horizontal_per_m: Option<f64>,
    /// See [`ClimbConstants::buoyancy_m_s2`].
    pub buoyancy_m_s2: Option<f64>,
    /// See [`ClimbConstants::tilt_deg`].
    pub tilt_deg: Option<f64>,
    /// See [`ClimbConstants::carrier_m_s`].
    pub carrier_m_s: Option<f64>,
    /// See [`ClimbConstants::random_m_s2`].
    pub random_m_s2: Option<f64>,
    /// See [`ClimbConstants::random_low_hz`].
    pub random_low_hz: Option<f64>,
    /// See [`ClimbConstants::random_high_hz`].
    pub random_high_hz: Option<f64>,
    /// See [`ClimbConstants::surface_m_s2`].
    pub surface_m_s2: Option<f64>,
    /// See [`ClimbConstants::surface_depth_m`].
    pub surface_depth_m: Option<f64>,
}

impl Default for ClimbScenario {
    fn default() -> Self {
        Self {
            profile: Profile::Steep,
            vary: 1.0,
            frame_s: None,
            tether_frames: 80,
            overlap_frames: 30,
            beacon_frames: 75,
            unseen_frames: 100,
            gap_s: 0.0,
            arrival_z_m: -0.2,
            release_z_m: None,
            thrust_m_s2: None,
            ramp_s: None,
            burn_s: None,
            tail_s: None,
            modulation: None,
            modulation_hz: None,
            drag_vertical_per_m: None,
            drag_horizontal_per_m: None,
            buoyancy_m_s2: None,
            tilt_deg: None,
            carrier_m_s: None,
            random_m_s2: None,
            random_low_hz: None,
            random_high_hz: None,
            surface_m_s2: None,
            surface_depth_m: None,
        }
    }
}

impl ClimbScenario {
    /// The constants, the profile's where the scenario gives none.
    #[must_use]
    pub fn constants(&self) -> ClimbConstants {
        let profile = self.profile.constants();
        ClimbConstants {
            thrust_m_s2: self.thrust_m_s2.unwrap_or(profile.thrust_m_s2),
            ramp_s: self.ramp_s.unwrap_or(profile.ramp_s),
            burn_s: self.burn_s.unwrap_or(profile.burn_s),
            tail_s: self.tail_s.unwrap_or(profile.tail_s),
            modulation: self.modulation.unwrap_or(profile.modulation),
            modulation_hz: self.modulation_hz.unwrap_or(profile.modulation_hz),
            drag_vertical_per_m: self.drag_vertical_per_m.unwrap_or(profile.drag_vertical_per_m),
            drag_horizontal_per_m: self.drag_horizontal_per_m.unwrap_or(profile.drag_horizontal_per_m),
            buoyancy_m_s2: self.buoyancy_m_s2.unwrap_or(profile.buoyancy_m_s2),
            tilt_deg: self.tilt_deg.unwrap_or(profile.tilt_deg),
            carrier_m_s: self.carrier_m_s.unwrap_or(profile.carrier_m_s),
            random_m_s2: self.random_m_s2.unwrap_or(profile.random_m_s2),
            random_low_hz: self.random_low_hz.unwrap_or(profile.random_low_hz),
            random_high_hz: self.random_high_hz.unwrap_or(profile.random_high_hz),
            surface_m_s2: self.surface_m_s2.unwrap_or(profile.surface_m_s2),
            surface_depth_m: self.surface_depth_m.unwrap_or(profile.surface_depth_m),
        }
    }

    /// The instants that part the climb.
    #[must_use]
    pub fn phases(&self) -> Phases {
        let frames = Frames {
            tether: self.tether_frames,
            overlap: self.overlap_frames,
            beacon: self.beacon_frames,
            unseen: self.unseen_frames,
        };
        Phases::new(&frames, self.frame_s.unwrap_or(self.profile.frame_s()), self.gap_s)
    }

    /// Where the climb begins.
    #[must_use]
    pub fn start(&self) -> Start {
        self.release_z_m.map_or(Start::ToReach { z_m: self.arrival_z_m }, |z_m| Start::At { z_m })
    }
}
