"""What a path holds, for the commands that take any file: a fit, a stack of scans, raw readings, or one scan."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.app.flags import MOST_CHARACTERS
from gonio.app.options import ScanOptions
from gonio.app.output import LEVEL, figure, strong, table
from gonio.app.views import file
from gonio.app.views.fit import provisos, values
from gonio.app.views.measuring.held import described_raw
from gonio.app.views.stacks import results
from gonio.files import FormatError
from gonio.fitting.covariance_kinds import COVARIANCES
from gonio.fitting.solution import Solution
from gonio.fitting.stored import is_solution
from gonio.measured.stack import foreign_dims
from gonio.measured.stack_store import is_store, open_stack
from gonio.models import catalogue
from gonio.outside import printable
from gonio.units import unit_label


def fit_in(path: Path) -> Solution | None:
    """The fit in a file that `gonio fit --out` or `Solution.save` wrote; None where the path holds something else.

    Raises FormatError, with the byte offset, for a damaged file.
    """
    return Solution.load(path) if is_solution(path) else None


FIT_SUFFIX = ".nc"


def fit_named(name: str) -> Solution | None:
    """The fit in the file of that name, where a model may be named too; None for a model, and where no file is meant.

    Raises FormatError for a file that holds no fit, and FileNotFoundError where a name that can only be a file's is of
    none.
    """
    if name in catalogue:
        return None
    path = Path(name)
    if len(name) < MOST_CHARACTERS and path.exists():
        if (solution := fit_in(path)) is None:
            raise FormatError(path, "holds no fit: give a model of gonio models, or what gonio fit --out writes")
        return solution
    if path.suffix == FIT_SUFFIX or len(path.parts) > 1:
        raise FileNotFoundError(f"{printable(name)}: there is no such file, and no model of that name")
    return None


def stack_in(path: Path) -> xr.Dataset | None:
    """The stack of scans in a Zarr store, its values not read; None where the path holds one scan, or something else.

    Raises FormatError, with the file in the store, for a damaged store.
    """
    stack = open_stack(path) if is_store(path) else None
    return stack if stack is not None and foreign_dims(stack) else None


def described(path: Path, used: ScanOptions, gamma: bool = False) -> tuple[dict[str, Any], Iterator[Any]]:
    """What a path holds, as plain data, whose `kind` says which entries there are, and the same for people.

    used: what is asked of a scan. gamma: print the paper's half widths behind the normal too.
    """
    if (solution := fit_in(path)) is not None:
        used.refuse_for(path, "a fit")
        record = {"file": str(path), "kind": "fit"} | _of_fit(solution)
        return record, _fit_lines(record, solution)
    if (stack := stack_in(path)) is not None:
        used.refuse_for(path, "a stack of scans")
        record = {"file": str(path), "kind": "stack"} | _of_stack(stack)
        return record, _stack_lines(record)
    if (fits := results.fits_in(path)) is not None:
        used.refuse_for(path, "fits of a stack")
        return fits, results.lines(fits)
    if (raw := described_raw(path)) is not None:
        used.refuse_for(path, "raw readings")
        return raw
    record = {"kind": "scan"} | file.describe(path, used.read(path, findings=False))
    return record, file.lines(record, gamma)


def _of_fit(solution: Solution) -> dict[str, Any]:
    attrs = solution.dataset.attrs
    return {
        **{name: attrs[name] for name in ("model", "solver", "status", "seconds", "points", "unit", "weighting")},
        "covariance": solution.covariance_kind,
        "loss": provisos.loss_record(solution),
        "instrument": provisos.instrument_record(solution),
        "smooth": {name: one._asdict() for name, one in solution.smooth.items()},
        "parameters": solution.parameters(),
        "intervals": {"level": LEVEL} | {n: list(ends) for n, ends in solution.intervals(LEVEL).items()},
    }


def _of_stack(stack: xr.Dataset) -> dict[str, Any]:
    lanes, brdf = foreign_dims(stack), stack["brdf"]
    return {
        "format": "Zarr",
        "unit": brdf.attrs["units"],
        "scans": {d: brdf.sizes[d] for d in lanes},
        "each": {str(d): n for d, n in brdf.sizes.items() if d not in lanes},
        "type": str(brdf.dtype),
        "megabytes": brdf.nbytes / 1e6,
        "variables": sorted(map(str, stack.data_vars)),
        **{name: _distinct(stack, name) for name in ("theta_i", "phi_i", "wavelength", "channel")},
        "theta_r": _ends(stack["theta_r"].values),
    }


def _distinct(stack: xr.Dataset, name: str) -> list[Any]:
    return np.unique(stack[name].values).tolist() if name in stack.coords else []


def _ends(values: np.ndarray) -> list[float]:
    return [float(values.min()), float(values.max())] if values.size else []


def _fit_lines(record: dict[str, Any], solution: Solution) -> Iterator[Any]:
    unit = unit_label(record["unit"])
    yield strong(record["file"], f": {record['model']} fitted to {record['points']} points [{unit}]")
    yield f"{record['solver']}, {record['seconds']:.3g} s: {record['status']}"
    yield from provisos.sample_lines(solution)
    yield from provisos.instrument_lines([solution])
    yield from provisos.loss_lines(solution)
    for smoothed, how in solution.smooth.items():
        yield f"{smoothed} is smooth over {how.by}, strength {figure(float(how.strength))}"
    if record["covariance"]:
        yield f"{record['covariance']} covariance: {COVARIANCES[record['covariance']]}"
    yield from values.solution_tables(solution)


def _stack_lines(record: dict[str, Any]) -> Iterator[Any]:
    unit = unit_label(record["unit"])
    yield strong(record["file"], f": stack of {math.prod(record['scans'].values())} scans [{unit}]")
    facts = table("", "", left=2)
    facts.show_header = False
    facts.columns[1].no_wrap = False
    for name in ("scans", "each"):
        facts.add_row(name, " x ".join(f"{dim} {size}" for dim, size in record[name].items()))
    for name, of in (("theta_i", "deg"), ("phi_i", "deg"), ("wavelength", "nm"), ("channel", "")):
        if record[name]:
            facts.add_row(name, file.listed(record[name], of))
    if record["theta_r"]:
        facts.add_row("theta_r", "{:g} to {:g} deg".format(*record["theta_r"]))
    facts.add_row("variables", ", ".join(record["variables"]))
    facts.add_row("stored", f"{record['type']}, {figure(record['megabytes'])} MB unpacked")
    yield facts
    yield "the values were not read: gonio fit-stack reads them block by block"
