"""`gonio check`: the plausibility of a model, a scan or a fit, whichever the name turns out to be."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.app.options import ScanOptions
from gonio.app.output import figure, strong, warn
from gonio.app.views import contents
from gonio.app.views.file import named
from gonio.findings import NAMES
from gonio.findings import check as findings_of
from gonio.fitting import Solution
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.measured.check import Finding, Severity
from gonio.model import Model
from gonio.models import catalogue
from gonio.plausibility import FURNACE_ANGLES, QUADRATURE, Verdict, of_scan
from gonio.resampling.hemisphere import Reflectance, reflectances
from gonio.results.energy import findings as energy_findings
from gonio.results.laws import laws, of_fit
from gonio.sampling import hemispherical_reflectance


class Checked(dict[str, list[Verdict]]):
    """Verdicts by what was checked. findings: what is wrong with a scan; None for a model and a fit."""

    findings: list[Finding] | None = None


Values = npt.NDArray[np.float64]


def check(
    target: str,
    values: Mapping[str, float],
    samples: int = 0,
    used: ScanOptions = ScanOptions(),  # noqa: B008 - frozen
) -> Checked:
    """Verdicts by what was checked: each term of a model, or the whole of it; a scan; each set of a fit.

    `values` are a model's weights and shape; without a weight every term is checked alone, at weight 1. With `samples`
    a model's reflectance comes from as many drawn directions at each incidence angle instead of quadrature. `used` is
    what is asked of a scan.
    Raises KeyError for a name that is neither a file nor a model.
    """
    path = Path(target)
    if path.exists():
        if values or samples:
            raise ValueError(
                "--set, --material and --samples belong to a model; a scan and a fit have their own values"
            )
        if (solution := contents.fit_in(path)) is not None:
            used.refuse_for(path, "a fit")
            return _of_solution(path, solution)
        if contents.stack_in(path) is not None:
            raise ValueError(f"{path}: holds many scans, and a check takes one: gonio info says which")
        return _of_scan(path, used.read(path, findings=False))
    if used != ScanOptions():
        raise ValueError(f"{target} is no file, and --select, masks and corrections belong to a scan")
    contents.fit_named(target)  # for what it refuses: a name that can only be that of a file
    return _of_model(catalogue[target], values, samples)


def _of_scan(path: Path, scan: xr.Dataset) -> Checked:
    """The laws, and what is wrong with the scan; warnings that are no mistake of a measurement go to standard error."""
    table: Sequence[Reflectance] | None
    try:
        table = reflectances(scan)
    except ValueError:  # of which the verdict about energy says why
        table = None
    checked = Checked({path.name: of_scan(scan, table)})
    checked.findings = [*findings_of(scan, table or ()), *energy_findings(scan, table or ())]
    for finding in checked.findings:
        if finding.severity is Severity.WARNING and finding.name not in NAMES:
            warn(path, finding)
    return checked


def _of_model(model: Model, values: Mapping[str, float], samples: int) -> Checked:
    if any(name in model.weights for name in values):
        whole = {model.name: (dict(values), dataset.ABSOLUTE)}
    else:
        whole = {
            f"{model.name}, {weight} = 1": (
                {weight: 1.0, **values},
                dataset.ABSOLUTE if model.term_unit(weight) == "sr-1" else "",
            )
            for weight in model.weights
        }
    out = Checked()
    for name, (chosen, unit) in whole.items():
        found = laws(partial(_evaluate, model, chosen), "" if samples else unit)
        out[name] = [*found[:-1], _sampled_energy(model, chosen, samples)] if samples and unit else found
    return out


def _sampled_energy(model: Model, values: Mapping[str, float], samples: int) -> Verdict:
    """The white furnace by Monte Carlo: violated where a reflectance is above 1 by more than four standard errors."""
    estimates = {a: hemispherical_reflectance(model, values, a, n=samples) for a in FURNACE_ANGLES}
    worst = max(estimates, key=lambda a: estimates[a].value)
    figures = {f"DHR({a:g})": e.value for a, e in estimates.items()}
    beyond = estimates[worst].value - 1 > max(4 * estimates[worst].standard_error, QUADRATURE)
    errors = max(e.standard_error for e in estimates.values())
    why = f"{samples} directions an angle, standard error up to {errors:.2g}"
    return Verdict("energy", not beyond, figures, f"theta_i {worst:g} deg", why)


def _of_solution(path: Path, solution: Solution) -> Checked:
    """Verdicts on each set of a fit; ValueError for one whose groups are of other coordinates than a check knows."""
    try:
        found = of_fit(solution)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return Checked({", ".join(part for part in (path.name, words) if part): one for words, one in found.items()})


def _evaluate(model: Model, values: Mapping[str, float], geometry: Geometry) -> Any:
    return model(geometry, values)


def record(checked: Checked) -> Any:
    """The verdicts as plain data; of a scan in an object, with what is wrong with it."""
    verdicts = [
        {"checked": name, "law": v.law, "holds": v.holds, "figures": v.figures, "where": v.where, "why": v.why}
        for name, found in checked.items()
        for v in found
    ]
    return verdicts if checked.findings is None else {"verdicts": verdicts, "findings": named(checked.findings)}


def lines(checked: Checked) -> Any:
    """The verdicts for people, and what mistakes of measurements a scan shows."""
    words = {True: "holds", False: "violated", None: "no verdict"}
    for name, verdicts in checked.items():
        yield strong(name)
        for v in verdicts:
            figures = _figures(v)
            where = f" at {v.where}" if v.where and v.holds is not True else ""
            detail = "; ".join(part for part in (figures + where, v.why) if part)
            yield f"  {v.law}: {words[v.holds]}{': ' + detail if detail else ''}"
    yield from (f"{finding} ({finding.name})" for finding in checked.findings or () if finding.name in NAMES)


def _figures(verdict: Verdict) -> str:
    """The figures of a verdict in a few words; the reflectances as their range."""
    if verdict.law == "energy" and verdict.figures:
        least, most = min(verdict.figures.values()), max(verdict.figures.values())
        return f"directional-hemispherical reflectance {figure(least)} to {figure(most)}"
    return ", ".join(f"{key} {value:.3g}" for key, value in verdict.figures.items() if key != "pairs")
