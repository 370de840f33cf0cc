"""Small plans and simulated benches that tests share."""

from gonio import catalogue
from gonio.acquisition import Conditions, Journal, Layout, grid, run
from gonio.acquisition.simulated import Diffuse, Electronics, SimulatedBench

VALUES = {"rho_s": 0.3, "rho_d": 0.2, "width": 0.2}
SMALL = grid(
    [20, 40],
    [-60, -30, -20, 0, 30, 60],
    layout=Layout(blocked=5, dark_every=4, check=(0, 45)),
    conditions=Conditions(wavelength=632.8, dwell=0.1),
)

FEW_RANGES = Electronics(ranges=(1e-7, 1e-5, 1e-4))


def bench(faults=(), surface=None, **given):
    """A bench of a white surface, which costs no time."""
    return SimulatedBench(surface or Diffuse(0.5), faults=faults, **{"electronics": FEW_RANGES} | given)


def bench_of(surface, ranges):
    """A bench of any surface with a detector of these ranges [W]."""
    return SimulatedBench(surface, electronics=Electronics(ranges=ranges))


def coating(**given):
    return SimulatedBench(catalogue["ggx"], VALUES, **given)


def measure(path, on, plan=SMALL):
    """The records of a run, to its end."""
    with Journal(path, plan, on.described(plan.conditions.filter)) as journal:
        return list(run(plan, on, journal))
