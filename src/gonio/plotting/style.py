"""The style of every figure: colours that colour-blind readers can distinguish, units on every axis, PNG and SVG."""

import io
import textwrap
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.files import refuse_existing, replacing
from gonio.measured import dataset
from gonio.outside import printable
from gonio.units import unit_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Values = npt.NDArray[np.float64]
Predictor = Callable[[xr.Dataset], Values]  # a fitted model: the BRDF at the directions of a flat scan
Band = Callable[[xr.Dataset], tuple[Values, Values]]  # the lower and upper end of its 95 % interval there

# Okabe and Ito's palette, ordered by contrast on white; line styles repeat the distinction for grey prints.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1.2, 1.2)), (0, (5, 1.5, 1.2, 1.5)))
MEASURED: dict[str, Any] = {
    "color": "0.25",
    "marker": "o",
    "markersize": 2.4,
    "linestyle": "none",
    "markeredgewidth": 0,
}
HOLLOW: dict[str, Any] = {"markerfacecolor": "white", "markeredgewidth": 0.6}  # over MEASURED: not measured
BARS: dict[str, Any] = {"fmt": "none", "ecolor": "0.6", "elinewidth": 0.7}
SPREAD = 0.085  # inches: the mean width of a character of a heading
THETA_R = "θᵣ [deg], positive is forward"


QUANTITIES = {frozenset(["reflection"]): "BRDF", frozenset(["transmission"]): "BTDF"}


def quantity_of(scan: xr.Dataset) -> str:
    """BRDF, BTDF, or BSDF of both modes."""
    return QUANTITIES.get(frozenset(dataset.modes(scan)), "BSDF")


def value_label(unit: str, quantity: str = "BRDF") -> str:
    """The label of an axis of values in a unit of scans."""
    return f"{quantity} [{unit_label(unit)}]"


GREEK = {"alpha": "α", "beta": "β", "gamma": "γ", "kappa": "κ", "rho": "ρ", "sigma": "σ", "theta": "θ", "tau": "τ"}


def symbol(name: str) -> str:
    """The name of a parameter as a symbol: `rho_s[30]` with a Greek letter and an index."""
    head, bracket, group = name.partition("[")
    letters, _, index = head.partition("_")
    if letters not in GREEK:
        return name
    written = rf"$_\mathrm{{{index}}}$" if index.isalnum() else f"_{index}" * bool(index)
    return GREEK[letters] + written + bracket + group


def as_label(text: str) -> str:
    """A name from outside as the label of a line: none of it is taken for a formula, or by a terminal or XML."""
    return printable(text).replace("$", r"\$")


def line_style(k: int) -> dict[str, Any]:
    """Colour and dashes of the k-th curve."""
    return {"color": COLOURS[k % len(COLOURS)], "linestyle": DASHES[k % len(DASHES)], "linewidth": 1.5}


def house_style() -> AbstractContextManager[None]:
    """Matplotlib settings shared by all figures; wrap drawing and saving in it."""
    import matplotlib as mpl

    return mpl.rc_context(
        {
            "font.family": "DejaVu Sans",
            "font.size": 9,
            "axes.titlesize": 9.5,
            "axes.labelsize": 9,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.grid": True,
            "grid.color": "0.9",
            "grid.linewidth": 0.6,
            "legend.frameon": False,
            "legend.fontsize": 8.5,
            "figure.dpi": 110,
            "savefig.dpi": 160,
            "svg.fonttype": "none",
            "svg.hashsalt": "gonio",
        }
    )


def new_figure(width: float, height: float) -> "Figure":
    """A figure without a window or global state."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def mark_specular(ax: "Axes", theta_i: float) -> None:
    """A thin line at the specular angle."""
    ax.axvline(theta_i, color="0.75", linewidth=0.8, zorder=0)


def angle_ticks(ax: "Axes", least: float, most: float) -> None:
    """Ticks at round angles across a scan."""
    step = 30 if most - least > 90 else 15
    ax.set_xticks([t for t in range(-90, 91, step) if least - 5 <= t <= most + 5])


def shared_legend(figure: "Figure", ax: "Axes", columns: int = 4) -> None:
    """One legend for all panels, under them."""
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(columns, len(labels)))


def heading(figure: "Figure", *parts: str) -> None:
    """A title over all panels, from the parts that are not empty, in as many lines as the width of the figure needs."""
    room = int(figure.get_figwidth() / SPREAD)
    lines: list[str] = []
    for part in (p for p in parts if p):
        if lines and len(lines[-1]) + len(part) + 5 <= room:
            lines[-1] += f"  ·  {part}"
        else:
            lines += textwrap.wrap(part, room) or [part]
    if lines:
        figure.suptitle("\n".join(lines), fontsize=10, parse_math=False)  # a name may hold $


def save(figure: "Figure", path: Path, suffixes: Iterable[str] = (".png", ".svg"), force: bool = False) -> list[Path]:
    """Write a figure beside `path` in each format; FileExistsError if a file exists and `force` is False."""
    targets = [path.with_name(path.name + suffix) for suffix in suffixes]
    for target in targets:
        refuse_existing(target, force)
    _make_printable(figure)
    with house_style():
        for target in targets:
            with replacing(target, force) as temporary:
                figure.savefig(temporary, metadata={"Date": None} if target.suffix == ".svg" else None)
    return targets


def svg(figure: "Figure") -> str:
    """The figure as one `<svg>` element, for a page that holds it."""
    _make_printable(figure)
    buffer = io.StringIO()
    with house_style():
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :].strip()


def _make_printable(figure: "Figure") -> None:
    """Names from files may hold characters that no SVG may hold: those are shown as their escapes."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        text.set_text(printable(text.get_text(), keep="\n"))
