"""The numbers in `src/math/geodesy.rs` and `tests/cli/fixes.rs`, by an independent library: `pip install pymap3d`."""

import pymap3d

PLACES = [
    ((42.375812, -71.147394667, 7.3), (42.377046167, -71.147322667, -22.5)),
    ((-33.9, 18.4, 0.0), (-33.95, 18.5, 120.0)),
    ((78.2, 15.6, -40.0), (78.3, 15.0, -2000.0)),
    ((0.0, 179.999, 10.0), (0.001, -179.999, 20.0)),
    ((89.9999, 45.0, 0.0), (89.9998, -135.0, 5.0)),
]
for origin, place in PLACES:
    enu = pymap3d.geodetic2enu(*place, *origin)
    print(f"({list(origin)}, {list(place)}, {[float(v) for v in enu]}),")
print([float(v) for v in pymap3d.geodetic2ecef(42.375812, -71.147394667, 7.3)])
for t in (0.5 * k for k in range(13)):
    print([float(v) for v in pymap3d.enu2geodetic(100 + 4 * t, -50 + 3 * t, -2 * t, 59.4, 10.5, 3.0)])
