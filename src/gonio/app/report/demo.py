"""The demo page: the paper's study, reproduced as far as its text allows, as one self-contained HTML file."""

import base64
import csv
import functools
import html
import io
from collections.abc import Callable, Iterable, Sequence
from datetime import date
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np

from gonio.app.output import uncertain
from gonio.app.report import study as paper
from gonio.app.report.study import COMPARED_AT, Sample, Study
from gonio.app.views.figures import predictors
from gonio.comparison.ranking import drop
from gonio.files import naming, refuse_existing, refuse_no_folder, replacing
from gonio.fitting.search.solver import Progress
from gonio.measured.dataset import flatten
from gonio.plotting.components import components
from gonio.plotting.convergence import convergence
from gonio.plotting.curves import curves
from gonio.plotting.error_bars import error_bars
from gonio.plotting.hemisphere import hemisphere
from gonio.plotting.residuals import residuals
from gonio.plotting.style import house_style

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

Rows = Sequence[Sequence[Any]]
Draw = Callable[[], "Figure"]
STUDY_SHARE = 0.6  # of the progress bar; the rest is drawing


def write_demo(folder: Path, *, seed: int, force: bool, progress: Progress) -> Path:
    """Run the study and write index.html and its tables as CSV; returns the page.

    Raises FileExistsError where the page is there and `force` is False, before anything is computed.
    """
    page = folder / "index.html"
    refuse_existing(page, force)
    refuse_no_folder(folder)
    with naming(folder):
        folder.mkdir(exist_ok=True)
    study = paper.run(seed, lambda fraction: progress(STUDY_SHARE * fraction))
    tables = _tables(study)
    drawings = _drawings(study)
    pictures = {}
    for done, (name, draw) in enumerate(drawings.items(), start=1):
        pictures[name] = _picture(draw(), name)
        progress(STUDY_SHARE + (1 - STUDY_SHARE) * done / len(drawings))
    for name, (heads, rows) in tables.items():
        _write_csv(folder / f"{name}.csv", heads, rows, force)
    template = Template(files(__package__).joinpath("demo.html").read_text(encoding="utf-8"))
    text = template.substitute(
        paper.facts(study),
        seed=study.seed,
        noise=f"{100 * paper.NOISE:g}",
        blocked=f"{paper.BLOCKED:g}",
        version=version("gonio"),
        date=date.today().isoformat(),
        **_averages(study),
        **{f"table_{name}": _html_table(*table) for name, table in tables.items()},
        **{f"figure_{name}": picture for name, picture in pictures.items()},
    )
    with replacing(page, force) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return page


def _tables(study: Study) -> dict[str, tuple[Sequence[str], Rows]]:
    return {
        "table1": _table_1(study),
        "shape": _shape(study),
        "solvers": _solvers(study),
        "printed_drops": _printed_drops(study),
        "simulated_errors": _simulated_errors(study),
    }


def _table_1(study: Study) -> tuple[Sequence[str], Rows]:
    """Table 1 recovered: printed ks beside ks fitted with free sigma and gamma."""
    angles = sorted(study.surfaces[0].constants.values["ks"])  # type: ignore[arg-type]
    rows = []
    for surface in study.surfaces:
        name = surface.constants.name
        rows.append([f"{name} printed", *(f"{surface.constants.at(a)['ks']:g}" for a in angles)])
        rows.append([f"{name} fitted", *(_fitted(surface, f"ks[{a:g}]") for a in angles)])
    return ["ks [a.u.] at θᵢ", *(f"{a:g}°" for a in angles)], rows


def _shape(study: Study) -> tuple[Sequence[str], Rows]:
    """The constants that do not depend on the incidence angle, printed and fitted, and gamma read from the curve."""
    rows = []
    for surface in study.surfaces:
        constants = surface.constants.at(30.0)
        for name, unit in (("kdd", "a.u."), ("kid", "a.u."), ("sigma", ""), ("gamma", "deg")):
            read = surface.half_width
            by_curve = uncertain(read.gamma, read.uncertainty) if name == "gamma" and read else ""
            heading = f"{name} [{unit}]" if unit else name
            rows.append([surface.constants.name, heading, f"{constants[name]:g}", _fitted(surface, name), by_curve])
    return ["sample", "constant", "printed", "fitted", "read from the half width"], rows


def _fitted(surface: Sample, name: str) -> str:
    return uncertain(surface.free.values[name], surface.free.uncertainties[name])


def _solvers(study: Study) -> tuple[Sequence[str], Rows]:
    """Exact weights against annealing, sigma and gamma held as the paper holds them."""
    rows = []
    for surface in study.surfaces:
        exact, annealed = surface.exact, surface.annealed
        apart = max(
            abs(annealed.values[n] - v) / exact.uncertainties[n]
            for n, v in exact.values.items()
            if np.isfinite(exact.uncertainties[n])
        )
        rows.append(
            [
                surface.constants.name,
                f"{exact.cost:.6e}",
                f"{annealed.cost:.6e}",
                f"{annealed.cost / exact.cost - 1:+.1e}",
                f"{apart:.2g}",
                f"{surface.speed_up:,.0f}",
            ]
        )
    heads = ["sample", "E exact", "E annealed", "excess of E", "largest shift [u]", "time ratio"]
    return heads, rows


def _printed_drops(study: Study) -> tuple[Sequence[str], Rows]:
    """The 24 percentages of Tables 2 and 3, as printed and recomputed from the printed errors."""
    drops = study.printed["drops"]
    both = zip(drops["torrance-sparrow"]["cells"], drops["t-c"]["cells"], strict=True)
    rows = [
        [sample, f"{angle}°", f"{p1:.2f}", f"{r1:.2f}", f"{p2:.2f}", f"{r2:.2f}"]
        for (sample, angle, p1, r1), (_, _, p2, r2) in both
    ]
    for what, key, form in (
        ("average drop [%]", "average", ".2f"),
        ("average drop of the error", "average_error", ".4f"),
    ):
        pair = [f"{v:{form}}" for k in ("torrance-sparrow", "t-c") for v in drops[k][key]]
        rows.append([what, "", *pair])
    heads = ["sample", "θᵢ", "vs T-S printed [%]", "recomputed", "vs T-C printed [%]", "recomputed"]
    return heads, rows


def _simulated_errors(study: Study) -> tuple[Sequence[str], Rows]:
    """NRMSE of the three models on the simulated scans, beside the printed errors."""
    rows = []
    for surface in study.surfaces:
        name = surface.constants.name
        for k, angle in enumerate(COMPARED_AT):
            ours = [surface.error(m, angle) for m in ("torrance-sparrow", surface.t_c, "cauchy-lorentz")]
            printed = [study.printed["errors"][m][name][k] for m in ("torrance-sparrow", "t-c", "cauchy-lorentz")]
            drops = [f"{drop(ours[0], ours[2]):.1f}", f"{drop(ours[1], ours[2]):.1f}"]
            cells = [f"{v:.4f}" for pair in zip(ours, printed, strict=True) for v in pair]
            rows.append([name, f"{angle:g}°", *cells, *drops])
    models = ("T-S", "T-C", "C-L")
    heads = ["sample", "θᵢ", *(f"{m} {w}" for m in models for w in ("here", "printed"))]
    return [*heads, "vs T-S [%]", "vs T-C [%]"], rows


def _averages(study: Study) -> dict[str, str]:
    """Average drops of nRMSE over the 12 simulated cells, as the paper averages its own."""
    drops: dict[str, list[float]] = {"t_s": [], "t_c": []}
    for surface in study.surfaces:
        for angle in COMPARED_AT:
            best = surface.error("cauchy-lorentz", angle)
            drops["t_s"].append(drop(surface.error("torrance-sparrow", angle), best))
            drops["t_c"].append(drop(surface.error(surface.t_c, angle), best))
    return {f"simulated_{key}": f"{np.mean(values):.1f}" for key, values in drops.items()}


def _drawings(study: Study) -> dict[str, Draw]:
    """Every figure of the page by name, not yet drawn."""
    out: dict[str, Draw] = {}
    for surface in study.surfaces:
        out |= _drawings_of(surface)
    al, sr = study.surfaces[0], next(s for s in study.surfaces if s.constants.name == "SR107")
    out["residuals"] = functools.partial(residuals, _compared(al), predictors(al.rows), title="Al, simulated")
    samples = {f"{s.constants.name}, θᵢ = 40°": (40.0, s.brdf(40.0)) for s in study.surfaces}
    out["figure8"] = functools.partial(hemisphere, samples, unit="a.u.", title="Published constants, as Fig 8")
    angles = {f"SR107 ({letter})": a for letter, a in zip("abcd", (20.0, 30.0, 40.0, 50.0), strict=True)}
    panels = {f"{name}, θᵢ = {a:g}°": (a, sr.brdf(a)) for name, a in angles.items()}
    out["figure9"] = functools.partial(hemisphere, panels, unit="a.u.", title="Published constants, as Fig 9")
    printed = {_LABELS[m]: e for m, e in study.printed["errors"].items() if m in _LABELS}
    out["printed"] = functools.partial(
        error_bars, printed, COMPARED_AT, metric="error as printed", title="Tables 2 and 3 as printed (Fig 12)"
    )
    simulated = {
        label: {s.constants.name: [s.error(_named(m, s), a) for a in COMPARED_AT] for s in study.surfaces}
        for m, label in _LABELS.items()
    }
    out["simulated"] = functools.partial(
        error_bars, simulated, COMPARED_AT, metric="nRMSE", title="The same on scans simulated from eqs 12 and 13"
    )
    histories = {s.constants.name: s.annealed.dataset["history"].values / s.exact.cost for s in study.surfaces}
    out["convergence"] = functools.partial(convergence, histories, exact=1.0, relative=True)
    return out


def _drawings_of(surface: Sample) -> dict[str, Draw]:
    """Curves and components of one surface."""
    scan, name = _compared(surface), surface.constants.name
    title = f"{name}, simulated"
    return {
        f"curves_{name}": functools.partial(curves, scan, predictors(surface.rows), title=title, normalised=True),
        f"components_{name}": functools.partial(
            components, scan, surface.model, surface.free.components, title=f"{title}: the three components"
        ),
    }


def _compared(surface: Sample) -> "xr.Dataset":
    """The scan at the incidence angles that the paper compares at."""
    scan = flatten(surface.scan)
    return scan.isel(direction=np.flatnonzero(np.isin(scan["theta_i"].values, COMPARED_AT)))


_LABELS = {"torrance-sparrow": "T-S", "t-c": "T-C", "cauchy-lorentz": "Cauchy-Lorentz"}


def _named(model: str, surface: Sample) -> str:
    return surface.t_c if model == "t-c" else model


def _picture(figure: "Figure", name: str) -> str:
    """An <img> that holds its own PNG, in a frame that scrolls sideways on a narrow screen."""
    buffer = io.BytesIO()
    with house_style():
        figure.savefig(buffer, format="png", dpi=130)
    data = base64.b64encode(buffer.getvalue()).decode("ascii")
    alt = html.escape(name.replace("_", " "))
    width = int(figure.get_figwidth() * 100)
    return f'<div class="wide"><img alt="{alt}" style="width:{width}px" src="data:image/png;base64,{data}"></div>'


def _html_table(heads: Sequence[str], rows: Rows) -> str:
    def line(cells: Iterable[Any], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(str(cell))}</{tag}>" for cell in cells) + "</tr>"

    body = "\n".join(line(row, "td") for row in rows)
    return f'<div class="wide"><table><thead>{line(heads, "th")}</thead>\n<tbody>{body}</tbody></table></div>'


def _write_csv(path: Path, heads: Sequence[str], rows: Rows, force: bool) -> None:
    with replacing(path, force) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heads)
        writer.writerows(rows)
