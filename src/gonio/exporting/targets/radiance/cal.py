"""The function file of a BRTDfunc: the model's formula, and the frame in which Radiance's vectors are put."""

import re
from typing import Any

import numpy as np

from gonio.exporting.frames import isotropic
from gonio.exporting.heading import heading
from gonio.exporting.languages.language import Writer
from gonio.exporting.languages.radiance import CAL
from gonio.exporting.running import executed
from gonio.exporting.subject import Subject
from gonio.files import temporary_folder
from gonio.geometry import Geometry
from gonio.optics.diffuse import lambertian
from gonio.symbols.formula import INCIDENCE, REFLECTION, Formula, formula_of

TABLE = "radiance-xml"  # the target for Radiance's BSDF tables
LOOPS = frozenset({"sum", "table"})

# T. Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6(1), 2017: two axes from the normal alone.
_AXES_OF_NORMAL = """
{n}_s = if(NzP, 1, -1);
{n}_a = -1 / ({n}_s + NzP);
{n}_b = NxP * NyP * {n}_a;
{n}_x(vx,vy,vz) = (1 + {n}_s*NxP*NxP*{n}_a)*vx + {n}_s*{n}_b*vy - {n}_s*NxP*vz;
{n}_y(vx,vy,vz) = {n}_b*vx + ({n}_s + NyP*NyP*{n}_a)*vy - NyP*vz;
"""
_AXES_OF_VECTOR = """
{n}_d = arg(10)*NxP + arg(11)*NyP + arg(12)*NzP;
{n}_l = sqrt((arg(10) - {n}_d*NxP)^2 + (arg(11) - {n}_d*NyP)^2 + (arg(12) - {n}_d*NzP)^2);
{n}_ux = (arg(10) - {n}_d*NxP) / {n}_l;
{n}_uy = (arg(11) - {n}_d*NyP) / {n}_l;
{n}_uz = (arg(12) - {n}_d*NzP) / {n}_l;
{n}_x(vx,vy,vz) = {n}_ux*vx + {n}_uy*vy + {n}_uz*vz;
{n}_y(vx,vy,vz) = (NyP*{n}_uz - NzP*{n}_uy)*vx + (NzP*{n}_ux - NxP*{n}_uz)*vy + (NxP*{n}_uy - NyP*{n}_ux)*vz;
"""
_NORMAL = "{n}_z(vx,vy,vz) = NxP*vx + NyP*vy + NzP*vz;"
_CALL = (
    "{f}(lx,ly,lz) = {m}({n}_x(lx,ly,lz), {n}_y(lx,ly,lz), {n}_z(lx,ly,lz),\n"
    "    {n}_x(-Dx,-Dy,-Dz), {n}_y(-Dx,-Dy,-Dz), {n}_z(-Dx,-Dy,-Dz));"
)


def refuse_long(subject: Subject) -> None:
    """ValueError for a model that a function file cannot hold."""
    if formula_of(subject.model).operations & LOOPS:
        raise ValueError(
            f"{subject.model.name} is a sum over many nodes, and Radiance's functions have no loops: write a table by "
            f"--to {TABLE}, or fit another model"
        )


def cal_lines(subject: Subject, name: str, by_channel: tuple[str, str, str], separate: bool) -> tuple[list[str], bool]:
    """The lines of the file, and whether it needs a vector along the surface's x axis.

    separate: without the Lambertian terms, which are numbers of the material.
    """
    oriented, frame = not isotropic(subject), f"{name}_axis"
    several = len(subject.sets) > 1
    without = ", without its Lambertian terms" if separate else ""
    what = f"{name}.cal: {subject.model.title}{without}, for Radiance's BRTDfunc {name}."
    comment = [line.translate({ord("{"): "(", ord("}"): ")"}) for line in heading(subject, what)]
    axes = (_AXES_OF_VECTOR if oriented else _AXES_OF_NORMAL).format(n=frame).strip()
    writer = Writer(CAL, f"{name}_f")
    lines, calls = [], []
    for channel, label in zip("rgb", by_channel, strict=True) if several else (("", by_channel[0]),):
        function = f"{name}_{channel}" if channel else name
        model = f"{function}_brdf"
        statements, results = writer.whole(_formula(subject, label, separate))
        lines += CAL.function(model, (*INCIDENCE, *REFLECTION), statements, results[0])
        calls.append(_CALL.format(f=function, m=model, n=frame))
    return ["{", *comment, "}", "", axes, _NORMAL.format(n=frame), *writer.shared(), "", *lines, "", *calls], oriented


def _formula(subject: Subject, label: str, separate: bool) -> Formula:
    values = dict(subject.sets[label])
    for weight, term in subject.model.terms.items():
        if separate and term is lambertian:
            values[weight] = 0.0
    return formula_of(subject.model).with_values(values)


_COMMENT = re.compile(r"\{[^{}]*\}")
_FUNCTION = re.compile(r"(\w+)(?:\(([\w, ]*)\))?$")


def evaluated(texts: list[str], geometry: Geometry) -> np.ndarray:
    """The BRDF [1/sr] of the red channel of written files: the material, and its function file where it has one.

    The normal is z, and an orientation is the surface's x axis.
    """
    kind, reals, functions = _material(texts[0])
    light, view = (np.stack(np.broadcast_arrays(*v)) for v in (geometry[:3], geometry[3:]))
    below = np.minimum(light[2], view[2]) <= 0
    if kind != "BRTDfunc":
        value = _ward(kind, reals, light, view)
    else:
        with np.errstate(all="ignore"), temporary_folder() as folder:
            module = folder / "functions.py"
            module.write_text(_as_python(_COMMENT.sub("", texts[1])), encoding="utf-8")
            functions_by_name = executed(module, known=_environment(view, reals))
            value = reals[0] / np.pi + functions_by_name[functions[0]](*light)
    return np.where(below, 0.0, value)


def _material(text: str) -> tuple[str, list[float], list[str]]:
    """Kind, numbers and words of a material."""
    words = " ".join(line for line in text.splitlines() if not line.startswith("#")).split()
    kind, rest = words[1], words[3:]
    strings = rest[1 : 1 + int(rest[0])]
    reals = rest[len(strings) + 2 :]
    return kind, [float(r) for r in reals[1:]], strings[6:]


def _ward(kind: str, reals: list[float], light: np.ndarray, view: np.ndarray) -> np.ndarray:
    """Radiance's plastic and metal (normal.c, dirnorm)."""
    colour, specularity, roughness = reals[0], reals[3], reals[4]
    specular = specularity * (colour if kind == "metal" else 1.0)
    value = np.full(light.shape[1:], colour * (1 - specularity) / np.pi)
    if not specular:
        return value
    half = light + view
    with np.errstate(all="ignore"):
        tangent = (half[0] ** 2 + half[1] ** 2) / half[2] ** 2
        lobe = np.exp(-tangent / roughness**2) * np.sum(half**2, axis=0) / (np.pi * roughness**2 * half[2] ** 4)
    return value + specular * lobe


def _environment(view: np.ndarray, reals: list[float]) -> dict[str, Any]:
    """What Radiance's functions know, on arrays: both sides of a choice are computed."""
    names = ("sqrt", "exp", "log", "sin", "cos", "tan", "floor", "abs")
    known: dict[str, Any] = {name: getattr(np, name) for name in names}
    known |= {"asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "atan2": np.arctan2}
    known |= {"NxP": np.float64(0), "NyP": np.float64(0), "NzP": np.float64(1)}
    known |= dict(zip(("Dx", "Dy", "Dz"), -view, strict=True))
    known["arg"] = lambda k: np.float64(reals[k - 1])
    known["_if"] = lambda condition, x, y: np.where(condition > 0, x, y)
    return known


def _as_python(text: str) -> str:
    """The definitions of a function file as those of a module of Python, in their order."""
    lines = []
    for definition in filter(str.strip, text.split(";")):
        head, _, body = definition.partition("=")
        found = _FUNCTION.match(head.strip())
        if found is None:
            raise ValueError(f"no definition of Radiance: {head.strip()!r}")
        name, arguments = found.groups()
        value = re.sub(r"\bif\(", "_if(", " ".join(body.split())).replace("^", "**")
        lines += [f"{name} = {value}"] if arguments is None else [f"def {name}({arguments}):", f"    return {value}"]
    return "\n".join([*lines, ""])
