//! What a USBL system saw of a dive, in one pass over the log: fixes in whatever shape, the ship, the depth.

use super::dive_depth::{Beside, beside};
use super::dive_error::DiveError;
use super::dive_ship::{placed, widened};
use super::gathered::{Gathered, Kind};
use super::load::{DIFFERENT_EPOCHS_S, Loaded, Readers, lack};
use super::numbers::{Numbers, Series};
use super::{SourceError, Timing};
use crate::config::{SourceConfig, Usbl};
use crate::estimate::usbl::Height;
use crate::estimate::usbl::geometry::bend_m;
use crate::log::{Log, MessagesRead, passed_over};
use crate::math::robust;
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
    /// How many fixes have a height beside them.
    pub with_height: usize,
    /// Whether heights count from the ellipsoid, and nothing tells where the sea's surface is.
    pub above_ellipsoid: bool,
    /// What the samples' seconds count from: the fixes' median time.
    pub origin: Time,
    /// What a person must read.
    pub warnings: Vec<String>,
    /// How the log was read.
    pub read: MessagesRead,
}

/// Loads the fixes at `path` and what else `usbl` names. Latitudes and longitudes become metres east and north of
/// `origin` (degrees and m), by default the first fix or ship's position at altitude 0, and heights above the level
/// surface through it.
///
/// # Errors
/// [`SourceError`] for a path or topic that doesn't fit, for one without a single sample, and for fixes and a ship or depth
/// that don't fit together.
pub fn load_dive(
    log: &Log,
    path: &str,
    usbl: &Usbl,
    origin: Option<[f64; 3]>,
) -> Result<DiveSamples, SourceError> {
    let index = log.index();
    let common = SourceConfig { datum: true, axes: usbl.axes, time: usbl.time, ..SourceConfig::default() };
    let mut sources = vec![Gathered::new(&SourceConfig {
        name: NAME.into(),
        position: Some(path.into()),
        latency_s: usbl.latency_s,
        position_sigma_m: usbl.sigma_m,
        ..common.clone()
    })?];
    sources[0].kind = Kind::Acoustic(usbl.angles);
    if usbl.ship.is_some() {
        let (position, position_sigma_m) = (usbl.ship.clone(), usbl.ship_sigma_m);
        let config = SourceConfig { name: "ship".into(), position, position_sigma_m, ..common };
        let mut ship = Gathered::new(&config)?;
        ship.kind = Kind::Ship;
        sources.push(ship);
    }
    let mut readers = Readers::default();
    for (i, source) in sources.iter().enumerate() {
        readers.add(index, i, source)?;
    }
    let number = |name, path: &Option<String>| {
        path.as_deref().map(|path| Numbers::new(index, name, path, usbl.time)).transpose()
    };
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
            let is_unit = matches!(error, SourceError::Dive(DiveError::NoUnit { .. }));
            return Err(if is_unit && !has_ship {
                DiveError::NoShip { path: path.into() }.into()
            } else {
                error
            });
        }
    }

    let is_polar = sources[0].one_kind();
    // ranges are seen from the ship, whose height is theirs
    let has_altitudes = sources.get(usize::from(is_polar)).is_some_and(Gathered::has_altitudes);
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
    if let Some(ship) = &ship {
        warnings.extend(ship.warnings.iter().cloned());
        fixes.notes.extend(ship.notes.iter().cloned());
        one_epoch("ship", ship.timing.delay_s, &fixes.timing)?;
    }
    let mut series = |name, numbers: Option<Numbers>| {
        let series = numbers.map_or(Ok(Series::default()), |numbers| numbers.finish(time))?;
        warnings.extend(series.warning);
        if !series.values.is_empty() {
            one_epoch(name, series.delay_s, &fixes.timing)?;
        }
        Ok::<_, SourceError>(series.values)
    };
    let (turns, depths) = (series("heading", heading)?, series("depth", depth)?);
    warnings.extend(match &ship {
        _ if is_polar => placed(&mut fixes, ship.as_ref(), &turns, usbl, time)?,
        Some(ship) if usbl.sigma_of_range > 0.0 => widened(&mut fixes, ship, usbl.sigma_of_range, time)?,
        _ => None,
    });
    if let Some(ship) = ship.filter(|_| is_polar) {
        (fixes.fix_origin, fixes.frame_id) = (ship.fix_origin, ship.frame_id);
    }
    let height =
        |&(time_s, depth_m): &(f64, f64)| Height { time_s, z_m: -depth_m, sigma_m: usbl.depth_sigma_m };
    let heights: Vec<Height> = depths.iter().map(height).collect();
    let beside = if heights.is_empty() { Beside::default() } else { beside(&fixes, &heights, time)? };
    if let (true, true, Some([latitude, longitude, altitude])) = (has_altitudes, beside.is_far, origin) {
        let (offset_m, count) = (beside.offset_m, beside.count);
        let surface = [latitude, longitude, altitude + offset_m];
        return Err(DiveError::SurfaceElsewhere { offset_m, count, surface }.into());
    }
    warnings.extend(beside.warning);
    let above_ellipsoid = has_altitudes && heights.is_empty();
    if above_ellipsoid {
        fixes.notes.push(ABOVE_ELLIPSOID.into());
    }
    fixes.notes.extend(bend(&fixes));
    let with_height = beside.count;
    Ok(DiveSamples { fixes, heights, with_height, above_ellipsoid, origin: time, warnings, read })
}

/// What to know of heights that were altitudes.
const ABOVE_ELLIPSOID: &str = "heights are altitudes, whose zero may be far from the sea's surface: an `origin` in `[output]` \
                               with the surface's altitude puts z = 0 there, and `surface_at_zero = true` says so";

/// An error where the clock of `name`, which log times are `delay_s` behind, is of another epoch than the fixes'.
fn one_epoch(name: &'static str, delay_s: f64, of_fixes: &Timing) -> Result<(), DiveError> {
    let apart_s = (delay_s - of_fixes.delay_s).abs();
    if apart_s > DIFFERENT_EPOCHS_S { Err(DiveError::Epochs { name, apart_s }) } else { Ok(()) }
}

/// A sentence where the sea's level is no plane over the dive.
fn bend(fixes: &Loaded) -> Option<String> {
    let mut far_m: Vec<f64> = fixes.source.positions.iter().map(|p| p.value[0].hypot(p.value[1])).collect();
    let far_m = robust::median(&mut far_m).filter(|_| fixes.fix_origin.is_some())?;
    (bend_m(far_m) > 1.0).then(|| {
        format!(
            "the fixes lie {:.0} km from `origin` in `[output]`: z is the height above the level there, and altitudes in `track_fix` \
             are {:.0} m too high; an origin near the dive mends it",
            far_m / 1000.0,
            bend_m(far_m)
        )
    })
}
