"""What follows from the values on the sliders: reflectance at some angles, and which laws of physics they break."""

import math
from functools import partial
from typing import Any

import numpy as np

from gonio import plausibility
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.viewing.sliders import Sliders

MOST = 3  # incidence angles of which the reflectance is given
NODES = ((64, 96), (140, 200))  # of pairs of quadratures: a pair that agrees is believed
SAME = 1e-3  # relative


def evaluated(at: Sliders) -> dict[str, Any]:
    """The directional-hemispherical reflectance at some incidence angles of the block, and the three laws.

    Each law is True, False or None for what nobody can know; `reflectances` are lists of theta_i [deg] and value, None
    where a lobe is too narrow for the quadrature. Relative data have none.
    """
    cells = at.opened.columns.header["cells"]
    shown = [k for k, cell in enumerate(cells) if cell["block"] == at.block]
    unit = dataset.unit(at.opened.scan)
    absolute = unit == dataset.ABSOLUTE
    chosen = _spread(sorted({cells[k]["theta_i"]: k for k in shown}.values(), key=lambda k: cells[k]["theta_i"]))
    values = at.at_cell(at.cell)
    reflectances: list[list[float | None]] = []
    for cell in chosen if absolute else []:
        theta_i = cells[cell]["theta_i"]
        reflectances.append([theta_i, _reflectance(at, at.at_cell(cell), theta_i)])
    known = [value for _, value in reflectances if value is not None]
    return {
        "unit": unit,
        "relative": not absolute,
        "reflectances": reflectances,
        "positive": plausibility.positivity(partial(_brdf, at, values)).holds,
        "reciprocal": plausibility.reciprocity(partial(_brdf, at, values)).holds,
        "conserves_energy": all(value <= 1 + plausibility.QUADRATURE for value in known) if known else None,
        "violates": sorted(at.model.violates),
    }


def _reflectance(at: Sliders, values: dict[str, float], theta_i: float) -> float | None:
    """The integral over the hemisphere; None where it still depends on the nodes, as for a narrow lobe."""
    for pair in NODES:
        coarse, fine = (
            plausibility.hemispherical_reflectance(partial(_brdf, at, values), theta_i, nodes) for nodes in pair
        )
        if math.isfinite(fine) and math.isclose(coarse, fine, rel_tol=SAME):
            return fine
    return None


def _brdf(at: Sliders, values: dict[str, float], geometry: Geometry) -> np.ndarray:
    return np.asarray(at.model(geometry, values), dtype=float)


def _spread(cells: list[int]) -> list[int]:
    if len(cells) <= MOST:
        return cells
    return [cells[k] for k in np.linspace(0, len(cells) - 1, MOST).round().astype(int)]
