"""Sections 1 to 6: what was measured, with what, how and where, and what the symbols mean; and what nobody stated."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.formats.bird.metadata import METADATA
from gonio.measured import dataset
from gonio.measured.sound import is_stated
from gonio.reporting import bird
from gonio.reporting.about import About, checked, further, over, stated
from gonio.reporting.bird import Item
from gonio.reporting.blocks import Cell, Facts, Lines, Notes, Picture, Pictures, Section, angle, count, filled, number
from gonio.reporting.case import Case
from gonio.results.content import scan_name

MOST_LISTED = 12  # values of a coordinate in one line
MOST_HEADER = 60  # lines of a file's header


def sections(case: Case) -> tuple[list[Section], Section]:
    """The first six sections, and the list of what is not stated, which is the last of the report."""
    about = over(case.known.about, _of_the_file(case))
    asked = {
        "Identification": (bird.IDENTIFICATION, _identified(case)),
        "Sample": (bird.SAMPLE, []),
        "Instrument": (bird.INSTRUMENT, _instrument(case)),
        "Method": (bird.METHOD, _method(case)),
        "Environment": (bird.ENVIRONMENT, []),
    }
    out, missing = [], []
    for title, (items, known) in asked.items():
        own = {label for label, _ in known}
        told = [(item.label, text) for item in items if (text := stated(about, item))]
        lacking = [i.label for i in items if i.label not in own | {label for label, _ in told}]
        missing += [(title, Cell(", ".join(lacking)))] * bool(lacking)
        facts = Facts([*known, *((label, Cell(text)) for label, text in told if label not in own)])
        lines = _header(case) if title == "Identification" else iter(())
        blocks = filled(iter((facts, *lines))) or [Notes("none", ["Nothing of this is stated."], plain=True)]
        out.append(Section(title.lower(), title, blocks))
    every: list[Item] = [item for items, _ in asked.values() for item in items]
    if rest := list(further(about, every)):
        out.append(
            Section(
                "remarks",
                "Further statements",
                [Facts([(name, Cell(text)) for name, text in rest], title="All else that was stated")],
            )
        )
    return [*out, _conventions(case)], _not_stated(missing)


def _not_stated(missing: Sequence[tuple[str, Cell]]) -> Section:
    words = (
        "Items that a report of scatter has (after ASTM E2387 and the BiRD format), and that neither the scan nor its "
    )
    words += (
        "description states. They are listed so that a reader sees what is not known; gonio claims conformity to no "
    )
    words += "standard."
    if not missing:
        return Section("not-stated", "Not stated", [Notes("explained", ["Every item was stated."], plain=True)])
    return Section("not-stated", "Not stated", [Notes("explained", [words], plain=True), Facts(missing)])


def _of_the_file(case: Case) -> About:
    """The metadata of a BiRD file, which has the same keys; what does not follow them is not looked at."""
    try:
        found = json.loads(case.scan.attrs.get(METADATA, "{}"))
        return checked(found) if isinstance(found, dict) else {}
    except (ValueError, RecursionError):
        return {}


def _identified(case: Case) -> list[tuple[str, Cell]]:
    rows = [("date of the report", Cell(case.known.date))] if case.known.date else []
    rows.append(("scan", Cell(scan_name(case.solution))))
    for k, file in enumerate(case.known.files, start=1):
        digest = f", SHA-256 {file.sha256}" if file.sha256 else ", a folder"
        rows.append(("file" if k == 1 else f"file {k}", Cell(file.name + digest)))
    return rows


def _header(case: Case) -> Iterator[Lines]:
    """The lines at the head of the file."""
    lines = [line for line in str(case.scan.attrs.get("provenance", "")).splitlines() if line.strip()]
    if len(lines) > MOST_HEADER:
        lines = [*lines[:MOST_HEADER], f".. and {len(lines) - MOST_HEADER} more lines"]
    yield Lines("header", "What the file says of itself", lines)


def _instrument(case: Case) -> list[tuple[str, Cell]]:
    rows = []
    wavelengths = _values(case, "wavelength")
    if wavelengths:
        rows.append(("wavelength", _listed(wavelengths, "nm")))
    for name in ("channel", "polarisation"):
        if found := _values(case, name):
            label = "incident polarisation" if name == "polarisation" else name
            rows.append((label, _listed(found, "")))
    cones = case.solution.instrument
    for name, half in (("source", cones.source_half_angle), ("detector", cones.detector_half_angle)):
        if half:
            rows.append((f"half-angle of the {name}, folded into the fit", number(half, unit="deg")))
    return rows


def _method(case: Case) -> list[tuple[str, Cell]]:
    flat = dataset.flatten(case.scan)
    used, every = int(dataset.in_use(flat).sum()), flat.sizes["direction"]
    absolute = "absolute: in 1/sr" if case.is_absolute else "relative: not calibrated, in arbitrary units"
    origin = f"no: the values are {case.scan.attrs['simulated']}" if "simulated" in case.scan.attrs else ""
    rows = [("measured", Cell(origin))] if origin else []
    rows += [
        ("absolute or relative", Cell(f"{absolute}, as the file has it")),
        ("values in use", count(used)),
        ("values masked or missing", count(every - used)),
        *_masked(flat),
        ("incidence angles", _listed(_values(case, "theta_i"), "deg")),
        ("plane", Cell("in the plane of incidence" if dataset.is_in_plane(case.flat).all() else "out of plane too")),
    ]
    if turned := _values(case, "phi_i"):
        rows.append(("surface turned to", _listed(turned, "deg")))
    rows.append(("standard uncertainties", Cell(_uncertainties(case))))
    return rows


def _masked(flat: xr.Dataset) -> Iterator[tuple[str, Cell]]:
    """Why values are masked, with the number of each."""
    if "mask" not in flat:
        return
    meanings = {k: word.replace("_", " ") for k, word in enumerate(dataset.MASK_MEANINGS)}
    found = zip(*np.unique(flat["mask"].values[flat["mask"].values != 0], return_counts=True), strict=True)
    if told := [f"{number_of} {meanings.get(int(flag), 'for another reason')}" for flag, number_of in found]:
        yield "masked because", Cell(", ".join(told))


def _uncertainties(case: Case) -> str:
    if "uncertainty" not in case.flat:
        return "the scan states none"
    told, of = int(is_stated(case.flat["uncertainty"].values).sum()), case.flat.sizes["direction"]
    return "stated at every value" if told == of else f"stated at {told} of {of} values" if told else "none is stated"


def _values(case: Case, name: str) -> list[float | str]:
    if name not in case.flat.coords:
        return []
    values = np.unique(case.flat[name].values)
    return np.unique(values.round(6)).tolist() if values.dtype.kind == "f" else [str(v) for v in values.tolist()]


def _listed(values: Sequence[float | str], unit: str) -> Cell:
    """Values in a line; of many the number and the ends, which are those of the data too."""
    texts = [angle(v).text if isinstance(v, float) else v for v in values]
    if len(texts) > MOST_LISTED:
        return Cell(f"{len(texts)} values, {texts[0]} to {texts[-1]} {unit}".strip())
    return Cell(f"{', '.join(texts)} {unit}".strip())


def _conventions(case: Case) -> Section:
    what = (
        f"f is the {case.quantity} in 1/sr: reflected radiance over irradiance, without the cosine of the detector."
        if case.is_absolute
        else f"f is the {case.quantity} in arbitrary units: the data are relative, and nothing about energy follows."
    )
    lines = [
        what,
        "θᵢ and θᵣ are the angles of source and detector from the surface normal. φ = φᵣ − φᵢ is the azimuth between "
        "them: 180° is forward, the half-plane of the specular direction, and 0 is backscatter.",
        "In the plane of incidence θᵣ has a sign: positive is forward, so that the specular direction is θᵣ = θᵢ.",
        "u is a standard uncertainty (k = 1). U = 2 u is the expanded uncertainty (k = 2), which covers about 95 % "
        "where errors are normal.",
    ]
    if "polarisation" in case.flat.coords:
        lines.append("s is perpendicular to the plane of ray and normal, p lies in it, and u is unpolarised light.")
    sketch = (Path(__file__).parent / "templates" / "conventions.svg").read_text(encoding="utf-8")
    pictures = Pictures("", [Picture(sketch, "Directions as gonio counts them")])
    return Section("conventions", "Quantity and conventions", [Notes("conventions", lines, plain=True), pictures])
