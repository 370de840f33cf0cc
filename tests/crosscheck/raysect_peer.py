"""Exported materials in Raysect, for tests/exporting/test_radio_peers.py. Knows nothing of gonio.

    python tests/crosscheck/raysect_peer.py FOLDER     writes tests/reference/peers/raysect_export.json

FOLDER is what export_files.py wrote. A box of the material stands in a sphere that emits uniformly, so that a ray at
theta to its normal sees the hemispherical-directional reflectance; every class gives its BRDF at pairs of directions.
"""

import importlib.metadata
import json
import math
import runpy
import sys
from pathlib import Path

import numpy as np
from peers import write
from raysect.core.math.random import seed
from raysect.optical import ConstantSF, Point3D, Ray, Vector3D, World
from raysect.optical.material import UniformSurfaceEmitter
from raysect.primitive import Box, Sphere

SEED = 19
RAYS = 20_000
ANGLES = (1.0, 40.0, 70.0)


def reflectance(material, theta):
    """Mean radiance that a ray at theta [deg] sees of the box, and its standard error."""
    world = World()
    Sphere(50.0, parent=world, material=UniformSurfaceEmitter(ConstantSF(1.0)))
    Box(Point3D(-5, -5, -1), Point3D(5, 5, 0), parent=world, material=material)
    angle = math.radians(theta)
    away = Vector3D(math.sin(angle), 0, math.cos(angle))
    found = np.empty(RAYS)
    for k in range(RAYS):
        ray = Ray(
            origin=Point3D(0, 0, 0) + away * 3,
            direction=-away,
            min_wavelength=500,
            max_wavelength=510,
            bins=1,
            extinction_prob=0.0,
            importance_sampling=False,
        )
        found[k] = ray.trace(world).samples[0]
    return float(found.mean()), float(found.std(ddof=1) / math.sqrt(RAYS))


def main(folder):
    pairs = json.loads((folder / "pairs.json").read_text())
    columns, surfaces = {}, {}
    for path in sorted(folder.glob("*.py")):
        name = path.stem.replace("-", "_")
        material = runpy.run_path(str(path))[name]()
        found = [material.bsdf(Vector3D(*p["light"]), Vector3D(*v), 500.0) for p in pairs for v in p["views"]]
        columns[path.stem] = [float(f"{value:.9g}") for value in found]
        seed(SEED)
        rows = [reflectance(material, theta) for theta in ANGLES]
        surfaces[path.stem] = {
            "theta": list(ANGLES),
            "reflectance": [round(mean, 7) for mean, _ in rows],
            "standard_error": [round(error, 7) for _, error in rows],
        }
    about = {
        "peer": "Raysect",
        "version": importlib.metadata.version("raysect"),
        "seed": SEED,
        "rays": RAYS,
        "value": "f [1/sr] of the class; reflectance: radiance of a box in a sphere of radiance 1, by so many rays",
    }
    write("raysect_export.json", about, {"pairs": pairs} | columns, surfaces)


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
