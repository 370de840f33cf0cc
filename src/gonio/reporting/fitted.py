"""Section 9: the model, its values and how sure they are, how good it is where, and what else was tried."""

import inspect
import math
from collections.abc import Iterator

import numpy as np

from gonio.comparison.metrics import METRICS, metrics_by_incidence
from gonio.fitting.certainty.correlation import Free
from gonio.fitting.certainty.identifiability import combinations, determinations
from gonio.reporting.blocks import Cell, Facts, Notes, Section, Table, angle, count, filled, number
from gonio.reporting.case import Case
from gonio.reporting.citation import reference
from gonio.reporting.figures import residual_pictures
from gonio.results.numbers import interval, uncertain
from gonio.results.prediction import is_logarithmic
from gonio.results.values import AT_BOUND, HELD, Value, values
from gonio.units import unit_label

TOGETHER = 0.9  # correlation, in size, that is said in words
MOST_PAIRS = 12
LEFT_OUT = {"theta_i": "each incidence angle", "out-of-plane": "all that is out of plane"}
MANY = 400  # free values beyond which their correlations are not listed
MOST_TRIED = 10  # models that are listed
MOST_ANGLES = 60  # of incidence whose metrics are listed, and reflectances


def section(case: Case) -> Section:
    """Everything about the fit."""

    def blocks() -> Iterator[object]:
        yield _what(case)
        yield Notes("terms", list(_terms(case)))
        yield _parameters(case)
        yield Notes("certainty", list(_certainty(case)))
        yield _metrics(case)
        yield _by_incidence(case)
        yield from residual_pictures(case)
        yield from _filled(case)
        yield _tried(case)
        yield Notes("provisos", list(_provisos(case)))

    return Section("model", "Model", filled(blocks()))


def _what(case: Case) -> Facts:
    solution, attrs = case.solution, case.solution.dataset.attrs
    floor = float(attrs["noise_floor"])
    rows = [
        ("name of the model", Cell(case.model)),
        ("title", Cell(solution.model.title)),
        ("publication", Cell(reference(solution.model.cite))),
        ("how the search ended", Cell(str(solution.status))),
        ("points fitted", count(attrs["points"])),
        ("effective number of values", Cell(f"{solution.effective_values:.3g}")),
        ("weighting", Cell(f"{attrs['weighting']}{_reason(str(attrs['weighting_reason']))}")),
        ("loss", Cell(str(attrs["loss"]))),
    ]
    rows += [("noise floor", number(floor, unit=case.unit))] if floor > 0 else []
    rows += [(f"breaks {law}", Cell(why)) for law, why in solution.model.violates.items()]
    return Facts(rows)


def _reason(reason: str) -> str:
    return f", as {reason}" if reason else ", as asked"


def _terms(case: Case) -> Iterator[str]:
    """The sum that the model is, and each term in the words of its declaration."""
    model = case.solution.model
    yield "f = " + " + ".join(f"{weight} × {_called(term)}" for weight, term in model.terms.items())
    for weight, term in model.terms.items():
        said = (inspect.getdoc(term) or "").partition("\n\n")[0].replace("\n", " ")
        yield f"{_called(term)} (weight {weight}): {said}" if said else f"{_called(term)} (weight {weight})"


def _called(term: object) -> str:
    return str(getattr(term, "__name__", "term")).lstrip("_").replace("_", " ")


def _parameters(case: Case) -> Table:
    found, has_systematic = list(values(case.solution)), case.solution.has_systematic
    systematic = case.solution.dataset["uncertainty_systematic"].values.tolist()
    heads = [
        "parameter",
        "value",
        "u",
        *["u, systematic"] * has_systematic,
        "95 % interval",
        "unit",
        "meaning",
        "status",
    ]
    rows = []
    for value, shift in zip(found, systematic, strict=True):
        parameter = case.solution.model.shape.get(value.parameter)
        name = f"{value.parameter}, {value.set}" if value.by else value.parameter
        rows.append(
            [
                *(Cell(name), *_number_and_u(value), *[number(shift, 2)] * has_systematic, _interval(value)),
                *(
                    Cell(unit_label(value.unit)),
                    Cell(
                        parameter.help
                        if parameter
                        else f"weight of {_called(case.solution.model.terms[value.parameter])}"
                    ),
                    Cell(value.status),
                ),
            ]
        )
    return Table("parameters", "Parameters: value, standard uncertainty u and interval of the fit", heads, rows)


def _number_and_u(value: Value) -> list[Cell]:
    """The value with as many digits as its uncertainty gives sense to, and that; neither has a meaning at a bound."""
    if value.status == HELD:
        return [number(value.value, 6), Cell("held")]
    if value.status == AT_BOUND:
        return [number(value.value, 6), Cell("–")]
    text, sign, spread = uncertain(value.value, value.uncertainty).partition(" ± ")
    if not sign:
        return [number(value.value, 4), Cell("not determined")]
    return [Cell(text, float(text), True), Cell(spread, float(spread), True)]


def _interval(value: Value) -> Cell:
    text = interval(value.low, value.high)
    ends = [None if part in ("∞", "−∞") else float(part) for part in text.split(" to ")] if " to " in text else None
    return Cell(text, ends, True)


def _certainty(case: Case) -> Iterator[str]:
    """Values that the data do not determine, those that go together, and combinations that are determined."""
    free = Free.of(case.solution)
    if len(free.names) > MANY:
        yield f"The {len(free.names)} fitted values are too many to list which of them go together."
        return
    farthest = float(case.points["theta_r"].max())
    yield from (f"{one.name}: {one.words}" for one in determinations(case.solution, farthest) if not one.determined)
    at_bound = case.solution.dataset["at_bound"].values[free.places]
    inside = np.flatnonzero(np.isfinite(free.variance) & (free.variance > 0) & ~at_bound)
    together = np.triu(free.correlation(inside), 1)
    pairs = np.argwhere(np.abs(together) > TOGETHER)
    order = np.argsort(-np.abs(together[tuple(pairs.T)]), kind="stable")
    for a, b in pairs[order[:MOST_PAIRS]]:
        one, other, r = free.names[inside[a]], free.names[inside[b]], together[a, b]
        how = "a higher" if r > 0 else "a lower"
        yield f"A higher {one} is made up for by {how} {other}: correlation {r:.3f}.".replace("-0", "−0")
    if len(pairs) > MOST_PAIRS:
        yield f"{len(pairs) - MOST_PAIRS} more pairs have correlations beyond {TOGETHER:g}."
    for combined in combinations(case.solution):
        yield f"{combined.name} is determined: {uncertain(combined.value, combined.uncertainty)}"


def _metrics(case: Case) -> Table:
    first = "log10_rmse" if is_logarithmic(case.solution) else "E"
    validated = case.solution.answer.get("validated", {})
    heads = ["metric", "fitted", *["left out"] * bool(validated), "meaning"]
    rows = []
    for name, value in sorted(case.solution.metrics.items(), key=lambda pair: pair[0] != first):
        left_out = validated.get(name)
        own = [number(left_out, 3) if left_out is not None else Cell("–")] if validated else []
        label = METRICS[name].title + (", which the fit makes small" if name == first else "")
        rows.append([Cell(label), number(value, 3), *own, Cell(METRICS[name].help)])
    by = str(validated.get("by"))
    by = f"{by} parts of blocks of directions" if by.isdigit() else LEFT_OUT.get(by, by)
    caption = "How far the fit is off" + (
        f", and where it was not fitted ({by}, left out in turn)" if validated else ""
    )
    return Table("metrics", caption, heads, rows)


def _by_incidence(case: Case) -> Table:
    points = case.points
    found = metrics_by_incidence(points, case.solution.brdf(points))
    names = ("log10_rmse", "delta", "nrmse")
    rows = [[angle(theta_i), *(number(one[name], 3) for name in names)] for theta_i, one in found.items()]
    rows = rows if 1 < len(rows) <= MOST_ANGLES else []
    heads = ["θᵢ [deg]", *(METRICS[name].title for name in names)]
    return Table("by-incidence", "Errors by incidence angle", heads, rows, left=0)


def _filled(case: Case) -> Iterator[Table]:
    """Reflectances of the model over the whole hemisphere, as the check of energy found them."""
    try:
        verdicts = {words: next(v for v in found if v.law == "energy") for words, found in case.laws.items()}
    except ValueError:  # of which the section on plausibility says why
        return
    verdicts = {words: verdict for words, verdict in verdicts.items() if verdict.figures}
    if not verdicts or case.quantity != "BRDF":
        return
    names = list(dict.fromkeys(name for verdict in verdicts.values() for name in verdict.figures))[:MOST_ANGLES]
    heads = [f"θᵢ = {name.removeprefix('DHR(').removesuffix(')')}°" for name in names]
    rows = [[Cell(w or "all"), *(number(v.figures.get(n, math.nan)) for n in names)] for w, v in verdicts.items()]
    caption = (
        f"Directional-hemispherical reflectance of {case.model}, which fills the directions that were not measured"
    )
    yield Table("model-reflectance", caption, ["set", *heads], rows)


def _tried(case: Case) -> Table:
    answer = case.solution.answer
    every = answer.get("tried", []) if len(answer.get("tried", [])) > 1 else []
    metric = METRICS[answer["metric"]].title if every else ""
    rows = [
        [count(k), Cell(str(one["model"])), _error(one["validated"])]
        for k, one in enumerate(every[:MOST_TRIED], start=1)
    ]
    rest = f"; {len(every) - MOST_TRIED} more come after these" if len(every) > MOST_TRIED else ""
    caption = f"Models that were tried, by their error where they were not fitted{rest}"
    return Table("tried", caption, ["rank", "model", f"left-out {metric}"], rows, left=0)


def _error(value: float | None) -> Cell:
    return Cell("not ranked: quick fits say that it does not come first") if value is None else number(value, 3)


def _provisos(case: Case) -> Iterator[str]:
    """What one has to know to read the values."""
    attrs, answer = case.solution.dataset.attrs, case.solution.answer
    for one in answer.get("contradicted", []):
        yield f"Left out of every fit: {one['words']} ({one['points']} points)."
    if attrs["points_discounted"]:
        yield f"{attrs['points_discounted']} points count for less than half under the {attrs['loss']} loss."
    if attrs["searches"] > 1 and attrs["searches_alike"] == 1 and attrs["next_minimum"] > 1:
        yield f"A lower minimum may exist: each of {attrs['searches']} searches met another one."
    if 0 < attrs["points_searched"] < attrs["points"]:
        yield f"Starts were searched on {attrs['points_searched']} of {attrs['points']} points, the minimum on all."
    for smoothed, how in case.solution.smooth.items():
        yield f"{smoothed} is smooth over {how.by}; the uncertainties do not include the bias that smoothing adds."
