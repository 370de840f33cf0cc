"""Evaluation from unit vectors in single precision, against Mitsuba 3's rough conductor and against a copy.

Both compute 1e7 pairs from six arrays of floats in memory into one. Like Mitsuba, gonio has its directions in arrays of
its own library (JAX) and puts the result where an earlier one was. NumPy arrays are in the details, and every ratio is
the median over runs in turn. A copy moves as many bytes, 14 read and 14 written a pair, by NumPy on all cores.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from figures import Figure, Timed, paired
from gonio import catalogue
from gonio.evaluation import evaluate
from gonio.processes.portable import cores

PAIRS = 10_000_000
ROUGHNESS, INDEX, EXTINCTION = 0.3, 1.5, 3.0
VALUES = {
    "ggx": {"rho_s": 1.0, "width": ROUGHNESS, "index": INDEX, "extinction": EXTINCTION},
    "cauchy-lorentz": {"ks": 1.0, "kdd": 0.5, "kid": 0.2, "sigma": 0.2, "gamma": 40.0},
}
LLVM = ("*/libLLVM.so.19*", "*/libLLVM-19.so*", "llvm-19/lib/libLLVM*.so*")  # below /usr/lib
Work = Callable[[], Any]
Vectors = tuple[np.ndarray, np.ndarray, np.ndarray]


def directions(seed: int) -> Vectors:
    """Components of unit vectors above the horizon, uniform in their cosine."""
    random = np.random.default_rng(seed)
    z = 0.01 + 0.99 * random.random(PAIRS, dtype=np.float32)
    azimuth = np.float32(2 * np.pi) * random.random(PAIRS, dtype=np.float32)
    across = np.sqrt(1 - z * z)
    return across * np.cos(azimuth), across * np.sin(azimuth), z


def in_numpy(name: str, wi: Vectors, wo: Vectors) -> Work:
    out = np.zeros(PAIRS, np.float32)
    return lambda: evaluate(catalogue[name], wi, wo, VALUES[name], out=out)


def in_jax(name: str, wi: Vectors, wo: Vectors) -> Work:
    import jax

    there = [tuple(map(jax.numpy.asarray, w)) for w in (wi, wo)]
    kept = [jax.numpy.zeros(PAIRS, "float32")]

    def work() -> None:
        kept[0] = evaluate(catalogue[name], *there, VALUES[name], out=kept[0])
        kept[0].block_until_ready()

    return work


def _llvm() -> list[str]:
    return [str(path) for pattern in LLVM for path in sorted(Path("/usr/lib").glob(pattern))]


def in_mitsuba(wi: Vectors, wo: Vectors) -> Work:
    """One channel of Mitsuba's GGX conductor, compiled by LLVM."""
    found = os.environ.get("DRJIT_LIBLLVM_PATH") or next(iter(_llvm()), "")
    if not found:
        raise FileNotFoundError("Mitsuba's llvm_ad_rgb needs LLVM 19: Debian's libllvm19, or DRJIT_LIBLLVM_PATH")
    os.environ["DRJIT_LIBLLVM_PATH"] = found
    import drjit
    import mitsuba

    mitsuba.set_variant("llvm_ad_rgb")
    material = {"type": "roughconductor", "distribution": "ggx", "alpha": ROUGHNESS, "eta": INDEX, "k": EXTINCTION}
    bsdf, context = mitsuba.load_dict(material), mitsuba.BSDFContext()
    there = [[mitsuba.Float(part) for part in w] for w in (wi, wo)]
    drjit.eval(there)
    drjit.sync_thread()

    def work() -> np.ndarray:
        interaction = drjit.zeros(mitsuba.SurfaceInteraction3f)
        interaction.wi = mitsuba.Vector3f(*there[0])
        value = bsdf.eval(context, interaction, mitsuba.Vector3f(*there[1]))[0]
        drjit.eval(value)
        drjit.sync_thread()
        return value

    return work


def a_copy() -> Work:
    """As many bytes as evaluation reads and writes."""
    source, there, step = np.ones(7 * PAIRS // 2, np.float32), np.zeros(7 * PAIRS // 2, np.float32), cores()
    pool = ThreadPoolExecutor(step)
    parts = list(zip(np.array_split(there, step), np.array_split(source, step), strict=True))
    return lambda: list(pool.map(lambda part: np.copyto(*part), parts))


def agreement(value: np.ndarray, wi: Vectors, wo: Vectors) -> float:
    """Median relative difference from Mitsuba, whose masking is the product of both directions' own."""
    ours = evaluate(catalogue["ggx"], wi, wo, VALUES["ggx"]) * wo[2]
    return float(np.median(np.abs(np.asarray(value) / ours - 1)))


def figure(name: str, peer: Work, wi: Vectors, wo: Vectors, **more: Any) -> Figure:
    """The smaller ratio of the two models; both, and NumPy's, beside it."""
    found: dict[str, Timed] = {}
    for model in VALUES:
        found[f"{model} JAX"] = paired(in_jax(model, wi, wo), peer, settled=True)
        found[f"{model} NumPy"] = paired(in_numpy(model, wi, wo), peer, settled=True)
    details = {
        key: timed.details() | {"pairs_per_second": PAIRS / timed.details()["seconds"]} for key, timed in found.items()
    }
    value = min(timed.ratio for key, timed in found.items() if key.endswith("JAX"))
    return Figure(name, value, details={"pairs": PAIRS, "precision": "float32"} | details | more)


def measure() -> list[Figure]:
    wi, wo = directions(0), directions(1)
    figures = [figure("evaluation_over_copy", a_copy(), wi, wo)]
    try:
        peer = in_mitsuba(wi, wo)
    except (ImportError, FileNotFoundError) as error:
        return [*figures, Figure("evaluation_over_mitsuba", reason=f"not measured: {error}")]
    return [*figures, figure("evaluation_over_mitsuba", peer, wi, wo, agreement=agreement(peer(), wi, wo))]
