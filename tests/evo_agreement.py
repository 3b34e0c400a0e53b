"""Position RMSE by evo (`evo_ape tum`, no alignment) of a track in an MCAP against a reference in it.

usage: evo_agreement.py LOG TRACK_TOPIC REFERENCE_TOPIC; prints the RMSE in m. The reference is interpolated to the
track's instants by numpy, and points outside it are left out.
"""

import json
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy
from mcap.reader import make_reader

log, *topics = sys.argv[1:]
rows = {topic: [] for topic in topics}
with open(log, "rb") as stream:
    for _, channel, message in make_reader(stream).iter_messages(topics=topics):
        value = json.loads(message.data)
        stamp = value["timestamp"]
        p = value["position"]
        rows[channel.topic].append((stamp["sec"] * 10**9 + stamp["nsec"], p["x"], p["y"], p["z"]))
track, reference = (sorted(rows[topic]) for topic in topics)
start = track[0][0]
track, reference = (
    numpy.array([[(ns - start) * 1e-9, x, y, z] for ns, x, y, z in series]) for series in (track, reference)
)
inside = (track[:, 0] >= reference[0, 0]) & (track[:, 0] <= reference[-1, 0])
track = track[inside]
met = numpy.column_stack(
    [track[:, 0]] + [numpy.interp(track[:, 0], reference[:, 0], reference[:, axis]) for axis in (1, 2, 3)]
)
with tempfile.TemporaryDirectory() as folder:
    for name, series in (("track", track), ("reference", met)):
        lines = (" ".join(f"{v:.12f}" for v in row) + " 0 0 0 1\n" for row in series)
        Path(folder, name).write_text("".join(lines))
    evo = Path(sys.executable).with_name("evo_ape")
    arguments = ["tum", "reference", "track", "--save_results", "result.zip", "--no_warnings"]
    subprocess.run([evo, *arguments], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    with zipfile.ZipFile(Path(folder, "result.zip")) as result:
        print(repr(json.loads(result.read("stats.json"))["rmse"]))
