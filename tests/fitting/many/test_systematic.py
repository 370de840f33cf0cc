"""What a stack states beside random uncertainties is in no uncertainty of its fits, and that is said."""

import logging

import numpy as np
import pytest

from gonio import Problem, catalogue, fit_many
from gonio.measured.causes import with_causes
from gonio.measured.dataset import make_scan
from gonio.measured.stack import one_scan

pytest.importorskip("jax", reason="the extra `batch` is not installed")


def test_fits_of_many_say_that_they_leave_the_causes_out(caplog):
    one = with_causes(make_scan([10.0] * 3, [0.0, 20.0, 40.0], [0.1, 0.1, 0.11]), {"scale": np.full(3, 0.001)})
    stack = one.drop_vars(["systematic", "cause"]).expand_dims(sample=2)
    problem = Problem(catalogue["lambert"], one_scan(stack, ("sample",)))
    with caplog.at_level(logging.WARNING, logger="gonio"):
        fits = fit_many(problem, stack)
    assert "is in no uncertainty of these fits" in fits.attrs["systematic"]
    assert "uncertainty_systematic of the stack is in no uncertainty" in caplog.text
    plain = fit_many(problem, stack.drop_vars("uncertainty_systematic"))
    assert plain.attrs["systematic"] == ""
