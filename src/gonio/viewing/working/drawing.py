"""A figure of a scan with the curve that a page shows, drawn by gonio in a process of its own."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.solution import Solution
from gonio.measured import dataset
from gonio.model import Model
from gonio.plotting.curves import curves
from gonio.plotting.page import FORMATS, Page, drawn_on
from gonio.plotting.style import SCALES, save
from gonio.results.figures import drawn, named
from gonio.results.view import OF_ANGLES, View, at_incidence

Values = npt.NDArray[np.float64]
KINDS, AXES = tuple(FORMATS), tuple(SCALES)
MOST = OF_ANGLES["curves"]


@dataclass(frozen=True)
class Drawing:
    """What is drawn, and where it is written.

    scan: one set of directions. theta_i: the incidence angles [deg]. path: without suffix; it is numbered where a file
    of that name exists. kind: pdf, png or svg. scale: linear or log.
    """

    scan: xr.Dataset
    title: str
    theta_i: Sequence[float]
    path: Path
    kind: str
    scale: str


def draw_fit(drawing: Drawing, solution: Solution) -> str:
    """The scan, and the fit with its band."""
    view = View(banded=True, scales=(drawing.scale,), theta_i=tuple(drawing.theta_i))
    with drawn_on(Page()):
        figure = drawn("curves", drawing.title, drawing.scan, named([solution]), view)
        return _saved(figure, drawing)


def draw_values(drawing: Drawing, model: Model, values: Mapping[float, Mapping[str, float]]) -> str:
    """The scan, and a model with values for each incidence angle [deg]."""
    angles = np.array(sorted(values))

    def predict(where: xr.Dataset) -> Values:
        nearest = np.abs(np.ravel(where["theta_i"].values)[:, None] - angles).argmin(axis=1)
        own = {name: np.array([values[a][name] for a in angles])[nearest] for name in model.parameters}
        plain = {name: column if np.ptp(column) else float(column[0]) for name, column in own.items()}
        return np.asarray(model(dataset.geometry(where), plain), dtype=float)

    with drawn_on(Page()):
        shown = at_incidence(drawing.scan, drawing.theta_i)
        figure = curves(shown, {model.name: predict}, title=drawing.title, scales=(drawing.scale,))
        return _saved(figure, drawing)


def _saved(figure: "object", drawing: Drawing) -> str:
    drawing.path.parent.mkdir(parents=True, exist_ok=True)
    path, suffix = drawing.path, f".{drawing.kind}"
    for again in range(2, 1000):
        if not path.with_name(path.name + suffix).exists():
            break
        path = drawing.path.with_name(f"{drawing.path.name}-{again}")
    return str(save(figure, path, (suffix,))[0])  # type: ignore[arg-type]
