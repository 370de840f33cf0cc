"""Values between the directions of a scan: on a grid in its own coordinates, or between scattered directions.

All interpolation is linear, f = sum_k w_k f_k with weights w_k >= 0 of sum 1, so its error falls with the square of the
step. Nothing is extrapolated: outside of the scan, across a hole and beside a missing value the answer is NaN.

- A grid (_on_grid): multilinear along the axes of its own system, spherical, half-difference or specular.
- Slices of one incidence each (_slice): along signed theta_r in the plane of incidence, else over a Delaunay
  triangulation of the reflected directions. Between incidence angles the lobe moves with the mirror direction: f at
  theta_i mixes both slices at the same theta_s, phi_s, the polar angle and azimuth about each one's mirror direction.
  At the same theta_r two peaks would be mixed instead of one moved.
- Slices of a surface turned about its normal (_turned): these for each phi_i, then linear in phi_i.
- A cloud (_cloud), with too few directions at each incidence: a Delaunay triangulation in three dimensions, and no
  test for holes.
"""

import functools
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.coordinates import SAME, SYSTEMS, WIDEST_AZIMUTH, System, system_of
from gonio.measured.dataset import HORIZON, flatten

Values = npt.NDArray[np.float64]

HOLE = 2.5  # a step this many times as wide as those beside it is a hole in the scan
FEWEST = 3  # directions for each incidence angle, on average: a triangle needs three. With fewer the scan is a cloud
LARGEST_CLOUD = 200_000  # directions that a triangulation in three dimensions can take


@dataclass(frozen=True)
class Targets:
    """Directions at which values are wanted [deg], arrays (n,), and their coordinates, each system's computed once."""

    theta_i: Values
    theta_r: Values
    phi: Values
    phi_i: Values

    def __len__(self) -> int:
        return len(self.theta_i)

    @functools.cached_property
    def _axes_by_system(self) -> dict[str, tuple[Values, ...]]:
        return {}

    def axes(self, system: System) -> tuple[Values, ...]:
        """The four coordinates (n,) [deg] of the directions in a system, in the order of `system.axes`."""
        if system.name not in self._axes_by_system:
            axes = system.axes_of(self.theta_i, self.theta_r, self.phi, self.phi_i)
            self._axes_by_system[system.name] = tuple(np.broadcast_arrays(*axes))
        return self._axes_by_system[system.name]

    @functools.cached_property
    def signed(self) -> Values:
        """theta_r [deg], positive on the forward side, NaN out of the plane of incidence."""
        phi, theta_r = np.radians(self.phi), np.asarray(self.theta_r)
        # The distance from the plane, not phi alone: near the normal any phi is in plane.
        out_of_plane = np.abs(np.sin(np.radians(theta_r)) * np.sin(phi)) > np.radians(SAME)
        return np.where(out_of_plane, np.nan, np.where(np.cos(phi) < 0, theta_r, -theta_r))

    @functools.cached_property
    def plane(self) -> Values:
        """Reflected directions (n, 2) as a map of the hemisphere with true distances from the normal [deg]."""
        phi = np.radians(self.phi)
        return np.column_stack([self.theta_r * np.cos(phi), self.theta_r * np.sin(phi)])

    def part(self, rows: npt.NDArray[np.intp]) -> "Targets":
        """Some of the directions, by their places."""
        return Targets(self.theta_i[rows], self.theta_r[rows], self.phi[rows], self.phi_i[rows])

    def moved(self, theta_i: float) -> "Targets":
        """The directions that lie about the mirror direction of another incidence angle as these do about their own."""
        specular = SYSTEMS["specular"]
        _, theta_s, phi_s, phi_i = self.axes(specular)
        angles = specular.directions(np.full(len(self), theta_i), theta_s, phi_s, phi_i)
        return Targets(*np.broadcast_arrays(*angles))  # some below the horizon, where no slice has a value


Interpolator = Callable[[Targets], Values]  # n directions to their values (n,), NaN where the scan does not reach


def interpolator(scan: xr.Dataset) -> tuple[Interpolator, str]:
    """Values between the directions of a scan of one set, and in words how they are interpolated (for the history).

    Raises ValueError for a scan of more than LARGEST_CLOUD directions that is neither a grid nor slices.
    """
    system = system_of(scan)
    if system is not None and scan["brdf"].dims != ("direction",):
        return _on_grid(scan, system), f"linearly on its {system.name} grid"
    return _scattered(flatten(scan))


def _on_grid(scan: xr.Dataset, system: System) -> Interpolator:
    """Linear interpolation along the axes of a grid; nodes below the horizon are left out of the mean.

    With a = 1 at nodes that have a value and m = 1 at nodes above the horizon that have none, the result is
    sum w a f / sum w a, and NaN where sum w m > 0: cells are filled up to the horizon, but not beside a gap.
    """
    from scipy.interpolate import RegularGridInterpolator

    names = [a for a in system.axes if a in scan["brdf"].dims]
    ordered = scan[["brdf"]].sortby(names).transpose(*names, ...)
    full = ordered["brdf"].transpose(*names)
    values = full.values.astype(float)
    above_of = [ordered[a].broadcast_like(full).transpose(*names).values <= HORIZON for a in ("theta_i", "theta_r")]
    above = above_of[0] & above_of[1]
    missing = np.isnan(values)
    stack = np.stack([np.where(missing, 0.0, values), above & ~missing, above & missing], axis=-1)
    axes = [_Axis.of(name, ordered[name].values, name in system.azimuths) for name in names]
    for k, axis in enumerate(axes):
        stack = np.take(stack, axis.source, axis=k)
    long = [k for k, axis in enumerate(axes) if len(axis.nodes) > 1]  # on the others `reaches` asks for the one node
    stack = stack.reshape(*(len(axes[k].nodes) for k in long), 3)
    grid = RegularGridInterpolator([axes[k].nodes for k in long], stack, bounds_error=False, fill_value=np.nan)

    def between(targets: Targets) -> Values:
        places = dict(zip(system.axes, targets.axes(system), strict=True))
        placed = [axis.place(places[name]) for name, axis in zip(names, axes, strict=True)]
        means = grid(np.column_stack([placed[k] for k in long]))
        with np.errstate(divide="ignore", invalid="ignore"):
            out: Values = np.where(means[:, 2] < SAME, means[:, 0] / means[:, 1], np.nan)
        for k, axis in enumerate(axes):
            out[~axis.reaches(placed[k])] = np.nan
        return out

    return between


@dataclass(frozen=True)
class _Axis:
    """One axis of a grid as it is interpolated."""

    nodes: Values  # [deg], ascending; of a full circle also the last node less a period, and the first one plus it
    source: npt.NDArray[np.intp]  # the row of the grid, or the slice, that each node comes from
    period: float = 0.0  # [deg]; 0 for one node, and for what is no azimuth
    mirrored: bool = False  # nodes are from 0 to 180 deg, and phi means 360 - phi as well
    is_azimuth: bool = False

    @classmethod
    def of(cls, name: str, nodes: Values, is_azimuth: bool) -> "_Axis":
        """Azimuths over the full circle join their ends; half a circle is mirrored, or for phi_d repeated.

        By reciprocity phi_d + 180 deg is the pair of directions exchanged, and has the same BRDF (rusinkiewicz1998).
        """
        rows = np.arange(len(nodes))
        if not is_azimuth or len(nodes) < 2:
            return cls(nodes, rows, is_azimuth=is_azimuth)
        if abs(nodes[-1] - nodes[0] - 360) < SAME:  # both ends of the circle are nodes: the same azimuth
            nodes, rows = nodes[:-1], rows[:-1]
        for period in (180.0, 360.0) if name == "phi_d" else (360.0,):
            if 0 < nodes[0] + period - nodes[-1] <= WIDEST_AZIMUTH:
                ends = [nodes[-1:] - period, nodes, nodes[:1] + period]
                return cls(np.concatenate(ends), np.r_[rows[-1], rows, rows[0]], period, is_azimuth=True)
        mirrored = abs(nodes[0]) < SAME and abs(nodes[-1] - 180) < SAME and len(nodes) > 2
        return cls(nodes, rows, 360.0, mirrored, is_azimuth=True)

    def place(self, values: Values) -> Values:
        """Angles [deg] on this axis: azimuths within one period, and those that rounding moved off a node put back."""
        placed = values % self.period if self.period else np.asarray(values, dtype=float)
        if self.mirrored:
            placed = np.minimum(placed, 360 - placed)
        near = self.nodes[np.abs(placed[:, None] - self.nodes).argmin(axis=1)] if len(self.nodes) < 8 else None
        if near is None:
            at = np.clip(np.searchsorted(self.nodes, placed), 1, len(self.nodes) - 1)
            is_lower = placed - self.nodes[at - 1] < self.nodes[at] - placed
            near = np.where(is_lower, self.nodes[at - 1], self.nodes[at])
        return np.where(np.abs(placed - near) < SAME, near, placed)

    def reaches(self, placed: Values) -> npt.NDArray[np.bool_]:
        """Where the axis has values: on its one node, or between azimuths no further apart than WIDEST_AZIMUTH."""
        if len(self.nodes) == 1:
            return np.abs(placed - self.nodes[0]) < SAME
        if not self.is_azimuth:
            return np.ones(len(placed), dtype=bool)
        at = np.clip(np.searchsorted(self.nodes, placed), 1, len(self.nodes) - 1)
        wide = self.nodes[at] - self.nodes[at - 1] > WIDEST_AZIMUTH
        return ~wide | np.isin(placed, self.nodes)  # equality is safe: `place` has put near ones on the node


def _scattered(flat: xr.Dataset) -> tuple[Interpolator, str]:
    """Slices of one incidence where they have FEWEST directions each on average, else a cloud of directions."""
    turned = "phi_i" in flat.coords and np.unique(flat["phi_i"].values).size > 1
    keys = _rounded(flat["theta_i"].values)
    slices = len(np.unique(np.column_stack([keys, _rounded(flat["phi_i"].values)]), axis=0)) if turned else None
    if flat.sizes["direction"] < FEWEST * (slices or len(np.unique(keys))):
        return _cloud(flat), "linearly between scattered directions about the mirror direction"
    if turned:
        return _turned(flat), "linearly between incidence angles, turns of the surface, and reflected directions"
    return _slices(flat), "linearly between reflected directions and between incidence angles, along the lobe"


def _rounded(values: Values) -> Values:
    return np.round(np.asarray(values, dtype=float) / SAME) * SAME


def _groups(values: Values) -> Iterable[tuple[float, npt.NDArray[np.intp]]]:
    """Each distinct angle [deg], ascending, and its rows in the order of the scan."""
    distinct, group = np.unique(_rounded(values), return_inverse=True)
    order = np.argsort(group, kind="stable")
    return zip(distinct.tolist(), np.split(order, np.cumsum(np.bincount(group))[:-1]), strict=True)


def _slices(flat: xr.Dataset) -> Interpolator:
    """One slice for each incidence angle."""
    parts = [(angle, _slice(flat.isel(direction=rows))) for angle, rows in _groups(flat["theta_i"].values)]
    return functools.partial(_between, parts, "theta_i", False)


def _turned(flat: xr.Dataset) -> Interpolator:
    """Slices for each turn of the surface. Turns may differ in their incidence angles."""
    parts = [(angle, _slices(flat.isel(direction=rows))) for angle, rows in _groups(flat["phi_i"].values % 360.0)]
    return functools.partial(_between, parts, "phi_i", True)


def _between(parts: list[tuple[float, Interpolator]], name: str, round_about: bool, targets: Targets) -> Values:
    """Linear between the slices on both sides of each target's theta_i, or of its phi_i with `round_about`."""
    nodes = np.array([angle for angle, _ in parts])
    axis = _Axis.of(name, nodes, round_about)
    wanted = axis.place(getattr(targets, name))
    at = np.clip(np.searchsorted(axis.nodes, wanted), 1, max(len(axis.nodes) - 1, 1))
    out = np.full(len(targets), np.nan)
    reached = axis.reaches(wanted) & (wanted >= axis.nodes[0]) & (wanted <= axis.nodes[-1])
    for upper in np.unique(at[reached]):
        rows = np.flatnonzero(reached & (at == upper))
        lower, upper = (upper - 1, upper) if len(axis.nodes) > 1 else (0, 0)
        span = axis.nodes[upper] - axis.nodes[lower]
        share = (wanted[rows] - axis.nodes[lower]) / span if span else np.zeros(len(rows))
        in_interval = targets.part(rows)
        total = np.zeros(len(rows))
        for node, weight in ((lower, 1 - share), (upper, share)):
            used = weight > 0  # the other slice is not asked for weight 0: 0 times NaN would be NaN
            angle, value_of = parts[axis.source[node]]
            chosen = in_interval.part(np.flatnonzero(used))
            total[used] += weight[used] * value_of(chosen if round_about else chosen.moved(angle))
        out[rows] = total
    return out


def _slice(part: xr.Dataset) -> Interpolator:
    """One incidence: along the plane of incidence where that was scanned, else over triangles of directions."""
    measured = targets_of(part)
    values = part["brdf"].values.astype(float)
    in_plane = ~np.isnan(measured.signed)
    along = _along(measured.signed[in_plane], values[in_plane])
    across = _over_triangles(measured.plane, values, _holes) if (~in_plane).sum() >= FEWEST else None

    def between(targets: Targets) -> Values:
        out = np.full(len(targets), np.nan)
        wanted_in_plane = ~np.isnan(targets.signed)
        out[wanted_in_plane] = along(targets.signed[wanted_in_plane])
        remaining = np.flatnonzero(np.isnan(out))  # out of plane, and in plane where the curve has a hole or an end
        if across is not None and len(remaining):
            out[remaining] = across(targets.plane[remaining])
        return out

    return between


def targets_of(flat: xr.Dataset) -> Targets:
    """The directions of a flat scan, the surface unturned where the scan does not say."""
    turned = flat["phi_i"].values.astype(float) if "phi_i" in flat.coords else np.zeros(flat.sizes["direction"])
    theta_i, theta_r, phi = (flat[a].values.astype(float) for a in ("theta_i", "theta_r", "phi"))
    return Targets(theta_i, theta_r, phi, turned)


def _along(theta_r: Values, values: Values) -> Callable[[Values], Values]:
    """Linear along signed theta_r; a step much wider than both steps beside it is a hole."""
    nodes, group = np.unique(_rounded(theta_r), return_inverse=True)
    mean = np.bincount(group, values) / np.bincount(group) if len(values) else values
    steps = np.diff(nodes)
    hole = np.zeros(len(steps), dtype=bool)
    # Wider than both: the first coarse step after fine ones has another coarse step beside it, and is no hole.
    hole[1:-1] = steps[1:-1] > HOLE * np.maximum(steps[:-2], steps[2:])

    def between(wanted: Values) -> Values:
        if len(nodes) < 2:
            return np.where(np.abs(wanted - nodes[0]) < SAME, mean[0], np.nan) if len(nodes) else wanted * np.nan
        at = np.clip(np.searchsorted(nodes, wanted), 1, len(nodes) - 1)
        share = (wanted - nodes[at - 1]) / steps[at - 1]
        on_lower, on_upper = np.abs(wanted - nodes[at - 1]) < SAME, np.abs(wanted - nodes[at]) < SAME
        inside = (share >= 0) & (share <= 1) & ~hole[at - 1]
        out = np.where(inside, (1 - share) * mean[at - 1] + share * mean[at], np.nan)
        return np.where(on_lower, mean[at - 1], np.where(on_upper, mean[at], out))  # the edge of a hole is measured

    return between


def _over_triangles(
    places: Values, values: Values, holes: Callable[..., npt.NDArray[np.bool_]] | None
) -> Callable[[Values], Values] | None:
    """Linear over a Delaunay triangulation of places (n, 2 or 3) [deg], repeats averaged; None if they span none."""
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import Delaunay, QhullError

    distinct, group = np.unique(_rounded(places), axis=0, return_inverse=True)
    group = group.ravel()  # NumPy 2.0 alone gives the inverse a second dimension
    mean = np.bincount(group, values) / np.bincount(group)
    try:
        triangles = Delaunay(distinct)
    except (QhullError, ValueError):  # too few, or all on one line
        return None
    linear = LinearNDInterpolator(triangles, mean)
    hole = holes(triangles) if holes else np.zeros(len(triangles.simplices), dtype=bool)

    def between(wanted: Values) -> Values:
        out: Values = linear(wanted)
        if hole.any():
            out[hole[triangles.find_simplex(wanted)]] = np.nan  # -1 outside reads the last one: NaN there already
        return out

    return between


def _holes(triangles: "object") -> npt.NDArray[np.bool_]:
    """Triangles (m,) with an edge more than HOLE times the least of the median edges at their three corners.

    The least: at a corner on the rim of a hole the many edges across it raise the median to their own length.
    """
    corners, places = triangles.simplices, triangles.points  # type: ignore[attr-defined]
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    length = np.linalg.norm(places[edges[:, 0]] - places[edges[:, 1]], axis=1)
    ends, both = edges.ravel(), np.repeat(length, 2)  # each edge counts at both of its ends
    order = np.lexsort((both, ends))
    counts = np.bincount(ends, minlength=len(places))
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    median = both[order][np.minimum(first + counts // 2, len(both) - 1)]
    longest = length.reshape(3, -1).max(axis=0)
    return longest > HOLE * median[corners].min(axis=1)


def _cloud(flat: xr.Dataset) -> Interpolator:
    """Directions without order: linear in the incidence angle and the position about the mirror direction."""
    if flat.sizes["direction"] > LARGEST_CLOUD:
        raise ValueError(
            f"{flat.sizes['direction']} directions without a grid are more than the {LARGEST_CLOUD} that can be "
            "interpolated: keep the dense grid, or select fewer"
        )
    linear = _over_triangles(_about_mirror(targets_of(flat)), flat["brdf"].values.astype(float), None)
    return lambda targets: linear(_about_mirror(targets)) if linear else np.full(len(targets), np.nan)


def _about_mirror(targets: Targets) -> Values:
    """Points (n, 3) [deg]: theta_i, and theta_s as a vector in the direction phi_s, so that a lobe stays in place."""
    _, theta_s, phi_s, _ = targets.axes(SYSTEMS["specular"])
    turn = np.radians(phi_s)
    return np.column_stack([targets.theta_i, theta_s * np.cos(turn), theta_s * np.sin(turn)])
