//! What a USBL system saw of a dive, in one pass over the log: fixes in whatever shape, the ship, the depth.

use super::SourceError;
use super::gathered::{Gathered, Kind};
use super::load::{Loaded, Readers, SigmaOrigin, lack};
use super::numbers::Numbers;
use crate::config::{AngleUnit, SourceConfig, Usbl};
use crate::estimate::usbl::geometry::{self, Polar};
use crate::estimate::usbl::ship::ShipTrack;
use crate::estimate::usbl::{Height, sigma_at_range};
use crate::log::decode::{MessagePath, Step};
use crate::log::{Log, MessagesRead, passed_over};
use crate::math::robust;
use crate::sample::Sample;
use crate::time::Time;

/// What the fixes are called.
const NAME: &str = "usbl";

/// A dive's samples, and how they were read.
#[derive(Debug)]
pub struct DiveSamples {
    /// The fixes, east, north and up, m.
    pub fixes: Loaded,
    /// The depth sensor's heights.
    pub heights: Vec<Height>,
    /// What the samples' seconds count from: the fixes' median time.
    pub origin: Time,
    /// What a person must read.
    pub warnings: Vec<String>,
    /// How the log was read.
    pub read: MessagesRead,
}

/// Loads the fixes at `path` and what else `usbl` names. Latitudes and longitudes become metres east, north and up of
/// `origin` (degrees and m), by default the first fix or ship's position at altitude 0: z = 0 is then the surface.
///
/// # Errors
/// [`SourceError`] for a path or topic that doesn't fit, for one without a single sample, and for ranges and bearings
/// without a ship.
pub fn load_dive(
    log: &Log,
    path: &str,
    usbl: &Usbl,
    origin: Option<[f64; 3]>,
) -> Result<DiveSamples, SourceError> {
    let index = log.index();
    let common = SourceConfig { datum: true, axes: usbl.axes, ..SourceConfig::default() };
    let mut sources = vec![Gathered::new(&SourceConfig {
        name: NAME.into(),
        position: Some(path.into()),
        time: usbl.time,
        latency_s: usbl.latency_s,
        position_sigma_m: usbl.sigma_m,
        ..common.clone()
    })?];
    sources[0].kind = Kind::Acoustic(usbl.angles);
    if usbl.ship.is_some() {
        let (position, position_sigma_m) = (usbl.ship.clone(), usbl.ship_sigma_m);
        sources.push(Gathered::new(&SourceConfig {
            name: "ship".into(),
            position,
            position_sigma_m,
            ..common
        })?);
    }
    let mut readers = Readers::default();
    for (i, source) in sources.iter().enumerate() {
        readers.add(index, i, source)?;
    }
    let number =
        |name, path: &Option<String>| path.as_deref().map(|path| Numbers::new(index, name, path)).transpose();
    let (mut heading, mut depth) = (number("heading", &usbl.heading)?, number("depth", &usbl.depth)?);
    let mut channels = readers.channels();
    channels.extend([&heading, &depth].into_iter().flatten().flat_map(Numbers::channels));
    let read = log.for_each_message(&channels, |message| {
        readers.read(&message, &mut sources);
        [&mut heading, &mut depth].into_iter().flatten().for_each(|numbers| numbers.read(&message));
        Ok::<(), SourceError>(())
    })?;
    for source in &mut sources {
        if let Some((_, error)) = lack(source, &read.damaged) {
            let has_ship = usbl.ship.is_some() && usbl.heading.is_some();
            let is_unit = matches!(error, SourceError::NoUnit { .. });
            return Err(if is_unit && !has_ship { SourceError::NoShip { path: path.into() } } else { error });
        }
    }

    let is_polar = sources[0].one_kind();
    let time = sources[0].median_time();
    let first = || {
        sources
            .iter()
            .find_map(Gathered::first_fix)
            .map(|[latitude, longitude, _]| [latitude, longitude, 0.0])
    };
    let origin = origin.or_else(first);
    let mut loaded = sources.into_iter().map(|source| source.finish(time, origin));
    let (Some(mut fixes), ship) = (loaded.next(), loaded.next()) else {
        return Err(SourceError::Empty { name: NAME.into(), topic: path.into() });
    };
    let mut warnings = passed_over(&read.damaged);
    let mut numbers = |numbers: Option<Numbers>| {
        let (values, said) = numbers.map_or(Ok((Vec::new(), None)), |n| n.finish(time))?;
        warnings.extend(said);
        Ok::<_, SourceError>(values)
    };
    let (headings, depths) = (numbers(heading)?, numbers(depth)?);
    let unit = usbl.angles.or_else(|| unit_of(usbl.heading.as_deref()?));
    let headings: Vec<(f64, f64)> = match (unit, usbl.heading.as_deref()) {
        (None, Some(path)) if is_polar => {
            return Err(SourceError::NoUnit { name: "heading".into(), path: path.into() });
        }
        (unit, _) => {
            headings.iter().map(|&(t, angle)| (t, unit.map_or(angle, |u| u.radians(angle)))).collect()
        }
    };
    let track = ship.as_ref().map(|ship| ShipTrack {
        positions: &ship.source.positions,
        headings: &headings,
        heading_sigma_rad: usbl.heading_sigma_deg.to_radians(),
    });
    match track {
        Some(track) if is_polar && !headings.is_empty() => warnings.extend(place(&mut fixes, &track, usbl)),
        _ if is_polar => return Err(SourceError::NoShip { path: path.into() }),
        Some(track) if usbl.sigma_of_range > 0.0 => {
            warnings.extend(widen(&mut fixes, &track, usbl.sigma_of_range));
        }
        _ => {}
    }
    if let Some(ship) = ship.filter(|_| is_polar) {
        (fixes.fix_origin, fixes.frame_id) = (ship.fix_origin, ship.frame_id);
    }
    if fixes.source.positions.is_empty() {
        return Err(SourceError::NoShip { path: path.into() });
    }
    let height =
        |&(time_s, depth_m): &(f64, f64)| Height { time_s, z_m: -depth_m, sigma_m: usbl.depth_sigma_m };
    let heights = depths.iter().map(height).collect();
    Ok(DiveSamples { fixes, heights, origin: time, warnings, read })
}

/// The unit that the last field of a path says.
fn unit_of(path: &str) -> Option<AngleUnit> {
    match MessagePath::parse(path).ok()?.steps.last()? {
        Step::Field(name) => AngleUnit::of_name(name),
        _ => None,
    }
}

/// Turns ranges, bearings and depressions into positions; those of instants at which the ship is not known are left out.
fn place(fixes: &mut Loaded, ship: &ShipTrack<'_>, usbl: &Usbl) -> Option<String> {
    let angle = usbl.angle_sigma_deg.to_radians();
    let measured = |raw: &Sample| {
        let [range_m, bearing_rad, depression_rad] = raw.value;
        let seen = Polar { range_m, bearing_rad, depression_rad, sigma: [usbl.range_sigma_m, angle, angle] };
        Some(geometry::fix(raw.time_s, &seen, &ship.at(raw.time_s)?))
    };
    let placed: Vec<Option<Sample>> = fixes.source.positions.iter().map(measured).collect();
    let mut sigmas: Vec<f64> = placed.iter().flatten().flat_map(|fix| fix.sigma).collect();
    let is_default = |usbl: &Usbl| (usbl.range_sigma_m, usbl.angle_sigma_deg, usbl.heading_sigma_deg);
    let stated = is_default(usbl) != is_default(&Usbl::default());
    let from = if stated { SigmaOrigin::Config } else { SigmaOrigin::Assumed };
    fixes.sigma[0] = robust::median(&mut sigmas).map(|sigma| (sigma, from));
    keep(fixes, &placed, "position and heading")
}

/// Adds the noise that grows with the range; fixes of instants at which the ship is not known are left out.
fn widen(fixes: &mut Loaded, ship: &ShipTrack<'_>, share: f64) -> Option<String> {
    let wider = |fix: &Sample| {
        let (from, _) = ship.position_at(fix.time_s)?;
        let range_m = (0..3).map(|i| (fix.value[i] - from[i]).powi(2)).sum::<f64>().sqrt();
        Some(Sample { sigma: fix.sigma.map(|sigma| sigma_at_range(sigma, share, range_m)), ..*fix })
    };
    let wider: Vec<Option<Sample>> = fixes.source.positions.iter().map(wider).collect();
    keep(fixes, &wider, "position")
}

/// Puts `found` in the fixes' place, and says how many there are of which the ship's `what` is not known.
fn keep(fixes: &mut Loaded, found: &[Option<Sample>], what: &str) -> Option<String> {
    let mut kept = found.iter().map(Option::is_some);
    fixes.arrival.retain(|_| kept.next() == Some(true));
    fixes.source.positions = found.iter().flatten().copied().collect();
    let lost = found.len() - fixes.source.positions.len();
    (lost > 0).then(|| {
        format!("{NAME}: {lost} fixes are left out: the ship's {what} at their instants is not known")
    })
}
