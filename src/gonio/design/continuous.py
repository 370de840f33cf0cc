"""The best design there can be, as parts of all readings for every direction, with the proof that it is.

Parts w_j need not be whole numbers of readings, and the criterion is convex in them. The equivalence theorem
(kiefer1960) says when they are best: no direction is more sensitive than the chosen ones are on average,

    max_j q_j = sum_j w_j q_j.

By convexity no design of so many readings, whole or not, is better than the criterion less max q - sum w q: a bound
that holds before the end of the search too. The multiplicative rule w_j <- w_j q_j^p / sum_k w_k q_k^p, with p = 1/2
for variances and 1 for the determinant, goes there without a step size (silvey1978, yu2010).
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gonio.design.question import Question

Values = npt.NDArray[np.float64]

PROVEN = 1e-3  # by how much max q / sum w q may exceed one
STEPS = 20_000
PURGED = 100  # steps between looks at which directions have all but gone
DESCENT = 500  # steps to the bound of distinct readings, which is then good to some thousandths
GONE = 1e-5  # of an even part: directions below it rest until the end, where they are looked at again


@dataclass(frozen=True, eq=False)
class Continuous:
    """parts (directions,): w, whose sum is one. covariance (values, values): C of that design.

    value: its criterion. excess: max q / sum w q, one at the optimum. bound: what no design of so many readings is
    below.
    """

    parts: Values
    covariance: Values
    value: float
    excess: float
    bound: float


def continuous(question: Question, readings: float = 1.0, proven: float = PROVEN, steps: int = STEPS) -> Continuous:
    """The best parts of so many readings, until max q / sum w q is within 1 + proven, or after `steps` steps."""
    parts = np.full(len(question.rows), 1 / len(question.rows))
    alive = np.arange(len(parts))
    power = 1.0 if question.aims is None else 0.5
    some = question
    for step in range(steps):
        own = parts[alive]
        q = some.sensitivities(question.covariance(some.information(readings * own)))
        mean = own @ q
        if q.max() <= (1 + proven) * mean:
            if len(alive) == len(parts):
                break
            all_q = question.sensitivities(question.covariance(question.information(readings * parts)))
            if all_q.max() <= (1 + proven) * (parts @ all_q):
                break
            back = all_q > mean
            parts = np.where(back, np.maximum(parts, 1e-3 / len(parts)), parts)
            parts, alive, some = parts / parts.sum(), np.arange(len(parts)), question
            continue
        own = own * q**power
        parts = np.zeros_like(parts)
        parts[alive] = own / own.sum()
        if step % PURGED == PURGED - 1:
            alive = np.flatnonzero(parts > GONE / len(parts))
            some = Question(question.rows[alive], question.aims, question.prior)
    return _found(question, parts, readings)


def _found(question: Question, parts: Values, readings: float) -> Continuous:
    covariance = question.covariance(question.information(readings * parts))
    q = readings * question.sensitivities(covariance)
    value, mean = question.value(covariance), float(parts @ q)
    return Continuous(parts, covariance, value, float(q.max()) / mean, value - (float(q.max()) - mean))


def distinct_bound(question: Question, places: npt.NDArray[np.intp], points: int, steps: int = DESCENT) -> float:
    """What no design of so many distinct readings is below: parts of readings between none and one a direction.

    places: of a design to start from. Each step goes towards the `points` most sensitive directions, of whose step the
    criterion falls most (frank1956); by convexity the criterion less what a whole step promises is a bound.
    """
    counts = np.bincount(places, minlength=len(question.rows)).clip(0, 1).astype(float)
    bound = -np.inf
    for step in range(steps):
        covariance = question.covariance(question.information(counts))
        q = question.sensitivities(covariance)
        towards = np.zeros_like(counts)
        towards[np.argpartition(-q, points - 1)[:points]] = 1.0
        bound = max(bound, question.value(covariance) - float(q @ (towards - counts)))
        counts = counts + (towards - counts) / (step + 5)
    return bound


def efficiency(question: Question, bound: float, covariance: Values) -> float:
    """How near a design comes to a bound, at most 1: the bound over its criterion.

    For the determinant it is the factor of readings, exp((bound - value)/values).
    """
    value = question.value(covariance)
    if question.aims is None:
        return float(np.exp((bound - value) / len(covariance)))
    return bound / value
