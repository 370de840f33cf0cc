"""What a store of fits holds, which `gonio fit-stack` wrote: as plain data and for people."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.app.output import figure, strong, table
from gonio.app.views.stacks.fitted import statuses_of, undetermined_in, undetermined_lines
from gonio.door.text import clip
from gonio.files import FormatError
from gonio.fitting.stack.manifest import FOLDER, Manifest
from gonio.outside import shortened


def fits_in(path: Path) -> dict[str, Any] | None:
    """What a store of fits holds, as plain data; None where the path is something else.

    Raises FormatError for a damaged store.
    """
    if not (path / FOLDER).is_dir():
        return None
    try:
        with xr.open_dataset(path, engine="zarr", consolidated=False, decode_times=False, chunks=None) as fits:
            return {"file": str(path), "kind": "fits"} | _of_fits(fits, Manifest(path))
    except Exception as error:  # of Zarr, xarray or a manifest that is not whole: any kind
        cause = f"{type(error).__name__}: {error}".splitlines()[0]
        raise FormatError(path, f"is a damaged store of fits ({clip(cause, 120)})") from error


def _of_fits(fits: xr.Dataset, manifest: Manifest) -> dict[str, Any]:
    lanes = [str(d) for d in fits["status"].dims]
    records = list(manifest.records())
    names = [str(v) for v in fits[lanes[0]].values] if len(lanes) == 1 and lanes[0] in fits.coords else []
    values = fits["value"].transpose("parameter", ...).values.reshape(fits.sizes["parameter"], -1)
    return {
        "model": str(fits.attrs["model"]),
        "unit": str(fits.attrs["unit"]),
        "fits": {dim: fits.sizes[dim] for dim in lanes},
        "fitted": sum(record.lanes for record in records),
        "weighting": str(fits.attrs["weighting"]),
        "weighting_reason": str(fits.attrs.get("weighting_reason", "")),
        "statuses": statuses_of(records),
        "undetermined": undetermined_in(records),
        "names": names,
        "values": {
            str(name): _spread(column[np.isfinite(column)])
            for name, column in zip(fits["parameter"].values, values, strict=True)
        },
    }


def _spread(values: np.ndarray) -> dict[str, float | None]:
    """The least, the median and the largest of some values; None of each where there is none."""
    ends = np.quantile(values, [0.0, 0.5, 1.0]).tolist() if values.size else [None] * 3
    return dict(zip(("least", "median", "largest"), ends, strict=True))


def lines(found: dict[str, Any]) -> "Iterator[Any]":
    """The same for people."""
    scans = int(np.prod(list(found["fits"].values())))
    yield strong(found["file"], f": {found['model']} fitted to {found['fitted']} of {scans} scans")
    yield ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in found["statuses"].items())
    yield f"weighting of every fit: {found['weighting']}, as {found['weighting_reason'] or 'asked'}"
    yield from undetermined_lines(found["undetermined"], scans)
    rows = table("value", "least", "median", "largest")
    for name, spread in found["values"].items():
        rows.add_row(name, *("" if value is None else figure(value) for value in spread.values()))
    yield rows
    if found["names"]:
        yield shortened("names: ", found["names"], "", most=160)
    yield "xarray.open_zarr opens it: value, uncertainty, status of every scan"
