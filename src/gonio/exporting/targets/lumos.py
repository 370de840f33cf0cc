"""Lumos-Sat: a function of NumPy for the brightness of satellites, which turns any normal into the surface's frame.

Lumos-Sat calls a BRDF with the direction to the light, the normal and the direction to the observer, each a tuple of
three arrays or numbers (lumos.calculator, get_intensity_satellite_frame).
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gonio.exporting.frames import isotropic
from gonio.exporting.heading import heading
from gonio.exporting.running import executed
from gonio.exporting.source import pairs, proved
from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.exporting.targets.python import lines_of
from gonio.geometry import Geometry

FRAME = "vectors of any frame: incident to the light, normal, outgoing to the observer; each three arrays or numbers"

_FRAME = '''
def _frame(normal{along}):
    """The axes of a surface; its normal is the third."""
    n = np.stack(np.broadcast_arrays(*(np.asarray(c, dtype=float) for c in normal)), axis=-1)
    n = n / np.linalg.norm(n, axis=-1, keepdims=True)
{axis}
    x = a - np.sum(a * n, axis=-1, keepdims=True) * n
    x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    return np.stack([x, np.cross(n, x), n], axis=-2)


def {name}(incident, normal, outgoing{along}):
    """BRDF [1/sr], without cosines, of directions to the light and to the observer; all are tuples of three.{told}"""
    axes = _frame(normal{given})
    local = []
    for w in (incident, outgoing):
        w = np.stack(np.broadcast_arrays(*(np.asarray(c, dtype=float) for c in w)), axis=-1)
        w = w / np.linalg.norm(w, axis=-1, keepdims=True)
        local.append(np.sum(axes * w[..., None, :], axis=-1))
    return _surface(*local)
'''
# The coordinate axis that is farthest from the normal, as any will do.
_ANY_AXIS = "    a = np.eye(3)[np.argmin(np.abs(n), axis=-1)]"
_ALONG = "    a = np.asarray(along, dtype=float)"
_TOLD = "\n\n    along: a vector whose projection on the surface is its x axis.\n    "


def make(subject: Subject, request: Request) -> Made:
    """The content of the file."""
    subject.values  # noqa: B018 - refuses several sets before anything is written
    turned = not isotropic(subject)
    what = f"{request.name}: {subject.model.title}, for Lumos-Sat."
    text = _FRAME.format(
        name=request.name,
        along=", along=(1.0, 0.0, 0.0)" if turned else "",
        given=", along" if turned else "",
        axis=_ALONG if turned else _ANY_AXIS,
        told=_TOLD if turned else "",
    )
    lines = lines_of(subject, "_surface", arrays=True, docstring=heading(subject, what, frame=FRAME))
    remarks = ("the surface has a direction: the argument `along` is a vector whose projection is its x axis",)
    return Made({request.out.name: "\n".join(lines) + "\n\n" + text}, remarks if turned else ())


def check(subject: Subject, request: Request) -> Proof:
    """The written function, at many pairs of directions about a normal that is tilted."""
    how = f"run in NumPy about a tilted normal, {HORIZON} from the horizon and farther"
    every = pairs()
    clear = np.minimum(np.abs(every.z_i), np.abs(every.z_r)) > HORIZON
    geometry = Geometry(*(c[clear] for c in every))
    return proved(subject, how, lambda g: run(request.out, request.name, g), LIMIT, geometry)


HORIZON = 0.01  # cosine below which the turn's last digits decide on which side of the horizon a direction is
LIMIT = 1e-8  # relative: the turn's rounding, times the steepness of a narrow lobe

TILTED = (0.36, -0.48, 0.8)


def run(path: Path, name: str, geometry: Geometry, normal: Sequence[float] = TILTED) -> np.ndarray:
    """What the function of a file gives for pairs in the frame of a surface of that normal."""
    module = executed(path)
    axes = module["_frame"](tuple(normal))  # the file's own: a model of a direction needs the same x axis
    both = (np.stack(np.broadcast_arrays(*w), axis=-1) @ axes for w in (geometry[:3], geometry[3:]))
    light, view = (np.moveaxis(w, -1, 0) for w in both)
    return np.asarray(module[name](tuple(light), tuple(normal), tuple(view)))


LUMOS = Target(
    name="lumos",
    title="Lumos-Sat",
    suffixes=(".py",),
    writes="a function of NumPy, NAME(incident, normal, outgoing), about any normal",
    make=make,
    check=check,
)
