"""Figures of scans and of fits to them: which predictor and which curves each kind of figure needs."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.comparison.assessment import Row
from gonio.fitting.certainty.band import band
from gonio.fitting.solution import Solution
from gonio.measured import dataset
from gonio.measured.polarimetry.degree import dolp, labelled
from gonio.measured.polarimetry.ratio import refuse_scalar
from gonio.options import one_of
from gonio.plotting.components import components
from gonio.plotting.convergence import convergence
from gonio.plotting.curves import curves
from gonio.plotting.lobes.polar import Arc, polar
from gonio.plotting.one_axes import ON_ONE_AXES
from gonio.plotting.page import drawn_on
from gonio.plotting.panels import origin_word, panel_curves
from gonio.plotting.residuals import residuals
from gonio.plotting.spectra import SPECTRAL, spectra
from gonio.plotting.style import LINEAR, SCALES, quantity_of
from gonio.results.content import scan_name
from gonio.results.numbers import LEVEL
from gonio.results.over_hemisphere import draw_hemisphere, draw_lobe
from gonio.results.over_wavelength import draw_spectrum
from gonio.results.view import OF_ANGLES, OF_DEGREES, OF_FITS, OF_VIEWS, WHOLE, Fits, View, at_incidence
from gonio.results.words import Words, finished, page_of, view_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot(
    scan: xr.Dataset,
    solutions: Solution | Row | Iterable[Solution | Row] | Mapping[str, Solution | Row] | None = None,
    kind: str = "curves",
    ax: "Axes | None" = None,
    **words: Unpack[Words],
) -> "Figure":
    """Draw a scan and the fits to it.

    Parameters
    ----------
    scan : xarray.Dataset
        The scan.
    solutions : Solution, sequence, or mapping
        One fit, several, those that `gonio.compare` ranked, or a mapping whose names stand in the legend. None draws
        the scan alone.
    kind : str
        `curves`, `polar` (in plane, the value as a radius), `spectrum` (over wavelength or channel at a direction),
        `hemisphere` (from above), `lobe` (in space), `residuals`, `components`, `convergence`, `spectra` or `dolp`
        (the degree of linear polarisation of readings in s and p, beside that of the fits).
    ax : matplotlib.axes.Axes, optional
        Axes to draw `curves` or `residuals` on, all incidence angles together. The other kinds, and these without
        `ax`, are figures of several panels.
    **words
        The page, in the words of the command line: `size`, (85, 60) in mm or a text such as "85x60mm", "8.5x6cm" or
        "3.3x2.4in"; `font` [pt] of all text; `dpi`; `title`; `style`, a Matplotlib style file. `out` names a file to
        write, with the suffix .pdf, .png or .svg or else in the formats of `format`; `force` overwrites it.
        What is drawn: `scale`, "linear", "log" or "both"; `theta_i`, the incidence angles [deg]; `at`, for `spectrum`,
        one direction (theta_i, theta_r, phi) [deg] or several; `normalised` and `band`, for `curves`.

    Returns
    -------
    matplotlib.figure.Figure
        The figure, not yet saved unless `out` names a file: `figure.savefig("fit.pdf")`.

    Raises
    ------
    ValueError
        The kind is not known, the figure cannot show what it was given, or it has no room on the page.
    TypeError
        A word is none of these.
    FileExistsError
        `out` is there, and `force` is not set.

    """
    fits = named(solutions)
    if kind not in KINDS:
        raise ValueError(f"there is no figure {kind!r}: choose one of {', '.join(KINDS)}")
    if ax is None:
        titles = {scan_name(solution) for solution in fits.values()}
        view, page = view_of(words), page_of(words)
        with drawn_on(page):
            figure = drawn(kind, titles.pop() if len(titles) == 1 else "", scan, fits, view)
            return finished(figure, page, words)
    if words:
        raise ValueError(f"ax has a page of its own: leave {', '.join(words)} out")
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
    view.refuse_unfit(kind)
    if dataset.is_degree(scan):
        scan = labelled(scan)
        if kind not in OF_DEGREES:
            raise ValueError(f"{kind} shows no degrees of polarisation: draw {one_of(OF_DEGREES)}")
    if view.theta_i and kind not in OF_VIEWS:  # which need the axes that a format may have
        scan = at_incidence(scan, view.theta_i)
    return KINDS[kind](title, scan, fits, view)


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


def _polar(title: str, scan: xr.Dataset, fits: Fits, view: View) -> "Figure":
    panels, note = panel_curves(scan, OF_ANGLES["polar"])
    predictors = _predictors(fits)
    arcs = [
        Arc(
            curve.theta_i,
            {name: (curve.fine_theta_r, predictor(curve.fine)) for name, predictor in predictors.items()},
            curve.theta_r,
            curve.points,
        )
        for curve in panels
    ]
    how: dict[str, Any] = {"title": title, "note": note, "scales": view.scales, "word": origin_word(scan)}
    return polar(arcs, unit=dataset.unit(scan), quantity=quantity_of(panels[0].points), **how)


def _spectra(title: str, _scan: xr.Dataset, fits: Fits, _view: View) -> "Figure":
    return spectra({name: fits[name].parameters() for name in sorted(fits)}, title=title)


def has_spectra(solution: Solution) -> bool:
    """Whether a fit has a parameter with one value for each wavelength."""
    return any(SPECTRAL in p.get("by", "").split(",") for p in solution.parameters().values())


def _curves(title: str, scan: xr.Dataset, fits: Fits, view: View) -> "Figure":
    bands = {name: partial(_ends, solution) for name, solution in fits.items()} if view.banded else {}
    scales = (LINEAR,) if dataset.is_degree(scan) and tuple(view.scales) == SCALES else view.scales
    how: dict[str, Any] = {"title": title, "normalised": view.normalised, "bands": bands, "scales": scales}
    return curves(scan, _predictors(fits), **how)


def _dolp(title: str, scan: xr.Dataset, fits: Fits, view: View) -> "Figure":
    """Degrees of linear polarisation: over the hemisphere where a scan has more than its plane, else as curves."""
    for solution in fits.values():
        refuse_scalar(solution.model)
    degrees = dolp(scan)
    is_flat = bool(dataset.is_in_plane(dataset.points(degrees)).all())
    return (_curves if is_flat else draw_hemisphere)(title, degrees, fits, view)


KINDS: Mapping[str, Callable[[str, xr.Dataset, Fits, View], "Figure"]] = {
    "curves": _curves,
    "residuals": _residuals,
    "components": _components,
    "polar": _polar,
    "spectrum": draw_spectrum,
    "hemisphere": draw_hemisphere,
    "lobe": draw_lobe,
    "convergence": _convergence,
    "spectra": _spectra,
    "dolp": _dolp,
}
