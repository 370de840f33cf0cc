"""Albedos of one surface and of the pixels of a stack, as plain data and for people."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.albedo import Albedo, albedo_maps, black_sky, blue_sky, nbar, white_sky
from gonio.app.output import figure, table, uncertain
from gonio.door.text import clip
from gonio.files import FormatError, replacing
from gonio.fitting.solution import Solution
from gonio.fitting.stack.manifest import FOLDER
from gonio.model import Model
from gonio.models import catalogue

TITLES = {
    "black_sky": "black-sky",
    "white_sky": "white-sky",
    "blue_sky": "blue-sky",
    "nbar": "NBAR",
}


def of_surface(
    surface: Model | Solution,
    values: Mapping[str, float],
    select: Mapping[str, str],
    theta_i: Sequence[float],
    diffuse: float | None,
    method: str,
) -> dict[str, Any]:
    """The albedos of a model or a fit, as plain data."""
    given: dict[str, Any] = {"values": values or None, "select": select or None}
    angles = list(theta_i)
    found: dict[str, Albedo] = {"black_sky": black_sky(surface, angles, **given, method=method)}
    found["white_sky"] = white_sky(surface, **given, method=method)
    if diffuse is not None:
        found["blue_sky"] = blue_sky(surface, angles, diffuse, **given, method=method)
    found["nbar"] = nbar(surface, angles, **given)
    columns = {
        name: {
            "value": np.asarray(one.value).tolist(),
            "uncertainty": np.asarray(one.uncertainty).tolist(),
            "uncertainty_systematic": np.asarray(one.systematic).tolist(),
        }
        for name, one in found.items()
    }
    model = surface.model.name if isinstance(surface, Solution) else surface.name
    head = {"model": model, "method": method, "theta_i": angles, "diffuse": diffuse}
    return head | {"fitted": isinstance(surface, Solution)} | columns


def lines(found: Mapping[str, Any]) -> Iterator[Any]:
    """The same for people."""
    names = [name for name in TITLES if name in found and name != "white_sky"]
    rows = table("theta_i [deg]", *(TITLES[name] for name in names), left=0)
    for k, angle in enumerate(found["theta_i"]):
        rows.add_row(f"{angle:g}", *(_number(found[name], k, found["fitted"]) for name in names))
    yield rows
    white = {key: [value] for key, value in found["white_sky"].items()}
    yield f"white-sky {_number(white, 0, found['fitted'])}"
    yield _how(found)


def _how(found: Mapping[str, Any]) -> str:
    mixed = "" if found["diffuse"] is None else f"; blue-sky with {100 * found['diffuse']:g} % of diffuse light"
    return f"by {found['method']} of {found['model']}{mixed}; NBAR is pi f from the nadir, without an integral"


def _number(column: Mapping[str, Any], k: int, fitted: bool) -> str:
    if not fitted:
        return f"{column['value'][k]:.6f}"
    return uncertain(column["value"][k], column["uncertainty"][k], column["uncertainty_systematic"][k])


def fits_of_stack(path: Path) -> xr.Dataset | None:
    """The fits in a store that `gonio fit-stack` wrote; None where the path is something else.

    Raises FormatError for a damaged store.
    """
    if not (path / FOLDER).is_dir():
        return None
    try:
        with xr.open_dataset(path, engine="zarr", consolidated=False, decode_times=False, chunks=None) as fits:
            return fits.load()
    except Exception as error:  # of Zarr, xarray or a manifest that is not whole: any kind
        cause = f"{type(error).__name__}: {error}".splitlines()[0]
        raise FormatError(path, f"is a damaged store of fits ({clip(cause, 120)})") from error


def maps_of(path: Path, fits: xr.Dataset, theta_i: Sequence[float], diffuse: float | None, method: str) -> xr.Dataset:
    """The maps of albedos of every fit of a stack; errors name the store."""
    name = str(fits.attrs.get("model", ""))
    if name not in catalogue:
        raise FormatError(path, f"holds fits of {clip(name)!r}, which is no model of the catalogue")
    try:
        return albedo_maps(fits, catalogue[name], theta_i, diffuse, method=method)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def write_maps(maps: xr.Dataset, out: Path, force: bool) -> None:
    """Write maps as NetCDF or Zarr, by the suffix; ValueError for another."""
    if out.suffix not in (".nc", ".zarr"):
        raise ValueError(f"{out}: maps are written as NAME.nc or NAME.zarr: name one of these")
    with replacing(out, force) as temporary:
        if out.suffix == ".nc":
            maps.to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")
        else:
            temporary.unlink()
            maps.drop_encoding().to_zarr(temporary, mode="w", zarr_format=3, consolidated=False)


def record_of_maps(maps: xr.Dataset, path: Path) -> dict[str, Any]:
    """What maps hold, as plain data: the least, median and largest of each, and the median of its uncertainty."""
    angles = maps["theta_i"].values.tolist()
    rows = []
    for name in (n for n in TITLES if n in maps):
        whole = maps[name]
        parts = [whole] if "theta_i" not in whole.dims else [whole.isel(theta_i=k) for k in range(len(angles))]
        for k, part in enumerate(parts):
            spread = _spread(part.values)
            if f"{name}_uncertainty" in maps:
                u = maps[f"{name}_uncertainty"]
                spread["uncertainty"] = _spread((u if len(u.dims) == len(part.dims) else u.isel(theta_i=k)).values)[
                    "median"
                ]
            rows.append({"albedo": name, "theta_i": angles[k] if "theta_i" in whole.dims else None, **spread})
    head = {"file": str(path), "model": maps.attrs["model"], "method": maps.attrs["method"]}
    sizes = {str(d): n for d, n in maps["white_sky"].sizes.items()}
    return head | {"diffuse": maps.attrs.get("diffuse"), "pixels": sizes, "maps": rows}


def _spread(values: Any) -> dict[str, float | None]:
    known = values[np.isfinite(values)]
    ends = np.quantile(known, [0.0, 0.5, 1.0]).tolist() if known.size else [math.nan] * 3
    return {**dict(zip(("least", "median", "largest"), ends, strict=True)), "missing": int(values.size - known.size)}


def lines_of_maps(found: Mapping[str, Any], out: Path | None) -> Iterator[Any]:
    """The same for people."""
    rows = table("albedo", "theta_i [deg]", "least", "median", "largest", "median of u", "missing")
    for row in found["maps"]:
        angle = "" if row["theta_i"] is None else f"{row['theta_i']:g}"
        numbers = (row["least"], row["median"], row["largest"], row.get("uncertainty", math.nan))
        rows.add_row(TITLES[row["albedo"]], angle, *map(figure, numbers), f"{row['missing']}")
    yield rows
    yield _how(found)
    yield f"wrote {out}" if out else "--out maps.nc writes the maps of every pixel with their uncertainties"
