"""The order of work: which compiled search runs when, on which lanes. What is computed stands in `projection`.

Lanes go through in blocks of one width, because compiled code has fixed array sizes. Of lanes that start together most
are done after a few steps and some need many more, and the compiled loop of a block runs until its slowest lane is
done. So it is stopped after a few steps. Lanes that are not done wait in a pool until they fill a block of their own:

    start      the most promising shapes take a few steps each, and the lowest goes on (a race)
    first      FIRST steps; lanes that are done have a result, the others join the pool
    go on      LATER steps for a full block from the pool, again and again
    cross      lanes that ended at a bound are tried along straight lines; a better point joins the pool

An annealing has none of this: every lane takes its chains to their end in one call.
Modules that need JAX are imported inside functions: it is an optional dependency, and slow to import.
"""

import functools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gonio.fitting.many.layout import Shared
from gonio.fitting.many.reading import FITTED, LaneBlock, joined
from gonio.fitting.many.results import Ended, Results
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.anneal import Anneal
from gonio.fitting.search.projection import BETTER, FOR_MANY, Projection
from gonio.fitting.search.starts import tried

if TYPE_CHECKING:
    from gonio.fitting.many import descent as compiled
    from gonio.fitting.many.projection import LaneArrays

Values = npt.NDArray[Any]
ON_CPU, ON_GPU = 2**16, 2**25  # values of a block: what a cache holds, and what keeps a GPU busy
WIDEST = 2**16  # lanes of a block at most, for scans of few points
LONG, FEW = 2**14, 2**11  # points of a scan that is long, and of the part of it that is searched first
RACE, LONG_RACE = 3, 12  # steps after which the better start of each lane is known; from three shape values on
FIRST, LATER = 4, 6  # steps in which most lanes end; the others go on together, so that few wait for the slowest


Pools = dict[bool, list[tuple[LaneBlock, Any]]]  # lanes that wait and their states, by whether they have `one_root`


@dataclass(frozen=True)
class Search:
    """How lanes are searched: the solver and the other arguments of `fit_many`."""

    solver: Projection | Anneal
    covariance: str  # a kind of COVARIANCES, or "" for none
    dtype: Any  # of all arrays of numbers
    block: int  # lanes side by side; 0 for what suits the device
    thorough: bool = True  # cross minima of three shape values and more wherever they lie, not only at a bound

    @property
    def anneal(self) -> Anneal | None:
        """The annealing, where that is the solver."""
        return self.solver if isinstance(self.solver, Anneal) else None

    @property
    def projection(self) -> Projection:
        """The settings of the search by projection, which nothing asks for where the solver is an annealing."""
        return self.solver if isinstance(self.solver, Projection) else FOR_MANY


class Runner:
    """The compiled searches of one problem: `take` for each block in turn, then `flush` once.

    start: coordinates (d, lanes) where the searches of all lanes begin; None where they are to be found first.
    results: filled as lanes end, in no particular order.
    """

    def __init__(
        self, problem: Problem, shared: Shared, lanes: int, search: Search, start: Values | None, results: Results
    ) -> None:
        self.layout, self.search, self.start, self.results = shared.layout, search, start, results
        self.width = self._width(lanes)
        self.geometry = tuple(map(self._cast, shared.geometry))
        self.held = {name: self._cast(v) for name, v in shared.held.items()}
        self.lower, self.upper = search.anneal.bounds(problem) if search.anneal else (problem.lower, problem.upper)
        self.axes_of_all = problem.axes()
        # An Anneal may narrow the bounds: coordinates 0 and 1 are then the narrower ones.
        maps = problem.axes(*(bound[self.layout.n :] for bound in (self.lower, self.upper))).maps
        self.axes = tuple(self._cast(m[:, None], bool if m.dtype == bool else None) for m in maps)
        points, self.form = tried(self.layout.d, search.projection.grid)
        self.points = points.T
        self.pools: Pools = {True: [], False: []}  # lanes that are not done
        self.edges: Pools = {True: [], False: []}  # lanes that are done, to be crossed

    def _width(self, lanes: int) -> int:
        """Lanes of a block: a power of two that suits the device, no wider than the stack needs."""
        import jax.numpy as jnp

        if self.search.block:
            return self.search.block
        chains = self.search.anneal.chains if self.search.anneal else 1
        values = ON_CPU if next(iter(jnp.zeros(()).devices())).platform == "cpu" else ON_GPU
        suits = 2 ** int(np.log2(max(values / (self.layout.cells * self.layout.rows * chains), 1)))
        return min(suits, WIDEST, 2 ** int(np.ceil(np.log2(lanes))))

    def take(self, block: LaneBlock) -> None:
        """Search the lanes of a block; those that need more steps join the pool.

        Pools are worked off as soon as they fill a block, crossings first: what they find joins the pool of searches.
        Memory stays that of a few blocks, however long the stack is.
        """
        from gonio.fitting.many import descent as compiled

        data = self._data(block)
        if self.search.anneal:
            self._sort_in(block, data, self._annealed(block, data, self.search.anneal))
            return
        state = self._begun(block, data)
        self._sort_in(block, data, compiled.advance(self.layout, data, state, self._steps(FIRST)))
        while _count(self.edges[block.one_root]) >= self.width:
            self._cross(block.one_root)
        while _count(self.pools[block.one_root]) >= self.width:
            self._go_on(block.one_root)

    def _begun(self, block: LaneBlock, data: "LaneArrays") -> "compiled.State":
        """Where each lane starts: at a given shape, or at the one of several that is ahead after a few steps.

        E at a start alone does not tell which leads to the lowest minimum. With three shape values and more it takes
        more steps to tell.
        """
        from gonio.fitting.many import descent as compiled
        from gonio.fitting.many import starts as lane_starts

        if self.start is not None or not self.layout.d:
            unit = np.zeros((0, self.width)) if self.start is None else self._wide(self.start[:, block.rows])
            return compiled.begin(self.layout, data, self._cast(unit))
        starts = lane_starts.starts_of(self.layout, data, self._cast(self.points), self.form, self._starts())
        race = self._steps(RACE if self.layout.d <= 2 else LONG_RACE)
        begun = (compiled.begin(self.layout, data, unit) for unit in starts)
        return functools.reduce(compiled.better, (compiled.advance(self.layout, data, s, race) for s in begun))

    def _annealed(self, block: LaneBlock, data: "LaneArrays", anneal: Anneal) -> "compiled.State":
        """The chains of every lane to their end; random numbers follow from the seed and the lane's place in the stack.

        So a lane has the same chains in a block of any width. Lanes that only fill up the block repeat the key of the
        stack's first lane, and nobody reads them.
        """
        import jax

        from gonio.fitting.many.annealing import Schedule, annealed

        rows = np.pad(block.rows, (0, self.width - len(block)))
        keys = jax.vmap(jax.random.fold_in, (None, 0))(jax.random.key(anneal.seed), rows)
        numbers = (anneal.initial_temperature, anneal.final_temperature, anneal.cooling_rate, anneal.step)
        tolerance = anneal.tolerance if anneal.tolerance > 0 else -np.inf  # no change is below that
        cast = [self._cast(np.asarray(v)) for v in (*numbers, tolerance)]
        schedule = Schedule(*cast, self._steps(anneal.patience))  # type: ignore[call-arg]
        return annealed(self.layout, data, keys, schedule, self._steps(anneal.max_iterations), anneal.chains)

    def flush(self) -> None:
        """Search the lanes that still wait to the end, in blocks that need not be full.

        Searches go before crossings: lanes that end meanwhile at a bound are crossed in the same block as the others.
        """
        for one_root in self.pools:
            while self.pools[one_root] or self.edges[one_root]:
                if self.pools[one_root]:
                    self._go_on(one_root)
                else:
                    self._cross(one_root)

    def _go_on(self, one_root: bool) -> None:
        """The lanes that have waited longest, as many as a block takes, some steps further."""
        from gonio.fitting.many import descent as compiled

        block, state = self._next_lanes(self.pools, one_root, self.width)
        data = self._data(block)
        state = compiled.State(*(self._cast(self._wide(v, fill), v.dtype) for v, fill in _with_fill(state)))
        self._sort_in(block, data, compiled.advance(self.layout, data, state, self._steps(LATER)))

    def _next_lanes(self, pools: Pools, one_root: bool, most: int) -> tuple[LaneBlock, Any]:
        """Take the lanes that have waited longest, `most` of them, out of a pool; their states as NumPy arrays."""
        from gonio.fitting.many import descent as compiled

        block = joined([b for b, _ in pools[one_root]])
        parts = zip(*(state for _, state in pools[one_root]), strict=True)
        state: Any = [np.concatenate(part, axis=-1) for part in parts]
        state = compiled.State(*state)
        now, later = np.arange(min(most, len(block))), np.arange(most, len(block))
        pools[one_root] = [(block.part(later), _lanes_in(state, later))] if len(later) else []
        return block.part(now), _lanes_in(state, now)

    def shift(self, block: LaneBlock) -> None:
        """By how much each cause shifts the values of the lanes of a block that has its shifts; into the results."""
        from gonio.fitting.many import covariance as lane_covariance

        rows, n = block.rows, self.layout.n
        value, pinned = self.results.value[rows].T, self.results.at_bound[rows].T
        unit = self.axes_of_all.unit(value[n:].T).T
        unknown = ~np.isfinite(value)
        data = self._data(block)
        point = tuple(self._cast(self._wide(np.nan_to_num(v))) for v in (unit, value[:n] / block.scale))
        for k, error in enumerate(block.shifts):
            held = self._cast(self._wide(pinned | unknown, True), bool)
            by = lane_covariance.moved(self.layout, data, point, self._cast(self._wide(error)), held)
            found = np.asarray(by)[:, : len(block)] * np.concatenate([np.tile(block.scale, (n, 1)), np.ones_like(unit)])
            self.results.shift[rows, k] = np.where(unknown, np.nan, found).T

    def _cross(self, one_root: bool) -> None:
        """From minima at a bound, straight along each coordinate: where a weight is zero its shape has no slope.

        What `Projection` does for one scan: a better point begins another search. All points of a lane's lines stand
        side by side as lanes of a block, each with the data of its lane: `d * line` of them, so few lanes fill one.
        """
        from gonio.fitting.many import descent as compiled

        line = self.search.projection.line
        points = self.layout.d * line
        block, state = self._next_lanes(self.edges, one_root, max(self.width // points, 1))
        lane = np.repeat(np.arange(len(block)), points)
        units = state.unit[:, lane].reshape(self.layout.d, len(block), points)
        for k in range(self.layout.d):
            units[k, :, k * line : (k + 1) * line] = np.linspace(0.0, 1.0, line)
        costs = []
        for first in range(0, len(lane), self.width):
            part = slice(first, first + self.width)
            data = self._data(block.part(lane[part]))
            begun = compiled.begin(self.layout, data, self._cast(self._wide(units.reshape(self.layout.d, -1)[:, part])))
            # The first pass of a search stays where it begins and computes E there, which is all that is asked.
            costs.append(np.asarray(compiled.advance(self.layout, data, begun, self._steps(1)).cost)[: len(lane[part])])
        cost = np.concatenate(costs).reshape(len(block), points)
        best = np.argmin(cost, axis=1)
        lower = np.flatnonzero(cost[np.arange(len(block)), best] < state.cost * (1 - BETTER))
        if len(lower):
            unit = self._cast(self._wide(units[:, lower, best[lower]]))
            restarted = _lanes_in(
                compiled.begin(self.layout, self._data(block.part(lower)), unit), np.arange(len(lower))
            )
            restarted = restarted._replace(steps=state.steps[lower])  # max_steps limits all searches of a lane together
            self.pools[one_root].append((block.part(lower), restarted))

    def _sort_in(self, block: LaneBlock, data: "LaneArrays", state: "compiled.State") -> None:
        """Lanes that ended go into the results and, to be crossed, to the edges; the others go into the pool.

        A lane ends when its search is done, when its steps are spent, or when it cannot be fitted at all. Its result is
        put in before it is crossed, and replaced if a crossing finds a lower minimum.
        """
        from gonio.fitting.many import covariance as lane_covariance

        covariance = None
        if self.search.covariance:
            error = self._cast(self._wide(block.error))
            covariance = lane_covariance.covariance(self.layout, data, state, error, self.search.covariance)
        done = np.asarray(state.done)[: len(block)] | (block.status != FITTED)
        spent = bool(self.search.anneal) | (np.asarray(state.steps)[: len(block)] >= self.search.projection.max_steps)
        ended = done | spent
        self.results.put(self.layout, block, self.axes, Ended(state, covariance, done), np.flatnonzero(ended))
        # At a bound a better minimum can be out of sight of the slopes; from three shape values on any minimum is
        # crossed. Lanes with a known start are not: the search that made it has crossed them on part of the points.
        bound = (np.asarray(state.side) != 0).any(axis=0) | np.isin(np.asarray(state.unit), (0.0, 1.0)).any(axis=0)
        bound |= self.search.thorough and self.layout.d > 2
        edge = ended & bound[: len(block)] & (block.status == FITTED) & (block.crossed < self.search.projection.rounds)
        if (
            self.search.projection.line
            and self.layout.d
            and edge.any()
            and not self.search.anneal
            and self.start is None
        ):
            which = np.flatnonzero(edge)
            part = replace(block.part(which), crossed=block.crossed[which] + np.int8(1))
            self.edges[block.one_root].append((part, _lanes_in(state, which)))
        remaining = np.flatnonzero(~ended)
        if len(remaining):
            self.pools[block.one_root].append((block.part(remaining), _lanes_in(state, remaining)))

    def _data(self, block: LaneBlock) -> "LaneArrays":
        """A block as compiled searches take it, filled up to the width.

        Lanes that fill it up have targets of zero: unless there are held weights, E is zero at the first evaluation and
        they are done.
        """
        from gonio.fitting.many.projection import LaneArrays

        scale = self._wide(block.scale, 1.0)  # not zero, for the division
        lower, upper = (np.asarray(b[: self.layout.n])[:, None] / scale for b in (self.lower, self.upper))
        arrays = (lower, upper, block.root if block.one_root else self._wide(block.root), self._wide(block.target))
        return LaneArrays(self.geometry, self.held, self.axes, *map(self._cast, (*arrays, 1 / scale)))

    def _wide(self, values: Values, fill: float = 0.0) -> Values:
        """Filled up to the block's width along the last axis."""
        missing = self.width - values.shape[-1]
        pad = [(0, 0)] * (values.ndim - 1) + [(0, missing)]
        return np.pad(values, pad, constant_values=fill) if missing > 0 else values

    def _starts(self) -> int:
        """How many starts of each lane are followed: in logarithms twice as many, as `Projection` does for one scan."""
        followed = self.search.projection.followed_of_many(self.layout.d) * (1 + self.layout.logarithmic)
        return min(followed, self.points.shape[1])

    def _steps(self, steps: int) -> Any:
        """A number of steps as a compiled function takes it: as an argument, so that no number needs a compilation."""
        import jax.numpy as jnp

        return jnp.asarray(steps, dtype=jnp.int32)

    def _cast(self, values: Values, dtype: Any = None) -> Any:
        """An array on the device, in the precision of the search unless a dtype is named."""
        import jax.numpy as jnp

        return jnp.asarray(values, dtype=dtype or self.search.dtype)


def _count(pool: list[tuple[LaneBlock, Any]]) -> int:
    """How many lanes wait in a pool."""
    return sum(len(block) for block, _ in pool)


def _lanes_in(state: Any, which: npt.NDArray[np.intp]) -> Any:
    """The lanes at some places of a state, as NumPy arrays: lanes that wait take no memory of the device."""
    return type(state)(*(np.asarray(v)[..., which] for v in state))


def _with_fill(state: Any) -> list[tuple[Values, float]]:
    """The arrays of a state, each with the value that fills it up: lanes that only fill a block are done."""
    return [(v, float(name == "done")) for name, v in zip(state._fields, state, strict=True)]
