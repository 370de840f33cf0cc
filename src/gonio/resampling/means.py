"""Means over the patches of a format that stores these, such as a Klems matrix, in place of values at their centres.

A patch has one value for all its directions. At its centre the value of a narrow lobe may be ten times the mean over
the patch, or a tenth of it, and the energy of such a file would be wrong by as much.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.formats.format import Evaluate, Format
from gonio.measured.dataset import DIRECTIONS, add_history
from gonio.resampling.interpolation import Targets
from gonio.resampling.resample import (
    FILLED,
    INTERPOLATED,
    MEASURED,
    MODELLED,
    ORIGINS,
    Filling,
    assembled,
    check_symmetries,
    directions_of,
    fill,
    resampled,
    without_masked,
    without_uncertainties,
)
from gonio.resampling.sources import Sources

Values = npt.NDArray[np.float64]


def means_over(
    scan: xr.Dataset, onto: xr.Dataset, target: Format, impose: Sequence[str], filling: Filling | None
) -> xr.Dataset:
    """The means of a scan over the patches whose centres are `onto`, as `target` stores them.

    Between the directions of the scan is what `resample` takes there, with the same `impose` and `filling`. What the
    scan's own form gives exactly is exact. The result has no uncertainties; the history says how the means came about.
    """
    check_symmetries(impose, filling)
    assert target.means is not None
    names = [n for n in ("uncertainty", "uncertainty_systematic", "line") if n in scan]
    sources = Sources(without_masked(scan).drop_vars(names), look_up=False)
    keys, columns, partial = [], [], 0
    nodes = _Nodes(sources, impose, filling)
    how = ""
    for k, (key, part) in enumerate(sources.sets):
        found = target.exact_means(part, onto) if target.exact_means and not impose else None
        if found is None:
            found = target.means(onto, nodes.of(k), "phi_i" in scan.coords)
        keys.append(key)
        columns.append(found.values.ravel())
        partial += found.partial
        how = found.how
    # with the attributes of the patches, by which the file's values hold for all directions of one
    out = assembled(scan, onto, directions_of(onto), keys, {"brdf": columns}).assign_attrs(onto.attrs)
    if filling is not None and filling.function is not None and nodes.total:
        out.attrs[MODELLED] = float(nodes.counts[FILLED] / nodes.total)
    return add_history(out, _line(out, how, partial, nodes, impose, filling) + without_uncertainties(scan, out))


def _line(
    out: xr.Dataset, how: str, partial: int, nodes: "_Nodes", impose: Sequence[str], filling: Filling | None
) -> str:
    """How the means came about, for the history."""
    text = f"means over {out['brdf'].size} pairs of patches, {how}"
    if nodes.total:
        text += f", {nodes.share(MEASURED, INTERPOLATED)} interpolated {nodes.how}"
        text += f", averaged over {' and '.join(impose)}" if impose else ""
        if filling is not None and filling.symmetries:
            text += f", {nodes.share(ORIGINS.index('by_symmetry'))} filled by {' and '.join(filling.symmetries)}"
        if filling is not None and filling.function is not None:
            text += f", {nodes.share(FILLED)} filled by {filling.name}, not measured"
    text += f"; {partial} of them over the part that has values" if partial else ""
    gaps = int(np.isnan(out["brdf"].values).sum())
    return text + (f"; {gaps} missing" if gaps else "")


def _flat(wanted: Targets) -> xr.Dataset:
    columns = (wanted.theta_i, wanted.theta_r, wanted.phi, wanted.phi_i)
    named = zip(DIRECTIONS, columns, strict=True)
    return xr.Dataset(coords={name: ("direction", column, {"units": "degree"}) for name, column in named})


class _Nodes:
    """The values of a scan at any directions, and a count of where they came from.

    The nodes of a quadrature are as good as never directions that were measured, so none is looked up: a node of the
    scan gets its value from the interpolation, too.
    """

    def __init__(self, sources: Sources, impose: Sequence[str], filling: Filling | None) -> None:
        self.sources, self.impose, self.filling = sources, impose, filling
        self.counts, self.how = np.zeros(len(ORIGINS), dtype=np.int64), ""

    @property
    def total(self) -> int:
        return int(self.counts.sum())

    def share(self, *origins: int) -> str:
        """Which share of the directions came from there, in words."""
        return f"{100 * self.counts[list(origins)].sum() / self.total:.3g} %"

    def of(self, k: int) -> Evaluate:
        """The function of directions of the set k."""

        def evaluate(theta_i: Values, theta_r: Values, phi: Values, phi_i: Values) -> Values:
            wanted = Targets(theta_i, theta_r, phi, phi_i)
            columns, self.how = resampled(self.sources, k, wanted, self.impose, self.filling)
            if self.filling is not None and self.filling.function is not None:
                fill(columns, _flat(wanted), self.sources.labels[k], self.filling.function)
            self.counts += np.bincount(columns["origin"].astype(np.int64), minlength=len(ORIGINS))
            return columns["brdf"]

        return evaluate
