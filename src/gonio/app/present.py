"""What people and programs see: tables, progress bars and JSON."""

import ast
import inspect
import json
import math
import sys
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gonio.app import provisos
from gonio.files import replacing
from gonio.model import declarations
from gonio.units import unit_label

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from gonio.app.certainty import Certainty
    from gonio.compare import Row
    from gonio.fitting.certainty.outliers import Scrutiny
    from gonio.materials import Material
    from gonio.model import Model, Term


LEVEL = 0.95  # of the intervals that are shown


def console() -> "Console":
    from rich.console import Console

    return Console(highlight=False)


def emit_json(data: Any, target: str, force: bool = False) -> None:
    """Write plain data as JSON to a file, or to standard output for `-`; NaN and infinities become null."""
    from gonio.fitting.solution import without_infinities

    text = json.dumps(without_infinities(data), indent=2, ensure_ascii=False, allow_nan=False)
    if target == "-":
        sys.stdout.write(text + "\n")
        return
    with replacing(Path(target), force) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


@contextmanager
def progress_bar(description: str) -> Iterator[Callable[[float], None]]:
    """A bar on standard error while work goes on, drawn only where a person looks at a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    terminal = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=terminal, transient=True, disable=not terminal.is_terminal) as bar:
        task = bar.add_task(description, total=1.0)
        yield lambda fraction: bar.update(task, completed=fraction)


def uncertain(value: float, uncertainty: float, systematic: float = math.nan) -> str:
    """A value with as many digits as its standard uncertainty gives sense to: two of the uncertainty's own.

    The systematic part follows where there is one.
    """
    if math.isnan(uncertainty):
        return f"{value:.6g} (held)"
    if not math.isfinite(uncertainty):
        return f"{value:.4g} (not determined)"
    parts = [value, uncertainty] + [systematic] * (not math.isnan(systematic))
    if uncertainty <= 0 or (value == 0 and uncertainty < 1e-300):
        return " ± ".join([f"{value:.6g}", "0", *(f"{part:.2g}" for part in parts[2:])])
    digits = max(1 - math.floor(math.log10(uncertainty)), 0)
    if digits > 6 or max(map(abs, parts)) >= 1e7:
        return " ± ".join([f"{value:.4e}", *(f"{part:.1e}" for part in parts[1:])])
    return " ± ".join(f"{part:.{digits}f}" for part in parts)


def table(*headings: str, title: str = "", left: int = 1) -> "Table":
    """A table of one line a row; the first `left` columns are text, the others numbers."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    out = Table(
        title=title or None, box=box.SIMPLE_HEAD, title_justify="left", title_style="bold", pad_edge=False, padding=0
    )
    for k, heading in enumerate(headings):
        out.add_column(escape(heading), justify="left" if k < left else "right", no_wrap=True, overflow="ellipsis")
    return out


def model_record(model: "Model") -> dict[str, Any]:
    """A model's declaration as plain data."""
    return {
        "name": model.name,
        "title": model.title,
        "cite": model.cite,
        "confidence": model.confidence,
        "weights": list(model.weights),
        "shape": [
            {"name": n, "default": p.default, "lower": p.lower, "upper": p.upper, "unit": p.unit, "help": p.help}
            for n, p in model.shape.items()
        ],
        "violates": dict(model.violates),
    }


def models_table(models: Sequence["Model"]) -> "Table":
    out = table("model", "what it is", "breaks", left=3)
    for model in models:
        mark = "" if model.confidence == "confirmed" else f" ({model.confidence})"
        out.add_row(model.name, model.title + mark, "".join(sorted(law[0].upper() for law in model.violates)))
    return out


BREAKS = "breaks: E energy unbounded, P can be negative, R not reciprocal"


def formula(model: "Model") -> str:
    """The sum of terms, each with its weight and shape parameters."""
    return "f = " + " + ".join(f"{w} {t.__name__}({', '.join(declarations(t))})" for w, t in model.terms.items())


def equation(term: "Term") -> str:
    """The body of a term as it is written, which is its equation; empty where the source is not at hand."""
    try:
        source = textwrap.dedent(inspect.getsource(inspect.unwrap(term)))
    except OSError:
        return ""
    function = next(node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef))
    documented = ast.get_docstring(function) is not None
    above = function.body[0].end_lineno if documented else function.body[0].lineno - 1
    return textwrap.dedent("\n".join(source.splitlines()[above:]))


WEIGHT_UNITS = {"sr-1": "1", "deg-1": "deg/sr", "1": "1/sr"}


def physics_rows(model: "Model") -> Iterator[tuple[str, str, str, str]]:
    """Each weight with its term's reciprocity, range of reflectance and least value, computed at default shape."""
    from gonio.app.checking import check

    for name, (positive, exchanged, energy) in check(model.name, {}).items():
        if exchanged.holds is None:
            reciprocity = exchanged.why
        else:
            worst = f"worst ln ratio {abs(exchanged.figures.get('worst ln ratio', 0)):.2g}"
            reciprocity = "holds" if exchanged.holds else worst
        spread = energy.figures.values()
        reflectance = f"{figure(min(spread))} to {figure(max(spread))}" if spread else "not normalised"
        yield name.split(", ")[-1].removesuffix(" = 1"), reciprocity, reflectance, figure(positive.figures["least"])


def model_lines(model: "Model") -> Iterator[Any]:
    """One model in full, as on the catalogue page: terms, equations, shape parameters, and its physics."""
    from rich.markup import escape
    from rich.padding import Padding

    yield f"[bold]{model.name}[/bold]: {model.title}"
    yield f"source {model.cite}, {model.confidence}\n"
    yield formula(model) + "\n"
    for weight, term in model.terms.items():
        unit = WEIGHT_UNITS[model.term_unit(weight)]
        yield f"[bold]{weight}[/bold] \\[{unit}]: {(term.__doc__ or '').splitlines()[0]}"
        if text := equation(term):
            yield Padding(f"[dim]{escape(text)}[/dim]", (0, 0, 1, 4))
    for name, p in model.shape.items():
        unit = f" {unit_label(p.unit)}".rstrip()
        yield f"[bold]{name}[/bold]: {p.help}: {p.default:g}{unit}, from {p.lower:g} to {p.upper:g}"
    rows = table("at default shape", "reciprocity", "reflectance to 85 deg", "least value", left=2)
    for row in physics_rows(model):
        rows.add_row(*row)
    yield rows
    for law, why in model.violates.items():
        yield f"breaks {law}: {why}"
    yield f"[dim]gonio draw {model.name}, gonio check {model.name} and gonio eval {model.name} show more[/dim]"


def material_record(material: "Material") -> dict[str, Any]:
    """Optical constants as plain data."""
    return {
        "name": material.name,
        "title": material.title,
        "cite": material.cite,
        "where": material.where,
        "note": material.note,
        "lines_only": material.lines,
        "wavelength_um": material.wavelength_um.tolist(),
        "n": material.n.tolist(),
        "k": material.k.tolist(),
    }


def materials_table(materials: Sequence["Material"]) -> "Table":
    out = table("material", "source", "wavelengths [µm]", left=3)
    for one in materials:
        out.add_row(one.name, one.cite, ", ".join(f"{w:g}" for w in one.wavelength_um))
    return out


ROWS_OF_A_MATERIAL = 24


def material_lines(material: "Material") -> Iterator[Any]:
    """One material in full: source, notes, and its constants with the reflectance at normal incidence."""
    from rich.markup import escape

    yield f"[bold]{escape(material.name)}[/bold]: {escape(material.title)}"
    yield escape(f"source {material.cite}, {material.where}".removesuffix(", "))
    if material.note:
        yield escape(material.note)
    out = table("wavelength [µm]", "n", "k", "reflectance", left=0)
    rows = list(zip(material.wavelength_um, material.n, material.k, strict=True))
    step = -(-len(rows) // ROWS_OF_A_MATERIAL)
    for wavelength, n, k in rows[::step]:
        out.add_row(f"{wavelength:g}", f"{n:.4g}", f"{k:.4g}", f"{((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2):.4f}")
    yield out
    if step > 1:
        yield f"every {step}th of {len(rows)} rows"


def solution_record(row: "Row", scrutiny: "Scrutiny", certainty: "Certainty") -> dict[str, Any]:
    """A fit as plain data, with what it was asked besides."""
    from gonio.fitting.certainty.identifiability import combinations, verdicts

    attrs = row.solution.dataset.attrs
    return {
        "model": attrs["model"],
        "solver": attrs["solver"],
        "status": attrs["status"],
        "seconds": attrs["seconds"],
        "points": attrs["points"],
        "points_searched": attrs.get("points_searched", attrs["points"]),
        "weighting": attrs["weighting"],
        "noise_floor": attrs.get("noise_floor", 0.0),
        "loss": provisos.loss_record(row.solution),
        "outliers": provisos.outlier_record(scrutiny),
        "instrument": provisos.instrument_record(row.solution),
        "covariance": row.solution.covariance_kind,
        "parameters": row.solution.parameters(),
        "intervals": {"level": LEVEL} | {n: list(ends) for n, ends in row.solution.intervals(LEVEL).items()},
        "metrics": dict(row.metrics),
        "aicc": row.aicc,
        "bic": row.bic,
        "effective_values": row.effective_values,
        "smooth": {name: one._asdict() for name, one in row.solution.smooth.items()},
        "verdicts": {
            v.name: {
                "determined": v.determined,
                "inflation": v.inflation,
                "partners": list(v.partners),
                "words": v.words,
            }
            for v in verdicts(row.solution, row.farthest, certainty.profiles)
        },
        "combinations": {
            c.name: {"value": c.value, "uncertainty": c.uncertainty} for c in combinations(row.model, row.solution)
        },
    } | certainty.record()


def verdict_lines(row: "Row", certainty: "Certainty") -> Iterator[str]:
    """What the data do not tell, in words, and what they tell instead; nothing where all is determined."""
    from rich.markup import escape

    from gonio.fitting.certainty.identifiability import combinations, verdicts

    for verdict in verdicts(row.solution, row.farthest, certainty.profiles):
        if not verdict.determined:
            yield f"[bold]{escape(verdict.name)}[/bold]: {escape(verdict.words)}"
    for found in combinations(row.model, row.solution):
        yield f"[bold]{escape(found.name)}[/bold]: determined, {uncertain(found.value, found.uncertainty)}"


def metrics_table(metrics: Mapping[str, float]) -> "Table":
    from gonio.compare import METRICS

    out = table("metric", "value", "meaning")
    out.columns[2].justify = "left"
    for name, value in metrics.items():
        out.add_row(METRICS[name].title, figure(value), METRICS[name].brief)
    return out


def ranking_table(scan: str, rows: Sequence["Row"]) -> "Table":
    """Models side by side, with the drop of nRMSE against the paper's two references, as in Tables 2 and 3."""
    from gonio.compare import METRICS, drop, reference_errors

    if rows and rows[0].validated:
        return _validated_table(scan, rows)
    references = reference_errors(rows)
    heads = [metric.title for metric in METRICS.values()]
    out = table("model", "", "free", *heads, *(f"vs {name}" for name in references), title=scan)
    for row in rows:
        own = row.metrics["nrmse"]
        drops = [_percent(drop(error, own)) if error != own else "–" for error in references.values()]
        found = (figure(row.metrics[name]) for name in METRICS)
        out.add_row(row.model.name, mark(row), _count(row), *found, *drops)
    out.caption, out.caption_justify = "\n".join(_marks_in_words(rows)), "left"
    return out


# One letter for a status other than converged, so that a fit that failed never looks like a good one.
MARKS = {"AT_BOUND": "b", "NOT_DETERMINED": "?", "STEPS_EXHAUSTED": "!", "TOO_FEW_POINTS": "#"}


def mark(row: "Row") -> str:
    return MARKS.get(row.solution.status.name, "")


def _marks_in_words(rows: Sequence["Row"]) -> Iterator[str]:
    """What the marks of these rows mean, each once."""
    met = {row.solution.status.name: row.solution.status.value.split(":")[0] for row in rows}
    return (f"{letter} {met[name]}" for name, letter in MARKS.items() if name in met)


def _validated_table(scan: str, rows: Sequence["Row"]) -> "Table":
    """Models by their error where they were not shown the measurement, and which differences mean something."""
    from gonio.compare import behind

    out = table("model", "", "free", "fitted", "left out", "behind", "AICc", "BIC", title=f"{scan}, lg RMSE")
    for row in rows:
        mean, error = behind(row, rows[0])
        if row is rows[0]:
            apart = "–"
        else:
            apart = f"{mean:.4f}±{error:.4f}" if math.isfinite(error) else f"{mean:.4f}"
            apart += " ≈" if abs(mean) < 2 * error else "  "
        errors = (row.metrics["log10_rmse"], row.validated["log10_rmse"])
        out.add_row(
            row.model.name,
            mark(row),
            _count(row),
            *(f"{error:.4f}" if math.isfinite(error) else "–" for error in errors),
            apart,
            *(f"{v:.0f}" if math.isfinite(v) else "–" for v in (row.aicc, row.bic)),
        )
    meaning = "behind the first: mean over the parts ± standard error; ≈ alike, within twice that"
    out.caption, out.caption_justify = "\n".join([meaning, *_marks_in_words(rows)]), "left"
    return out


def _count(row: "Row") -> str:
    """How many values a fit had the use of: a whole number where nothing is smooth."""
    return f"{row.effective_values:.1f}".removesuffix(".0")


def _percent(value: float) -> str:
    """A drop in eight characters; one far below zero says only that."""
    if value < -1e4:
        return "< -1e4%"
    return f"{value:+.1f}%" if abs(value) < 100 else f"{value:+.0f}%"


ANGLES_A_TABLE = 7


def incidence_tables(rows: Sequence["Row"]) -> "Iterator[Table]":
    """NRMSE of every model at every incidence angle."""
    angles = list(rows[0].by_incidence)
    for start in range(0, len(angles), ANGLES_A_TABLE):
        some = angles[start : start + ANGLES_A_TABLE]
        out = table("nRMSE at theta_i [deg]", *(f"{angle:g}" for angle in some))
        for row in rows:
            out.add_row(row.model.name, *(figure(row.by_incidence[angle]["nrmse"]) for angle in some))
        yield out


def figure(value: float) -> str:
    """Three significant digits, or a dash for a figure that the data do not allow."""
    if not math.isfinite(value):
        return "–"
    return f"{value:.3g}".replace("e-0", "e-").replace("e+0", "e+")
