"""Eradiate: the parameters of a surface that it has itself, as YAML or as a dictionary of Python.

RPV and Ross-Li are the same formulas there (Eradiate's kernel, plugins rpv and rtls), under other names.
"""

import ast
from collections.abc import Mapping
from typing import Any

import numpy as np
import yaml

from gonio.exporting.heading import heading
from gonio.exporting.source import proved
from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.geometry import Geometry
from gonio.model import Model
from gonio.models.hapke1981 import hapke
from gonio.models.lambert import lambert
from gonio.models.rahman1993 import rpv
from gonio.models.wanner1995 import ross_li

# Eradiate's name of each, its parameters, and what of ours each of them is.
SURFACES: dict[Model, tuple[str, Mapping[str, str]]] = {
    lambert: ("lambertian", {"reflectance": "rho"}),
    rpv: ("rpv", {"rho_0": "r0", "k": "k", "g": "theta", "rho_c": "rc"}),
    ross_li: ("rtls", {"f_iso": "fiso", "f_vol": "fvol", "f_geo": "fgeo"}),
}
REMEDY = "fit rpv or ross-li, as in gonio export SCAN --model rpv --to eradiate"


def make(subject: Subject, request: Request) -> Made:
    """A mapping in YAML, or a dictionary in a Python file."""
    surface = surface_of(subject)
    what = f"{request.name}: {subject.model.title}, as a surface of Eradiate."
    comment = [f"# {line}".rstrip() for line in heading(subject, what, frame=FRAME, quantity=QUANTITY)]
    if request.out.suffix.lower() == ".py":
        rows = [f"    {name!r}: {value!r}," for name, value in surface.items()]
        lines = [*comment, "", f"{request.name} = {{", *rows, "}"]
    else:
        flow = None if any(isinstance(v, dict) for v in surface.values()) else False  # lists of wavelengths on a line
        lines = [*comment, "", yaml.safe_dump(surface, sort_keys=False, default_flow_style=flow).rstrip()]
    remarks = (
        ("between the wavelengths of the fit Eradiate interpolates the parameters, not the BRDF",)
        if subject.by == "wavelength" and len(subject.sets) > 1
        else ()
    )
    return Made({request.out.name: "\n".join([*lines, ""])}, remarks)


def surface_of(subject: Subject) -> dict[str, Any]:
    """Eradiate's dictionary; ValueError for a model that it does not have."""
    if subject.model is hapke:
        raise ValueError(
            "hapke is another formula in Eradiate, 1 to 4 % from this one: it has the H function of 2002 and writes "
            f"the share of the backward lobe as (1 + c)/2: {REMEDY}"
        )
    if subject.model not in SURFACES:
        raise ValueError(f"Eradiate has no surface {subject.model.name}: {REMEDY}")
    kind, names = SURFACES[subject.model]
    if subject.by == "wavelength" and len(subject.sets) > 1:
        order = sorted(subject.sets, key=float)
        return {"type": kind} | {
            theirs: {
                "type": "interpolated",
                "wavelengths": [float(label) for label in order],
                "values": [float(subject.sets[label][ours]) for label in order],
            }
            for theirs, ours in names.items()
        }
    return {"type": kind} | {theirs: float(subject.values[ours]) for theirs, ours in names.items()}


QUANTITY = "Eradiate's parameters; its BRDF is f in 1/sr, without the cosine of the reflection angle"
FRAME = "the surface's normal is z; wavelengths are in nm, which are Eradiate's own"


def check(subject: Subject, request: Request) -> Proof:
    """The parameters read back from the file, in this program's formula; Eradiate is not run."""
    text = request.out.read_text(encoding="utf-8")
    if request.out.suffix.lower() == ".py":
        statement = ast.parse(text).body[0]
        found = ast.literal_eval(statement.value)  # type: ignore[attr-defined]
    else:
        found = yaml.safe_load(text)
    _, names = SURFACES[subject.model]
    label = min(subject.sets, key=float) if subject.by == "wavelength" else subject.label
    values = {ours: _first(found[theirs]) for theirs, ours in names.items()}

    def run(geometry: Geometry) -> np.ndarray:
        return np.asarray(subject.model(geometry, values))

    one = subject if len(subject.sets) == 1 else subject.one(label)
    return proved(one, "Eradiate is not run: the parameters of the file were read back", run)


def _first(value: Any) -> float:
    return float(value["values"][0] if isinstance(value, dict) else value)


ERADIATE = Target(
    name="eradiate",
    title="Eradiate",
    suffixes=(".yml", ".yaml", ".py"),
    writes="the surface's dictionary, in YAML or Python: rpv, ross-li and lambert, over wavelengths too",
    make=make,
    check=check,
)
