"""The compiled searches of many lanes, block after block: what runs when, while `lanes` says what is computed."""

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
    from gonio.fitting.many import projection as compiled

Values = npt.NDArray[Any]
ON_CPU, ON_GPU = 2**16, 2**25  # values of a block: what a cache holds, and what keeps a GPU busy
WIDEST = 2**16  # lanes of a block
LONG, FEW = 2**14, 2**11  # points of a scan that is long, and of the part of it that is searched first
RACE, LONG_RACE = 3, 12  # steps after which the better start of each lane is known; from three shape values on
FIRST, LATER = 4, 6  # steps in which most lanes end; the others go on together, so that few wait for the slowest


Pools = dict[bool, list[tuple[LaneBlock, Any]]]  # lanes that wait and their states, by whether points are weighed alike


@dataclass(frozen=True)
class Search:
    """How lanes are searched: the solver and the other arguments of `fit_many`.

    thorough: whether minima of three shape values and more are crossed wherever they lie, not only at a bound.
    """

    solver: Projection | Anneal
    covariance: str
    dtype: Any
    block: int
    thorough: bool = True

    @property
    def anneal(self) -> Anneal | None:
        """The annealing, where that is the solver."""
        return self.solver if isinstance(self.solver, Anneal) else None

    @property
    def projection(self) -> Projection:
        """The settings of the search by projection, which nothing asks for where the solver is an annealing."""
        return self.solver if isinstance(self.solver, Projection) else FOR_MANY


class Runner:
    """The compiled searches of one problem, block after block.

    Lanes that are not done after a few steps wait in a pool until they fill a block of their own, so that one slow lane
    keeps no block busy.
    """

    def __init__(
        self, problem: Problem, shared: Shared, lanes: int, search: Search, start: Values | None, results: Results
    ) -> None:
        self.layout, self.search, self.start, self.results = shared.layout, search, start, results
        self.width = self._width(lanes)
        self.geometry = tuple(map(self._cast, shared.geometry))
        self.held = {name: self._cast(v) for name, v in shared.held.items()}
        self.lower, self.upper = search.anneal.bounds(problem) if search.anneal else (problem.lower, problem.upper)
        maps = problem.axes(*(bound[self.layout.n :] for bound in (self.lower, self.upper))).maps
        self.axes = tuple(self._cast(m[:, None], bool if m.dtype == bool else None) for m in maps)
        points, self.form = tried(self.layout.d, search.projection.grid)
        self.points = points.T
        self.pools: Pools = {True: [], False: []}
        self.edges: Pools = {True: [], False: []}

    def _width(self, lanes: int) -> int:
        import jax.numpy as jnp

        if self.search.block:
            return self.search.block
        chains = self.search.anneal.chains if self.search.anneal else 1
        values = ON_CPU if next(iter(jnp.zeros(()).devices())).platform == "cpu" else ON_GPU
        suits = 2 ** int(np.log2(max(values / (self.layout.cells * self.layout.rows * chains), 1)))
        return min(suits, WIDEST, 2 ** int(np.ceil(np.log2(lanes))))

    def take(self, block: LaneBlock) -> None:
        """Search the lanes of a block; those that need more steps join the pool."""
        from gonio.fitting.many import projection as compiled

        data = self._data(block)
        if self.search.anneal:
            self._keep(block, data, self._annealed(block, data, self.search.anneal))
            return
        state = self._begun(block, data)
        self._keep(block, data, compiled.advance(self.layout, data, state, self._steps(FIRST)))
        while _count(self.edges[block.alike]) >= self.width:
            self._cross(block.alike)
        while _count(self.pools[block.alike]) >= self.width:
            self._go_on(block.alike)

    def _begun(self, block: LaneBlock, data: "compiled.LaneArrays") -> "compiled.State":
        """Where each lane starts: at a given shape, or at the one of several that is ahead after a few steps."""
        from gonio.fitting.many import projection as compiled
        from gonio.fitting.many import starts as lane_starts

        if self.start is not None or not self.layout.d:
            given = np.zeros((0, self.width)) if self.start is None else self._wide(self.start[:, block.rows])
            return compiled.begin(self.layout, data, self._cast(given))
        starts = lane_starts.starts_of(self.layout, data, self._cast(self.points), self.form, self._starts())
        race = self._steps(RACE if self.layout.d <= 2 else LONG_RACE)
        begun = (compiled.begin(self.layout, data, unit) for unit in starts)
        return functools.reduce(compiled.better, (compiled.advance(self.layout, data, s, race) for s in begun))

    def _annealed(self, block: LaneBlock, data: "compiled.LaneArrays", anneal: Anneal) -> "compiled.State":
        """The chains of every lane to their end; the random numbers of a lane follow from the seed and its place."""
        import jax

        from gonio.fitting.many.annealing import Schedule, annealed

        rows = np.pad(block.rows, (0, self.width - len(block)))
        keys = jax.vmap(jax.random.fold_in, (None, 0))(jax.random.key(anneal.seed), rows)
        numbers = (anneal.initial_temperature, anneal.final_temperature, anneal.cooling_rate, anneal.step)
        tolerance = anneal.tolerance if anneal.tolerance > 0 else -np.inf
        cast = [self._cast(np.asarray(v)) for v in (*numbers, tolerance)]
        schedule = Schedule(*cast, self._steps(anneal.patience))  # type: ignore[call-arg]
        return annealed(self.layout, data, keys, schedule, self._steps(anneal.max_iterations), anneal.chains)

    def flush(self) -> None:
        """Search what is left in the pools to the end."""
        for alike in self.pools:
            while self.pools[alike] or self.edges[alike]:
                if self.pools[alike]:
                    self._go_on(alike)
                else:
                    self._cross(alike)

    def _go_on(self, alike: bool) -> None:
        """The lanes that have waited longest, as many as a block takes, some steps further."""
        from gonio.fitting.many import projection as compiled

        block, state = self._taken(self.pools, alike, self.width)
        data = self._data(block)
        state = compiled.State(*(self._cast(self._wide(v, one), v.dtype) for v, one in _filled(state)))
        self._keep(block, data, compiled.advance(self.layout, data, state, self._steps(LATER)))

    def _taken(self, pools: Pools, alike: bool, most: int) -> tuple[LaneBlock, Any]:
        """The lanes that wait first in a pool, and their states as NumPy arrays."""
        from gonio.fitting.many import projection as compiled

        block = joined([b for b, _ in pools[alike]])
        parts = zip(*(state for _, state in pools[alike]), strict=True)
        state: Any = [np.concatenate(part, axis=-1) for part in parts]
        state = compiled.State(*state)
        now, later = np.arange(min(most, len(block))), np.arange(most, len(block))
        pools[alike] = [(block.part(later), _lanes_in(state, later))] if len(later) else []
        return block.part(now), _lanes_in(state, now)

    def _cross(self, alike: bool) -> None:
        """From minima at a bound, straight along each coordinate: where a weight is zero its shape has no slope.

        What `Projection` does for one scan: a better point begins another search.
        """
        from gonio.fitting.many import projection as compiled

        line = self.search.projection.line
        tried = self.layout.d * line
        block, state = self._taken(self.edges, alike, max(self.width // tried, 1))
        places = np.repeat(np.arange(len(block)), tried)
        units = state.unit[:, places].reshape(self.layout.d, len(block), tried)
        for k in range(self.layout.d):
            units[k, :, k * line : (k + 1) * line] = np.linspace(0.0, 1.0, line)
        costs = []
        for at in range(0, len(places), self.width):
            some = slice(at, at + self.width)
            data = self._data(block.part(places[some]))
            begun = compiled.begin(self.layout, data, self._cast(self._wide(units.reshape(self.layout.d, -1)[:, some])))
            costs.append(
                np.asarray(compiled.advance(self.layout, data, begun, self._steps(1)).cost)[: len(places[some])]
            )
        cost = np.concatenate(costs).reshape(len(block), tried)
        best = np.argmin(cost, axis=1)
        lower = np.flatnonzero(cost[np.arange(len(block)), best] < state.cost * (1 - BETTER))
        if len(lower):
            again = compiled.begin(self.layout, self._data(block.part(lower)), self._cast(units[:, lower, best[lower]]))
            again = again._replace(steps=state.steps[lower])
            self.pools[alike].append((block.part(lower), _lanes_in(again, np.arange(len(lower)))))

    def _keep(self, block: LaneBlock, data: "compiled.LaneArrays", state: "compiled.State") -> None:
        """Put what was found where it belongs, and lanes that are not done into the pool."""
        from gonio.fitting.many import covariance as lane_covariance

        spread = None
        if self.search.covariance:
            error = self._cast(self._wide(block.error))
            spread = lane_covariance.covariance(self.layout, data, state, error, self.search.covariance)
        done = np.asarray(state.done)[: len(block)] | (block.status != FITTED)
        spent = bool(self.search.anneal) | (np.asarray(state.steps)[: len(block)] >= self.search.projection.max_steps)
        ended = done | spent
        self.results.put(self.layout, block, self.axes, Ended(state, spread, done), np.flatnonzero(ended))
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
            self.edges[block.alike].append((part, _lanes_in(state, which)))
        rest = np.flatnonzero(~ended)
        if len(rest):
            self.pools[block.alike].append((block.part(rest), _lanes_in(state, rest)))

    def _data(self, block: LaneBlock) -> "compiled.LaneArrays":
        from gonio.fitting.many import projection as compiled

        scale = self._wide(block.scale, 1.0)
        lower, upper = (np.asarray(b[: self.layout.n])[:, None] / scale for b in (self.lower, self.upper))
        arrays = (lower, upper, block.root if block.alike else self._wide(block.root), self._wide(block.target))
        return compiled.LaneArrays(self.geometry, self.held, self.axes, *map(self._cast, (*arrays, 1 / scale)))

    def _wide(self, values: Values, fill: float = 0.0) -> Values:
        """Filled up to the block's width along the last axis."""
        missing = self.width - values.shape[-1]
        pad = [(0, 0)] * (values.ndim - 1) + [(0, missing)]
        return np.pad(values, pad, constant_values=fill) if missing > 0 else values

    def _starts(self) -> int:
        return min(self.search.projection.followed(self.layout.d), self.points.shape[1])

    def _steps(self, steps: int) -> Any:
        import jax.numpy as jnp

        return jnp.asarray(steps, dtype=jnp.int32)

    def _cast(self, values: Values, dtype: Any = None) -> Any:
        import jax.numpy as jnp

        return jnp.asarray(values, dtype=dtype or self.search.dtype)


def _count(pool: list[tuple[LaneBlock, Any]]) -> int:
    return sum(len(block) for block, _ in pool)


def _lanes_in(state: Any, which: npt.NDArray[np.intp]) -> Any:
    """Some lanes of a state, as NumPy arrays."""
    return type(state)(*(np.asarray(v)[..., which] for v in state))


def _filled(state: Any) -> list[tuple[Values, float]]:
    """The arrays of a state with what fills them up: lanes of nothing are done."""
    return [(v, float(name == "done")) for name, v in zip(state._fields, state, strict=True)]
