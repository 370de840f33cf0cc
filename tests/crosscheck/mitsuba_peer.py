"""BRDF values of Mitsuba 3's own materials at 1 000 random geometries, for tests/test_peers.py. Knows nothing of gonio.

    python tests/crosscheck/mitsuba_peer.py     writes tests/reference/peers/mitsuba.json

Every variant of the wheel computes in single precision, so that everything given to Mitsuba is exact in it: parameters
are short binary fractions and directions are integers over 2^24 that make a unit vector to 1e-9. What is stored is what
BSDF.eval returns, f cos(theta_r), with the digits that identify the single precision number.
"""

import mitsuba as mi
import numpy as np
from peers import write

VARIANT = "scalar_rgb"
SEED = 20240707
COUNT = 1000
GRID = 2**24
LEAST_COSINE = 0.1
LOBE = 0.5  # squared slope of the facet up to which a geometry belongs to the lobe of a surface of rms slope 1/2


def directions(random, count, least=LEAST_COSINE):
    """Integers (count, 3) over GRID that make unit vectors to 1e-9, uniform in the cosine of the polar angle."""
    z = random.uniform(least, 1.0, 60 * count)
    azimuth = random.uniform(0.0, 2 * np.pi, z.size)
    across = np.sqrt(1 - z**2)
    found = np.rint(GRID * np.stack([across * np.cos(azimuth), across * np.sin(azimuth), z], axis=-1)).astype(np.int64)
    unit = np.abs((found**2).sum(axis=-1) / GRID**2 - 1) < 1e-9
    return found[unit][:count]


def geometries(random):
    """Two sets of pairs: over the hemisphere, and those of them whose half vector is tilted by little."""
    first, second = directions(random, 8 * COUNT), directions(random, 8 * COUNT)
    both = np.concatenate([first, second], axis=-1)
    x, y, z = (both[:, k] + both[:, k + 3] for k in range(3))
    near = (x**2 + y**2) / z**2 < LOBE
    found = {"hemisphere": both[:COUNT], "lobe": both[COUNT:][near[COUNT:]][:COUNT]}
    assert all(pairs.shape == (COUNT, 6) for pairs in found.values())
    return found


def rough(distribution, alpha, eta, k):
    return {"type": "roughconductor", "distribution": distribution, "alpha": alpha, "eta": grey(eta), "k": grey(k)}


def principled(base, roughness=0.75, **parameters):
    """Index 1 switches the dielectric reflection off, which is not the 2012 model's."""
    return {"type": "principled", "base_color": grey(base), "roughness": roughness, "eta": 1.0} | parameters


def grey(value):
    return {"type": "spectrum", "value": value}


SURFACES = {
    "diffuse": ("hemisphere", {"type": "diffuse", "reflectance": grey(0.5)}),
    "ggx 0.25": ("hemisphere", rough("ggx", 0.25, 1.375, 7.625)),
    "ggx 0.5": ("hemisphere", rough("ggx", 0.5, 0.25, 3.375)),
    "ggx 0.75": ("hemisphere", rough("ggx", 0.75, 1.5, 1.0)),
    "beckmann lobe": ("lobe", rough("beckmann", 0.5, 1.375, 7.625)),
    "beckmann": ("hemisphere", rough("beckmann", 0.5, 1.375, 7.625)),
    "base": ("hemisphere", principled(0.5)),
    "flat": ("hemisphere", principled(0.5, flatness=0.75)),
    "sheen": ("hemisphere", principled(0.5, sheen=0.5)),
    "metal": ("hemisphere", principled(0.5, metallic=1.0, eta=1.5)),
    **{
        f"brushed {anisotropic:g}": ("hemisphere", principled(0.5, metallic=1.0, eta=1.5, anisotropic=anisotropic))
        for anisotropic in (0.25, 0.5, 0.75, 1.0)
    },
    "dielectric": ("hemisphere", principled(0.5, eta=1.5)),
    "clearcoat": ("hemisphere", principled(0.0, clearcoat=1.0, clearcoat_gloss=0.0)),
}


def evaluate(material, pairs):
    """Mitsuba's f cos(theta_r) of every pair, with the digits that identify the single precision number."""
    bsdf, context, interaction = mi.load_dict(material), mi.BSDFContext(), mi.SurfaceInteraction3f()
    found = []
    for pair in (pairs / GRID).tolist():
        interaction.wi = pair[:3]
        red, green, blue = bsdf.eval(context, interaction, mi.Vector3f(pair[3:]))
        assert red == green == blue
        found.append(float(np.format_float_positional(np.float32(red), unique=True)))
    return found


def main():
    mi.set_variant(VARIANT)
    pairs = geometries(np.random.default_rng(SEED))
    write(
        "mitsuba.json",
        {
            "peer": "Mitsuba",
            "version": mi.__version__,
            "variant": VARIANT,
            "precision": "single",
            "seed": SEED,
            "value": "f cos(theta_r) [1/sr], as BSDF.eval returns it",
            "directions": f"x y z of w_i, x y z of w_r, each times {GRID}",
        },
        {f"directions {name}": found.T.tolist() for name, found in pairs.items()}
        | {name: evaluate(material, pairs[where]) for name, (where, material) in SURFACES.items()},
        {name: {"geometries": where} | material for name, (where, material) in SURFACES.items()},
    )


if __name__ == "__main__":
    main()
