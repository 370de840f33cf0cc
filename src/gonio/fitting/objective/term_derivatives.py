"""The terms of a model at some directions, and how each changes with the shape parameters that it depends on.

With the BRDF f = sum_k w_k t_k(s), weights w and shape s, a search needs dt_k/ds_i and d2t_k/ds_i ds_j. They are
differences over a step h_i of each parameter:

    dt/ds_i       (t(s_i + h_i) - t(s_i - h_i)) / (2 h_i)
    d2t/ds_i^2    (t(s_i + h_i) - 2 t + t(s_i - h_i)) / h_i^2
    d2t/ds_i ds_j (t(s_i + h_i, s_j + h_j) - t(s_i + h_i) - t(s_j + h_j) + t) / (h_i h_j)

A term depends on few of the shape parameters. Only those are moved, one at a time for first derivatives and two at a
time for second ones, so that a model of many terms costs little more than its terms.

This serves `objective.blocks` alone: derivatives of terms at distinct directions are shared by all points there. The
residual of an ordinary problem is differentiated in `objective.slopes`.
"""

import functools
import itertools
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.differences import CENTRAL, SMALLEST, derivative
from gonio.fitting.objective.problem import Problem
from gonio.geometry import Geometry
from gonio.model import Model, declarations

Values = npt.NDArray[np.float64]

# Of a parameter's size: the best step of a central difference, good to some 1e-10, less than a printed digit shows. A
# second difference over so small a step has an error of eps/h^2, some 1e-5: enough for a step of a search.
STEP = CENTRAL


class Terms(NamedTuple):
    """Every term at m directions for one shape, and its derivatives.

    shape (n_shape,). values (terms, m). first: derivatives in the order of `TermDerivatives.pairs` (pairs, m). second:
    in the order of `TermDerivatives.crosses` (crosses, m), zero where a bound left no room to measure them.
    """

    shape: Values
    values: Values
    first: Values
    second: Values


class Pair(NamedTuple):
    """A term and a free shape parameter that it depends on, by their places; `model` has that term alone.

    So moving the parameter evaluates no other term.
    """

    term: int
    parameter: int
    model: Model


class TermDerivatives:
    """The terms of a problem's model, and their derivatives by its free shape parameters, at any directions.

    pairs: each term with each free shape parameter that it depends on. crosses: places in `pairs` of two parameters of
    one term, or of one parameter with itself; between terms there is no second derivative, because f is their sum.
    The problem must have one value for each shape parameter.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        names = [entry.name for entry in problem.free_shape]
        self.pairs = tuple(
            Pair(k, names.index(name), replace(problem.model, terms={weight: term}))
            for k, (weight, term) in enumerate(problem.model.terms.items())
            for name in declarations(term)
            if name in names
        )
        combinations = itertools.combinations_with_replacement(range(len(self.pairs)), 2)
        self.crosses = tuple((a, b) for a, b in combinations if self.pairs[a].term == self.pairs[b].term)

    def at(self, directions: Geometry, shape: Values) -> Terms:
        """The terms and their derivatives at m directions for a shape (n_shape,).

        First derivatives are central differences. Where a bound leaves no room for both sides they are those of
        `differences.derivative`, and second derivatives are zero: these only make a search faster, and no uncertainty
        is computed from them.
        """
        terms, n = _values(self.problem.model, directions, self._named(shape)), self.problem.n_weights
        lower, upper, steps = self.problem.lower[n:], self.problem.upper[n:], STEP * np.maximum(np.abs(shape), SMALLEST)

        def moved_by(model: Model, *parameters: int, times: float = 1.0) -> Values:
            moved = shape.copy()
            moved[list(parameters)] += times * steps[list(parameters)]
            return _values(model, directions, self._named(moved))[0]

        first, second = (np.zeros((len(pairs), terms.shape[1])) for pairs in (self.pairs, self.crosses))
        ahead: dict[int, Values] = {}  # by place in `pairs`: the mixed differences use it again
        for a, (term, k, model) in enumerate(self.pairs):
            if shape[k] - steps[k] < lower[k] or shape[k] + steps[k] > upper[k]:
                near = shape[k : k + 1], lower[k], upper[k]
                along = functools.partial(self._along, model, directions, shape, k)
                first[a] = derivative(along, *near, scale=SMALLEST)[:, 0]
                continue
            ahead[a], behind = moved_by(model, k), moved_by(model, k, times=-1)
            first[a] = (ahead[a] - behind) / (2 * steps[k])
            second[self.crosses.index((a, a))] = (ahead[a] - 2 * terms[term] + behind) / steps[k] ** 2
        for place, (a, b) in enumerate(self.crosses):
            if a != b and a in ahead and b in ahead:
                term, k, model = self.pairs[a]
                # one-sided: one more evaluation for each pair of parameters, where a central one would take four
                both = moved_by(model, k, self.pairs[b].parameter)
                area = steps[k] * steps[self.pairs[b].parameter]
                second[place] = (both - ahead[a] - ahead[b] + terms[term]) / area
        return Terms(shape.copy(), terms, first, second)

    def _along(self, model: Model, directions: Geometry, shape: Values, k: int, value: Values) -> Values:
        """The one term (m,) of a model as a function of the k-th shape value (1,) alone."""
        moved = shape.copy()
        moved[k] = value[0]
        return _values(model, directions, self._named(moved))[0]

    def _named(self, shape: Values) -> dict[str, float]:
        """All shape parameters by name, held ones too."""
        by_name, at = {}, 0
        for entry in self.problem.entries:
            if entry.is_weight:
                continue
            if entry.held is not None:
                by_name[entry.name] = entry.held[0]
                continue
            by_name[entry.name] = float(shape[at])
            at += 1
        return by_name


def _values(model: Model, directions: Geometry, shape: dict[str, float]) -> Values:
    """The terms (terms, m) of a model at m directions; shape parameters that the model lacks are ignored."""
    basis = model.basis(directions, {name: shape[name] for name in model.shape})
    return np.array([np.broadcast_to(value, directions.z_i.shape) for value in basis.values()], dtype=float)
