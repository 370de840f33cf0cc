"""The figures of a GPU: fits of a million scans, and evaluation against a copy in its own memory. `make bench-gpu`.

The scans are those of fits_speed.py. A time is the median of several runs after one that compiles. A copy moves as many
bytes as evaluation reads and writes, 28 a pair in single precision, within the memory of the GPU.
"""

import cProfile
import json
import pstats
import statistics
import sys
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import evaluation_speed
import fits_speed
from figures import machine
from gonio import Problem, catalogue
from gonio.evaluation import evaluate
from gonio.fitting import fit_many

RECORD = Path(__file__).with_name("gpu.json")
SCANS, PAIRS = 1_000_000, 100_000_000
BYTES_OF_A_PAIR = 28  # six components read and one value written, in single precision


def seconds(work: Callable[[], Any], runs: int) -> dict[str, float]:
    """The first run, which compiles, and the median of the others."""
    taken = []
    for _ in range(runs + 1):
        started = time.perf_counter()
        work()
        taken.append(time.perf_counter() - started)
    return {"first_seconds": taken[0], "seconds": statistics.median(taken[1:]), "least_seconds": min(taken[1:])}


def on_gpu(pairs: int, seed: int) -> tuple[Any, Any, Any]:
    """Components of unit vectors above the horizon, uniform in their cosine, made on the GPU."""
    of_z, of_azimuth = jax.random.split(jax.random.key(seed))
    z = jax.random.uniform(of_z, (pairs,), jnp.float32, 0.01, 1.0)
    azimuth = jax.random.uniform(of_azimuth, (pairs,), jnp.float32, 0.0, 2 * np.pi)
    across = jnp.sqrt(1 - z * z)
    return across * jnp.cos(azimuth), across * jnp.sin(azimuth), z


def evaluation() -> dict[str, Any]:
    """Pairs a second and bytes a second of two models, and of a copy."""
    wi, wo = on_gpu(PAIRS, 0), on_gpu(PAIRS, 1)
    source = jnp.ones(BYTES_OF_A_PAIR // 8 * PAIRS, jnp.float32)
    copy = jax.jit(lambda x: x + 1.0)
    copied = seconds(lambda: copy(source).block_until_ready(), 20)
    rate = 2 * source.nbytes / copied["seconds"]
    found: dict[str, Any] = {"pairs": PAIRS, "copy_bytes_a_second": rate}
    for name, values in evaluation_speed.VALUES.items():
        model = catalogue[name]
        timed = seconds(lambda m=model, v=values: evaluate(m, wi, wo, v).block_until_ready(), 20)  # type: ignore[misc]
        moved = BYTES_OF_A_PAIR * PAIRS / timed["seconds"]
        found[name] = timed | {
            "pairs_a_second": PAIRS / timed["seconds"],
            "bytes_a_second": moved,
            "part_of_a_copy": moved / rate,
        }
        print(name, found[name], flush=True)
    return found


def fits() -> dict[str, Any]:
    """Seconds for a million fits, by precision, with and without uncertainties; how their E compares with a CPU's."""
    scans = fits_speed.stack(SCANS, dtype="float32")
    print("made", scans["brdf"].nbytes / 1e9, "GB", flush=True)
    problem = Problem(fits_speed.MODEL, scans.isel(sample=0), grouped=fits_speed.GROUPED)
    few = scans.isel(sample=slice(0, 2000))
    reference = fit_many(problem, few, covariance="", device="cpu")["cost"].values
    found: dict[str, Any] = {"scans": SCANS, "points": len(fits_speed.SIGNED)}
    for precision in ("float32", "float64"):
        for covariance in ("", "robust"):
            kept: list[Any] = []

            def work(precision: str = precision, covariance: str = covariance, kept: list[Any] = kept) -> None:
                kept[:] = [fit_many(problem, scans, covariance=covariance, precision=precision, device="gpu")]

            timed = seconds(work, 2)
            excess = kept[0]["cost"].values[: len(reference)] / reference - 1
            found[f"{precision} {covariance or 'values alone'}"] = timed | {
                "fits_a_second": SCANS / timed["seconds"],
                "converged": int(kept[0]["converged"].sum()),
                "ended_higher_than_on_a_cpu": int(np.sum(excess > 1e-4)),
                "median_excess_of_E": float(np.median(np.abs(excess))),
            }
            print(precision, covariance, timed, flush=True)
    return found


def profile() -> None:
    """Where the time of the host goes, for whoever makes it faster."""
    scans = fits_speed.stack(200_000, dtype="float32")
    problem = Problem(fits_speed.MODEL, scans.isel(sample=0), grouped=fits_speed.GROUPED)
    fit_many(problem, scans, covariance="", precision="float32", device="gpu")
    with cProfile.Profile() as measured:
        fit_many(problem, scans, covariance="", precision="float32", device="gpu")
    pstats.Stats(measured).sort_stats("tottime").print_stats(25)


def main() -> None:
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else RECORD
    device = jax.devices("gpu")[0]
    record = {"device": device.device_kind, "machine": machine(), "date": date.today().isoformat()}
    record["evaluation"] = evaluation()
    target.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    record["fits"] = fits()
    target.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    if "--profile" in sys.argv[2:]:
        profile()


if __name__ == "__main__":
    main()
