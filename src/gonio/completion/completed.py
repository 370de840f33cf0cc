"""A surface at directions that were not measured: a fit, corrected by what its residuals say."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.completion.correction import LEVEL, RELATIVE, Correction, Learned
from gonio.fitting.solution import Solution
from gonio.measured import dataset
from gonio.measured.dataset import DIRECTIONS, SETS, add_history

Values = npt.NDArray[np.float64]

ORIGINS = ("measured", "corrected", "model")
HALF = 0.5  # of the variance of the process: where less is known, the value rests on the model
STEP, STEEPEST = 5.0, 80.0  # deg of theta_r, of the directions where none are asked for
AZIMUTHS = np.arange(0.0, 360.0, 15.0)
DIGITS = 6  # of angles [deg] that are one direction


@dataclass(frozen=True)
class Corrected:
    """A fit with what the residuals of a scan say beyond it: a BRDF at any directions of its sets."""

    solution: Solution
    learned: Learned

    @classmethod
    def of(cls, scan: xr.Dataset, solution: Solution, correction: Correction | None = None) -> "Corrected":
        """The correction of a fit by a scan, with the prior of public materials where none is given.

        Raises ValueError where the units of both differ, or fewer than 10 values are positive.
        """
        if dataset.is_degree(scan) or dataset.unit(scan) != solution.unit:
            raise ValueError(
                f"the fit is in {solution.unit} and the scan in {dataset.unit(scan)}: a correction needs a scan of a "
                "BRDF and a fit of it"
            )
        points = dataset.points(scan)
        return cls(solution, (correction or Correction()).learned(points, solution.brdf(points)))

    def brdf(self, points: xr.Dataset) -> Values:
        """The corrected BRDF (n,) at n directions, in the unit of the fit."""
        shift = self.learned.shift(points)  # refuses a set that the scan does not have
        return np.asarray(self.solution.brdf(points) * 10**shift)

    @property
    def words(self) -> str:
        """By what the model is corrected."""
        prior = " and the prior of public materials" if self.learned.how.prior else ""
        return f"corrected by {self.learned.points} values{prior}"


def complete(
    scan: xr.Dataset,
    solution: Solution,
    onto: xr.Dataset | None = None,
    prior: bool = True,
    without: Sequence[str] = (),
) -> xr.Dataset:
    """The BRDF at any directions: a fit, corrected by what the scan says beyond it, with a standard uncertainty.

    The correction is a Gaussian process of the residual lg m - lg f of the scan, in coordinates that do not change
    where light and detector are exchanged (`completion.process`), so the result is reciprocal where the model is. Near
    to measured directions it follows the data without their noise; far from them it returns to the model.

    Parameters
    ----------
    scan : xarray.Dataset
        What was measured. Values that are not positive are left out.
    solution : Solution
        A fit of it, such as `gonio.fit(scan, "gonio-best")` gives.
    onto : xarray.Dataset, optional
        The directions, such as another scan. Without them the half space in steps of 5 deg of theta_r up to 80 deg and
        15 deg of azimuth, at each incidence angle of the scan. Directions that name no set have every set of the scan.
    prior : bool
        Whether the residuals of public materials take part (`completion.prior`).
    without : sequence of str
        Names of materials that are left out of these.

    Returns
    -------
    xarray.Dataset
        `brdf`; `uncertainty`, the standard uncertainty of one measured value there, of the correction and the noise of
        the scan, without that of the fitted values; `lower` and `upper`, the 95 % interval, which is even in lg;
        `origin`: `measured` where the scan has that direction or the exchanged one, `corrected` where neighbours
        tell at least half of the variance of the correction, `model` elsewhere. All three are values of the smooth
        surface, also where it was measured.

    Raises
    ------
    ValueError
        The units of both differ, fewer than 10 values are positive, there is no such material, or the directions name a
        set that the scan does not have.

    Examples
    --------
    >>> import gonio
    >>> scan = gonio.sample("coating")
    >>> solution = gonio.fit(scan, "ggx", held={"index": 1.5, "extinction": 0.0})
    >>> str(gonio.complete(scan, solution)["origin"].values[0])
    'measured'

    """
    corrected = Corrected.of(scan, solution, Correction(prior=prior, without=tuple(without)))
    points, learned = dataset.points(scan), corrected.learned
    places = _places(points, onto)
    shift, lg_uncertainty, known = learned.at(places)  # refuses a set that the scan does not have
    modelled = solution.brdf(places)
    value = modelled * 10**shift
    unit = {"units": dataset.unit(scan)}
    origin = np.where(known >= HALF, *ORIGINS[1:])
    origin[_is_measured(points, places)] = ORIGINS[0]
    columns = {
        "brdf": (value, unit),
        "uncertainty": (value * RELATIVE * lg_uncertainty, unit),
        "lower": (value * 10 ** (-LEVEL * lg_uncertainty), unit),
        "upper": (value * 10 ** (LEVEL * lg_uncertainty), unit),
        "origin": (origin, {}),
    }
    found = places.assign({name: ("direction", column, attrs) for name, (column, attrs) in columns.items()})
    found.attrs = dict(scan.attrs)
    left_out = points.sizes["direction"] - learned.points
    words = f"; {left_out} that are not positive took no part" * bool(left_out)
    return add_history(found, f"completed by {solution.model.name}, {corrected.words}{words}")


def _places(points: xr.Dataset, onto: xr.Dataset | None) -> xr.Dataset:
    """The directions as a flat Dataset of coordinates; those without a set once for each set of the scan."""
    flat = _half_space(np.unique(points["theta_i"].values)) if onto is None else _flat(onto)
    names = [name for name in SETS if name in points.coords and name not in flat.coords]
    if not names or not points.sizes["direction"]:
        return flat
    rows = np.unique(np.array([points[name].values.astype(str) for name in names]), axis=1, return_index=True)[1]
    repeated = [
        flat.assign_coords(
            {name: ("direction", np.full(flat.sizes["direction"], points[name].values[row])) for name in names}
        )
        for row in np.sort(rows)
    ]
    return xr.concat(repeated, "direction") if len(repeated) > 1 else repeated[0]


def _flat(onto: xr.Dataset) -> xr.Dataset:
    if lacking := [name for name in ("theta_i", "theta_r", "phi") if name not in onto.variables]:
        raise ValueError(f"the directions have no {lacking[0]}: give a scan, or a table with theta_i, theta_r and phi")
    flat = dataset.flatten(onto) if "brdf" in onto else onto
    kept = [name for name in (*DIRECTIONS, *SETS) if name in flat.coords]
    alone = xr.Dataset(
        coords={name: ("direction", np.atleast_1d(flat[name].values), flat[name].attrs) for name in kept}
    )
    above = (alone["theta_i"].values <= dataset.HORIZON) & (alone["theta_r"].values <= dataset.HORIZON)
    if not above.all():
        raise ValueError(f"{int((~above).sum())} directions lie below the horizon: leave them out")
    return alone


def _half_space(theta_i: Values) -> xr.Dataset:
    axes = (theta_i, np.arange(0.0, STEEPEST + STEP / 2, STEP), AZIMUTHS)
    columns = [axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")]
    kept = (columns[1] > 0) | (columns[2] == 0)  # the normal once
    named = zip(("theta_i", "theta_r", "phi"), columns, strict=True)
    return xr.Dataset(coords={name: ("direction", column[kept], {"units": "degree"}) for name, column in named})


def _is_measured(points: xr.Dataset, places: xr.Dataset) -> npt.NDArray[np.bool_]:
    """Which directions the scan has, as they are or exchanged."""
    names = [name for name in SETS if name in points.coords]
    known = {*_keys(points, names, False), *_keys(points, names, True)}
    return np.array([key in known for key in _keys(places, names, False)], dtype=bool)


def _keys(points: xr.Dataset, names: Sequence[str], exchanged: bool) -> list[tuple[object, ...]]:
    """Each direction as something to look up; an exchanged one is seen from the other side, with -phi."""
    one, other, phi = (points[name].values.astype(float) for name in ("theta_i", "theta_r", "phi"))
    if exchanged:
        one, other, phi = other, one, -phi
    phi = np.where(np.minimum(one, other) > 0, np.round(phi % 360, DIGITS) % 360, 0.0)  # no azimuth at the normal
    angles = [np.round(one, DIGITS).tolist(), np.round(other, DIGITS).tolist(), phi.tolist()]
    return list(zip(*angles, *(points[name].values.tolist() for name in names), strict=True))
