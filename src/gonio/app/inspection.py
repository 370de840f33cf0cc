"""What a file holds, what is wrong with it, and the half widths that can be read from it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from gonio.app import present
from gonio.fit.half_width import half_widths
from gonio.measured import dataset
from gonio.measured.check import check
from gonio.measured.formats import read, recognise
from gonio.units import label


def describe(path: Path) -> dict[str, Any]:
    """A scan's format, quantity, grid and findings as plain data."""
    scan = read(path)
    flat = dataset.flatten(scan)
    used = dataset.points(flat)
    unit = scan["brdf"].attrs.get("units", "")
    in_plane = bool(dataset.is_in_plane(flat).all())
    return {
        "file": str(path),
        "format": recognise(path).title,
        "quantity": "relative BRDF" if unit == dataset.RELATIVE else "BRDF",
        "unit": unit,
        "points": int(flat.sizes["direction"]),
        "points_in_use": int(used.sizes["direction"]),
        "theta_i": np.unique(flat["theta_i"].values).tolist(),
        "theta_r": _range(dataset.signed_theta_r(flat) if in_plane else flat["theta_r"].values),
        "wavelengths": np.unique(flat["wavelength"].values).tolist() if "wavelength" in flat.coords else [],
        "channels": np.unique(flat["channel"].values).tolist() if "channel" in flat.coords else [],
        "symmetry": "in plane" if in_plane else "all azimuths",
        "uncertainty": "uncertainty" in flat,
        "provenance": flat.attrs.get("provenance", "").splitlines(),
        "history": flat.attrs.get("history", "").splitlines(),
        "checks": [
            {"severity": str(f.severity), "what": f.what, "where": f.where, "remedy": f.remedy} for f in check(flat)
        ],
        "half_widths": [
            {
                "curve": h.curve,
                "gamma": h.gamma,
                "uncertainty": h.uncertainty,
                "floor": h.floor,
                "status": str(h.status),
            }
            for h in half_widths(flat)
        ],
    }


def _range(values: np.ndarray) -> list[float]:
    return [float(values.min()), float(values.max())]


def tables(record: dict[str, Any]) -> Iterator[Any]:
    """The same for people."""
    yield f"[bold]{record['file']}[/bold]: {record['format']}, {record['quantity']} \\[{label(record['unit'])}]"
    low, high = record["theta_r"]
    facts = present.table("", "", left=2)
    facts.show_header = False
    facts.add_row("points", f"{record['points']}, {record['points_in_use']} in use, {record['symmetry']}")
    facts.add_row("theta_i", _listed(record["theta_i"], "deg"))
    facts.add_row("theta_r", f"{low:g} to {high:g} deg")
    for name, unit in (("wavelengths", "nm"), ("channels", "")):
        if record[name]:
            facts.add_row(name, _listed(record[name], unit))
    facts.add_row("uncertainty", "stated" if record["uncertainty"] else "not stated")
    yield facts
    for line in record["provenance"]:
        yield f"[dim]# {_escaped(line)}[/dim]"
    for finding in record["checks"]:
        where = f" ({finding['where']})" if finding["where"] else ""
        yield f"{finding['severity']}: {finding['what']}{where}: {finding['remedy']}"
    if not record["checks"]:
        yield "nothing wrong was found"
    if any(h["gamma"] == h["gamma"] for h in record["half_widths"]):
        widths = present.table("backscatter side of", "half width [deg]", "status", left=1)
        widths.columns[2].justify = "left"
        for h in record["half_widths"]:
            width = present.uncertain(h["gamma"], h["uncertainty"]) if h["gamma"] == h["gamma"] else "–"
            widths.add_row(h["curve"], width, h["status"])
        yield widths


def _listed(values: list[Any], unit: str, most: int = 12) -> str:
    texts = [f"{v:g}" if isinstance(v, float) else str(v) for v in values]
    shown = texts if len(texts) <= most else [*texts[: most - 1], "..", texts[-1]]
    return f"{', '.join(shown)} {unit}".strip()


def _escaped(text: str) -> str:
    from rich.markup import escape

    return escape(text)
