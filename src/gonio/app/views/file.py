"""What a file holds, what is wrong with it, and the widths of lobes that can be read from it."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.app.output import faint, figure, strong, table, uncertain
from gonio.app.views import energy
from gonio.comparison.consistency import contradictions
from gonio.comparison.consistency import record as contradicted_record
from gonio.findings import check, lobes
from gonio.findings.lobe import Width
from gonio.formats import read, recognise
from gonio.measured import dataset
from gonio.measured.check import Finding, further
from gonio.measured.half_width import half_widths
from gonio.measured.polarimetry.degree import dolp, in_words
from gonio.measured.sound import is_stated
from gonio.measured.stack import foreign_dims
from gonio.results.energy import findings as energy_findings
from gonio.results.energy import of_table
from gonio.units import unit_label

MOST_LINES, LONGEST = 40, 1000  # of a file's own remarks: lines, and characters of one
MOST_POINTS, MOST_CURVES = 100_000, 1_000  # of a scan whose curves are read for the widths of their lobes
MOST_LOBES = 40  # lines of the table; --json has them all


def describe(path: Path, scan: xr.Dataset | None = None) -> dict[str, Any]:
    """A scan's format, quantity, grid and findings as plain data; of the mended scan where it is given."""
    scan, kind = read(path) if scan is None else scan, recognise(path)
    flat = dataset.flatten(scan)
    used = dataset.in_use(flat)
    stated = int((used & is_stated(flat["uncertainty"].values)).sum()) if "uncertainty" in flat else 0
    in_plane = bool(dataset.is_in_plane(flat).all())
    found = [] if foreign_dims(scan) else of_table(scan)
    wrong = [*check(scan, found), *energy_findings(scan, found)]
    is_small = not foreign_dims(scan) and _is_small(flat) and not dataset.is_degree(scan)
    return {
        "file": str(path),
        "format": kind.title,
        "name": kind.name,
        "quantity": _quantity(scan),
        "stored": scan.attrs.get("stored", ""),
        "unit": scan["brdf"].attrs.get("units", ""),
        "points": int(flat.sizes["direction"]),
        "points_in_use": int(used.sum()),
        "grid": {str(d): n for d, n in scan["brdf"].sizes.items() if d != "direction"},
        "lanes": list(foreign_dims(scan)),
        "theta_i": _distinct(flat, "theta_i"),
        "theta_r": _range(dataset.signed_theta_r(flat) if in_plane else flat["theta_r"].values),
        "phi_i": _distinct(scan, "phi_i"),
        "wavelengths": _distinct(scan, "wavelength"),
        "channels": _distinct(scan, "channel"),
        "polarisation": _distinct(scan, "polarisation"),
        "dolp": [] if foreign_dims(scan) else _degrees(scan),
        "symmetry": _symmetry(scan, in_plane),
        "uncertainty": bool(stated),
        "uncertainty_stated": stated,
        "further": further(flat),
        "provenance": flat.attrs.get("provenance", "").splitlines(),
        "history": flat.attrs.get("history", "").splitlines(),
        "reflectance": energy.record(found),
        "checks": [{"severity": str(f.severity), "what": f.what, "where": f.where, "remedy": f.remedy} for f in wrong],
        "findings": named(wrong),
        "contradicted": contradicted_record(contradictions(dataset.points(scan))) if is_small else [],
        "lobes": [asdict(lobe) | {"status": str(lobe.status)} for lobe in lobes(scan)] if is_small else [],
        "half_widths": _half_widths(flat) if is_small else [],
    }


def named(found: Sequence[Finding]) -> list[dict[str, str]]:
    """What is wrong with a scan as plain data: the name of each mistake, how much it matters, evidence and remedy."""
    return [
        {
            "name": f.name,
            "severity": str(f.severity),
            "evidence": f"{f.what} ({f.where})" if f.where else f.what,
            "remedy": f.remedy,
        }
        for f in found
    ]


def _quantity(scan: xr.Dataset) -> str:
    """What the values are: the reader's own word, else by the modes and the unit."""
    if "quantity" in scan.attrs:
        return str(scan.attrs["quantity"])
    if dataset.is_degree(scan):
        return "degree of linear polarisation"
    modes = _distinct(scan, "mode")
    name = "BSDF" if len(modes) > 1 else "BTDF" if modes == ["transmission"] else "BRDF"
    mueller = "Mueller " if "mueller" in scan else ""
    return f"relative {name}" if scan["brdf"].attrs.get("units") == dataset.RELATIVE else f"{mueller}{name}"


def _symmetry(scan: xr.Dataset, in_plane: bool) -> str:
    if in_plane:
        return "in plane"
    turned = len(_distinct(scan, "phi_i")) > 1
    return str(scan.attrs.get("symmetry") or ("surface turned" if turned else "all azimuths"))


def _distinct(scan: xr.Dataset, name: str) -> list[Any]:
    return np.unique(_rounded(scan[name].values)).tolist() if name in scan.coords else []


def _rounded(values: np.ndarray) -> np.ndarray:
    """Angles that a change of coordinates moved by rounding are one."""
    if values.dtype.kind != "f":
        return values
    small = np.abs(values) < 1e9  # larger ones have no ninth decimal, and rounding multiplies them
    return np.where(small, np.where(small, values, 0.0).round(9), values) + 0.0


def _is_small(flat: xr.Dataset) -> bool:
    """Whether there are so few points and curves that reading them all takes no seconds."""
    curves = len(np.unique(flat["theta_i"].values)) * math.prod(
        len(_distinct(flat, name)) for name in dataset.sets(flat)
    )
    return flat.sizes["direction"] <= MOST_POINTS and curves <= MOST_CURVES


def _degrees(scan: xr.Dataset) -> list[float]:
    """The least and the greatest degree of polarisation that a scan holds or gives; empty where it gives none."""
    try:
        values = dataset.points(dolp(scan))["brdf"].values
    except ValueError:
        return []
    return [float(values.min()), float(values.max())] if values.size else []


def _half_widths(flat: xr.Dataset) -> list[dict[str, Any]]:
    """The paper's gamma, read from every curve."""
    names = ("curve", "gamma", "uncertainty", "floor")
    return [{n: getattr(h, n) for n in names} | {"status": str(h.status)} for h in half_widths(flat)]


def _range(values: np.ndarray) -> list[float]:
    return [round(float(values.min()), 9) + 0.0, round(float(values.max()), 9) + 0.0]


def lines(record: dict[str, Any], gamma: bool = False) -> Iterator[Any]:
    """The same for people; with `gamma` the paper's reading behind the normal too."""
    unit = f" [{unit_label(record['unit'])}]" if unit_label(record["unit"]) else ""
    yield strong(record["file"], f": {record['format']}, {record['quantity']}{unit}")
    yield _facts(record)
    for line in record["provenance"][:MOST_LINES]:
        more = f" .. and {len(line) - LONGEST} more characters; --json has them all" if len(line) > LONGEST else ""
        yield faint(f"# {line[:LONGEST]}{more}")
    if len(record["provenance"]) > MOST_LINES:
        yield faint(f"# and {len(record['provenance']) - MOST_LINES} more lines; --json has them all")
    for finding in record["findings"]:
        name = f" ({finding['name']})" if finding["name"] else ""
        yield f"{finding['severity']}: {finding['evidence']}: {finding['remedy']}{name}"
    for one in record["contradicted"]:
        points = f"{one['points']} point{'s' * (one['points'] != 1)}"
        yield f"note: {one['words']}: a fit leaves {points} out, unless --keep-all is given"
    if not record["findings"] and not record["contradicted"]:
        yield "nothing wrong was found"
    yield from _lobe_lines(record)
    if gamma:
        yield from _gamma_lines(record)


def _lobe_lines(record: dict[str, Any]) -> Iterator[Any]:
    """The lobe of every curve: where its peak lies, and its half width as measured."""
    found = record["lobes"][:MOST_LOBES]
    if not any(lobe["half_width"] == lobe["half_width"] for lobe in found):
        return
    unit = unit_label(record["unit"])
    widths = table("curve", f"peak [{unit}]", "at theta_r [deg]", "half width of the lobe [deg]", left=1)
    for lobe in found:
        half = f"{lobe['half_width']:.1f}" if lobe["half_width"] == lobe["half_width"] else "–"
        mark = "" if lobe["status"] in (Width.BOTH, Width.AT_END, Width.NO_LOBE, Width.NEVER) else " *"
        widths.add_row(lobe["curve"], figure(lobe["peak"]), f"{lobe['theta_r']:.1f}", half + mark)
    yield widths
    if any(lobe["status"] in (Width.TO_NORMAL, Width.FROM_NORMAL) for lobe in found):
        yield "* from one side of the peak: the scan ends before the other falls to half"
    if len(record["lobes"]) > MOST_LOBES:
        yield f"and {len(record['lobes']) - MOST_LOBES} more curves; --json has them all"


def _gamma_lines(record: dict[str, Any]) -> Iterator[Any]:
    """The paper's gamma of every curve, as `--hold gamma=half-width` reads it."""
    if not record["half_widths"]:
        yield "gamma is read from curves in plane, and not from so many"
        return
    widths = table("curve", "gamma [deg]", "behind the normal", left=1)
    widths.columns[2].justify = "left"
    for h in record["half_widths"]:
        width = uncertain(h["gamma"], h["uncertainty"]) if h["gamma"] == h["gamma"] else "–"
        widths.add_row(h["curve"], width, h["status"])
    yield widths


def _facts(record: dict[str, Any]) -> Any:
    """The table of what a scan holds."""
    low, high = record["theta_r"]
    facts = table("", "", left=2)
    facts.show_header = False
    facts.columns[1].no_wrap = False
    facts.add_row("points", f"{record['points']}, {record['points_in_use']} in use, {record['symmetry']}")
    sizes = [f"{name} {size}" for name, size in record["grid"].items() if name not in record["lanes"]]
    for name, parts in (("scans", [f"{n} {record['grid'][n]}" for n in record["lanes"]]), ("grid", sizes)):
        if parts:
            facts.add_row(name, " x ".join(parts))
    if record["stored"]:
        facts.add_row("stored as", record["stored"])
    facts.add_row("theta_i", listed(record["theta_i"], "deg"))
    facts.add_row("theta_r", f"{low:g} to {high:g} deg")
    if record["phi_i"]:
        facts.add_row("surface turned to", listed(record["phi_i"], "deg"))
    for name, unit in (("wavelengths", "nm"), ("channels", ""), ("polarisation", "")):
        if record[name]:
            facts.add_row(name, listed(record[name], unit))
    if record["dolp"]:
        facts.add_row("polarised", _polarised(record))
    if record["reflectance"]:
        facts.add_row("reflectance", energy.in_words(record["reflectance"]))
    facts.add_row("uncertainty", _share_stated(record))
    if record["further"]:
        facts.add_row("kept, not used", ", ".join(record["further"]))
    return facts


def _polarised(record: dict[str, Any]) -> str:
    """The degrees of linear polarisation, and which they are, or how to have them."""
    low, high = record["dolp"]
    words = f"degree of linear polarisation {low:.3g} to {high:.3g}"
    if record["unit"] != dataset.DEGREE:
        return f"{words}: --dolp takes it for the values, gonio plot --figure dolp draws it"
    return f"{words}; {'; '.join(in_words(label) for label in record['polarisation'])}"


def _share_stated(record: dict[str, Any]) -> str:
    """At how many of the values in use a standard uncertainty is stated that can be used."""
    stated, of = record["uncertainty_stated"], record["points_in_use"]
    if stated in (0, of):
        return "stated" if stated else "not stated"
    return f"stated at {stated} of {of} values in use"


def listed(values: list[Any], unit: str, most: int = 12) -> str:
    """Values in a line, or where there are many their number and their ends."""
    texts = [f"{v:g}" if isinstance(v, float) else str(v) for v in values]
    if len(texts) > most:
        return f"{len(texts)} values, {texts[0]} to {texts[-1]} {unit}".strip()
    return f"{', '.join(texts)} {unit}".strip()
