"""Figures of scans and of fits to them: which predictor and which curves each kind of figure needs."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.comparison.assessment import Row
from gonio.fitting.certainty.band import band
from gonio.fitting.solution import Solution
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.options import one_of
from gonio.plotting.components import components
from gonio.plotting.convergence import convergence
from gonio.plotting.curves import curves
from gonio.plotting.hemisphere import hemisphere, room_for_views, top_view
from gonio.plotting.one_axes import ON_ONE_AXES
from gonio.plotting.page.sheet import side_by_side
from gonio.plotting.panels import FAR_SIDE, first_set, origin_word
from gonio.plotting.residuals import residuals
from gonio.plotting.spectra import SPECTRAL, spectra
from gonio.plotting.style import SCALES, quantity_of
from gonio.resampling.resample import resample
from gonio.results.content import scan_name
from gonio.results.numbers import LEVEL

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Fits = Mapping[str, Solution]


@dataclass(frozen=True, kw_only=True)
class View:
    """What of a scan is drawn, and how.

    normalised, banded: for `curves`, over their specular value or with 95 % bands. scales: for `curves` and
    `components`, the rows, of `linear` and `log`. theta_i: incidence angles of the scan [deg], all where it is empty.
    together: all channels, wavelengths and other sets of a scan in the same panels of `curves`, not the first alone.
    """

    normalised: bool = False
    banded: bool = False
    scales: Sequence[str] = SCALES
    theta_i: Sequence[float] = ()
    together: bool = False

    def __post_init__(self) -> None:
        if not self.scales or any(scale not in SCALES for scale in self.scales):
            raise ValueError(f"scales are {one_of(SCALES)}, or both")


WHOLE = View()
MOST_PANELS = 4
SAME_ANGLE = 0.005  # deg: an angle is named as it is written, with two decimals
OF_SCALES = ("curves", "components")
OF_ANGLES = {"curves": 6, "residuals": 6, "components": 4, "hemisphere": MOST_PANELS}  # and the most of them
OF_FITS = ("residuals", "components", "convergence", "spectra")  # figures that show nothing of a scan alone


def plot(
    scan: xr.Dataset,
    solutions: Solution | Row | Iterable[Solution | Row] | Mapping[str, Solution | Row] | None = None,
    kind: str = "curves",
    ax: "Axes | None" = None,
) -> "Figure":
    """Draw a scan and the fits to it; returns a Matplotlib Figure.

    solutions: one fit, several, those that `compare` ranked, or a mapping whose names stand in the legend; None draws
    the scan alone. kind: `curves`, `residuals`, `components`, `hemisphere`, `convergence` or `spectra`.
    ax: Matplotlib axes to draw `curves` or `residuals` on, all incidence angles together; the other kinds, and these
    without ax, are figures of several panels.
    Raises ValueError for another kind, and where the figure cannot show what it was given.
    """
    fits = named(solutions)
    if kind not in KINDS:
        raise ValueError(f"there is no figure {kind!r}: choose one of {', '.join(KINDS)}")
    if ax is None:
        titles = {scan_name(solution) for solution in fits.values()}
        return drawn(kind, titles.pop() if len(titles) == 1 else "", scan, fits)
    if kind not in ON_ONE_AXES:
        raise ValueError(f"{kind} has panels of its own: leave ax out, or draw {' or '.join(ON_ONE_AXES)}")
    if kind in OF_FITS and not fits:
        raise ValueError(f"{kind} shows fits: give a solution")
    ON_ONE_AXES[kind](ax, scan, {name: solution.brdf for name, solution in fits.items()})
    figure = ax.figure.figure  # of axes in a subfigure too
    assert figure is not None
    return figure


def named(solutions: Any) -> Fits:
    """Fits by the name that the legend gives them: that of the model, numbered where it occurs again."""
    if solutions is None:
        return {}
    if isinstance(solutions, Mapping):
        return {str(name): _solution(one) for name, one in solutions.items()}
    several = [solutions] if isinstance(solutions, Solution | Row) else list(solutions)
    fits: dict[str, Solution] = {}
    for one in map(_solution, several):
        again = sum(other.model.name == one.model.name for other in fits.values())
        fits[f"{one.model.name} ({again + 1})" if again else one.model.name] = one
    return fits


def _solution(one: Any) -> Solution:
    if isinstance(one, Row):
        return one.solution
    if not isinstance(one, Solution):
        raise TypeError(f"{type(one).__name__} is no fit: give what gonio.fit or gonio.compare returns")
    return one


def drawn(kind: str, title: str, scan: xr.Dataset, fits: Fits, view: View = WHOLE) -> "Figure":
    """One figure of a scan with the fits to it, the best first.

    Raises ValueError where the figure cannot show what it was given.
    """
    if kind in OF_FITS and not fits:
        raise ValueError(f"{kind} shows fits: give a solution")
    if view.scales != SCALES and kind not in OF_SCALES:
        raise ValueError(f"{kind} has its own scales: leave --scale out, or draw {one_of(OF_SCALES)}")
    if view.theta_i:
        if kind not in OF_ANGLES:
            raise ValueError(f"{kind} shows all incidence angles: leave --theta-i out, or draw {one_of(OF_ANGLES)}")
        room = room_for_views(MOST_PANELS) if kind == "hemisphere" else side_by_side(OF_ANGLES[kind])
        if len(view.theta_i) > room:
            raise ValueError(
                f"{kind} has room for {room} of {len(view.theta_i)} incidence angles: name fewer, or a larger size"
            )
        if kind != "hemisphere":  # which needs the axes that a format may have
            scan = at_incidence(scan, view.theta_i)
    return KINDS[kind](title, scan, fits, view)


def at_incidence(scan: xr.Dataset, theta_i: Sequence[float]) -> xr.Dataset:
    """A flat scan of these incidence angles [deg] alone; ValueError with those there are for one that it has not."""
    flat = dataset.points(scan)
    there = np.unique(flat["theta_i"].values)
    for angle in theta_i:
        if not np.isclose(there, angle, rtol=0, atol=SAME_ANGLE).any():
            known = ", ".join(f"{one:.4g}" for one in there)
            raise ValueError(f"the scan has no incidence angle of {angle:g} deg: choose of {known}")
    chosen = np.isclose(flat["theta_i"].values[:, None], np.asarray(theta_i), rtol=0, atol=SAME_ANGLE).any(axis=1)
    return flat.isel(direction=np.flatnonzero(chosen))


def _predictors(fits: Fits) -> dict[str, Callable[[xr.Dataset], npt.NDArray[np.float64]]]:
    """A function of directions for each fit, in the order of the names, so that a model keeps its colour."""
    return {name: fits[name].brdf for name in sorted(fits)}


def _ends(solution: Solution, points: xr.Dataset) -> tuple[Any, Any]:
    """The ends of the 95 % band at the directions of a flat scan."""
    at_points = band(solution, points)
    reach = solution.expanded(at_points["uncertainty"].values, at_points["uncertainty_systematic"].values, LEVEL)
    return at_points["brdf"].values - reach, at_points["brdf"].values + reach


def _residuals(title: str, scan: xr.Dataset, fits: Fits, _view: View) -> "Figure":
    return residuals(scan, _predictors(fits), title=title)


def _components(title: str, scan: xr.Dataset, fits: Fits, view: View) -> "Figure":
    name, best = next(iter(fits.items()))
    title = title if title == name else f"{title}: {name}"
    return components(scan, best.model, best.components, title=title, scales=view.scales)


def _convergence(title: str, _scan: xr.Dataset, fits: Fits, _view: View) -> "Figure":
    annealed = {name: solution for name, solution in fits.items() if solution.dataset.attrs["solver"] == "anneal"}
    histories = {name: solution.dataset["history"].values for name, solution in annealed.items()}
    if not histories:
        raise ValueError("an exact solution has no course to draw: add --solver anneal")
    return convergence(histories, title=title)


def _hemisphere(title: str, scan: xr.Dataset, fits: Fits, view: View) -> "Figure":
    """The scan as measured, where it covers more than the plane of incidence, and the best model beside it."""
    flat, note = first_set(dataset.points(scan))
    flat = at_incidence(flat, view.theta_i) if view.theta_i else flat
    # A format's own interpolation needs its own axes.
    whole = first_set(scan)[0] if dataset.PARAMETERISATION in scan.attrs else None
    outside = np.unique(flat["theta_i"].values[~dataset.is_in_plane(flat)])
    if not fits and not outside.size:
        raise ValueError(
            "the scan is only of the plane of incidence, which covers no hemisphere: draw curves, or give a fit, as by "
            "--models, whose hemisphere is drawn"
        )
    angles = outside if outside.size else np.unique(flat["theta_i"].values)
    most = max(room_for_views(MOST_PANELS) // (1 + bool(fits and outside.size)), 1)
    panels: dict[str, tuple[float, Callable[[Geometry], Any]]] = {}
    chosen = angles[np.unique(np.linspace(0, len(angles) - 1, most).round().astype(int))].tolist()
    for angle in chosen:
        here = flat.isel(direction=np.flatnonzero(flat["theta_i"].values == angle))
        if outside.size:
            panels[f"{origin_word(scan)}, θᵢ = {angle:.4g}°"] = (
                angle,
                partial(_as_measured, here if whole is None else whole, angle),
            )
        if fits:
            name, best = next(iter(fits.items()))
            values = {k: float(np.ravel(v)[0]) for k, v in best.at(here.isel(direction=[0])).items()}
            panels[f"{name}, θᵢ = {angle:.4g}°"] = (angle, partial(_at, best.model, values))
    notes = [note] if note else []
    notes += [f"{len(chosen)} of {len(angles)} incidence angles"] * (len(angles) > most)
    notes += [FAR_SIDE] * (quantity_of(flat) == "BTDF")
    notes += ["the scan itself is of the plane of incidence alone"] * (not outside.size)
    return hemisphere(
        panels,
        unit=dataset.unit(scan),
        title=title,
        logarithmic=True,
        note="; ".join(notes),
        quantity=quantity_of(flat),
    )


def _as_measured(here: xr.Dataset, theta_i: float, _: Geometry) -> Any:
    """The values of one set at an incidence angle [deg] over the top view, NaN where nothing near was measured."""
    theta_r, phi = top_view()
    onto = dataset.make_scan(np.full(theta_r.size, theta_i), theta_r.ravel(), np.zeros(theta_r.size), phi.ravel())
    if "phi_i" in here.coords:  # a surface that was turned is seen as it lay first
        onto = onto.assign_coords(phi_i=("direction", np.full(theta_r.size, np.ravel(here["phi_i"].values)[0])))
        onto["phi_i"].attrs["units"] = "degree"
    directions = onto.drop_vars([str(n) for n in onto.data_vars])
    return resample(here, directions)["brdf"].values.reshape(theta_r.shape)


def _at(model: Any, values: Mapping[str, float], geometry: Geometry) -> Any:
    return model(geometry, values)


def _spectra(title: str, _scan: xr.Dataset, fits: Fits, _view: View) -> "Figure":
    return spectra({name: fits[name].parameters() for name in sorted(fits)}, title=title)


def has_spectra(solution: Solution) -> bool:
    """Whether a fit has a parameter with one value for each wavelength."""
    return any(SPECTRAL in p.get("by", "").split(",") for p in solution.parameters().values())


def _curves(title: str, scan: xr.Dataset, fits: Fits, view: View) -> "Figure":
    bands = {name: partial(_ends, solution) for name, solution in fits.items()} if view.banded else {}
    how: dict[str, Any] = {"title": title, "normalised": view.normalised, "bands": bands, "scales": view.scales}
    return curves(scan, _predictors(fits), **how)


KINDS: Mapping[str, Callable[[str, xr.Dataset, Fits, View], "Figure"]] = {
    "curves": _curves,
    "residuals": _residuals,
    "components": _components,
    "hemisphere": _hemisphere,
    "convergence": _convergence,
    "spectra": _spectra,
}
