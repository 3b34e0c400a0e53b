//! The trajectory format of the TUM RGB-D benchmark, which `evo` and many others read: a line a point,
//! `timestamp x y z qx qy qz qw`, in s and m.

use std::io::{self, Write};

use super::Exported;

/// Writes the track. The orientation is the identity, since the format wants one and no attitude is known.
///
/// # Errors
/// That of the writer.
pub fn write_tum(exported: Exported<'_>, out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "# timestamp x y z qx qy qz qw; s, m. The orientation is the identity: no attitude is known."
    )?;
    for point in &exported.recorded.track.points {
        let time = point.time.to_string();
        let [x, y, z] = point.state.position;
        writeln!(out, "{} {x} {y} {z} 0 0 0 1", time.trim_end_matches(" s"))?;
    }
    Ok(())
}
