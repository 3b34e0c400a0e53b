//! What the ship's track adds to fixes: places for ranges and bearings, and noise that grows with the range.

use super::dive_error::{DiveError, Span};
use super::load::{Loaded, SigmaOrigin};
use crate::config::{AngleUnit, Usbl};
use crate::estimate::usbl::geometry::{self, Polar};
use crate::estimate::usbl::ship::{MOST_GAP_S, ShipTrack};
use crate::estimate::usbl::sigma_at_range;
use crate::log::decode::{MessagePath, Step};
use crate::math::robust;
use crate::sample::Sample;
use crate::time::Time;

/// Turns ranges, bearings and depressions into positions seen from `ship`, whose headings are `turns` as they were read; a
/// sentence where some are left out. Times count from `origin`.
///
/// # Errors
/// [`DiveError::NoShip`] without a ship or a heading; those of [`headings`] and [`place`].
pub(super) fn placed(
    fixes: &mut Loaded,
    ship: Option<&Loaded>,
    turns: &[(f64, f64)],
    usbl: &Usbl,
    origin: Time,
) -> Result<Option<String>, DiveError> {
    let (Some(ship), Some(path)) = (ship, &usbl.heading) else {
        return Err(DiveError::NoShip { path: fixes.config.position.clone().unwrap_or_default() });
    };
    let headings = headings(path, turns, usbl.angles)?;
    let ([range_m, angle_rad, heading_sigma_rad], stated) = usbl.polar_sigmas();
    let track = ShipTrack { positions: &ship.source.positions, headings: &headings, heading_sigma_rad };
    place(fixes, &track, [range_m, angle_rad, angle_rad], stated, origin)
}

/// Adds the noise that grows with the range from `ship`: see [`widen`].
///
/// # Errors
/// [`DiveError::OtherFrame`]; those of [`widen`].
pub(super) fn widened(
    fixes: &mut Loaded,
    ship: &Loaded,
    share: f64,
    origin: Time,
) -> Result<Option<String>, DiveError> {
    let fixes_are_places = fixes.fix_origin.is_some();
    if fixes_are_places != ship.fix_origin.is_some() {
        return Err(DiveError::OtherFrame { fixes_are_places });
    }
    let track = ShipTrack { positions: &ship.source.positions, headings: &[], heading_sigma_rad: 0.0 };
    widen(fixes, &track, share, origin)
}

/// Headings by time in radians; `angles` is the unit where the field's name doesn't say one.
///
/// # Errors
/// [`DiveError::NoUnit`]; [`DiveError::NotAngles`] where one of them is more than a turn.
fn headings(
    path: &str,
    values: &[(f64, f64)],
    angles: Option<AngleUnit>,
) -> Result<Vec<(f64, f64)>, DiveError> {
    /// A turn that was not wrapped at once, rad.
    const MOST_RAD: f64 = 6.5;
    let of_name = || match MessagePath::parse(path).ok()?.steps.last()? {
        Step::Field(name) => AngleUnit::of_name(name),
        _ => None,
    };
    let (name, path) = ("heading".to_owned(), path.to_owned());
    let Some(unit) = of_name().or(angles) else {
        return Err(DiveError::NoUnit { name, path });
    };
    let turned: Vec<(f64, f64)> = values.iter().map(|&(t, angle)| (t, unit.radians(angle))).collect();
    match turned.iter().filter(|(_, angle)| angle.abs() > MOST_RAD).count() {
        0 => Ok(turned),
        beyond => Err(DiveError::NotAngles { name, path, beyond, count: turned.len() }),
    }
}

/// Turns ranges, bearings and depressions into positions; those of instants at which the ship is not known are left out,
/// with a sentence. `sigma` is that of ranges, m, bearings and depressions, rad, and `stated` by the config or not. Times
/// count from `origin`.
///
/// # Errors
/// [`DiveError::ShipElsewhere`] where none is left.
fn place(
    fixes: &mut Loaded,
    ship: &ShipTrack<'_>,
    sigma: [f64; 3],
    stated: bool,
    origin: Time,
) -> Result<Option<String>, DiveError> {
    let measured = |raw: &Sample| {
        let [range_m, bearing_rad, depression_rad] = raw.value;
        let seen = Polar { range_m, bearing_rad, depression_rad, sigma };
        Some(geometry::fix(raw.time_s, &seen, &ship.at(raw.time_s)?))
    };
    let placed: Vec<Option<Sample>> = fixes.source.positions.iter().map(measured).collect();
    let (count, known) = (placed.len(), placed.iter().flatten().count());
    let times = (Span::of(origin, ship.positions.iter().map(|p| p.time_s)), headings_span(ship, origin));
    if known == 0 {
        let fixes = span(fixes, origin);
        let ship = vec![("positions", times.0), ("headings", times.1)];
        let (what, most_gap_s) = ("position and heading", MOST_GAP_S);
        return Err(DiveError::ShipElsewhere { what, fixes, ship, most_gap_s });
    }
    let mut kept = placed.iter().map(Option::is_some);
    fixes.arrival.retain(|_| kept.next() == Some(true));
    fixes.source.positions = placed.iter().flatten().copied().collect();
    let from = if stated { SigmaOrigin::Config } else { SigmaOrigin::Assumed };
    fixes.sigma[0] = median_sigma(fixes).map(|sigma| (sigma, from));
    let lost = count - known;
    Ok((lost > 0).then(|| {
        format!(
            "usbl: {lost} of {count} fixes are left out: the ship's position and heading about them are not known, or more \
             than {MOST_GAP_S:.0} s apart (positions {}; headings {})",
            times.0, times.1
        )
    }))
}

/// Adds the noise that grows with the range, which is taken for the usual one where the ship is not known; a sentence
/// where it is not.
///
/// # Errors
/// [`DiveError::ShipElsewhere`] where it is known at no fix.
fn widen(
    fixes: &mut Loaded,
    ship: &ShipTrack<'_>,
    share: f64,
    origin: Time,
) -> Result<Option<String>, DiveError> {
    if !fixes.sigma[0].is_some_and(|(_, from)| from.is_stated()) {
        return Ok(Some(
            "usbl: `sigma_of_range` is not used: it adds to the noise nearby, which `sigma_m` in `[usbl]` states".into(),
        ));
    }
    let range_m = |fix: &Sample| {
        let (from, _) = ship.position_at(fix.time_s)?;
        Some((0..3).map(|i| (fix.value[i] - from[i]).powi(2)).sum::<f64>().sqrt())
    };
    let ranges_m: Vec<Option<f64>> = fixes.source.positions.iter().map(range_m).collect();
    let mut known: Vec<f64> = ranges_m.iter().flatten().copied().collect();
    let (count, lost) = (ranges_m.len(), ranges_m.len() - known.len());
    let positions = Span::of(origin, ship.positions.iter().map(|p| p.time_s));
    let Some(usual_m) = robust::median(&mut known) else {
        let (fixes, ship) = (span(fixes, origin), vec![("ship's positions", positions)]);
        return Err(DiveError::ShipElsewhere { what: "position", fixes, ship, most_gap_s: MOST_GAP_S });
    };
    for (fix, range_m) in fixes.source.positions.iter_mut().zip(ranges_m) {
        fix.sigma = fix.sigma.map(|sigma| sigma_at_range(sigma, share, range_m.unwrap_or(usual_m)));
    }
    if let (Some(sigma), Some((_, from))) = (median_sigma(fixes), fixes.sigma[0]) {
        fixes.sigma[0] = Some((sigma, from));
    }
    Ok((lost > 0).then(|| {
        format!(
            "usbl: the noise of {lost} of {count} fixes is that of the usual range, {usual_m:.0} m: the ship's positions about \
             them are not known, or more than {MOST_GAP_S:.0} s apart ({positions})"
        )
    }))
}

/// When there are fixes.
pub(super) fn span(fixes: &Loaded, origin: Time) -> Span {
    Span::of(origin, fixes.source.positions.iter().map(|fix| fix.time_s))
}

fn headings_span(ship: &ShipTrack<'_>, origin: Time) -> Span {
    Span::of(origin, ship.headings.iter().map(|(time_s, _)| *time_s))
}

fn median_sigma(fixes: &Loaded) -> Option<f64> {
    let mut sigmas: Vec<f64> = fixes.source.positions.iter().flat_map(|fix| fix.sigma).collect();
    robust::median(&mut sigmas)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SourceConfig;
    use crate::sample::Source;
    use crate::source::Timing;

    #[test]
    fn a_headings_name_says_its_unit_before_the_config_does() {
        let read = |path, angle, angles| headings(path, &[(0.0, angle)], angles).map(|h| h[0].1);
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!(read("/ship.heading_rad", quarter, Some(AngleUnit::Degrees)).is_ok_and(|h| h == quarter));
        assert!(read("/ship.heading_deg", 90.0, Some(AngleUnit::Radians)).is_ok_and(|h| h == quarter));
        assert!(read("/ship.heading", 90.0, Some(AngleUnit::Degrees)).is_ok_and(|h| h == quarter));
        assert!(matches!(read("/ship.heading", 1.0, None), Err(DiveError::NoUnit { .. })));
    }

    #[test]
    fn degrees_are_no_headings_in_radians() {
        let found = headings("/ship.heading", &[(0.0, 1.0), (1.0, 90.0)], Some(AngleUnit::Radians));
        assert!(matches!(found, Err(DiveError::NotAngles { beyond: 1, count: 2, .. })), "{found:?}");
    }

    fn loaded(sigma: SigmaOrigin) -> Loaded {
        let fix = |time_s: f64| Sample { time_s, value: [0.0, 0.0, -1000.0], sigma: [1.0; 3] };
        let source = Source { positions: [0.0, 1.0, 90.0].map(fix).into(), ..Source::default() };
        Loaded {
            config: SourceConfig::default(),
            source,
            frame_id: String::new(),
            fix_origin: None,
            timing: Timing { clock: "stamp".into(), delay_s: 0.0, delay_spread_s: 0.0, delay_growth_s: 0.0 },
            arrival: vec![0, 1, 2],
            sigma: [Some((1.0, sigma)), None],
            notes: Vec::new(),
            warnings: Vec::new(),
        }
    }

    #[test]
    fn a_fix_without_a_ship_keeps_the_noise_of_the_usual_range_and_the_median_is_the_widened_one() {
        let positions = [0.0, 1.0].map(|time_s| Sample { time_s, value: [0.0; 3], sigma: [1.0; 3] });
        let ship = ShipTrack { positions: &positions, headings: &[], heading_sigma_rad: 0.0 };
        let mut fixes = loaded(SigmaOrigin::Config);
        let said = widen(&mut fixes, &ship, 0.005, Time::from_ns(0)).expect("a ship");
        assert!(said.is_some_and(|said| said.contains("1 of 3 fixes")));
        let expected = 1.0_f64.hypot(5.0);
        assert!(fixes.source.positions.iter().all(|fix| (fix.sigma[0] - expected).abs() < 1e-12));
        assert!(fixes.sigma[0].is_some_and(|(sigma, _)| (sigma - expected).abs() < 1e-12));
        // what nobody stated is not widened, and that is told
        let mut fixes = loaded(SigmaOrigin::Estimated);
        let said = widen(&mut fixes, &ship, 0.005, Time::from_ns(0)).expect("a ship");
        assert!(
            said.is_some_and(|said| said.contains("`sigma_m`"))
                && fixes.source.positions[0].sigma == [1.0; 3]
        );
    }
}
