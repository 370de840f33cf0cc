"""Data and curves in the plane of incidence as a small picture of SVG: without Matplotlib, for a light page or a dark.

It has no text from outside but the quantity's unit, so that nothing in it is to be escaped but that.
"""

from collections.abc import Callable, Iterator
from html import escape

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.distinct import distinct
from gonio.units import unit_label

Values = npt.NDArray[np.float64]
# Blue, orange, green, purple, brown: each has a contrast of 3 to 1 or more on white as on black.
COLOURS = ("#1e82c8", "#d0601a", "#0f9070", "#b8609a", "#997000")
MOST_POINTS = 60  # of a curve: more are not told apart on so few pixels
WIDE = 30.0  # ratio of the largest to the smallest value above which the axis is logarithmic
MARGINS = (46.0, 8.0, 8.0, 30.0)  # left, right, top, bottom of a picture with labels


def sparkline(
    scan: xr.Dataset,
    predicted: Callable[[xr.Dataset], Values] | None = None,
    size: tuple[int, int] = (320, 110),
    labelled: bool = False,
) -> str:
    """The measured values as dots over theta_r, and a model's as lines; empty where nothing lies in the plane.

    predicted: the model's values (n,) at the directions of a flat scan. size: width and height in pixels. labelled:
    whether the axes are. Of several sets the first is drawn, and of many incidence angles a few.
    """
    flat = dataset.points(scan)
    curves = list(_curves(flat))
    if not curves:
        return ""
    modelled = [predicted(curve) if predicted else np.empty(0) for curve in curves]
    shown = np.concatenate([*(curve["brdf"].values for curve in curves), *modelled])
    place, words = _scale(shown, dataset.unit(scan))
    left, right, top, bottom = MARGINS if labelled else (2.0, 2.0, 3.0, 3.0)
    width, height = size[0] - left - right, size[1] - top - bottom
    parts = [_frame(left, top, width, height, words if labelled else None)]
    for k, (curve, model) in enumerate(zip(curves, modelled, strict=True)):
        x = left + width * (dataset.signed_theta_r(curve) + 90.0) / 180.0
        dots, line = (top + height * (1.0 - place(v)) for v in (curve["brdf"].values, model))
        colour = COLOURS[k % len(COLOURS)]
        drawn = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(x, dots, strict=True) if np.isfinite(b))
        parts.append(f'<path d="{drawn}" stroke="{colour}" stroke-width="3" stroke-linecap="round"/>')
        if len(model):
            path = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, line, strict=True) if np.isfinite(b))
            parts.append(f'<polyline points="{path}" stroke="{colour}" stroke-width="1.2"/>')
    said = "measured values as dots, the model as lines, over theta_r" if predicted else "measured values over theta_r"
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{size[0]}" height="{size[1]}" '
    head += f'viewBox="0 0 {size[0]} {size[1]}" role="img" aria-label="{said}" fill="none">'
    return head + "".join(parts) + "</svg>"


def _curves(flat: xr.Dataset) -> Iterator[xr.Dataset]:
    """The curves in the plane of the first set, sorted by theta_r: as many as there are colours, evenly chosen."""
    flat = flat.isel(direction=np.flatnonzero(dataset.is_in_plane(flat)))
    for name in (*dataset.sets(flat), *(("phi_i",) if "phi_i" in flat.coords else ())):
        values = flat[name].values
        flat = flat.isel(direction=np.flatnonzero(values == values[0]))
    if not flat.sizes["direction"]:
        return
    angles = distinct(flat["theta_i"].values)[0]
    chosen = angles[np.unique(np.linspace(0, len(angles) - 1, min(len(angles), len(COLOURS))).round().astype(int))]
    for angle in chosen:
        curve = flat.isel(direction=np.flatnonzero(np.isclose(flat["theta_i"].values, angle)))
        order = np.argsort(dataset.signed_theta_r(curve), kind="stable")
        kept = order[np.unique(np.linspace(0, len(order) - 1, min(len(order), MOST_POINTS)).round().astype(int))]
        yield curve.isel(direction=kept)


def _scale(values: Values, unit: str) -> tuple[Callable[[Values], Values], tuple[str, str, str]]:
    """From values to parts of the height, NaN where there is none; and what stands at the axis: ends, and the unit."""
    finite = values[np.isfinite(values)]
    positive = finite[finite > 0]
    label = unit_label(unit) or "1"
    if len(positive) and positive.max() > WIDE * positive.min():
        low, high = np.log10(positive.min()), np.log10(positive.max())

        def logarithmic(v: Values) -> Values:
            with np.errstate(divide="ignore", invalid="ignore"):
                place = (np.log10(v) - low) / (high - low)
            return np.where(np.isfinite(place), place, np.nan)

        return logarithmic, (f"{10**low:.1e}", f"{10**high:.1e}", f"f [{label}], log")
    low, high = min(float(finite.min(initial=0.0)), 0.0), float(finite.max(initial=0.0))
    span = (high - low) or 1.0
    return lambda v: (v - low) / span, (f"{low:.2g}", f"{high:.2g}", f"f [{label}]")


def _frame(left: float, top: float, width: float, height: float, words: tuple[str, str, str] | None) -> str:
    """The axis of theta_r, the normal as a line, and the words at the axes."""
    base, middle = top + height, left + width / 2
    lines = (
        f'<path d="M{left:g} {base:g}h{width:g}M{middle:g} {top:g}v{height:g}" stroke="currentColor" opacity=".35"/>'
    )
    if words is None:
        return lines
    ticks = "".join(
        _text(left + width * (angle + 90) / 180, base + 12, f"{angle}°".replace("-", "−"), "middle")
        for angle in (-60, -30, 0, 30, 60)
    )
    low, high, quantity = words
    return "".join(
        [
            f'<g fill="currentColor" font-family="sans-serif" font-size="10">{ticks}',
            _text(left + width / 2, base + 25, "θᵣ", "middle"),
            _text(left - 3, base, low, "end"),
            _text(left - 3, top + 9, high, "end"),
            _text(left + 4, top + 9, quantity, "start"),
            f"</g>{lines}",
        ]
    )


def _text(x: float, y: float, words: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(words)}</text>'
