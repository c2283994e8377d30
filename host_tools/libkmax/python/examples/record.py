"""Records a hand at a wall and draws it: record.py [ADDRESS [PICTURE.svg]]"""

import sys
import tempfile

import kmax
import numpy as np

picture = sys.argv[2] if len(sys.argv) > 2 else "wall.svg"
with kmax.Device(sys.argv[1] if len(sys.argv) > 1 else None) as device:
    device.set({"wall.law": "plain", "wall.position": "here - 5 mm", "wall.stiffness": "0.5 N/mm", "wall.damping": 1})
    with device.armed():
        recording = device.record(2)
print(f"{len(recording.time)} samples, {recording.inside.mean():.0%} of them inside the wall, from {recording.source}")

with tempfile.NamedTemporaryFile("w", suffix=".csv") as table:
    columns = np.column_stack([recording.time, recording.position, recording.force])
    np.savetxt(table.name, columns, delimiter=",", header="time_s,position_m,force_n", comments="")
    kmax.run("plot", table.name, "--out", picture)
print(picture)
