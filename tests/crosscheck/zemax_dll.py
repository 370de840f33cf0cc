"""The scatter DLL of OpticStudio outside OpticStudio: a million calls a model, and every model by Windows' compiler.

    python tests/crosscheck/zemax_dll.py     writes tests/reference/peers/zemax-dll.json

Needs gcc and x86_64-w64-mingw32-gcc. Directions are counted in bins against the density that gonio computes, and the
mean of the energies is set beside the reflectance by quadrature. Tests use the same with fewer calls.
"""

import json
import math
import shutil
import subprocess
import sys
import tempfile
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from scipy.stats import chi2

import gonio
from gonio import Geometry, catalogue
from gonio.exporting.mixture import mixture
from gonio.exporting.subject import of_model
from gonio.exporting.targets.c import compiled, compiler
from gonio.exporting.targets.zemax import scattered
from gonio.plausibility import hemispherical_reflectance

RESULTS = Path(__file__).parents[1] / "reference" / "peers" / "zemax-dll.json"
CALLS = 1_000_000
INCIDENCES = (10.0, 40.0, 70.0)
WINDOWS = "x86_64-w64-mingw32-gcc"
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", "-shared", "-static-libgcc")
MODELS = {
    "lambert": {"rho": 0.5},
    "ggx": {"rho_s": 0.8, "rho_d": 0.1, "width": 0.3},
    "beckmann": {"rho_s": 0.8, "rho_d": 0.1, "m": 0.3},
    "student-t": {"rho_s": 0.8, "rho_d": 0.1, "width": 0.3},
    "gonio-best": {"rho_s": 0.3, "rho_u": 0.2, "rho_dd": 0.1, "rho_f": 0.1, "gamma": 45.0},
    "harvey-shack": {"b0": 0.5, "L": 0.2, "S": -2.0},
    "phong": {"ks": 0.3, "kd": 0.2},
    "ward": {"rho_s": 0.3, "rho_d": 0.2},
    "torrance-sparrow": {"ks": 0.3, "kd": 0.2},
    "oren-nayar": {"scale": 0.6},
    "minnaert": {"rho": 0.4},
    "rpv": {"r0": 0.2},
}
EDGES = np.linspace(0, 1, 13), np.linspace(-math.pi, math.pi, 13)  # of the bins in z and azimuth


def specular(theta_i, phi=30.0):
    """The specular ray [unit vector] of light that arrives at theta_i, with the normal z."""
    t, p = math.radians(theta_i), math.radians(phi)
    return np.array([math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)])


def shares(density, ray, each=30):
    """The probability of each bin, by the midpoint rule on each x each cells of it."""
    z, a = (np.linspace(e[0], e[-1], each * (len(e) - 1) + 1) for e in EDGES)
    zz, aa = np.meshgrid((z[1:] + z[:-1]) / 2, (a[1:] + a[:-1]) / 2, indexing="ij")
    sine = np.sqrt(1 - zz**2)
    g = Geometry(-ray[0], -ray[1], ray[2], sine * np.cos(aa), sine * np.sin(aa), zz)
    cells = density(g) * (z[1] - z[0]) * (a[1] - a[0])
    return np.histogram2d(zz.ravel(), aa.ravel(), EDGES, weights=cells.ravel())[0].ravel()


WIDTHS = (("w_x", "w_y"), ("m_x", "m_y"))  # along the grain and across it


def isotropic(model):
    """Weights, and equal widths of a model with a grain: OpticStudio does not say how a surface lies."""
    equal = {across: model.shape[along].default for along, across in WIDTHS if across in model.shape}
    return dict.fromkeys(model.weights, 0.3) | equal


def compared(name, values, library, theta_i, calls):
    """The mean energy with its standard error beside the reflectance, and the p-value of the directions."""
    subject = of_model(catalogue[name], values)
    ray = specular(theta_i)
    directions, energies = scattered(library, np.tile(ray, (calls, 1)), np.arange(calls, dtype=float))
    kept = energies > 0
    azimuth = np.arctan2(directions[kept, 1], directions[kept, 0])
    counts = np.histogram2d(directions[kept, 2], azimuth, EDGES)[0].ravel()
    inside = shares(mixture(subject).density, ray)
    expected, counts = np.append(inside, 1 - inside.sum()) * calls, np.append(counts, np.sum(~kept))
    large = expected > 20
    expected = np.append(expected[large], max(expected[~large].sum(), 1.0))
    counts = np.append(counts[large], counts[~large].sum())
    statistic = np.sum((counts - expected) ** 2 / expected)
    return {
        "mean energy": float(energies.mean()),
        "standard error": float(energies.std() / math.sqrt(calls)),
        "reflectance": hemispherical_reflectance(subject.brdf, theta_i, 400),
        "p": float(chi2.sf(statistic, len(counts) - 1)),
    }


def main():
    folder = Path(tempfile.mkdtemp())
    windows = {}
    for name, model in catalogue.items():
        done = gonio.export(model, folder / f"{name}.c", to="zemax-dll", values=isotropic(model))
        command = [WINDOWS, *STRICT, "-o", str(folder / f"{name}.dll"), str(done.files[0])]
        subprocess.run(command, check=True)
        windows[name] = done.prove().error
    rows = {}
    for name, values in MODELS.items():
        done = gonio.export(catalogue[name], folder / f"{name}.c", to="zemax-dll", values=values, force=True)
        library = compiled(compiler(), done.files[0], folder / f"{name}.so")
        rows[name] = {f"{t:g}": compared(name, values, library, t, CALLS) for t in INCIDENCES}
        print(name, rows[name], flush=True)
    shutil.rmtree(folder)
    versions = {
        c: subprocess.run([c, "-dumpfullversion"], capture_output=True, text=True).stdout.strip()
        for c in ("gcc", WINDOWS)
    }
    about = {
        "compilers": versions,
        "command": "make crosscheck",
        "calls": CALLS,
        "windows": "every model that Windows' compiler takes, and the largest relative error of its energies natively",
        "date": datetime.now(UTC).date().isoformat(),
    }
    RESULTS.write_text(
        json.dumps({"about": about, "windows": windows, "models": rows}, indent=1) + "\n", encoding="utf-8"
    )


if __name__ == "__main__":
    sys.exit(main())
