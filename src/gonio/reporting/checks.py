"""Sections 10 to 13: whether it can be true, what computed it, what is wrong with the scan, and how to cite."""

import platform
from collections.abc import Iterator, Sequence

from gonio.findings import check
from gonio.plausibility import Verdict, of_scan
from gonio.reporting.blocks import Cell, Facts, Lines, Notes, Section, Table, count, filled, number
from gonio.reporting.case import Case
from gonio.reporting.citation import of_gonio, reference
from gonio.resampling.hemisphere import Reflectance
from gonio.results.energy import findings as energy_findings
from gonio.results.implausible import implausible
from gonio.results.numbers import figure

EIGHT = 8.0  # deg, of the geometry of reflectance that is called d/8
NEAR = 2.5  # deg: light no farther off stands for it
HOLDS = {True: "holds", False: "violated", None: "no verdict"}


def plausibility(case: Case) -> Section:
    """Positivity, reciprocity and energy of the measured values and of the fit, and values that no surface has."""
    rows = [_row("measured values", verdict) for verdict in of_scan(case.scan, case.table)]
    notes = [f"not physical: {words}" for words in implausible(case.solution)]
    try:
        for words, verdicts in case.laws.items():
            rows += [_row(f"fit of {case.model}" + f", {words}" * bool(words), verdict) for verdict in verdicts]
    except ValueError as error:
        notes.append(f"the fit was not checked: it {error}")
    caption = "Laws of physics. Measured pairs are to be judged by their uncertainty."
    table = Table("laws", caption, ["of", "law", "verdict", "amount and place"], rows, left=4)
    return Section("plausibility", "Plausibility", filled(iter((table, Notes("not-physical", notes)))))


def _row(of: str, verdict: Verdict) -> list[Cell]:
    if verdict.law == "energy" and verdict.figures:
        ends = min(verdict.figures.values()), max(verdict.figures.values())
        amount = f"directional-hemispherical reflectance {figure(ends[0])} to {figure(ends[1])}"
    else:
        amount = ", ".join(f"{name} {value:.3g}" for name, value in verdict.figures.items() if name != "pairs")
    place = f"at {verdict.where}" if verdict.where and verdict.holds is not True else ""
    detail = "; ".join(part for part in (" ".join((amount, place)).strip(), verdict.why) if part)
    return [Cell(of), Cell(verdict.law), Cell(HOLDS[verdict.holds]), Cell(detail or "–")]


def warnings(case: Case) -> Section:
    """What `gonio info` says of the scan."""
    found = [*check(case.scan, case.table), *energy_findings(case.scan, case.table)]
    lines = [f"{one}{f' ({one.name})' if one.name else ''}" for one in found]
    return Section("warnings", "Warnings about the scan", [Notes("warnings", lines or ["Nothing wrong was found."])])


def software(case: Case) -> Section:
    """Versions, seed, command line and history."""
    attrs = case.solution.dataset.attrs
    rows = [
        ("fitted with", Cell(str(attrs["versions"]) or "not stated")),
        ("Python that wrote this page", Cell(platform.python_version())),
        ("precision", Cell(str(attrs["precision"]))),
    ]
    rows += [("device", Cell(str(attrs["device"])))] * bool(attrs["device"])
    rows += [("solver", Cell(str(attrs["settings"] or attrs["solver"])))]
    rows += [("seed", count(case.known.seed))] if case.known.seed is not None else []
    rows += [("command", Cell(case.known.command))] if case.known.command else []
    history = str(attrs["data_history"]).splitlines()
    return Section("software", "Software and history", [Facts(rows), *_history(history)])


def _history(lines: Sequence[str]) -> Iterator[Lines]:
    if lines:
        yield Lines("history", "What was done with the data before the fit", lines)


def citation(case: Case) -> Section:
    """How to cite gonio and the model."""
    rows = [("gonio", Cell(of_gonio())), (f"model {case.model}", Cell(reference(case.solution.model.cite)))]
    words = "A result that rests on gonio cites gonio, the paper of the model, and the source of the data."
    return Section("citation", "How to cite", [Notes("explained", [words], plain=True), Facts(rows)])


def reflectance(case: Case) -> Iterator[Table]:
    """The reflectance over the directions that were measured, each with how much of the hemisphere they cover."""
    rows = [[Cell(_light(one), one.where), number(one.value), number(100 * one.covered, 3)] for one in case.table]
    heads = ["direction of the light", "reflectance", "hemisphere covered [%]"]
    caption = (
        "Reflectance of the measured values, integrated over the measured solid angle alone: no model fills the rest."
    )
    if any(map(_is_at_eight, case.table)):
        caption += (
            f" As d/8 is marked what is lit from within {NEAR:g}° of {EIGHT:g}°: by reciprocity it is the reflectance "
            "of diffuse light seen from there, the specular part included."
        )
    yield Table("measured-reflectance", caption, heads, rows)


def _is_at_eight(one: Reflectance) -> bool:
    return abs(one.theta_i - EIGHT) <= NEAR


def _light(one: Reflectance) -> str:
    return f"{one.where} (as d/8)" if _is_at_eight(one) else one.where
