"""The angles at which a function of directions, such as a model, is tabulated: chosen from the width of its own lobe.

A table is read back by linear interpolation, whose error falls with the square of the step over the half width w of
the lobe. Steps are a part of w about the mirror direction and grow in proportion to the distance from it, up to some
degrees. Towards grazing incidence a lobe is narrowed across the plane of incidence by cos(theta_i), and values change
fast, so that both incidence angles and azimuths are denser there.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.formats.format import Format
from gonio.measured.coordinates import grid
from gonio.measured.dataset import make_scan
from gonio.resampling.hemisphere import projected_nodes

Values = npt.NDArray[np.float64]
Brdf = Callable[[Values, Values, Values], Values]  # f (n,) at theta_i, theta_r and phi [deg] (n,)

FINE = 0.05  # deg: step of the grid on which a peak and its half are searched
PEAKS_AT = (5.0, 30.0, 60.0)  # deg: incidence angles at which the half width is taken
LOW = 0.02  # of the largest value: a lobe that is lower than that needs no nodes of its own
WIDE = 45.0  # deg: the half width of what does not fall to half, such as a Lambertian
GRAZING = 90.0  # deg: the last incidence angle
STEEP = (70.0, 72.5, 75.0, 77.5, 80.0, 81.5, 83.0, 85.0, 86.25, 87.5, 88.25, 89.0)  # deg: as 1/cos(theta_i) asks
LAST = (85.0, 87.5, 89.0, GRAZING)  # deg: of which those are left out, from the end, where the function has no bound
BOUND = 1.2  # times the reflectance at LAST[0], or 1: a function that reflects more has no bound towards grazing
PART, GROWTH = 0.25, 0.15  # steps at the lobe in half widths, and further off in distances from it
WIDEST, WIDEST_TURN, FINEST = 5.0, 10.0, 0.05  # deg, between polar angles and between azimuths; and the least
ACROSS = 0.25  # of such a step is the first one about the mirror direction: towards grazing the lobe is narrower
NEAREST = 1.0  # deg: that step at most
TURNS = (0, 2, 4, 6, 9, 13, 18, 25, 35, 50, 70, 90)  # deg: azimuths about the mirror direction, in each quarter
HORIZON_AT = 89.5  # deg: nearer to the horizon a function is taken there, since many models have no bound at 90
LARGEST = 3_000_000  # values of a table


def half_width(brdf: Brdf) -> float:
    """Half the width of the lobe at half its height [deg] in the plane of incidence, the least over PEAKS_AT.

    The height is that above the least value in the plane. WIDE where nothing rises by LOW, or one side does not fall.
    """
    found = [WIDE]
    for theta_i in PEAKS_AT:
        coarse = np.arange(-89.0, 89.0 + FINE, FINE)
        near = theta_i + np.concatenate([-np.geomspace(1e-3, 5, 200), [0.0], np.geomspace(1e-3, 5, 200)])
        theta_r = np.unique(np.concatenate([coarse, near]))
        f = brdf(np.full(len(theta_r), theta_i), np.abs(theta_r), np.where(theta_r < 0, 0.0, 180.0))
        theta_r, f = (v[np.abs(theta_r) <= LAST[0]] for v in (theta_r, f))  # a rise to the horizon is no lobe
        top = int(np.argmax(f))
        below = np.flatnonzero(f < (f[top] + f.min()) / 2)
        lower, upper = below[below < top], below[below > top]
        if f[top] - f.min() > LOW * f[top] and len(lower) and len(upper):
            found.append(float(theta_r[upper[0]] - theta_r[lower[-1]]) / 2)
    return max(min(found), 1e-3)


def reflectance(brdf: Brdf, theta_i: float) -> float:
    """The directional-hemispherical reflectance of a function at one incidence angle [deg], NaN left out."""
    targets, weights = projected_nodes(theta_i)
    return float(np.nansum(weights * brdf(targets.theta_i, np.minimum(targets.theta_r, HORIZON_AT), targets.phi)))


def last_incidence(brdf: Brdf) -> float:
    """The largest incidence angle [deg] up to which a function is bounded: GRAZING for most models."""
    at_first = max(reflectance(brdf, LAST[0]), 1.0 / BOUND)
    last = LAST[0]
    for theta_i in LAST[1:]:
        if not reflectance(brdf, min(theta_i, 90.0 - 1e-4)) <= BOUND * at_first:
            break
        last = theta_i
    return last


@dataclass(frozen=True)
class Lobe:
    """What decides on the angles of a table: the half width [deg] and the last incidence angle [deg]."""

    width: float
    last: float

    @classmethod
    def of(cls, brdf: Brdf) -> "Lobe":
        """Those of a function of directions."""
        return cls(half_width(brdf), last_incidence(brdf))

    def incidences(self, step: float) -> Values:
        """Incidence angles [deg] from 0 to the last in even steps, and those of STEEP."""
        even = np.linspace(0.0, 90.0, max(round(90.0 / step), 1) + 1)
        even = even[(even <= STEEP[0]) | (step < STEEP[1] - STEEP[0])]
        angles = np.unique(np.round(np.concatenate([even, STEEP, LAST]), 6))
        return angles[angles <= self.last]

    def specular(self, fineness: float, half: bool) -> dict[str, Values]:
        """The axes of a grid about the mirror direction; half: whether azimuths to 180 stand for all."""
        theta_i = self.incidences(WIDEST / fineness)
        theta_s = _graded(
            min(ACROSS * PART * self.width, NEAREST) / fineness,
            GROWTH / fineness,
            WIDEST / fineness,
            90.0 + theta_i[-1],
        )
        quarter = np.array(TURNS, dtype=float)
        turns = np.unique(np.concatenate([quarter, 180.0 - quarter]))
        phi_s = turns if half else np.unique(np.concatenate([turns, 360.0 - turns]))
        return {"theta_i": theta_i, "theta_s": theta_s, "phi_s": phi_s}

    def spherical(self, fineness: float, half: bool) -> dict[str, Values]:
        """The axes of a grid about the normal, on which the lobe is met by every incidence angle and theta_r."""
        step = max(PART * self.width / fineness, FINEST)
        theta_r = np.linspace(0.0, 90.0, round(90.0 / min(step, WIDEST / 2)) + 1)
        theta_i = self.incidences(min(4 / 3 * step, WIDEST / fineness))
        turns = 180.0 - _graded(2 / 3 * step, GROWTH / fineness, WIDEST_TURN / fineness, 180.0)
        return {
            "theta_i": theta_i,
            "theta_r": np.unique(np.concatenate([theta_r, np.array([87.5, 89.0])])),
            "phi": np.unique(turns if half else np.concatenate([turns, 360.0 - turns]) % 360.0).round(6),
        }


def _graded(first: float, growth: float, widest: float, end: float) -> Values:
    """Angles from 0 to `end` [deg] in steps of `first`, further off of `growth` times the angle, `widest` at most."""
    angles = [0.0]
    least = max(min(first, widest), FINEST / 2)
    while angles[-1] < end:
        angles.append(angles[-1] + min(max(least, growth * angles[-1]), widest))
    if len(angles) > 2 and angles[-1] - end > (angles[-1] - angles[-2]) / 2:
        angles.pop()
    return np.round(np.array([*angles[:-1], end]), 6)


def stub(target: Format, lobe: Lobe, fineness: float = 1.0, largest: float = LARGEST) -> xr.Dataset:
    """A scan without values whose directions a layout of the format keeps: a grid of its own kind, fine enough.

    Of more than `largest` values it is as fine as that allows. A format with one grid alone has that whatever it gets,
    and a format without a grid gets one about the mirror direction.
    """
    theta_i = lobe.incidences(WIDEST / fineness)
    flat = make_scan(theta_i, theta_i, np.full(len(theta_i), np.nan), np.full(len(theta_i), 180.0))
    probe = flat if target.layout is None else target.layout(flat)
    dims = tuple(probe.dims)
    spherical = "theta_s" not in dims and target.layout is not None
    azimuths = next((probe[n] for n in ("phi_s", "phi") if n in dims), None)
    half = azimuths is not None and float(azimuths.max()) <= 180.0
    while True:
        axes = (lobe.spherical if spherical else lobe.specular)(fineness, half)
        if spherical and not {"theta_r", "phi"} <= set(dims):  # places of its own at these incidence angles, or at none
            axes |= {"theta_i": lobe.incidences(WIDEST / fineness), "theta_r": np.zeros(1), "phi": np.zeros(1)}
        if np.prod([len(v) for v in axes.values()]) <= largest:
            break
        fineness *= 0.9
    made = grid("spherical" if spherical else "specular", **axes)
    empty = np.full([len(v) for v in axes.values()], np.nan)
    return made.assign(brdf=(tuple(axes), empty, {"units": "sr-1"})).assign_attrs(symmetry="isotropic", history="")
