"""The figure of two workers against one, as dask_bench measures it, as many pairs as five minutes allow."""

from dask_bench import measure as pairs
from figures import Figure

BUDGET = 330.0  # s


def measure() -> Figure:
    """`dask_two_over_one`, with the whole command, the runs, and whether both wrote the same to the last bit beside."""
    found = pairs(budget=BUDGET)
    value, reason = found.pop("dask_two_over_one"), found.pop("reason")
    return Figure("dask_two_over_one", value, reason, found)
