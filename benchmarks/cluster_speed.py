"""The figure of two workers against one, as dask_bench measures it, as many pairs as five minutes allow.

Run as a program it takes five pairs, ten minutes, and keeps their figure in results.json.
"""

from typing import Any

from dask_bench import measure as pairs
from figures import Figure, keep

BUDGET = 330.0  # s


def figure(found: dict[str, Any]) -> Figure:
    """`dask_two_over_one`, with the whole command, the runs, and whether both wrote the same to the last bit beside."""
    value, reason = found.pop("dask_two_over_one"), found.pop("reason")
    return Figure("dask_two_over_one", value, reason, found)


def measure() -> Figure:
    """The figure of what the budget allows."""
    return figure(pairs(budget=BUDGET))


if __name__ == "__main__":
    keep(figure(pairs()))
