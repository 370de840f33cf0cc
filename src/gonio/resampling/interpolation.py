"""Values between the directions of a scan: on a grid in its own coordinates, or between scattered directions.

Nothing is extrapolated. Between incidence angles the lobe moves with the mirror direction. Where a scan has no value
near enough, the answer is NaN.
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

HOLE = 2.5  # a step so many times as wide as those beside it is a hole in the scan
FEWEST = 3  # directions an incidence angle, on average; with fewer the scan is a cloud
LARGEST_CLOUD = 200_000  # directions that a triangulation in three dimensions can take


@dataclass(frozen=True)
class Targets:
    """Directions at which values are wanted [deg], and their coordinates, each system's computed once."""

    theta_i: Values
    theta_r: Values
    phi: Values
    phi_i: Values

    def __len__(self) -> int:
        return len(self.theta_i)

    @functools.cached_property
    def _kept(self) -> dict[str, tuple[Values, ...]]:
        return {}

    def axes(self, system: System) -> tuple[Values, ...]:
        if system.name not in self._kept:
            found = system.axes_of(self.theta_i, self.theta_r, self.phi, self.phi_i)
            self._kept[system.name] = tuple(np.broadcast_arrays(*found))
        return self._kept[system.name]

    @functools.cached_property
    def signed(self) -> Values:
        """theta_r [deg], positive on the forward side, NaN out of the plane of incidence."""
        phi, theta_r = np.radians(self.phi), np.asarray(self.theta_r)
        away = np.abs(np.sin(np.radians(theta_r)) * np.sin(phi)) > np.radians(SAME)
        return np.where(away, np.nan, np.where(np.cos(phi) < 0, theta_r, -theta_r))

    @functools.cached_property
    def plane(self) -> Values:
        """Reflected directions (n, 2) as a map of the hemisphere with true distances from the normal [deg]."""
        phi = np.radians(self.phi)
        return np.column_stack([self.theta_r * np.cos(phi), self.theta_r * np.sin(phi)])

    def part(self, rows: npt.NDArray[np.intp]) -> "Targets":
        return Targets(self.theta_i[rows], self.theta_r[rows], self.phi[rows], self.phi_i[rows])

    def moved(self, theta_i: float) -> "Targets":
        """The directions that lie to the mirror direction of another incidence angle as these do to their own."""
        specular = SYSTEMS["specular"]
        _, theta_s, phi_s, phi_i = self.axes(specular)
        found = specular.directions(np.full(len(self), theta_i), theta_s, phi_s, phi_i)
        return Targets(*np.broadcast_arrays(*found))


Interpolator = Callable[[Targets], Values]


def interpolator(scan: xr.Dataset) -> tuple[Interpolator, str]:
    """Values between the directions of a scan of one set, and in words how they are found."""
    system = system_of(scan)
    if system is not None and scan["brdf"].dims != ("direction",):
        return _on_grid(scan, system), f"linearly on its {system.name} grid"
    return _scattered(flatten(scan))


def _on_grid(scan: xr.Dataset, system: System) -> Interpolator:
    """Linear interpolation along the axes of a grid; nodes below the horizon are left out of the mean."""
    from scipy.interpolate import RegularGridInterpolator

    names = [a for a in system.axes if a in scan["brdf"].dims]
    ordered = scan[["brdf"]].sortby(names).transpose(*names, ...)
    full = ordered["brdf"].transpose(*names)
    values = full.values.astype(float)
    sky = [ordered[a].broadcast_like(full).transpose(*names).values <= HORIZON for a in ("theta_i", "theta_r")]
    above = sky[0] & sky[1]
    missing = np.isnan(values)
    stack = np.stack([np.where(missing, 0.0, values), above & ~missing, above & missing], axis=-1)
    axes = [_Axis.of(name, ordered[name].values, name in system.azimuths) for name in names]
    for k, axis in enumerate(axes):
        stack = np.take(stack, axis.source, axis=k)
    long = [k for k, axis in enumerate(axes) if len(axis.nodes) > 1]
    stack = stack.reshape(*(len(axes[k].nodes) for k in long), 3)
    grid = RegularGridInterpolator([axes[k].nodes for k in long], stack, bounds_error=False, fill_value=np.nan)

    def between(targets: Targets) -> Values:
        places = dict(zip(system.axes, targets.axes(system), strict=True))
        moved = [axis.place(places[name]) for name, axis in zip(names, axes, strict=True)]
        found = grid(np.column_stack([moved[k] for k in long]))
        with np.errstate(divide="ignore", invalid="ignore"):
            out: Values = np.where(found[:, 2] < SAME, found[:, 0] / found[:, 1], np.nan)
        for k, axis in enumerate(axes):
            out[~axis.reaches(moved[k])] = np.nan
        return out

    return between


@dataclass(frozen=True)
class _Axis:
    """One axis of a grid as it is interpolated: nodes in ascending order, the rows that they come from, the period."""

    nodes: Values
    source: npt.NDArray[np.intp]
    period: float = 0.0
    mirrored: bool = False
    is_azimuth: bool = False

    @classmethod
    def of(cls, name: str, nodes: Values, is_azimuth: bool) -> "_Axis":
        """Azimuths all round join their ends; a half of them is mirrored, or for phi_d repeated (reciprocity)."""
        rows = np.arange(len(nodes))
        if not is_azimuth or len(nodes) < 2:
            return cls(nodes, rows, is_azimuth=is_azimuth)
        if abs(nodes[-1] - nodes[0] - 360) < SAME:  # both ends of the circle are there: the same azimuth
            nodes, rows = nodes[:-1], rows[:-1]
        for period in (180.0, 360.0) if name == "phi_d" else (360.0,):
            if 0 < nodes[0] + period - nodes[-1] <= WIDEST_AZIMUTH:
                ends = [nodes[-1:] - period, nodes, nodes[:1] + period]
                return cls(np.concatenate(ends), np.r_[rows[-1], rows, rows[0]], period, is_azimuth=True)
        mirrored = abs(nodes[0]) < SAME and abs(nodes[-1] - 180) < SAME and len(nodes) > 2
        return cls(nodes, rows, 360.0, mirrored, is_azimuth=True)

    def place(self, values: Values) -> Values:
        """Values on this axis: azimuths within one period, and those beside a node by rounding on it."""
        placed = values % self.period if self.period else np.asarray(values, dtype=float)
        if self.mirrored:
            placed = np.minimum(placed, 360 - placed)
        near = self.nodes[np.abs(placed[:, None] - self.nodes).argmin(axis=1)] if len(self.nodes) < 8 else None
        if near is None:
            at = np.clip(np.searchsorted(self.nodes, placed), 1, len(self.nodes) - 1)
            left = placed - self.nodes[at - 1] < self.nodes[at] - placed
            near = np.where(left, self.nodes[at - 1], self.nodes[at])
        return np.where(np.abs(placed - near) < SAME, near, placed)

    def reaches(self, placed: Values) -> npt.NDArray[np.bool_]:
        """Where the axis says something: on its one node, or between azimuths that are neighbours."""
        if len(self.nodes) == 1:
            return np.abs(placed - self.nodes[0]) < SAME
        if not self.is_azimuth:
            return np.ones(len(placed), dtype=bool)
        at = np.clip(np.searchsorted(self.nodes, placed), 1, len(self.nodes) - 1)
        wide = self.nodes[at] - self.nodes[at - 1] > WIDEST_AZIMUTH
        return ~wide | np.isin(placed, self.nodes)


def _scattered(flat: xr.Dataset) -> tuple[Interpolator, str]:
    """Slices of one incidence where the scan has such, else a cloud of directions."""
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
    distinct, group = np.unique(_rounded(values), return_inverse=True)
    order = np.argsort(group, kind="stable")
    return zip(distinct.tolist(), np.split(order, np.cumsum(np.bincount(group))[:-1]), strict=True)


def _slices(flat: xr.Dataset) -> Interpolator:
    parts = [(angle, _slice(flat.isel(direction=rows))) for angle, rows in _groups(flat["theta_i"].values)]
    return functools.partial(_between, parts, "theta_i", False)


def _turned(flat: xr.Dataset) -> Interpolator:
    parts = [(angle, _slices(flat.isel(direction=rows))) for angle, rows in _groups(flat["phi_i"].values % 360.0)]
    return functools.partial(_between, parts, "phi_i", True)


def _between(parts: list[tuple[float, Interpolator]], name: str, round_about: bool, targets: Targets) -> Values:
    """Linear between the parts on both sides of each target's angle, the lobe moved along with the incidence."""
    nodes = np.array([angle for angle, _ in parts])
    axis = _Axis.of(name, nodes, round_about)
    wanted = axis.place(getattr(targets, name))
    at = np.clip(np.searchsorted(axis.nodes, wanted), 1, max(len(axis.nodes) - 1, 1))
    out = np.full(len(targets), np.nan)
    reached = axis.reaches(wanted) & (wanted >= axis.nodes[0]) & (wanted <= axis.nodes[-1])
    for right in np.unique(at[reached]):
        rows = np.flatnonzero(reached & (at == right))
        left, right = (right - 1, right) if len(axis.nodes) > 1 else (0, 0)
        span = axis.nodes[right] - axis.nodes[left]
        share = (wanted[rows] - axis.nodes[left]) / span if span else np.zeros(len(rows))
        some = targets.part(rows)
        total = np.zeros(len(rows))
        for node, weight in ((left, 1 - share), (right, share)):
            used = weight > 0
            angle, value_of = parts[axis.source[node]]
            chosen = some.part(np.flatnonzero(used))
            total[used] += weight[used] * value_of(chosen if round_about else chosen.moved(angle))
        out[rows] = total
    return out


def _slice(part: xr.Dataset) -> Interpolator:
    """One incidence: along the plane of incidence where that was scanned, else over triangles of directions."""
    here = targets_of(part)
    values = part["brdf"].values.astype(float)
    in_plane = ~np.isnan(here.signed)
    along = _along(here.signed[in_plane], values[in_plane])
    across = _over_triangles(here.plane, values, _holes) if (~in_plane).sum() >= FEWEST else None

    def between(targets: Targets) -> Values:
        out = np.full(len(targets), np.nan)
        flat_on = ~np.isnan(targets.signed)
        out[flat_on] = along(targets.signed[flat_on])
        rest = np.flatnonzero(np.isnan(out))
        if across is not None and len(rest):
            out[rest] = across(targets.plane[rest])
        return out

    return between


def targets_of(flat: xr.Dataset) -> Targets:
    """The directions of a flat scan, the surface unturned where the scan does not say."""
    turned = flat["phi_i"].values.astype(float) if "phi_i" in flat.coords else np.zeros(flat.sizes["direction"])
    theta_i, theta_r, phi = (flat[a].values.astype(float) for a in ("theta_i", "theta_r", "phi"))
    return Targets(theta_i, theta_r, phi, turned)


def _along(theta_r: Values, values: Values) -> Callable[[Values], Values]:
    """Linear along signed theta_r; a step much wider than those on both sides of it is a hole."""
    nodes, group = np.unique(_rounded(theta_r), return_inverse=True)
    mean = np.bincount(group, values) / np.bincount(group) if len(values) else values
    steps = np.diff(nodes)
    hole = np.zeros(len(steps), dtype=bool)
    hole[1:-1] = steps[1:-1] > HOLE * np.maximum(steps[:-2], steps[2:])

    def between(wanted: Values) -> Values:
        if len(nodes) < 2:
            return np.where(np.abs(wanted - nodes[0]) < SAME, mean[0], np.nan) if len(nodes) else wanted * np.nan
        at = np.clip(np.searchsorted(nodes, wanted), 1, len(nodes) - 1)
        share = (wanted - nodes[at - 1]) / steps[at - 1]
        left, right = np.abs(wanted - nodes[at - 1]) < SAME, np.abs(wanted - nodes[at]) < SAME
        inside = (share >= 0) & (share <= 1) & ~hole[at - 1]
        out = np.where(inside, (1 - share) * mean[at - 1] + share * mean[at], np.nan)
        return np.where(left, mean[at - 1], np.where(right, mean[at], out))

    return between


def _over_triangles(
    places: Values, values: Values, holes: Callable[..., npt.NDArray[np.bool_]] | None
) -> Callable[[Values], Values] | None:
    """Linear over a triangulation; None where the directions span none."""
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import Delaunay, QhullError

    distinct, group = np.unique(_rounded(places), axis=0, return_inverse=True)
    group = group.ravel()
    mean = np.bincount(group, values) / np.bincount(group)
    try:
        triangles = Delaunay(distinct)
    except (QhullError, ValueError):
        return None
    linear = LinearNDInterpolator(triangles, mean)
    hole = holes(triangles) if holes else np.zeros(len(triangles.simplices), dtype=bool)

    def between(wanted: Values) -> Values:
        out: Values = linear(wanted)
        if hole.any():
            out[hole[triangles.find_simplex(wanted)]] = np.nan
        return out

    return between


def _holes(triangles: "object") -> npt.NDArray[np.bool_]:
    """Triangles with an edge much longer than those that usually meet at its corners."""
    corners, places = triangles.simplices, triangles.points  # type: ignore[attr-defined]
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    length = np.linalg.norm(places[edges[:, 0]] - places[edges[:, 1]], axis=1)
    ends, both = edges.ravel(), np.repeat(length, 2)
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
    _, theta_s, phi_s, _ = targets.axes(SYSTEMS["specular"])
    turn = np.radians(phi_s)
    return np.column_stack([targets.theta_i, theta_s * np.cos(turn), theta_s * np.sin(turn)])
