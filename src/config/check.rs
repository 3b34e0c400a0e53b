//! Every value of a config held to its range.

use super::{Config, ConfigError, Usbl};
use crate::estimate::registration::Kind;

fn range(ok: bool, key: String, value: String, expected: &'static str) -> Result<(), ConfigError> {
    if ok { Ok(()) } else { Err(ConfigError::Range { key, value, expected }) }
}

fn positive(key: &str, value: Option<f64>) -> Result<(), ConfigError> {
    let ok = value.is_none_or(|v| v > 0.0 && v.is_finite());
    range(ok, key.into(), format!("{:?}", value.unwrap_or_default()), "a positive number")
}

impl Config {
    /// Checks every value's range.
    ///
    /// # Errors
    /// [`ConfigError::Range`] for the first that is out of it.
    pub fn check(&self) -> Result<(), ConfigError> {
        let (output, fusion, beyond) = (&self.output, &self.fusion, &self.extrapolation);
        let plain = |c: char| c.is_alphanumeric() || "/_-.".contains(c);
        let prefix = output.prefix();
        let prefix_ok = prefix.starts_with('/') && !prefix.ends_with('/') && prefix.chars().all(plain);
        range(prefix_ok, "output.prefix".into(), format!("{prefix:?}"), "\"/name\"")?;
        positive("output.rate_hz", output.rate_hz)?;
        range(
            output.rate_hz.is_none_or(|r| (0.001..=10_000.0).contains(&r)),
            "output.rate_hz".into(),
            format!("{:?}", output.rate_hz.unwrap_or_default()),
            "0.001 to 10000 Hz",
        )?;
        let origin_ok = |[latitude, longitude, altitude]: [f64; 3]| {
            latitude.abs() <= 90.0 && longitude.abs() <= 360.0 && altitude.is_finite()
        };
        range(
            output.origin.is_none_or(origin_ok),
            "output.origin".into(),
            format!("{:?}", output.origin.unwrap_or_default()),
            "latitude and longitude in degrees, altitude in m",
        )?;
        positive("fusion.knot_spacing_s", fusion.knot_spacing_s)?;
        positive("fusion.bridge_max_s", Some(fusion.bridge_max_s))?;
        let orders = 1..=crate::estimate::polynomial::MAX_ORDER;
        range(orders.contains(&fusion.order), "fusion.order".into(), fusion.order.to_string(), "1 to 48")?;
        range(
            orders.contains(&beyond.order),
            "extrapolation.order".into(),
            beyond.order.to_string(),
            "1 to 48",
        )?;
        range(
            (1..=100_000).contains(&fusion.window_points),
            "fusion.window_points".into(),
            fusion.window_points.to_string(),
            "1 to 100000",
        )?;
        self.usbl.check()?;
        let priors = &self.registration;
        for kind in Kind::ALL {
            let key = format!("registration's {}", kind.name());
            positive(&key, Some(priors.of(kind)))?;
        }
        let horizon_ok = (0.0..=3600.0).contains(&beyond.horizon_s);
        range(horizon_ok, "extrapolation.horizon_s".into(), beyond.horizon_s.to_string(), "0 to 3600 s")?;
        positive("extrapolation.window_s", beyond.window_s)?;
        range(
            beyond.stop_z_m.is_none_or(f64::is_finite),
            "extrapolation.stop_z_m".into(),
            format!("{:?}", beyond.stop_z_m.unwrap_or_default()),
            "a finite number",
        )?;
        for point in &self.characteristic_point {
            let key = format!("characteristic_point {:?}: z_m", point.name);
            range(point.z_m.is_finite(), key, point.z_m.to_string(), "a finite number")?;
        }
        range(
            self.source.len() <= 32,
            "source".into(),
            format!("a list of {}", self.source.len()),
            "at most 32 sources",
        )?;
        let datums = self.source.iter().filter(|s| s.datum).count();
        range(datums <= 1, "source.datum".into(), format!("true for {datums} sources"), "one datum at most")?;
        for (i, source) in self.source.iter().enumerate() {
            let key = |k: &str| format!("source {:?}: {k}", source.name);
            let unique = !source.name.is_empty() && self.source[..i].iter().all(|s| s.name != source.name);
            range(unique, key("name"), format!("{:?}", source.name), "a name of its own")?;
            let measures = source.position.is_some() || source.velocity.is_some();
            range(measures, key("position"), "missing".into(), "a position or a velocity path")?;
            positive(&key("position_sigma_m"), source.position_sigma_m)?;
            positive(&key("velocity_sigma_m_s"), source.velocity_sigma_m_s)?;
            let latency_ok = source.latency_s.abs() <= 3600.0;
            range(latency_ok, key("latency_s"), source.latency_s.to_string(), "-3600 to 3600 s")?;
            let offset_ok = source.offset_m.iter().all(|v| v.is_finite());
            range(offset_ok, key("offset_m"), format!("{:?}", source.offset_m), "three finite numbers")?;
        }
        Ok(())
    }
}

impl Usbl {
    fn check(&self) -> Result<(), ConfigError> {
        for (key, value) in [
            ("usbl.sigma_m", self.sigma_m),
            ("usbl.range_sigma_m", Some(self.range_sigma_m)),
            ("usbl.angle_sigma_deg", Some(self.angle_sigma_deg)),
            ("usbl.heading_sigma_deg", Some(self.heading_sigma_deg)),
            ("usbl.ship_sigma_m", self.ship_sigma_m),
            ("usbl.depth_sigma_m", Some(self.depth_sigma_m)),
            ("usbl.speed_limit_m_s", Some(self.speed_limit_m_s)),
            ("usbl.bridge_max_s", Some(self.bridge_max_s)),
            ("usbl.cycle_s", self.cycle_s),
        ] {
            positive(key, value)?;
        }
        let share = || ("usbl.sigma_of_range".to_owned(), self.sigma_of_range.to_string());
        let ((key, value), ok) = (share(), (0.0..1.0).contains(&self.sigma_of_range));
        range(ok, key, value, "0 to 1")?;
        let ((key, value), ok) = (share(), self.ship.is_some() || self.sigma_of_range == 0.0);
        range(ok, key, value, "0 without `usbl.ship`")?;
        let latency_ok = self.latency_s.is_finite();
        range(latency_ok, "usbl.latency_s".into(), self.latency_s.to_string(), "a finite number")
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn parse(text: &str) -> Result<Config, ConfigError> {
        Config::parse(text, Path::new("trial.toml"))
    }

    #[test]
    fn values_out_of_range_are_named_with_what_was_expected() {
        for (text, part) in [
            ("[output]\nprefix = \"fused\"", "output.prefix is \"fused\", expected \"/name\""),
            ("[output]\nrate_hz = 0.0", "output.rate_hz is 0.0, expected a positive number"),
            ("[output]\nrate_hz = nan", "output.rate_hz is NaN"),
            ("[output]\norigin = [91.0, 0.0, 0.0]", "output.origin is [91.0, 0.0, 0.0], expected latitude"),
            ("[fusion]\norder = 49", "fusion.order is 49, expected 1 to 48"),
            ("[extrapolation]\nhorizon_s = -1.0", "extrapolation.horizon_s is -1"),
            ("[[source]]\nname = \"a\"", "source \"a\": position is missing"),
            (
                "[[source]]\nname = \"a\"\nposition = \"/a.p\"\n[[source]]\nname = \"a\"\nposition = \"/b.p\"",
                "a name of its own",
            ),
            (
                "[[source]]\nname = \"a\"\nposition = \"/a.p\"\nposition_sigma_m = -1.0",
                "position_sigma_m is -1.0",
            ),
            ("[[characteristic_point]]\nname = \"exit\"\nz_m = inf", "z_m is inf"),
            (
                "[registration]\nclock_offset_s = -1.0",
                "registration's clock offset is -1.0, expected a positive number",
            ),
        ] {
            let error = parse(text).expect_err(text).to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
