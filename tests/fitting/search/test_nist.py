"""The local search against NIST's certified nonlinear-regression problems, from both starting points (nist1998)."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from numpy import arctan, cos, exp, pi, sin

from gonio.fitting.certainty.covariance import scaled
from gonio.fitting.objective.differences import derivative
from gonio.fitting.objective.tangent import Tangent
from gonio.fitting.search.descent import LeastSquares, descend
from places import SHARED

Values = npt.NDArray[np.float64]

FOLDER = SHARED / "nist_strd"
CERTIFIED = 11.0  # digits that are printed
BAR, BAR_DEVIATION = 8.0, 6.0  # digits asked for, of parameters and of standard deviations
# Lanczos1 repeats a sum of exponentials in 14 digits: its residual is what the 14th digit rounded, 8e-14, which double
# precision knows to half a percent a point. The deviations are proportional to it, and the values are not.
ROUNDING = {"Lanczos1": 2.5}


def saturation(b: Values, x: Values) -> Values:
    return b[0] * (1 - exp(-b[1] * x))


def ultrasonic(b: Values, x: Values) -> Values:
    return exp(-b[0] * x) / (b[1] + b[2] * x)


def two_peaks(b: Values, x: Values) -> Values:
    peaks = b[2] * exp(-((x - b[3]) ** 2) / b[4] ** 2) + b[5] * exp(-((x - b[6]) ** 2) / b[7] ** 2)
    return b[0] * exp(-b[1] * x) + peaks


def three_decays(b: Values, x: Values) -> Values:
    return b[0] * exp(-b[1] * x) + b[2] * exp(-b[3] * x) + b[4] * exp(-b[5] * x)


def cubic_by_cubic(b: Values, x: Values) -> Values:
    return (b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3) / (1 + b[4] * x + b[5] * x**2 + b[6] * x**3)


def three_cycles(b: Values, x: Values) -> Values:
    t = 2 * pi * x
    year = b[1] * cos(t / 12) + b[2] * sin(t / 12)
    return b[0] + year + b[4] * cos(t / b[3]) + b[5] * sin(t / b[3]) + b[7] * cos(t / b[6]) + b[8] * sin(t / b[6])


MODELS: dict[str, Callable[[Values, Values], Values]] = {
    "Bennett5": lambda b, x: b[0] * (b[1] + x) ** (-1 / b[2]),
    "BoxBOD": saturation,
    "Chwirut1": ultrasonic,
    "Chwirut2": ultrasonic,
    "DanWood": lambda b, x: b[0] * x ** b[1],
    "ENSO": three_cycles,
    "Eckerle4": lambda b, x: b[0] / b[1] * exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
    "Gauss1": two_peaks,
    "Gauss2": two_peaks,
    "Gauss3": two_peaks,
    "Hahn1": cubic_by_cubic,
    "Kirby2": lambda b, x: (b[0] + b[1] * x + b[2] * x**2) / (1 + b[3] * x + b[4] * x**2),
    "Lanczos1": three_decays,
    "Lanczos2": three_decays,
    "Lanczos3": three_decays,
    "MGH09": lambda b, x: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "MGH10": lambda b, x: b[0] * exp(b[1] / (x + b[2])),
    "MGH17": lambda b, x: b[0] + b[1] * exp(-x * b[3]) + b[2] * exp(-x * b[4]),
    "Misra1a": saturation,
    "Misra1b": lambda b, x: b[0] * (1 - (1 + b[1] * x / 2) ** -2.0),
    "Misra1c": lambda b, x: b[0] * (1 - (1 + 2 * b[1] * x) ** -0.5),
    "Misra1d": lambda b, x: b[0] * b[1] * x / (1 + b[1] * x),
    "Nelson": lambda b, x: b[0] - b[1] * x[0] * exp(-b[2] * x[1]),  # of the logarithm of y
    "Rat42": lambda b, x: b[0] / (1 + exp(b[1] - b[2] * x)),
    "Rat43": lambda b, x: b[0] / (1 + exp(b[1] - b[2] * x)) ** (1 / b[3]),
    "Roszman1": lambda b, x: b[0] - b[1] * x - arctan(b[2] / (x - b[3])) / pi,
    "Thurber": cubic_by_cubic,
}


@dataclass(frozen=True)
class Certified:
    """One problem: its data, two starts, and what NIST certifies."""

    name: str
    level: str
    x: Values
    y: Values
    starts: tuple[Values, Values]
    values: Values
    deviations: Values
    residual_squares: float

    def residual(self, b: Values) -> Values:
        with np.errstate(all="ignore"):  # a search may try values at which the model overflows
            return MODELS[self.name](b, self.x) - self.y


def load(path: Path) -> Certified:
    """Read a file of NIST's: a header of 60 lines for the eye, then columns y, x, .."""
    text = path.read_text(encoding="ascii")
    table = np.array(re.findall(r"^\s*b\d+ =\s+(\S+)\s+(\S+)\s+(\S+)\s+(\S+)\s*$", text, re.MULTILINE), dtype=float)
    columns = np.array([line.split() for line in text.splitlines()[60:] if line.strip()], dtype=float).T
    (parameters,) = re.findall(r"(\d+) Parameters", text)
    (points,) = re.findall(r"(\d+) Observations", text)
    if len(table) != int(parameters) or columns.shape[1] != int(points):
        raise ValueError(f"{path.name}: {len(table)} parameters and {columns.shape[1]} points, and not as it says")
    y, x = columns[0], columns[1:]
    return Certified(
        path.stem,
        re.findall(r"(\w+) Level of Difficulty", text)[0].lower(),
        x if len(x) > 1 else x[0],
        np.log(y) if path.stem == "Nelson" else y,
        (table[:, 0], table[:, 1]),
        table[:, 2],
        table[:, 3],
        float(re.findall(r"Residual Sum of Squares:\s+(\S+)", text)[0]),
    )


def digits(found: Values, certified: Values) -> float:
    """Matching digits of the worst value: minus the decimal logarithm of its relative error, as NIST counts."""
    worst = float(np.max(np.abs(found - certified) / np.abs(certified)))  # NaN or infinite where nothing was found
    return float(np.clip(-np.log10(max(worst, 1e-300)), 0.0, CERTIFIED)) if np.isfinite(worst) else 0.0


def solve(problem: Certified, start: int) -> tuple[float, float, int]:
    """Matching digits of values and of standard deviations, and evaluations; the same settings for every problem."""
    end = descend(LeastSquares(problem.residual), problem.starts[start])
    spread = scaled(Tangent(derivative(problem.residual, end.point)), problem.residual(end.point))
    return digits(end.point, problem.values), digits(np.sqrt(np.diag(spread)), problem.deviations), end.evaluations


@pytest.fixture(scope="module")
def certified() -> list[Certified]:
    if not FOLDER.is_dir():
        pytest.skip(f"no certified problems at {FOLDER}")
    return [load(FOLDER / f"{name}.dat") for name in MODELS]


def test_formulas_give_the_certified_residual(certified):
    """At the certified values each formula gives the certified sum of squares, so none is mistyped."""
    for problem in certified:
        found = float(np.sum(problem.residual(problem.values) ** 2))
        # Lanczos1 and 2 fit to 13 and to six digits: rounding of the printed values is all of the residual, or some
        tolerance = {"Lanczos1": np.inf, "Lanczos2": 1e-5}.get(problem.name, 1e-9)
        assert found == pytest.approx(problem.residual_squares, rel=tolerance), problem.name


@pytest.mark.parametrize(("start", "needed"), [(0, 25), (1, 27)], ids=["start-1", "start-2"])
def test_matching_digits(certified, start, needed):
    """Eight digits of every value: on all 27 problems from the near start, on 25 from the far one."""
    found = {problem.name: solve(problem, start) for problem in certified}
    print({name: (round(values, 1), round(deviations, 1)) for name, (values, deviations, _) in found.items()})
    solved = [name for name, (values, _, _) in found.items() if values >= BAR]
    assert len(found) == 27
    assert len(solved) >= needed, sorted(set(found) - set(solved))
    for name in solved:
        assert found[name][1] >= ROUNDING.get(name, BAR_DEVIATION), name


def test_units_do_not_matter(certified):
    """Data and values in other units, fifteen decades away, are solved to the same digits."""
    (problem,) = [p for p in certified if p.name == "Chwirut2"]
    for unit in (1e-15, 1e15):
        end = descend(LeastSquares(lambda b, unit=unit: unit * problem.residual(b * unit)), problem.starts[0] / unit)
        assert digits(end.point * unit, problem.values) >= BAR


def test_bounds_hold_what_presses_against_them(certified):
    """A bound short of the optimum is met exactly, and the other value is the optimum beside it."""
    (problem,) = [p for p in certified if p.name == "Misra1a"]
    upper = np.array([0.9 * problem.values[0], 1.0])
    found = descend(LeastSquares(problem.residual, 0.0, upper), np.array([100.0, 1e-3]))
    held = descend(LeastSquares(lambda b: problem.residual(np.array([upper[0], b[0]]))), problem.starts[1][1:])
    assert found.point[0] == upper[0]
    assert found.point[1] == pytest.approx(held.point[0], rel=1e-9)
    assert found.offset < 1e-9
    slopes = derivative(problem.residual, found.point, 0.0, upper)  # from one side where the bound is
    free = derivative(problem.residual, found.point)
    np.testing.assert_allclose(slopes, free, rtol=1e-8)


def test_an_exact_derivative_is_used(certified):
    """It costs no evaluation, and leads to the same digits."""
    (problem,) = [p for p in certified if p.name == "DanWood"]

    def exact(b):
        power = problem.x ** b[1]
        return np.stack([power, b[0] * power * np.log(problem.x)], axis=-1)

    np.testing.assert_allclose(derivative(problem.residual, problem.values), exact(problem.values), rtol=1e-11)
    given, by_differences = (
        descend(LeastSquares(problem.residual, jacobian=j), problem.starts[0]) for j in (exact, None)
    )
    assert digits(given.point, problem.values) >= BAR
    assert given.evaluations < by_differences.evaluations


def test_how_a_search_ends(certified):
    """Out of steps, and exactly at the data."""
    (problem,) = [p for p in certified if p.name == "MGH17"]
    assert descend(LeastSquares(problem.residual), problem.starts[0], max_steps=5).exhausted
    there = descend(LeastSquares(lambda b: b - 3.0), np.array([3.0, 3.0]))
    assert (there.cost, there.offset, there.exhausted) == (0.0, 0.0, False)
