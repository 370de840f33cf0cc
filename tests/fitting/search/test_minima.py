"""Starts that grow with the dimension, and what a fit says where its searches end in different minima."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from gonio import Problem, catalogue, fit, simulate
from gonio.app.views.fit import provisos
from gonio.fitting.search.projection import Projection
from gonio.fitting.search.solver import Optimum, silent


@dataclass(frozen=True)
class Several:
    """Projection, with other ends of its searches than were met."""

    moved: tuple[float, ...]  # factor of the first weight in each
    name = "several"

    def search(self, problem: Problem, progress=silent) -> Optimum:
        found = Projection().search(problem, progress)
        others = [found.vector * np.r_[factor, np.ones(len(found.vector) - 1)] for factor in self.moved]
        return replace(found, rivals=tuple(others))


@pytest.fixture(scope="module")
def problem() -> Problem:
    model = catalogue["ggx"]
    values = {"rho_s": 0.5, "rho_d": 0.1, "width": 0.2, "index": 1.5, "extinction": 0.0}
    scan = simulate(model, values, [20.0, 50.0], np.arange(-80, 81, 5.0), noise=0.05, seed=1)
    return Problem(model, scan)


def test_starts_grow_with_the_dimension():
    assert [Projection().followed(d) for d in (1, 2, 3, 4, 5, 8, 12)] == [4, 4, 4, 4, 5, 8, 12]
    assert [Projection(searches=3).followed(d) for d in (1, 12)] == [3, 3]
    assert [Projection().followed_of_many(d) for d in (1, 2, 3, 12)] == [2, 2, 4, 4]


def test_searches_that_agree_are_counted_and_nothing_is_said(problem):
    solution = fit(problem, solver=Several((1.0, 1.0, 1.5)))
    attrs = solution.dataset.attrs
    assert (attrs["searches"], attrs["searches_alike"]) == (4, 3)
    assert attrs["next_minimum"] > 1.001
    assert not list(provisos.minima_lines(solution))


def test_where_rivals_differ_a_lower_minimum_may_exist(problem):
    solution = fit(problem, solver=Several((1.05, 1.5)))
    attrs = solution.dataset.attrs
    assert (attrs["searches"], attrs["searches_alike"]) == (3, 1)
    (line,) = provisos.minima_lines(solution)
    assert line.plain.startswith("a lower minimum may exist: of 3 searches one met the lowest, the next ends")
    assert "--setting searches=12 looks further" in line.plain
    assert provisos.minima_record(solution)["searches_alike"] == 1


def test_a_fit_without_rivals_says_nothing():
    model = catalogue["lambert"]
    solution = fit(Problem(model, simulate(model, {"rho": 0.5}, [30.0], np.arange(-60, 61, 20.0))))
    assert solution.dataset.attrs["searches"] == 0
    assert not list(provisos.minima_lines(solution))
