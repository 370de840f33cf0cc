"""What of a scan a figure draws, and how: for the command line and for `gonio.plot` alike."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from gonio.fitting.solution import Solution
from gonio.measured import dataset
from gonio.options import one_of
from gonio.plotting.hemisphere import room_for_views
from gonio.plotting.page.sheet import side_by_side
from gonio.plotting.style import SCALES

Fits = Mapping[str, Solution]
Direction = tuple[float, float, float]

MOST_PANELS = 4
SAME_ANGLE = 0.005  # deg: an angle is named as it is written, with two decimals
OF_SCALES = ("curves", "components", "spectrum", "polar", "lobe")
OF_DEGREES = ("curves", "residuals", "spectrum", "hemisphere", "dolp", "convergence", "spectra")  # of polarisation
OF_VIEWS = ("hemisphere", "lobe")  # a panel for each incidence angle that shows all directions
# The figures of chosen incidence angles, and the most of them. In spectrum and polar they share a panel.
OF_ANGLES = {
    "curves": 6,
    "residuals": 6,
    "components": 4,
    "hemisphere": MOST_PANELS,
    "dolp": MOST_PANELS,
    "lobe": MOST_PANELS,
    "polar": 6,
    "spectrum": 6,
}
ON_ONE_PANEL = ("polar", "spectrum")
OF_FITS = ("residuals", "components", "convergence", "spectra")  # figures that show nothing of a scan alone


@dataclass(frozen=True, kw_only=True)
class View:
    """What of a scan is drawn, and how.

    normalised, banded: for `curves`, over their specular value or with 95 % bands. scales: the rows of `curves` and
    `components` and the panels of `polar`, of `linear` and `log`; `spectrum` and `lobe` have one, linear where both are
    named. theta_i: incidence angles of the scan [deg], all where it is empty.
    together: all channels, wavelengths and other sets of a scan in the same panels of `curves`, not the first alone.
    at: directions of `spectrum`, each theta_i, theta_r and phi [deg].
    """

    normalised: bool = False
    banded: bool = False
    scales: Sequence[str] = SCALES
    theta_i: Sequence[float] = ()
    together: bool = False
    at: Sequence[Direction] = ()

    def __post_init__(self) -> None:
        if not self.scales or any(scale not in SCALES for scale in self.scales):
            raise ValueError(f"scales are {one_of(SCALES)}, or both")

    def refuse_unfit(self, kind: str) -> None:
        """ValueError with the remedy where a figure of this kind has nothing of what is asked."""
        if self.banded and (self.normalised or kind != "curves"):
            raise ValueError("bands are drawn on curves that are not normalised: leave out --band, or the other option")
        if self.together and kind != "curves":
            raise ValueError(f"{kind} does not show several sets together: leave --together out, or draw curves")
        if tuple(self.scales) != SCALES and kind not in OF_SCALES:
            raise ValueError(f"{kind} has its own scales: leave --scale out, or draw {one_of(OF_SCALES)}")
        if self.at and kind != "spectrum":
            raise ValueError(f"{kind} shows all directions: leave --at out, or draw spectrum")
        if self.at and self.theta_i:
            raise ValueError("--at names directions with their incidence angle: leave --theta-i out")
        if self.theta_i:
            self._refuse_angles(kind)

    def _refuse_angles(self, kind: str) -> None:
        if kind not in OF_ANGLES:
            raise ValueError(f"{kind} shows all incidence angles: leave --theta-i out, or draw {one_of(OF_ANGLES)}")
        room = OF_ANGLES[kind]
        if kind not in ON_ONE_PANEL:
            room = room_for_views(room) if kind in OF_VIEWS else side_by_side(room)
        if len(self.theta_i) > room:
            raise ValueError(
                f"{kind} has room for {room} of {len(self.theta_i)} incidence angles: name fewer, or a larger size"
            )

    @property
    def scale(self) -> str:
        """The scale of a figure that has one."""
        return self.scales[0]


WHOLE = View()


def at_incidence(scan: xr.Dataset, theta_i: Sequence[float]) -> xr.Dataset:
    """A flat scan of these incidence angles [deg] alone; ValueError with those there are for one that it has not."""
    flat = dataset.points(scan)
    there = np.unique(flat["theta_i"].values)
    for angle in theta_i:
        if not np.isclose(there, angle, rtol=0, atol=SAME_ANGLE).any():
            known = ", ".join(f"{one:.4g}" for one in there)
            raise ValueError(f"the scan has no incidence angle of {angle:g} deg: choose of {known}")
    chosen = np.isclose(flat["theta_i"].values[:, None], np.asarray(theta_i), rtol=0, atol=SAME_ANGLE).any(axis=1)
    return flat.isel(direction=np.flatnonzero(chosen))
