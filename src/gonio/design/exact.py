"""Designs of whole numbers of readings: greedy choice, then exchange (fedorov1972).

The greedy choice takes, one after another, the direction that makes the criterion fall most. The exchange then takes
each chosen direction out and puts the best one in its place, until no exchange gains: it never ends above the greedy
choice. No step looks at more than the covariance (values, values) and one row for each direction.
"""

import numpy as np
import numpy.typing as npt

from gonio.design.question import Question

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

GAINED = 1e-9  # of the criterion: what an exchange must gain, so that rounding does not go round in circles
PASSES = 30  # through all chosen directions; a handful is what it takes


def chosen(question: Question, points: int, kept: Places | None = None, repeats: bool = False) -> Places:
    """Places (points,) of the directions to read, in order: greedy choice and exchange.

    kept: places that are chosen already and stay, the first of the result. repeats: whether a direction may be read
    more than once. Raises ValueError where there are fewer directions than points, and without repeats.
    """
    return exchanged(question, greedy(question, points, kept, repeats), 0 if kept is None else len(kept), repeats)


def greedy(question: Question, points: int, kept: Places | None = None, repeats: bool = False) -> Places:
    """Places (points,): each the direction that makes the criterion fall most after those before it."""
    if points > len(question.rows) and not repeats:
        raise ValueError(
            f"{points} readings are asked for and {len(question.rows)} directions are there to choose from: "
            "ask for fewer, take a finer step, or allow repeats"
        )
    out = [] if kept is None else kept.tolist()
    free = np.ones(len(question.rows), dtype=bool)
    free[out] = repeats
    information = question.information(_counts(question, out))
    while len(out) < points:
        gains = question.gains(question.covariance(information))
        best = int(np.argmax(np.where(free, gains, -np.inf)))
        out.append(best)
        free[best] = repeats
        information = information + np.outer(question.rows[best], question.rows[best])
    return np.array(out, dtype=np.intp)


def exchanged(question: Question, places: Places, fixed: int = 0, repeats: bool = False) -> Places:
    """The places with every one but the first `fixed` replaced by the best direction as long as that gains."""
    out = places.tolist()
    free = np.ones(len(question.rows), dtype=bool)
    free[out] = repeats
    information = question.information(_counts(question, out))
    value = question.value(question.covariance(information))
    for _ in range(PASSES):
        before = value
        for k in range(fixed, len(out)):
            row = question.rows[out[k]]
            without = information - np.outer(row, row)
            gains = question.gains(question.covariance(without))
            best = int(np.argmax(np.where(free, gains, -np.inf)))
            if not free[best] or gains[best] <= gains[out[k]]:
                continue
            tried = without + np.outer(question.rows[best], question.rows[best])
            trial = question.value(question.covariance(tried))
            if trial < value - GAINED * abs(value):
                free[out[k]], free[best] = True, repeats
                out[k], information, value = best, tried, trial
        if value == before:
            break
    return np.array(out, dtype=np.intp)


def _counts(question: Question, places: list[int]) -> Values:
    return np.bincount(np.array(places, dtype=np.intp), minlength=len(question.rows)).astype(float)
