"""The drawings of a report: one small svg a curve, which a telephone shows at its own size and a page beside others."""

import re
from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from gonio.measured import dataset
from gonio.outside import printable
from gonio.plotting.page import Page, drawn_on
from gonio.plotting.style import LINEAR, LOG, house_style
from gonio.plotting.style import svg as svg_of
from gonio.reporting.blocks import Notes, Picture, Pictures
from gonio.reporting.case import Case
from gonio.results.figures import drawn, has_spectra
from gonio.results.view import View

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CURVES = Page(size="85x58mm", font=8, title="")
RESIDUALS = Page(size="85x68mm", font=8, title="")
PANEL = (0.185, 0.2, 0.79, 0.765)  # left, bottom, width and height of the axes on a page of that size with that text
TALL = Page(size="85x130mm", font=8, title="", dpi=130)
SPECTRUM = Page(size="85x75mm", font=8, title="")
MOST = 6  # curves that are drawn
SHORT_AXIS = 30.0  # of its ends: an axis that is shorter shows 2 and 5 beside powers of ten
DECADES = 1.3  # from least to largest value, from which an axis is logarithmic
FEWEST = 20  # directions out of plane that show something of a hemisphere


def curve_pictures(case: Case) -> Iterator[Any]:
    """Measured values, uncertainties, the fit and its band, a picture for each incidence angle and set."""
    chosen = list(_curves(case))
    total = sum(len(_angles(part)) for part in case.all_sets.values())
    pictures = [_curve(case, part, theta_i, words) for words, part, theta_i in chosen]
    drawn_well = [picture for picture in pictures if isinstance(picture, Picture)]
    yield Pictures(_legend(case, total, len(drawn_well)), drawn_well)
    yield Notes("figures", list(dict.fromkeys(picture for picture in pictures if isinstance(picture, str))), plain=True)


def _curves(case: Case) -> Iterator[tuple[str, xr.Dataset, float]]:
    """At most MOST curves of the sets that are shown, evenly chosen among incidence angles."""
    for words, part in case.sets.items():
        angles = _angles(part)
        share = max(MOST // len(case.sets), 1)
        for k in np.unique(np.linspace(0, len(angles) - 1, share).round().astype(int)).tolist():
            yield words, part, angles[k]


def _angles(part: xr.Dataset) -> list[float]:
    """Incidence angles [deg] of a set with a curve in plane to draw; all of them where none has one."""
    theta_i = part["theta_i"].values
    in_plane, counts = np.unique(theta_i[dataset.is_in_plane(part)], return_counts=True)
    angles: list[float] = in_plane[counts > 1].tolist()
    return angles or np.unique(theta_i).tolist()[:1]


def _curve(case: Case, part: xr.Dataset, theta_i: float, words: str) -> Picture | str:
    where = f"θᵢ = {theta_i:.4g}°" + f", {words}" * bool(words)
    measured = part["brdf"].values[np.isclose(part["theta_i"].values, theta_i)]
    positive = measured[measured > 0]
    wide = positive.size and np.log10(positive.max()) - np.log10(positive.min()) > DECADES
    view = View(theta_i=(theta_i,), scales=(LOG if wide else LINEAR,), banded=True)
    fits = {case.model: case.solution} if case.part_known[words] else {}
    try:
        with drawn_on(CURVES):
            figure = drawn("curves", "", part, fits, view)
            return Picture(svg_element(_alone(figure), f"curve-{theta_i:.4g}-{words}", f"Curve at {where}"), where)
    except ValueError as error:
        return f"No figure of curves: {error}"


def _legend(case: Case, total: int, shown: int) -> str:
    words = "Dots are measured values"
    words += ", bars their standard uncertainties" * ("uncertainty" in case.flat)
    words += f"; the line is {case.model}, the shade its 95 % band, and the thin vertical line the specular direction."
    return words + f" Shown are {shown} of {total} curves." * (total > shown)


def residual_pictures(case: Case) -> Iterator[Any]:
    """What the fit leaves over, and the values of a spectrum over the wavelength."""
    pictures, notes = [], []
    kinds = {"residuals": "Residuals, all incidence angles together"}
    if has_spectra(case.solution):
        kinds["spectra"] = "Values by wavelength"
    for kind, caption in kinds.items():
        try:
            pictures.append(Picture(svg_element(_drawing(case, kind), kind, caption), caption))
        except ValueError as error:
            notes.append(f"No figure of {kind}: {error}")
    yield Pictures("", pictures)
    yield Notes("residual-figures", notes, plain=True)


def _drawing(case: Case, kind: str) -> "Figure":
    with drawn_on(RESIDUALS if kind == "residuals" else SPECTRUM), house_style():
        if kind != "residuals":
            return drawn(kind, "", case.points, {case.model: case.solution})
        from matplotlib.figure import Figure

        from gonio.plotting.one_axes import residuals_on

        figure = Figure(figsize=RESIDUALS.sides)
        ax = figure.subplots()
        residuals_on(ax, case.points, {case.model: case.solution.brdf})
        ax.legend(ncols=3, loc="lower center", bbox_to_anchor=(0.45, 1.0), columnspacing=1.0, handlelength=1.2)
        ax.set_position((*PANEL[:3], 0.65))
        return figure


def hemisphere_pictures(case: Case) -> Iterator[Any]:
    """Top views of what was measured out of plane, each above that of the fit."""
    part = next(iter(case.sets.values()))
    angles, counts = np.unique(part["theta_i"].values[~dataset.is_in_plane(part)], return_counts=True)
    angles = angles[counts >= FEWEST]
    if not angles.size:
        return
    theta_i = float(angles[len(angles) // 2])  # one, as each takes a second
    pictures, notes = [], []
    try:
        with drawn_on(TALL):
            figure = drawn("hemisphere", "", case.scan, {case.model: case.solution}, View(theta_i=(theta_i,)))
            name = f"Hemisphere at θᵢ = {theta_i:.4g}°"
            pictures.append(Picture(svg_element(figure, "hemisphere", name), name))
    except ValueError as error:
        notes.append(f"No figure of the hemisphere: {error}")
    legend = "Top views: the centre is θᵣ = 0, the rim 90°, forward to the right; + is the specular direction. Blank "
    legend += "directions were not measured. Above as measured, below the fit."
    legend += f" Shown is 1 of {len(angles)} incidence angles." * (len(angles) > 1)
    yield Pictures(legend, pictures)
    yield Notes("hemisphere-figures", list(dict.fromkeys(notes)), plain=True)


def svg_element(figure: "Figure", name: str, said: str) -> str:
    """One svg element whose names are its own on the page, with fonts that stand in for Matplotlib's."""
    _bare(figure)
    prefix = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") + "-"
    text = svg_of(figure)
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'\bid="', f'id="{prefix}', text)
    text = re.sub(r'"#(?=[\w-]+")', f'"#{prefix}', text).replace("url(#", f"url(#{prefix}")
    text = text.replace("'DejaVu Sans'", "'DejaVu Sans', Verdana, sans-serif")
    return text.replace("<svg ", f'<svg role="img" aria-label="{escape(printable(said))}" ', 1)


def _alone(figure: "Figure") -> "Figure":
    """A figure of one panel whose legend and title stand on the page in words, in margins that are known."""
    for legend in list(figure.legends):
        legend.remove()
    figure.set_layout_engine("none")
    for ax in figure.axes:
        ax.set_title("")
        ax.set_position(PANEL)
    return figure


def _bare(figure: "Figure") -> None:
    """Powers of ten in plain digits, as formulas take most of the time of drawing."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            if axis.get_scale() == "log":
                low, high = sorted(axis.get_view_interval())
                if low > 0 and high < SHORT_AXIS * low:
                    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
                axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
                axis.set_minor_formatter(NullFormatter())
