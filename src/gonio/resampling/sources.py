"""Where the values of a scan come from: each of its sets, what was measured in it, and what its symmetries say.

Images are the directions at which a surface with a symmetry has the same BRDF (resample.py). The reciprocal image of
light that went through from the front is light from the back, and so the value of another set (exchange.py).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.dataset import PARAMETERISATION, SETS
from gonio.measured.exchange import exchanged, partners
from gonio.resampling.interpolation import Interpolator, Targets, interpolator
from gonio.resampling.lookup import Measured

Values = npt.NDArray[np.float64]

SYMMETRIES = {
    "reciprocity": "source and detector exchanged",
    "bilateral": "mirrored in the plane of incidence",
}
# Values of a set. A larger table is not looked up: the interpolation gives a node its value, counted as interpolated.
MOST_LOOKED_UP = 400_000


@dataclass(frozen=True)
class Source:
    """Where the values of one set come from: measured ones, and between them an interpolation; `how` in words."""

    between: Interpolator
    measured: Measured | None
    how: str

    def at(self, wanted: Targets) -> tuple[Values, npt.NDArray[np.bool_]]:
        """Measured values (n,) where there are such, else interpolated, and which of them are measured."""
        if self.measured is None:
            return self.between(wanted), np.zeros(len(wanted), dtype=bool)
        values, exact = self.measured.at(wanted, "brdf")
        remaining = np.flatnonzero(~exact)
        if len(remaining):
            values[remaining] = self.between(wanted.part(remaining))
        return values, exact


class Sources:
    """The sets of a scan, the source of each, made when it is first asked for, and the set that is its exchange."""

    def __init__(self, scan: xr.Dataset, look_up: bool = True) -> None:
        """look_up: whether the very directions that were measured are looked for; if not, they are interpolated too."""
        self._look_up = look_up
        self.sets = list(sets_of(scan))
        single = {n: scan[n].values.ravel()[0] for n in SETS if n in scan.coords and scan[n].size}
        self.labels = [single | key for key, _ in self.sets]  # of each set, those that all sets share included
        self._partners = partners(self.labels)
        self._shared = {p for k, p in enumerate(self._partners) if p is not None and p != k}
        self._made: dict[int, Source] = {}

    def of(self, k: int) -> Source:
        """The source of the set k."""
        if k not in self._made:
            # A scan may hold hundreds of sets: only what another set will ask for stays.
            self._made = {j: source for j, source in self._made.items() if j in self._shared}
            part = self.sets[k][1]
            between, how = interpolator_of(part)
            measured = Measured(part) if self._look_up and part["brdf"].size <= MOST_LOOKED_UP else None
            self._made[k] = Source(between, measured, how)
        return self._made[k]

    def without_exchange(self) -> str:
        """What the history says of sets of which the scan does not hold the set with source and detector exchanged."""
        count = self._partners.count(None)
        sets = "the transmission" if count == len(self.sets) == 1 else f"{count} of {len(self.sets)} sets"
        return f"; not {sets} by reciprocity, for which light from the other side is needed" if count else ""

    def images(self, k: int, wanted: Targets, symmetries: Sequence[str]) -> list[Values]:
        """The values (n,) of the set k at each image of n directions, as many arrays as the set has images."""
        found = []
        for image, is_exchanged in _images(wanted, symmetries):
            other = self._partners[k] if is_exchanged else k
            if other is not None:
                found.append(self.of(other).at(image)[0])
        return found


def sets_of(scan: xr.Dataset) -> Iterator[tuple[dict[str, Any], xr.Dataset]]:
    """Each set of a scan with the coordinates of SETS that distinguish it, such as {"wavelength": 550.0}.

    Grids and parameterisations are kept. A flat scan of one set has no such coordinates: {}.
    """
    dims = [d for d in scan["brdf"].dims if d in SETS]
    if scan["brdf"].dims != ("direction",):
        for index in np.ndindex(*(scan.sizes[d] for d in dims)):
            part = scan.isel(dict(zip(dims, index, strict=True)))
            yield {str(d): part[d].values.item() for d in dims}, part
        return
    # Labels may be texts and numbers: each column becomes integers, so that rows can be compared.
    names = dataset.sets(scan)
    codes = [np.unique(scan[n].values, return_inverse=True)[1].ravel() for n in names]
    if not names:
        yield {}, scan
        return
    _, first, group = np.unique(np.column_stack(codes), axis=0, return_index=True, return_inverse=True)
    for k, row in enumerate(first):
        key = {n: scan[n].values[row].item() for n in names}
        yield key, scan.isel(direction=np.flatnonzero(group.ravel() == k))


def interpolator_of(part: xr.Dataset) -> tuple[Interpolator, str]:
    """The format's own interpolation where the scan carries one, else that between its directions."""
    name = part.attrs.get(PARAMETERISATION)
    if not name:
        return interpolator(part)
    from gonio.formats import formats

    evaluate = formats()[name].evaluate
    if evaluate is None:
        return interpolator(part)
    return lambda t: np.ravel(evaluate(part, t.theta_i, t.theta_r, t.phi, t.phi_i)), f"as {name} files are read"


def _images(wanted: Targets, symmetries: Sequence[str]) -> Iterator[tuple[Targets, bool]]:
    """The other directions at which a surface with these symmetries has the same BRDF: with both of them, three.

    With each whether source and detector are exchanged in it.
    """
    swapped = Targets(*exchanged(wanted.theta_i, wanted.theta_r, wanted.phi, wanted.phi_i))
    if "reciprocity" in symmetries:
        yield swapped, True
    if "bilateral" in symmetries:
        yield _mirrored(wanted), False
        if "reciprocity" in symmetries:
            yield _mirrored(swapped), True


def _mirrored(wanted: Targets) -> Targets:
    """The mirror image in the plane of the normal and the surface's x axis: both azimuths change sign."""
    return Targets(wanted.theta_i, wanted.theta_r, -wanted.phi % 360.0, -wanted.phi_i % 360.0)
