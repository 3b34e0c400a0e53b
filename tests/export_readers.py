"""What other tools read of exported tracks; fails where they can't, or where it is not what the CSV says.

usage: export_readers.py FOLDER, which holds track.csv, .parquet, .geojson, .kml and .tum of one track. Prints what
the test holds against the log: JSON.
"""

import json
import sys
from pathlib import Path

import fastkml
import geojson
import numpy
import pandas
import pyarrow.parquet
from evo.tools import file_interface

geojson.geometry.DEFAULT_PRECISION = 12  # it rounds
folder = Path(sys.argv[1])
table = pandas.read_csv(folder / "track.csv")

parquet = pandas.read_parquet(folder / "track.parquet")
assert list(parquet.columns) == list(table.columns), parquet.columns
assert parquet["time_ns"].dtype == "int64"
for column in table.columns:
    if column in ("phase", "method"):
        assert (parquet[column] == table[column]).all(), column
    else:
        numpy.testing.assert_array_equal(parquet[column].isna(), table[column].isna(), column)
        numpy.testing.assert_allclose(parquet[column], table[column], rtol=1e-15, err_msg=column)
metadata = pyarrow.parquet.read_metadata(folder / "track.parquet").metadata
metadata = {key.decode(): value.decode() for key, value in metadata.items()}

trajectory = file_interface.read_tum_trajectory_file(str(folder / "track.tum"))
assert trajectory.check()[0], trajectory.check()
numpy.testing.assert_allclose(trajectory.positions_xyz, table[["x_m", "y_m", "z_m"]], rtol=1e-15)
numpy.testing.assert_allclose(trajectory.timestamps, table["time_ns"] * 1e-9, atol=1e-6)
numpy.testing.assert_array_equal(trajectory.orientations_quat_wxyz, [[1, 0, 0, 0]] * len(table))

features = geojson.loads((folder / "track.geojson").read_text())
assert features.is_valid, features.errors()
lines = [f for f in features["features"] if f["geometry"]["type"] == "LineString"]
marks = [f for f in features["features"] if f["geometry"]["type"] == "Point"]

kml = fastkml.KML.from_string((folder / "track.kml").read_bytes())
(document,) = kml.features
placemarks = document.features
shapes = [(p.name, p.geometry.geom_type, [list(c) for c in p.geometry.coords]) for p in placemarks]
expected = [(f["properties"]["phase"], "LineString", f["geometry"]["coordinates"]) for f in lines]
# what XML can't hold is shown as an escape
names = [f["properties"]["name"].replace("\x01", "\\u{1}") for f in marks]
expected += [(name, "Point", [f["geometry"]["coordinates"]]) for name, f in zip(names, marks, strict=True)]
for shape, wanted in zip(shapes, expected, strict=True):
    assert shape == wanted, (shape[:2], wanted[:2])
assert all(p.kml_geometry.altitude_mode.value == "absolute" for p in placemarks)
styles = {style.id for style in document.styles}
assert all(p.style_url.url.lstrip("#") in styles for p in placemarks[: len(lines)])

json.dump(
    {
        "rows": len(table),
        "metadata": metadata,
        "phases": [f["properties"]["phase"] for f in lines],
        "marks": [f["properties"]["name"] for f in marks],
        "lines": [f["geometry"]["coordinates"] for f in lines],
        "document": document.name,
    },
    sys.stdout,
)
