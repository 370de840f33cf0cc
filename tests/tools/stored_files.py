"""Files of fits and stores of stacks, as people have them: what `make fuzz` damages beside the formats of scans."""

from pathlib import Path

import numpy as np

import stacks
from gonio import Problem, catalogue, fit, join, simulate, write
from gonio.fitting.certainty.bootstrap import bootstrap, kept
from gonio.fitting.search.anneal import Anneal
from gonio.measured.dataset import RELATIVE
from gonio.measured.instrument import Instrument


def fits(folder: Path) -> list[Path]:
    """Files of fits with everything that one may hold: groups, smooth values, draws, a history, cones, a lost value."""
    lorentz, ggx = catalogue["cauchy-lorentz"], catalogue["ggx"]
    angles = np.arange(-70.0, 71, 10)
    values = {"ks": 2.0, "kdd": 30.0, "kid": 0.1, "sigma": 0.15, "gamma": 20.0}
    scan = simulate(lorentz, values, [30.0, 50.0], angles, noise=0.01)
    relative = simulate(lorentz, values, [30.0, 50.0], angles, noise=0.01, unit=RELATIVE)
    surfaces = {
        name: simulate(ggx, {"rho_s": 0.3, "rho_d": diffuse, "width": 0.2}, [40.0], angles, noise=0.01)
        for name, diffuse in (("a", 0.1), ("b", 0.2))
    }
    problems = {
        "plain": Problem(lorentz, relative),
        "grouped": Problem(lorentz, scan, grouped={"ks": ("theta_i",)}, held={"gamma": 20.0}),
        "folded": Problem(lorentz, scan, instrument=Instrument(1.0, 1.0), loss="cauchy", weighting="relative"),
        "joined": Problem(ggx, join(surfaces)),
    }
    solutions = {name: fit(problem) for name, problem in problems.items()}
    solutions["annealed"] = fit(problems["plain"], solver=Anneal(max_iterations=200))
    solutions["drawn"] = kept(solutions["grouped"], bootstrap(problems["grouped"], solutions["grouped"], draws=20))
    for name, solution in solutions.items():
        solution.save(folder / f"{name}.nc")
    return [folder / f"{name}.nc" for name in solutions]


def stack_stores(folder: Path) -> list[Path]:
    """Stores of scans as gonio writes them and as people do by xarray's defaults: texts, gaps, masks, two lanes."""
    two = stacks.write_stack(folder / "two.zarr", {"x": 3, "y": 4})
    stacks.write_stack(folder / "samples.zarr", {"sample": 9}, chunk=4)
    masked = two.assign(
        mask=("direction", np.array([0, 0, 1, 0, 0])), uncertainty=two["brdf"].copy(data=0.01 * two["brdf"].values)
    )
    write(masked.drop_vars("label"), folder / "own.zarr")
    empty = two.assign(brdf=two["brdf"].where(two["x"] > 0))
    stacks.put(empty, folder / "gaps.zarr", encoding={"brdf": {"chunks": (1, 4, 5), "compressors": None}})
    return sorted(folder.glob("*.zarr"))
