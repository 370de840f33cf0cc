"""The style of every figure: colours that colour-blind readers can distinguish, units on every axis, the files."""

import io
import textwrap
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.files import refuse_existing, replacing
from gonio.measured import dataset
from gonio.outside import printable
from gonio.plotting.page import current
from gonio.plotting.page.room import refuse_crowded, thin_labels
from gonio.plotting.page.sheet import POINTS
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
THETA_R = "θᵣ [deg], positive is forward"
THETA_R_SHORT = "θᵣ [deg]"
LINEAR, LOG = "linear", "log"
SCALES = (LINEAR, LOG)  # the rows of a figure of curves, from above
ROOM_OF_THETA_R = 2.64  # inches a panel, with the usual text, from which the label has room
SPREAD = 0.612  # of the size of text: the mean width of a character of a heading
UNDATED: dict[str, dict[str, None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
LARGEST_PNG = 100e6  # pixels


QUANTITIES = {frozenset(["reflection"]): "BRDF", frozenset(["transmission"]): "BTDF"}


def quantity_of(scan: xr.Dataset) -> str:
    """BRDF, BTDF, or BSDF of both modes; DoLP of degrees of linear polarisation."""
    if "brdf" in scan and dataset.is_degree(scan):
        return "DoLP"
    return QUANTITIES.get(frozenset(dataset.modes(scan)), "BSDF")


def value_label(unit: str, quantity: str = "BRDF") -> str:
    """The label of an axis of values in a unit of scans."""
    return f"{quantity} [{unit_label(unit)}]" if unit_label(unit) else quantity


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
    import matplotlib as mpl

    return {"color": colour(k), "linestyle": DASHES[k % len(DASHES)], "linewidth": mpl.rcParams["lines.linewidth"]}


def colour(k: int) -> Any:
    """The k-th colour of the style."""
    import matplotlib as mpl

    colours = mpl.rcParams["axes.prop_cycle"].by_key().get("color", COLOURS)
    return colours[k % len(colours)]


def house_style() -> AbstractContextManager[None]:
    """Matplotlib settings shared by all figures, and those of the page; wrap drawing and saving in it."""
    import matplotlib as mpl
    from matplotlib.rcsetup import cycler

    settings: dict[Any, Any] = {
        "font.family": "DejaVu Sans",
        "font.size": 9,
        "axes.titlesize": 9.5,
        "axes.labelsize": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "axes.axisbelow": True,  # no line of the grid runs through a dot
        "grid.color": "0.9",
        "grid.linewidth": 0.6,
        "axes.prop_cycle": cycler(color=COLOURS),
        "lines.linewidth": 1.5,
        "legend.frameon": False,
        "legend.fontsize": 8.5,
        "figure.titlesize": 10,
        "figure.dpi": 110,
        "savefig.dpi": 160,
        "svg.fonttype": "none",
        "svg.hashsalt": "gonio",
        "pdf.fonttype": 42,  # TrueType: editors and journals want fonts, not outlines
    } | current().settings
    return mpl.rc_context(settings)


def new_figure(width: float, height: float) -> "Figure":
    """A figure without a window or global state, as large as the page, or as it needs where none is asked for."""
    from matplotlib.figure import Figure

    return Figure(figsize=current().sides or (width, height), layout="constrained")


def mark_specular(ax: "Axes", theta_i: float) -> None:
    """A thin line at the specular angle."""
    ax.axvline(theta_i, color="0.75", linewidth=0.8, zorder=0)


def angle_ticks(ax: "Axes", least: float, most: float) -> None:
    """Ticks at round angles across a scan, on a page of a given size as many as have room."""
    if current().sides:
        from matplotlib.ticker import MaxNLocator

        ax.xaxis.set_major_locator(MaxNLocator("auto", steps=[1, 1.5, 3, 4.5, 6, 9, 10]))
        return
    step = 30 if most - least > 90 else 15
    ax.set_xticks([t for t in range(-90, 91, step) if least - 5 <= t <= most + 5])


def shared_legend(figure: "Figure", of: "Axes | Sequence[Any]", columns: int = 4) -> None:
    """One legend for all panels, of axes or of the artists given, under them, in as many columns as have room."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    renderer = FigureCanvasAgg(figure).get_renderer()  # type: ignore[no-untyped-call]
    handles: list[Any]
    if isinstance(of, Sequence):
        handles, labels = list(of), [str(artist.get_label()) for artist in of]
    else:
        handles, labels = of.get_legend_handles_labels()
    for count in range(min(columns, len(labels)), 0, -1):
        legend = figure.legend(handles, labels, loc="outside lower center", ncols=count)
        if count == 1 or legend.get_window_extent(renderer).width <= figure.get_figwidth() * figure.dpi:
            break
        legend.remove()


def scale_word(scale: str, scales: Sequence[str]) -> str:
    """The scale of an axis in words, where a figure has several."""
    words = {LINEAR: ", linear", LOG: ", logarithmic"}
    return words[scale] if len(scales) > 1 else ""


def theta_r_label(figure: "Figure", panels: int) -> str:
    """The label of an axis of theta_r, in words where so many panels side by side have room for them."""
    room = figure.get_figwidth() / panels * POINTS / current().points
    return THETA_R if room >= ROOM_OF_THETA_R else THETA_R_SHORT


def heading(figure: "Figure", title: str, *notes: str) -> None:
    """A title over all panels and what is not drawn, as many lines as the width needs; the page may name the title."""
    import matplotlib as mpl
    from matplotlib.font_manager import FontProperties

    asked = current().title
    title = title if asked is None else printable(asked)
    parts = [part for part in (title, *notes) if part]
    if not parts:
        return
    size = FontProperties(size=mpl.rcParams["figure.titlesize"]).get_size_in_points()
    room = max(int(figure.get_figwidth() * 72 / (SPREAD * size)), 8)
    lines: list[str] = []
    for part in parts:
        if lines and len(lines[-1]) + len(part) + 5 <= room:
            lines[-1] += f"  ·  {part}"
        else:
            lines += textwrap.wrap(part, room) or [part]
    figure.suptitle("\n".join(lines), parse_math=False)  # a name may hold $


def explanation(words: str) -> str:
    """What the marks of a figure mean, in its heading; nothing on a page of a given size, whose caption says it."""
    return "" if current().sides else words


def save(figure: "Figure", path: Path, suffixes: Iterable[str] = (".png", ".svg"), force: bool = False) -> list[Path]:
    """Write a figure beside `path` in each format.

    Raises FileExistsError if a file exists and `force` is False, and ValueError where the figure has no room on the
    page that is asked for. Files are the same for the same figure: they hold no date.
    """
    targets = [path.with_name(path.name + suffix) for suffix in suffixes]
    for target in targets:
        refuse_existing(target, force)
    _make_printable(figure)
    with house_style():
        fit_to_page(figure)
        if any(target.suffix.lower() == ".png" for target in targets):
            _refuse_vast(figure)
        engine = figure.get_layout_engine()
        try:
            for target in targets:
                kind = target.suffix.lower().removeprefix(".")
                with replacing(target, force) as temporary:
                    figure.savefig(temporary, format=kind, metadata=UNDATED.get(kind))
                figure.set_layout_engine("none")  # to find room for the panels anew takes as long as to draw them
        finally:
            figure.set_layout_engine(engine)
    return targets


def fit_to_page(figure: "Figure") -> None:
    """Labels as many as have room, where something is asked of the page; ValueError where the figure has no room."""
    if not current().is_plain:
        with house_style():
            thin_labels(figure)
            refuse_crowded(figure, current().points)


def _refuse_vast(figure: "Figure") -> None:
    import matplotlib as mpl

    resolution = mpl.rcParams["savefig.dpi"]
    resolution = figure.dpi if resolution == "figure" else resolution
    width, height = figure.get_size_inches() * resolution
    if width * height > LARGEST_PNG:
        raise ValueError(f"a PNG of {width:.0f} x {height:.0f} pixels is too large: give fewer dpi, or write .pdf")


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
