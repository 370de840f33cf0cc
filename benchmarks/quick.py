"""The five figures of `make bench-quick`, in less than ten minutes, and those of other peers.

    python benchmarks/quick.py [MODULE ..]      all of MODULES, or those that are named

Every module has a function `measure` that returns one Figure or several; one that is missing or cannot measure leaves
null in results.json, with the reason beside it. Run alone on the machine, after `make bench-peers`.
"""

import importlib
import sys
from collections.abc import Iterable

from figures import Figure, keep

# what each module measures
MODULES = {
    "evaluation_speed": ("evaluation_over_mitsuba", "evaluation_over_copy"),
    "fits_speed": ("fits_over_scipy", "long_scan_seconds", "anneal_one_over_many"),
    "annealing_speed": ("anneal_over_exact", "dual_annealing_over_exact"),
    "cluster_speed": ("dask_two_over_one",),
    "lmfit_peer": ("lmfit_over_fit",),
    "lumos_peer": ("lumos_over_evaluation",),
}


def measured(module: str) -> Iterable[Figure]:
    """The figures of a module, and null for each that it does not give."""
    reason, found = f"benchmarks/{module}.py did not measure it", ()
    try:
        given = importlib.import_module(module).measure()
        found = (given,) if isinstance(given, Figure) else tuple(given)
    except ModuleNotFoundError as error:
        lacking = f"benchmarks/{module}.py is not there" if error.name == module else f"{error.name} is not installed"
        reason = f"not measured: {lacking}"
    except Exception as error:  # one figure that fails must not take the others with it
        reason = f"not measured: {type(error).__name__}: {error}"
    have = {figure.name for figure in found}
    return (*found, *(Figure(name, reason=reason) for name in MODULES[module] if name not in have))


def main(names: list[str]) -> int:
    unknown = set(names) - MODULES.keys()
    if unknown:
        print(f"no module {', '.join(unknown)}: choose from {', '.join(MODULES)}", file=sys.stderr)
        return 2
    for module in names or MODULES:
        for figure in measured(module):
            keep(figure)
            print(
                f"{figure.name}: {figure.reason if figure.value is None else format(figure.value, '.4g')}", flush=True
            )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
