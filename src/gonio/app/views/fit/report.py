"""One fit as plain data and for people: what the data do not determine, and how good it is."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from gonio.app.output import LEVEL, figure, strong, table, uncertain
from gonio.app.views.fit import provisos, values
from gonio.app.views.judged import judged_lines, judged_record
from gonio.results.implausible import implausible
from gonio.results.values import values as values_of

if TYPE_CHECKING:
    from rich.table import Table

    from gonio.app.views.fit.certainty import Certainty
    from gonio.comparison import Row
    from gonio.fitting.certainty.outliers import Scrutiny
    from gonio.fitting.solution import Solution


def solution_record(row: "Row", scrutiny: "Scrutiny", certainty: "Certainty") -> dict[str, Any]:
    """A fit as plain data, with what it was asked besides."""
    from gonio.design.remedy import remedy_of
    from gonio.fitting.certainty.identifiability import combinations, determinations

    attrs = row.solution.dataset.attrs
    return {
        "model": attrs["model"],
        "solver": attrs["solver"],
        "status": attrs["status"],
        "seconds": attrs["seconds"],
        "points": attrs["points"],
        "points_searched": attrs["points_searched"],
        "minima": provisos.minima_record(row.solution),
        "weighting": attrs["weighting"],
        "noise_floor": attrs["noise_floor"],
        "loss": provisos.loss_record(row.solution),
        "outliers": provisos.outlier_record(scrutiny),
        "instrument": provisos.instrument_record(row.solution),
        "covariance": row.solution.covariance_kind,
        "parameters": row.solution.parameters(),
        "intervals": {"level": LEVEL} | _intervals(row.solution),
        "implausible": list(implausible(row.solution)),
        "metrics": dict(row.metrics),
        "lg_rmse_points": judged_record(row.judged),
        "aicc": row.aicc,
        "bic": row.bic,
        "effective_values": row.effective_values,
        "smooth": {name: one._asdict() for name, one in row.solution.smooth.items()},
        "verdicts": {
            d.name: {
                "determined": d.determined,
                "inflation": d.inflation,
                "partners": list(d.partners),
                "words": d.words,
            }
            for d in determinations(row.solution, row.farthest, certainty.profiles, remedy_of(row.solution))
        },
        "combinations": {c.name: {"value": c.value, "uncertainty": c.uncertainty} for c in combinations(row.solution)},
    } | certainty.record()


def _intervals(solution: "Solution") -> dict[str, list[float]]:
    """Low and high end by parameter, with the systematic part that the scan states, within the bounds of the fit."""
    found = values_of(solution)
    return {f"{v.parameter}[{v.group}]" if v.by else v.parameter: [v.low, v.high] for v in found}


def determination_lines(row: "Row", certainty: "Certainty") -> Iterator[Any]:
    """Which values the data do not determine, and which combinations they do; nothing where all are determined."""
    from gonio.design.remedy import remedy_of
    from gonio.fitting.certainty.identifiability import combinations, determinations

    for one in determinations(row.solution, row.farthest, certainty.profiles, remedy_of(row.solution)):
        if not one.determined:
            yield strong(one.name, f": {one.words}")
    for combination in combinations(row.solution):
        stated = uncertain(combination.value, combination.uncertainty)
        yield strong(combination.name, f": determined, {stated}")


def metrics_table(metrics: Mapping[str, float]) -> "Table":
    from gonio.comparison import METRICS

    out = table("metric", "value", "meaning")
    out.columns[2].justify = "left"
    for name, value in metrics.items():
        out.add_row(METRICS[name].title, figure(value), METRICS[name].brief)
    return out


def lines(which: str, row: "Row", scrutiny: "Scrutiny", certainty: "Certainty") -> Iterator[Any]:
    """A fit for people; `which` names what was fitted."""
    from gonio.fitting import Projection
    from gonio.fitting.covariance_kinds import COVARIANCES, DEFAULT

    solution, attrs = row.solution, row.solution.dataset.attrs
    yield strong(attrs["model"], f" fitted to {which}, {attrs['points']} points")
    how = attrs["solver"] if attrs["settings"] in ("", repr(Projection())) else attrs["settings"]
    yield f"{how}, {attrs['seconds']:.3g} s: {attrs['status']}"
    yield from provisos.sample_lines(solution)
    yield from provisos.minima_lines(solution)
    yield from provisos.grain_lines(solution, scrutiny.points)
    yield from provisos.instrument_lines([solution])
    yield from provisos.loss_lines(solution)
    yield from values.smooth_lines(row)
    if solution.covariance_kind != DEFAULT:
        yield f"{solution.covariance_kind} covariance: {COVARIANCES[solution.covariance_kind]}"
    yield from values.solution_tables(solution)
    yield from (strong("not physical", f": {words}") for words in implausible(solution))
    yield from determination_lines(row, certainty)
    yield from provisos.outlier_lines(scrutiny)
    yield from certainty.tables()
    yield metrics_table(row.metrics)
    yield from judged_lines([row.judged], solution.unit)
