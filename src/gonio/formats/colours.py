"""The three colour planes R, G and B of the binary tables of MERL and UTIA."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import xarray as xr

COLOURS = ("R", "G", "B")


def planes(brdf: xr.DataArray, axes: Sequence[str], title: str) -> list[npt.NDArray[np.float64]]:
    """The values of R, G and B, each with the axes in this order. A scan without channels gives its values three times.

    Raises ValueError for channels other than R, G and B, and for several sets along another coordinate.
    """
    brdf = brdf.isel({d: 0 for d in brdf.dims if d not in axes and brdf.sizes[d] == 1})
    parts = [brdf] * len(COLOURS)
    if "channel" in brdf.dims:
        names = [str(name) for name in brdf["channel"].values]
        if sorted(names) != sorted(COLOURS):
            raise ValueError(f"{title} has the channels R, G and B, not {', '.join(names)}: select one")
        parts = [brdf.sel(channel=name) for name in COLOURS]
    if others := [str(d) for d in parts[0].dims if d not in axes]:
        raise ValueError(f"{title} holds one set in three colours: select one of each {' and '.join(others)}")
    return [part.transpose(*axes).values.astype(float) for part in parts]
