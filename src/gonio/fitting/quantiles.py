"""Quantiles of the normal distribution and of Student's t.

SciPy's, imported when one is asked for: its import takes longer than reading and drawing a scan, which need none.
"""

from typing import Any

import numpy.typing as npt


def normal(probability: npt.ArrayLike) -> Any:
    """Quantile of the standard normal distribution, for a probability or an array of them."""
    from scipy.special import ndtri

    return ndtri(probability)


def student_t(freedom: npt.ArrayLike, probability: npt.ArrayLike) -> Any:
    """Quantile of Student's t with so many degrees of freedom; numbers or arrays that broadcast."""
    from scipy.special import stdtrit

    return stdtrit(freedom, probability)
