"""Raysect and Cherab: a material class of plain Python, which draws the directions in which light is followed.

In Raysect's surface frame z is the normal on the side of the ray, s_incoming points to the viewer and s_outgoing to
the light. evaluate_shading gives radiance x f x cosine, which Raysect divides by pdf (optical/material/material.pyx).
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gonio.exporting.frames import isotropic
from gonio.exporting.heading import heading
from gonio.exporting.languages.language import Writer
from gonio.exporting.languages.python import PYTHON
from gonio.exporting.mixture import Mixture, mixture
from gonio.exporting.running import executed
from gonio.exporting.source import proved
from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.exporting.targets.python import lines_of
from gonio.geometry import Geometry
from gonio.symbols.formula import INCIDENCE, NUMBERS, REFLECTION, Formula, density_of, draw_of

FRAME = "Raysect's surface space: z is the normal on the side of the ray, w_i to the light, w_r to the viewer"

_MATERIAL = '''

# the values, and what they give on their own{each}
SETS = [(values, _prepare(values)) for values in {sets}]
{wavelengths}

def _values(s_incoming, s_outgoing):
    """The BRDF [1/sr] of every set, for the directions to the viewer and to the light; 0 where a model is negative."""
    light, view = (s_outgoing.x, s_outgoing.y, s_outgoing.z), (s_incoming.x, s_incoming.y, s_incoming.z)
    return [max(0.0, _reflected(v, pre, _incidence(v, pre, light), light, view)) for v, pre in SETS]


class {name}(ContinuousBSDF):
    """{title}; see the top of the file for what it holds."""

    def pdf(self, s_incoming, s_outgoing, back_face):
        if not s_outgoing.z > 0:
            return 1.0  # Raysect divides by it what evaluate_shading gives, which is nothing
        w = s_incoming.x, s_incoming.y, s_incoming.z, s_outgoing.x, s_outgoing.y, s_outgoing.z
        return {density}

    def sample(self, s_incoming, back_face):
        choice, u, v = uniform(), uniform(), uniform()
        x, y, z = _drawn(choice, s_incoming.x, s_incoming.y, s_incoming.z, u, v)
        return Vector3D(x, y, z) if z > 0 else Vector3D(0.0, 0.0, -1.0)  # light that is lost

    def evaluate_shading(self, world, ray, s_incoming, s_outgoing, w_reflection_origin, *others):
        surface_to_world = others[3]
        if not s_outgoing.z > 0:
            return ray.new_spectrum()
        spectrum = ray.spawn_daughter(w_reflection_origin, s_outgoing.transform(surface_to_world)).trace(world)
        value = {spectral}
        spectrum.samples[:] = np.asarray(spectrum.samples) * value * s_outgoing.z
        return spectrum

    def evaluate_volume(self, spectrum, *others):
        return spectrum

    def bsdf(self, s_incident, s_reflected, wavelength):
        return {one}
'''


def make(subject: Subject, request: Request) -> Made:
    """The content of the file."""
    spectral = subject.by == "wavelength" and len(subject.sets) > 1
    labels = sorted(subject.sets, key=float) if spectral else [subject.label]
    first = subject.one(labels[0]) if spectral else subject
    first.values  # noqa: B018 - refuses several sets that are no wavelengths, with the remedy
    if not isotropic(subject):
        raise ValueError(
            "the surface has a direction of its own, and Raysect turns each surface as it likes: "
            "fit a model without one"
        )
    drawn = mixture(subject)
    lines = lines_of(first, "_surface", arrays=False, docstring=heading(subject, _what(subject, request), frame=FRAME))
    text = "\n".join(lines).replace("\nimport math\n", f"\nimport math\n{_IMPORTS}", 1)
    found = "np.interp({}, WAVELENGTHS, _values({}, {}))" if spectral else "_values({1}, {2})[0]"
    material = _MATERIAL.format(
        name=request.name,
        title=subject.model.title.replace("\\", " ").replace('"', "'"),
        each=", for each wavelength" if spectral else "",
        sets=repr([dict(subject.sets[label]) for label in labels]),
        wavelengths=f"WAVELENGTHS = {[float(label) for label in labels]!r}\n" if spectral else "",
        density=_density(drawn),
        spectral=found.format("spectrum.wavelengths", "s_incoming", "s_outgoing"),
        one=found.format("wavelength", "s_reflected", "s_incident"),
    )
    return Made({request.out.name: "\n".join([text, *_samplers(drawn), material])}, _remarks(subject, drawn))


_IMPORTS = """
import numpy as np
from raysect.core.math.random import uniform
from raysect.optical import Vector3D
from raysect.optical.material import ContinuousBSDF
"""


def _what(subject: Subject, request: Request) -> str:
    return f"{request.name}: {subject.model.title}, as a material of Raysect."


def _remarks(subject: Subject, drawn: Mixture) -> tuple[str, ...]:
    found = ["both sides of a surface reflect alike"]
    if drawn.unsampled:
        found.append(f"{', '.join(drawn.unsampled)}: drawn by the cosine law, so that a narrow lobe is noisy")
    if "positivity" in subject.model.violates:
        found.append("the model can be negative: the material takes 0 there")
    if subject.by == "wavelength" and len(subject.sets) > 1:
        found.append("between the wavelengths of the fit the BRDF is interpolated, and beyond them it stays as it is")
    return tuple(found)


def _density(drawn: Mixture) -> str:
    """The density of the mixture, as an expression."""
    terms = [f"{lobe.share!r} * _density_{k}(*w)" for k, lobe in enumerate(drawn.lobes)]
    return " + ".join([*terms, f"{drawn.cosine!r} * s_outgoing.z / math.pi"])


def _samplers(drawn: Mixture) -> list[str]:
    """Functions that draw each lobe and give its density, and the choice between them."""
    writer, functions = Writer(PYTHON, "_sampled"), list[str]()
    choice, below = [], 0.0
    for k, lobe in enumerate(drawn.lobes):
        shape = drawn.shape(lobe)
        draw = draw_of(lobe.sampler, lobe.term).with_values(shape)
        density = density_of(lobe.sampler, lobe.term).with_values(shape)
        functions += _function(writer, f"_draw_{k}", (*INCIDENCE, *NUMBERS), draw)
        functions += _function(writer, f"_density_{k}", (*INCIDENCE, *REFLECTION), density)
        below += lobe.share
        choice += [f"    if choice < {below!r}:", f"        return _draw_{k}(x_i, y_i, z_i, u, v)"]
    return [*writer.shared(), *functions, "", "", "def _drawn(choice, x_i, y_i, z_i, u, v):", *choice, *_COSINE]


_COSINE = (
    "    radius, azimuth = math.sqrt(u), 2 * math.pi * v",
    "    return radius * math.cos(azimuth), radius * math.sin(azimuth), math.sqrt(1 - u)",
)


def _function(writer: Writer, name: str, arguments: tuple[str, ...], formula: Formula) -> list[str]:
    statements, results = writer.whole(formula)
    body = [f"    {line}" for line in (*statements, f"return {', '.join(results)}")]
    return ["", "", f"def {name}({', '.join(arguments)}):", *body]


class Vector:
    """What the written class needs of Raysect's Vector3D."""

    def __init__(self, x: float, y: float, z: float) -> None:
        self.x, self.y, self.z = x, y, z


class Base:
    """What the written class needs of Raysect's ContinuousBSDF: nothing."""


def loaded(path: Path, uniform: Any = None) -> dict[str, Any]:
    """The names of a written module, with stand-ins for Raysect's classes; uniform: where its numbers come from."""
    modules: Mapping[str, Mapping[str, Any]] = {
        "raysect": {},
        "raysect.core": {},
        "raysect.core.math": {},
        "raysect.core.math.random": {"uniform": uniform},
        "raysect.optical": {"Vector3D": Vector},
        "raysect.optical.material": {"ContinuousBSDF": Base},
    }
    return executed(path, modules)


def check(subject: Subject, request: Request) -> Proof:
    """The BSDF that the written class gives at many pairs of directions; Raysect is not run."""
    material = loaded(request.out)[request.name]()
    label = min(subject.sets, key=float) if len(subject.sets) > 1 else subject.label
    one = subject.one(label) if len(subject.sets) > 1 else subject
    wavelength = float(label) if len(subject.sets) > 1 else 0.0

    def run(geometry: Geometry) -> np.ndarray:
        rows = np.stack(np.broadcast_arrays(*geometry), axis=-1).tolist()
        found = [material.bsdf(Vector(*row[:3]), Vector(*row[3:]), wavelength) for row in rows]
        expected = np.asarray(one.brdf(geometry))
        return np.where(expected < 0, np.where(np.array(found) == 0, expected, found), found)

    how = "Raysect is not run: the class was run with stand-ins for Raysect's own"
    return proved(one, how, run, limit=1e-11)  # powers of math and of NumPy differ for large exponents


RAYSECT = Target(
    name="raysect",
    title="Raysect",
    suffixes=(".py",),
    writes="a material class of plain Python with its samplers, for Raysect and Cherab",
    make=make,
    check=check,
)
