"""Models exported for Mitsuba 3, and what gonio says of them, for mitsuba_plugin.py, which knows nothing of gonio.

    python tests/crosscheck/mitsuba_files.py FOLDER

Directions are exact in single precision, in which Mitsuba takes them.
"""

import json
import sys
import zlib
from pathlib import Path

import numpy as np

from gonio import Geometry, catalogue, export
from gonio.exporting.entry import write
from gonio.exporting.subject import Subject
from gonio.sampling import hemispherical_reflectance

MODELS = {
    "ggx": {"rho_s": 0.8, "rho_d": 0.1, "width": 0.2},
    "gonio-best": {"rho_u": 0.3, "rho_s": 0.4, "rho_dd": 0.1, "rho_f": 0.2, "gamma": 45.0},
    "cauchy-lorentz": {"ks": 0.5, "kdd": 0.1, "kid": 0.05},
    "student-t": {"rho_s": 0.8, "rho_d": 0.1, "width": 0.15},
    "abg": {"A": 0.01, "B": 0.003, "g": 1.8},
    "ward": {"rho_s": 0.4, "rho_d": 0.1, "alpha_x": 0.1, "alpha_y": 0.25},
    "disney": {"scale": 0.5, "clearcoat": 0.05, "roughness": 0.4, "metallic": 0.5},
    "beckmann": {"rho_s": 0.8, "rho_d": 0.1, "m": 0.25},
    "oren-nayar": {"scale": 0.6, "s": 0.4},
    "generalised-harvey-shack": {"scale": 1.0, "sigma": 0.1, "length": 3.0},
    "torrance-sparrow": {"ks": 0.5, "kd": 0.1, "sigma": 0.15},
    "phong": {"ks": 0.3, "kd": 0.1, "n": 40.0},
}
CHANNELS = {
    "R": {"rho_s": 0.8, "rho_d": 0.30, "width": 0.20, "index": 1.5, "extinction": 0.0},
    "G": {"rho_s": 0.7, "rho_d": 0.20, "width": 0.25, "index": 1.6, "extinction": 0.1},
    "B": {"rho_s": 0.6, "rho_d": 0.05, "width": 0.30, "index": 1.7, "extinction": 0.2},
}
WAVELENGTHS = dict(zip(("450.0", "550.0", "650.0"), CHANNELS.values(), strict=True))
PAIRS, FURNACE, STEP = 4000, (0.0, 45.0, 75.0), 1e-4
DRAWN = 400_000
PIXELS, WITHIN, REACH = 48, 24, 1.1  # side of the image, points along the side of a pixel, half width of the view
LIGHT = np.array([0.5, 0.3, 0.8]) / np.linalg.norm([0.5, 0.3, 0.8])


def directions(random, count):
    """Components of unit vectors that single precision holds exactly."""
    z, azimuth = random.uniform(0.02, 1.0, count), random.uniform(0, 2 * np.pi, count)
    sine = np.sqrt(1 - z**2)
    return [c.astype(np.float32).astype(float) for c in (sine * np.cos(azimuth), sine * np.sin(azimuth), z)]


def sphere(model, values):
    """The picture (PIXELS, PIXELS) of a sphere under parallel light of unit irradiance, each pixel a mean over points.

    The camera is on the z axis, far away. The surface's own x axis runs along the circles of latitude.
    """
    picture = np.zeros((PIXELS, PIXELS))
    points = (np.arange(PIXELS * WITHIN) + 0.5) / (PIXELS * WITHIN) * 2 - 1
    for row in range(PIXELS):
        part = points[row * WITHIN : (row + 1) * WITHIN]
        x, y = np.meshgrid(REACH * points, -REACH * part)
        inside = x**2 + y**2 < 1
        x, y = x[inside], y[inside]
        normal = np.stack([x, y, np.sqrt(1 - x**2 - y**2)])
        along = np.stack([-y, x, 0 * x]) / np.hypot(x, y)
        frame = (along, np.cross(normal, along, axis=0), normal)
        w_i, w_r = ([np.einsum("k,kn->n", w, axis) for axis in frame] for w in (LIGHT, np.array([0.0, 0.0, 1.0])))
        value = np.zeros(inside.shape)
        value[inside] = model(Geometry(*w_i, *w_r), values) * np.maximum(w_i[2], 0)
        picture[row] = value.reshape(WITHIN, PIXELS, WITHIN).mean(axis=(0, 2))
    return picture


def slopes(model, values, geometry):
    """Derivatives of the sum of f cos(theta_r) by every parameter, by central differences in double precision."""
    found = {}
    for name, value in values.items():
        step = STEP * max(abs(value), 0.01)
        above, below = (np.sum(model(geometry, values | {name: value + s}) * geometry.z_r) for s in (step, -step))
        found[name] = float((above - below) / (2 * step))
    return found


def expected(model, values, geometry):
    seed = zlib.crc32(model.name.encode())
    estimates = [hemispherical_reflectance(model, values, t, DRAWN, seed=seed + k) for k, t in enumerate(FURNACE)]
    return {
        "f": np.asarray(model(geometry, values)),
        "sphere": sphere(model, values),
        "furnace": np.array([(e.value, e.standard_error) for e in estimates]),
        "slopes": np.array(list(slopes(model, values, geometry).values())),
    }


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(20261130)
    geometry = Geometry(*directions(random, PAIRS), *directions(random, PAIRS))
    arrays = {"directions": np.stack(geometry)}
    about = {}
    for name, given in MODELS.items():
        model = catalogue[name]
        values = dict.fromkeys(model.weights, 0.0) | {n: p.default for n, p in model.shape.items()} | given
        file = f"{name.replace('-', '_')}_mitsuba.py"
        done = export(model, folder / file, to="mitsuba", values=given, force=True)
        about[name] = {"file": file, "values": given, "parameters": list(values), "shares": dict(done.numbers)}
        arrays |= {f"{name} {what}": array for what, array in expected(model, values, geometry).items()}
    for by, sets in (("channel", CHANNELS), ("wavelength", WAVELENGTHS)):
        subject = Subject(catalogue["ggx"], sets, by, origin="values for a check")
        write(subject, folder / f"ggx_{by}_mitsuba.py", "mitsuba", name=f"ggx_{by}", force=True)
        arrays |= {f"{by} {label}": np.asarray(subject.brdf(geometry, label)) for label in sets}
    about |= {"pixels": PIXELS, "reach": REACH, "light": LIGHT.tolist(), "angles": FURNACE}
    np.savez(folder / "expected.npz", **arrays)
    (folder / "expected.json").write_text(json.dumps(about, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
