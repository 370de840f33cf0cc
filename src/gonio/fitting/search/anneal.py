"""Simulated annealing, as the paper's Appendix A lays it out (guo2023, appendix A; kirkpatrick1983).

A random step changes E by d. It is accepted with the probability min(1, exp(-d/T)), so that the search can leave a
local minimum while the temperature T is high. T falls by one factor after each step (Metropolis's rule under geometric
cooling). The best point met is the result.

The appendix names the settings and gives no values: the defaults here are gonio's own. No local search follows, so E
ends above its minimum. `Projection` reaches an E at least as low in a small part of the time (docs/performance.md):
this solver is for comparison with the paper. `fitting.many.annealing` does the same for many scans at once.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.cells.memory import refuse_too_large
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.solver import Optimum, Progress, silent

Values = npt.NDArray[np.float64]
BLOCK = 256  # steps whose random numbers are drawn at once


@dataclass(frozen=True)
class Anneal:
    """Metropolis search under a falling temperature; the names are those of Appendix A of guo2023.

    Parameters
    ----------
    initial_temperature, final_temperature, cooling_rate : float
        The temperature, in units of E, is multiplied by the rate after each iteration; the search ends below the final
        one.
    max_iterations : int
        Of each chain.
    tolerance, patience : float, int
        The search ends when the best E has changed by less than the tolerance over `patience` iterations (the appendix
        names no window; without one the first refused step would end the search). Zero never ends it.
    lb, ub : mapping
        Bounds of weights and shape by name, where they should be narrower than the problem's. An upper bound that is
        given nowhere is the weight at which its term alone fits the measured values best by least squares. Where
        residuals are squared errors, no optimum of non-negative terms and weights lies above.
    step : float
        Standard deviation of a perturbation at the initial temperature, in units of the range from lb to ub; it falls
        with the square root of the temperature, as does the distance from a minimum at which E, which is quadratic
        there, exceeds it by the temperature.
    seed : int
        Of the random numbers.
    chains : int
        Independent searches side by side; the best one counts.

    Raises
    ------
    ValueError
        A cooling rate outside 0 to 1, temperatures that do not fall or are negative, or counts below one.

    """

    initial_temperature: float = 1.0
    final_temperature: float = 1e-8
    cooling_rate: float = 0.999
    max_iterations: int = 20_000
    tolerance: float = 0.0
    patience: int = 1_000
    lb: Mapping[str, float] = field(default_factory=dict)
    ub: Mapping[str, float] = field(default_factory=dict)
    step: float = 0.5
    seed: int = 0
    chains: int = 1
    name = "anneal"

    def __post_init__(self) -> None:
        if not 0 < self.cooling_rate < 1:
            raise ValueError(f"cooling_rate must lie between 0 and 1, and is {self.cooling_rate:g}")
        if not self.initial_temperature > self.final_temperature >= 0:
            raise ValueError("initial_temperature must be above final_temperature, which must not be negative")
        if self.max_iterations < 1 or self.chains < 1 or self.patience < 1:
            raise ValueError("max_iterations, patience and chains must be at least 1")

    def search(self, problem: Problem, progress: Progress = silent) -> Optimum:
        """The values of least E that any chain met; the history holds each chain's best E after each iteration.

        `exhausted` says that max_iterations ended the search before temperature or tolerance did.
        Raises ValueError as `bounds` does, and where there is not enough memory for the designs of all chains.
        """
        refuse_too_large(problem, 1 + self.chains)
        objective = _Objective(problem, *self.bounds(problem))
        random = np.random.default_rng(self.seed)
        size = len(problem.names)
        current = random.random((self.chains, size))
        cost = objective(current)
        best, best_cost = current.copy(), cost.copy()
        temperature, history = self.initial_temperature, [best_cost.copy()]
        exhausted = True
        for iteration in range(1, self.max_iterations):  # the random start counts as iteration 0
            k = iteration % BLOCK
            if iteration == 1 or k == 0:
                steps = random.standard_normal((BLOCK, self.chains, size))
                chances = np.log(random.random((BLOCK, self.chains)))
                progress(iteration / self.max_iterations)
            width = self.step * np.sqrt(temperature / self.initial_temperature)
            trial = np.clip(current + width * steps[k], 0.0, 1.0)
            trial_cost = objective(trial)
            # exp(-d/T) > u as -d > T log u: no exponential overflows, and a T near zero divides nothing
            accepted = (cost - trial_cost) > temperature * chances[k]
            current[accepted], cost[accepted] = trial[accepted], trial_cost[accepted]
            better = cost < best_cost
            best[better], best_cost[better] = current[better], cost[better]
            history.append(best_cost.copy())
            temperature *= self.cooling_rate
            if temperature < self.final_temperature or self._settled(history):
                exhausted = False
                break
        progress(1.0)
        winner = int(np.argmin(best_cost))
        vector = objective.vector(best)[winner]
        evaluations = len(history) * self.chains
        return Optimum(vector, float(best_cost[winner]), exhausted, evaluations, np.array(history))

    def _settled(self, history: list[Values]) -> bool:
        """Whether no chain's best E has fallen by the tolerance within the last `patience` iterations."""
        if self.tolerance <= 0 or len(history) <= self.patience:
            return False
        return bool(np.all(history[-1 - self.patience] - history[-1] < self.tolerance))

    def bounds(self, problem: Problem) -> tuple[Values, Values]:
        """The problem's bounds, narrowed to lb and ub; ValueError for an unknown name or a range that is empty."""
        names = [entry.name for entry in problem.free for _ in entry.labels]
        for name in (*self.lb, *self.ub):
            if name not in names:
                raise ValueError(f"no free parameter is called {name!r}; there are {', '.join(dict.fromkeys(names))}")
        lower = np.maximum(problem.lower, [self.lb.get(name, -np.inf) for name in names])
        upper = np.minimum(problem.upper, [self.ub.get(name, np.inf) for name in names])
        for name, low, high in zip(names, lower, upper, strict=True):
            if low > high:
                raise ValueError(f"nothing lies between lb and ub of {name}: {low:g} to {high:g}")
        return lower, upper


class _Objective:
    """E (eq 11) of many candidates at once, in coordinates (..., n) from 0 (lb) to 1 (ub).

    One width of step then suits all values, whatever their units: weights of one fit can differ by a factor of 3000
    (guo2023, eq 12). The design is computed once where no shape is free.
    """

    def __init__(self, problem: Problem, lower: Values, upper: Values) -> None:
        self.problem = problem
        self._n = problem.n_weights
        self._lower, self._upper = lower, upper
        self._axes = problem.axes(lower[self._n :], upper[self._n :])
        self._constant = None if problem.free_shape else self._weighted(np.empty((1, 0)))

    def __call__(self, unit: Values) -> Values:
        """E and the penalty of candidates (chains, n), as a solver minimises them (chains,)."""
        matrix, target, vector = self._system(unit)
        modelled = (matrix @ vector[:, : self._n, None])[..., 0]
        penalty = self.problem.cost(vector @ self.problem.penalty.T)
        if self.problem.logarithmic:  # the target is minus the part of held weights, so this is the BRDF
            return penalty + self.problem.cost(self.problem.difference(modelled - target))
        return penalty + self.problem.cost(modelled - target)

    def vector(self, unit: Values) -> Values:
        """Weights and shape of candidates in unit coordinates."""
        return self._system(unit)[2]

    def _system(self, unit: Values) -> tuple[Values, Values, Values]:
        """Design and target of candidates as `_weighted` gives them, and their weights and shape (chains, n)."""
        shape = self._axes.values(unit[:, self._n :])
        matrix, target, upper = self._constant if self._constant is not None else self._weighted(shape)
        lower = self._lower[: self._n]
        weights = lower + unit[:, : self._n] * (upper - lower)
        return matrix, target, np.concatenate([weights, shape], axis=1)

    def _weighted(self, shape: Values) -> tuple[Values, Values, Values]:
        """Design and target as the residual weighs them (unweighted before a logarithm), and weights' upper bounds.

        The upper bound of a weight without one is a'm/a'a, with its column a of the design and the measured values m.
        It changes with the shape, and with it what a unit coordinate of the weight means.
        """
        problem = self.problem
        matrix, fixed = problem.design(shape)
        if problem.logarithmic:
            target, measured = -fixed, problem.measured - fixed
        else:
            matrix = problem.root_weights[:, None] * matrix
            target = measured = problem.target - problem.root_weights * fixed
        squared = np.einsum("...nw,...nw->...w", matrix, matrix)
        best_alone = np.einsum("...nw,...n->...w", matrix, measured) / np.where(squared > 0, squared, 1.0)
        declared = self._upper[: self._n]
        upper = np.where(np.isfinite(declared), declared, np.maximum(best_alone, self._lower[: self._n]))
        return matrix, target, upper
