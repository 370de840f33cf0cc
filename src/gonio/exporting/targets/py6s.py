"""Py6S: the ground reflectance of 6S, by its own model where it has this one, else by tables for a geometry.

6S states reflectance factors, pi f. What it computes of its parameters is read in its subroutines rahmbrdf, modisbrdf,
minnbrdf and hapkbrdf; the order of its tables in its main program and in Py6S's GroundReflectance.
"""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from gonio.exporting.frames import isotropic
from gonio.exporting.heading import heading
from gonio.exporting.running import executed
from gonio.exporting.source import DOUBLE, proved
from gonio.exporting.subject import Subject, Values
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.exporting.targets.python import lines_of
from gonio.geometry import Geometry
from gonio.model import Model
from gonio.models.hapke1981 import hapke
from gonio.models.lambert import lambert
from gonio.models.minnaert1941 import minnaert
from gonio.models.rahman1993 import rpv
from gonio.models.wanner1995 import ross_li
from gonio.plausibility import bihemispherical_reflectance

Call = tuple[str, tuple[float, ...]]
ZENITHS = (*range(0, 81, 10), 85)  # deg
AZIMUTHS = tuple(range(0, 361, 30))  # deg
SAME = 1e-9  # relative difference of numbers that 6S takes as one

QUANTITY = "6S's reflectance factor, pi f, where f is the BRDF in 1/sr without the cosine"
FRAME = "angles in degrees from the vertical; equal azimuths of sun and viewer are backscatter"
DECIMALS = "Py6S hands 6S six decimals of each number"
CLAMPED = "some versions of 6S take 75 deg for a larger zenith of the sun, and 65 deg for one of the viewer"
COARSE = (
    "6S has tables every 10 deg of zenith and 30 deg of azimuth, of five decimals, and interpolates between them; "
    "table_error is the relative rms of linear interpolation, at random directions up to 85 deg"
)


def own_model(subject: Subject) -> Call | None:
    """The method of Py6S's GroundReflectance that is this model, with its numbers; None where it has none."""
    find = _OWN.get(subject.model)
    return find(subject.values) if find else None


def _lambert(v: Values) -> Call | None:
    return ("HomogeneousLambertian", (v["rho"],)) if v["rho"] >= 0 else None  # below 0 are codes of built-in spectra


def _ross_li(v: Values) -> Call:
    return "HomogeneousMODISBRDF", (v["fiso"], v["fvol"], v["fgeo"])


def _minnaert(v: Values) -> Call:
    return "HomogeneousMinnaert", (v["k"], v["rho"])


def _rpv(v: Values) -> Call | None:
    """6S takes r0 for the hot spot too."""
    same = math.isclose(v["r0"], v["rc"], rel_tol=SAME)
    return ("HomogeneousRahman", (v["r0"], v["theta"], v["k"])) if same else None


def _hapke(v: Values) -> Call | None:
    """6S has one lobe of the phase function, and states the surge at opposition over w P(0)."""
    lobe = -v["b"] if v["c"] == 1 or v["b"] == 0 else v["b"] if v["c"] == -1 else None
    if lobe is None or v["w"] == 0 or not math.isclose(v["scale"], 1.0, rel_tol=SAME):
        return None
    return "HomogeneousHapke", (v["w"], lobe, v["b0"] * v["w"] * _towards_light(lobe), v["h"])


def _towards_light(asymmetry: float) -> float:
    """6S's phase function at opposition."""
    return (1 - asymmetry**2) / (1 + asymmetry) ** 3


_OWN: Mapping[Model, Callable[[Values], Call | None]] = {
    lambert: _lambert,
    ross_li: _ross_li,
    minnaert: _minnaert,
    rpv: _rpv,
    hapke: _hapke,
}

_TABLES = '''

# bihemispherical reflectance, under uniform light
ALBEDO = {albedo!r}
ZENITHS = np.array({zeniths})
AZIMUTHS = np.array({azimuths})


def factor(solar_z, view_z, azimuth):
    """Reflectance factor pi f; zeniths and the azimuth between sun and viewer in degrees, which broadcast."""
    z_i, z_r, phi = (np.radians(np.asarray(a, dtype=float)) for a in np.broadcast_arrays(solar_z, view_z, azimuth))
    light = np.stack([np.sin(z_i), 0 * z_i, np.cos(z_i)], axis=-1)
    view = np.stack([np.sin(z_r) * np.cos(phi), np.sin(z_r) * np.sin(phi), np.cos(z_r)], axis=-1)
    return np.pi * _surface(light, view)


def {name}(solar_z, solar_a, view_z, view_a):
    """Py6S's ground reflectance for the geometry of your scene, whose angles Py6S has in degrees."""
    # 6S reads a line for each azimuth, with the zeniths in it: shape (13, 10)
    tables = [factor(zenith, ZENITHS, AZIMUTHS[:, None]) for zenith in (solar_z, view_z)]
    observed = float(factor(solar_z, view_z, view_a - solar_a))
    return GroundReflectance.HomogeneousUserDefined(observed, ALBEDO, *tables)
'''


def make(subject: Subject, request: Request) -> Made:
    """A module that gives the ground reflectance, or a function of the geometry that gives it."""
    what = f"{request.name}: {subject.model.title}, as a ground reflectance of Py6S."
    told = heading(subject, what, quantity=QUANTITY, frame=FRAME)
    if found := own_model(subject):
        method, numbers = found
        comment = [f"# {line}".rstrip() for line in told]
        call = f"{request.name} = GroundReflectance.{method}({', '.join(map(repr, numbers))})"
        lines = [*comment, "", "from Py6S import GroundReflectance", "", call, ""]
        return Made(
            {request.out.name: "\n".join(lines)}, (DECIMALS, CLAMPED) if subject.model is ross_li else (DECIMALS,)
        )
    return _tabulated(subject, request, told)


def _tabulated(subject: Subject, request: Request, told: list[str]) -> Made:
    if not isotropic(subject):
        raise ValueError(
            "the surface has a direction of its own, and 6S knows the azimuth between sun and viewer alone: fit a "
            "model without one"
        )
    error = table_error(subject)
    if error > request.worst:
        raise ValueError(
            f"6S's tables, every 10 deg of zenith and 30 deg of azimuth, miss this lobe by {error:.2g} (relative rms), "
            f"more than {request.worst:g}: fit rpv, ross-li or minnaert, or allow more by --worst"
        )
    albedo = float(bihemispherical_reflectance(lambda g: np.asarray(subject.brdf(g))))
    if albedo > 1:
        raise ValueError(
            f"the surface reflects {albedo:.3g} times what arrives, and 6S takes 1 at most: check the scale"
        )
    tables = _TABLES.format(name=request.name, albedo=albedo, zeniths=list(ZENITHS), azimuths=list(AZIMUTHS))
    lines = lines_of(subject, "_surface", arrays=True, docstring=told)
    text = "\n".join(lines).replace(
        "import numpy as np\n", "import numpy as np\nfrom Py6S import GroundReflectance\n", 1
    )
    return Made({request.out.name: text + "\n" + tables}, (COARSE,), {"table_error": error, "albedo": albedo})


def table_error(subject: Subject, n: int = 4000) -> float:
    """Relative rms error of linear interpolation in a table, at `n` random directions for each of four suns."""
    random = np.random.default_rng(6)
    azimuth, cos = random.uniform(0, 360, n), random.uniform(math.cos(math.radians(85)), 1, n)
    zenith = np.degrees(np.arccos(cos))
    errors = []
    for sun in (10.0, 30.0, 50.0, 70.0):
        nodes = np.meshgrid(ZENITHS, AZIMUTHS, indexing="ij")
        table = _brdf(subject, sun, *nodes)
        found = RegularGridInterpolator((ZENITHS, AZIMUTHS), table)(np.stack([zenith, azimuth], axis=-1))
        errors.append(found / _brdf(subject, sun, zenith, azimuth) - 1)
    return float(np.sqrt(np.mean(np.square(errors))))


def _brdf(subject: Subject, sun: float, zenith: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    return np.asarray(subject.brdf(Geometry.from_degrees(np.full(np.shape(zenith), sun), zenith, azimuth)))


def check(subject: Subject, request: Request) -> Proof:
    """What the written file hands to Py6S, of which a stand-in keeps the arguments; 6S is not run."""
    module = loaded(request.out)
    how = "6S is not run: what the file hands to Py6S was computed anew"
    if found := own_model(subject):
        wrong = module[request.name] != found
        return Proof(how, math.inf if wrong else 0.0, DOUBLE)

    def run(geometry: Geometry) -> np.ndarray:
        vectors = np.stack(np.broadcast_arrays(*geometry), axis=-1)
        return np.asarray(module["_surface"](vectors[..., :3], vectors[..., 3:]))

    return proved(subject, how, run)


def loaded(path: Path) -> dict[str, Any]:
    """The names of a written module, with a stand-in for Py6S that returns each method's name and arguments."""

    class Calls:
        def __getattr__(self, name: str) -> Callable[..., tuple[str, tuple[Any, ...]]]:
            return lambda *arguments: (name, arguments)

    return executed(path, {"Py6S": {"GroundReflectance": Calls()}})


PY6S = Target(
    name="py6s",
    title="Py6S",
    suffixes=(".py",),
    writes="a GroundReflectance for 6S: its own model where it has this one, else tables for a geometry",
    make=make,
    check=check,
)
