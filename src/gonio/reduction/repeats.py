"""Values of one direction put together: repeats averaged.

Random uncertainties shrink with the number of values; a cause of systematic uncertainty shifts all of them, so its
shifts are averaged with their signs.
"""

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.causes import causes, with_causes
from gonio.measured.dataset import DIRECTIONS, SETS, add_history, flatten

Values = npt.NDArray[np.float64]
DECIMALS = 6  # of a degree, to which equal directions agree


def averaged(scan: xr.Dataset) -> xr.Dataset:
    """The scan with one value for each direction of each set, the mean of those in use, in the order of the first.

    `uncertainty` is that of the mean: the scatter of n values over sqrt(n), n - 1 degrees of freedom, or what the
    stated uncertainties give where that is more or n is 1. `repeats` is n. Where all values of a direction are masked,
    it stays masked and is the mean of them.
    """
    flat = flatten(scan)
    return add_history(_means(flat, (*DIRECTIONS, *SETS)), "averaged repeats: uncertainties are of the mean")


def _keys(flat: xr.Dataset, names: tuple[str, ...]) -> list[tuple[object, ...]]:
    columns = [flat[n].values for n in names if n in flat.coords]
    return list(
        zip(*(np.round(c, DECIMALS).tolist() if c.dtype.kind == "f" else c.tolist() for c in columns), strict=True)
    )


def _means(flat: xr.Dataset, names: tuple[str, ...]) -> xr.Dataset:
    keys = _keys(flat, names)
    rows: dict[tuple[object, ...], list[int]] = {}
    used = flat["mask"].values == 0 if "mask" in flat else np.ones(len(keys), dtype=bool)
    for row, key in enumerate(keys):
        rows.setdefault(key, []).append(row)
    groups = [[r for r in some if used[r]] or some for some in rows.values()]
    brdf = flat["brdf"].values
    stated = flat["uncertainty"].values if "uncertainty" in flat else np.full(len(brdf), np.nan)
    out = flat.isel(direction=[some[0] for some in groups]).drop_vars("line", errors="ignore")
    mean = np.array([brdf[some].mean() for some in groups])
    columns = {"brdf": (mean, flat["brdf"].attrs), "repeats": (np.array([len(g) for g in groups]), {"units": "1"})}
    spread = np.array([_of_mean(brdf[some], stated[some]) for some in groups])
    if np.isfinite(spread).any():
        columns["uncertainty"] = (spread, flat["brdf"].attrs)
    if "net_signal" in flat:
        columns["net_signal"] = (
            np.array([flat["net_signal"].values[g].mean() for g in groups]),
            flat["net_signal"].attrs,
        )
    out = out.assign({name: ("direction", values, attrs) for name, (values, attrs) in columns.items()})
    return with_causes(out, {n: np.array([v[some].mean() for some in groups]) for n, v in causes(flat).items()})


def _of_mean(values: Values, stated: Values) -> float:
    """The standard uncertainty of the mean of some values; NaN where neither scatter nor statement tells it."""
    count = len(values)
    known = np.sqrt(np.sum(stated**2)) / count
    scatter = values.std(ddof=1) / np.sqrt(count) if count > 1 else np.nan
    return float(np.fmax(known, scatter))
