"""What a detector does to the light: its nonlinearity, the ratios of its ranges, and the filters before it."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.reduction.readings import place

Values = npt.NDArray[np.float64]
PLUS_MINUS = ("±", "+-")


class Known(NamedTuple):
    """A number with its standard uncertainty."""

    value: float
    uncertainty: float = 0.0

    @classmethod
    def parsed(cls, text: str, what: str) -> "Known":
        """`4.75`, or `4.75±0.005`, or `4.75+-0.005`; ValueError with `what` it should be."""
        parts = next((text.split(mark) for mark in PLUS_MINUS if mark in text), [text])
        try:
            numbers = [float(part) for part in parts]
        except ValueError:
            numbers = []
        if not 1 <= len(numbers) <= 2 or not np.isfinite(numbers).all() or (len(numbers) > 1 and numbers[1] < 0):
            raise ValueError(f"{what} is {text!r}: give a number, or VALUE+-UNCERTAINTY with a standard uncertainty")
        return cls(*numbers)

    @property
    def relative(self) -> float:
        """The relative standard uncertainty."""
        return self.uncertainty / abs(self.value)


def linearised(net: Values, slope: float, level: float) -> Values:
    """Signals (n,) without the detector's nonlinearity: V/(1 + a log10(V/V0)), with a the slope and V0 the level.

    A signal that is not positive stays as it is. With a = 5e-4, adding two equal fluxes gives 1.00015 times the sum.
    """
    if not slope:
        return net
    if not level > 0:
        raise ValueError(f"the level of the nonlinearity is {level:g}: give the signal at which it is taken as zero")
    decades = np.log10(np.where(net > 0, net, level) / level)
    return net / (1 + slope * decades)


def gain_ratio(high: Known, low: Known) -> Known:
    """The ratio of two ranges from readings of one flux in both, without their darks."""
    value = high.value / low.value
    return Known(value, abs(value) * float(np.hypot(high.relative, low.relative)))


def ratios(raw: xr.Dataset, known: Mapping[str, Known]) -> Values:
    """By what the signal of each reading (n,) is divided for its range: 1 where no ratio is known."""
    _refuse_unknown(known, raw["range"].values.tolist(), "range")
    return np.array([known[name].value if name in known else 1.0 for name in raw["range"].values.tolist()])


def transmittances(raw: xr.Dataset, rows: npt.NDArray[np.intp], known: Mapping[str, Known]) -> Values:
    """By what the signal of each reading (n,) is divided for its filter.

    rows: the readings that are compared with one another. Where all of these have one filter, it cancels. Raises
    ValueError where they have several and the transmittance of one is not known.
    """
    names = raw["filter"].values.tolist()
    _refuse_unknown(known, names, "filter")
    compared = {names[row] for row in rows.tolist()}
    for row in rows.tolist() if len(compared) > 1 else ():
        if names[row] and names[row] not in known:
            raise ValueError(
                f"{place(raw, row)}: read behind the filter {names[row]!r}, and others are not: give its transmittance,"
                f" --filter {names[row]}=VALUE+-UNCERTAINTY"
            )
    return np.array([known[name].value if name in known else 1.0 for name in names])


def _refuse_unknown(known: Mapping[str, Known], names: Iterable[str], what: str) -> None:
    there = sorted({n for n in names if n})
    for name, one in known.items():
        if name not in there:
            raise ValueError(f"no reading has the {what} {name!r}; there are {', '.join(there) or 'none'}")
        if not one.value > 0:
            raise ValueError(f"the {what} {name!r} has the ratio {one.value:g}: give a number above zero")
