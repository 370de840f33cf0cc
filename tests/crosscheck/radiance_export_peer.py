"""Exported materials in Radiance's rtrace, for tests/exporting/test_radio_peers.py. Knows nothing of gonio.

    python tests/crosscheck/radiance_export_peer.py FOLDER     writes tests/reference/peers/radiance_export.json

FOLDER is what export_files.py wrote: materials, and the pairs of directions in the frame of the surface. Each is asked
on one polygon, which is tilted, from its front and from its back, under one small source.
"""

import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyradiance
from peers import write

ROOT = Path(pyradiance.__file__).parent
HALF_ANGLE = 0.005  # deg; Radiance widens its own lobes by the solid angle of the source, here by 2e-9
DIGITS = 8
NORMAL = np.array([0.36, -0.48, -0.8])  # of the polygon


def frame(normal, along=(1.0, 0.0, 0.0)):
    """The surface's axes as columns: x is the projection of a vector, as an exported material has it."""
    x = np.array(along) - np.dot(along, normal) * normal
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(normal, x), normal], axis=1)


def polygon(axes, side):
    """Four corners, counter-clockwise about the normal, or about its opposite where the back is asked."""
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    points = [axes[:, 0] * a + axes[:, 1] * b for a, b in (corners if side == "front" else corners[::-1])]
    return "12 " + " ".join(f"{v:.17g}" for p in points for v in p)


def run(folder, command, *arguments, data=b""):
    environment = os.environ | {"RAYPATH": f"{folder}:{ROOT / 'lib'}"}
    found = subprocess.run(
        [ROOT / "bin" / command, *arguments],
        input=data,
        stdout=subprocess.PIPE,
        check=True,
        cwd=folder,
        env=environment,
    )
    return found.stdout


def values(folder, material, name, light, views, side):
    """BRDF [1/sr] by channel for one direction to the light and many to the viewer, in the frame of the surface."""
    axes = frame(NORMAL)
    sun = axes @ np.array(light)
    level = 1 / (2 * math.pi * (1 - math.cos(math.radians(HALF_ANGLE))))
    scene = (
        f"void light lamp 0 0 3 {level:.17g} {level:.17g} {level:.17g}\n"
        f"lamp source sun 0 0 4 {sun[0]:.17g} {sun[1]:.17g} {sun[2]:.17g} {2 * HALF_ANGLE}\n"
        f"{material}\n{name} polygon plate 0 0 {polygon(axes, side)}\n"
    )
    towards = [axes @ np.array(view) for view in views]
    rays = "".join(f"{row(5 * v)} {row(-v)}\n" for v in towards)
    options = ["-h", "-w", "-fad", "-ab", "0", "-dj", "0", "-ds", "0", "-dt", "0", "-dc", "1", "-lr", "0"]
    with tempfile.TemporaryDirectory() as made:
        octree = Path(made) / "scene.oct"
        (Path(made) / "scene.rad").write_text(scene)
        octree.write_bytes(run(folder, "oconv", Path(made) / "scene.rad"))
        found = np.frombuffer(run(folder, "rtrace", *options, octree, data=rays.encode())).reshape(-1, 3)
    return found / light[2]


def without_heading(text):
    """The file without its comments, which name the day."""
    return "\n".join(line for line in text.rpartition("}\n")[2].splitlines() if line and not line.startswith("#"))


def row(vector):
    return " ".join(f"{v:.17g}" for v in vector)


def main(folder):
    pairs = json.loads((folder / "pairs.json").read_text())
    columns = {}
    for path in sorted(folder.glob("*.rad")):
        text = path.read_text(encoding="utf-8")
        name = text[text.index("\nvoid ") :].split()[2]
        for side in ("front", "back"):
            rows = [values(folder, text, name, p["light"], p["views"], side) for p in pairs]
            three = np.concatenate(rows)
            for k, channel in enumerate("RGB" if np.any(three != three[:, :1]) else " "):
                label = " ".join([path.stem, side, channel]).strip()
                columns[label] = [float(f"{v:.{DIGITS}g}") for v in three[:, k]]
    about = {
        "peer": "Radiance, by pyradiance",
        "version": pyradiance.__version__,
        "precision": "colours in single precision",
        "value": "f [1/sr]: radiance of a polygon of normal 0.36, -0.48, -0.8 under one source, over the cosine",
    }
    surfaces = {
        p.name: {"file": without_heading(p.read_text(encoding="utf-8"))} for p in sorted(folder.glob("*.[rc]a[dl]"))
    }
    write("radiance_export.json", about, {"pairs": pairs} | columns, surfaces)


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
