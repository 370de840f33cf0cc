"""The plugins that gonio wrote, run by Mitsuba 3; knows nothing of gonio.

    python tests/crosscheck/mitsuba_plugin.py FOLDER     writes tests/reference/peers/mitsuba_plugin.json

FOLDER is what mitsuba_files.py wrote. The llvm variants need LLVM 19: DRJIT_LIBLLVM_PATH names its library.
"""

import importlib
import json
import math
import sys
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
from peers import write

mi.set_variant("llvm_ad_rgb")

from mitsuba.chi2 import ChiSquareTest, SphericalDomain  # noqa: E402 (it needs a variant)

VARIANT = mi.variant()
MODELS = 12
SEEN = 1e-6  # of the largest value: what is less light than this
TILTED = (20.0, 45.0, 70.0)
AZIMUTH = 30.0
SAMPLES = 1_000_000
SPP = 4096
ROUNDING = 1e-5  # of a mean in single precision, where every direction has the same weight
SCALAR_PAIRS = 20


def loaded(folder, name, variant=VARIANT, **properties):
    """The BSDF of one file for a variant."""
    mi.set_variant(variant)
    sys.path.insert(0, str(folder))
    module = importlib.import_module(name)
    importlib.reload(module)
    sys.path.pop(0)
    return mi.load_dict({"type": module.NAME} | properties), module.NAME


def interaction(wi):
    si = dr.zeros(mi.SurfaceInteraction3f, len(wi[0]))
    si.wi = mi.Vector3f(*(mi.Float(c) for c in wi))
    return si


def relative(found, expected):
    """The largest difference over the value, or over SEEN of the largest one."""
    found, expected = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
    return float(np.max(np.abs(found - expected) / np.maximum(np.abs(expected), SEEN * np.abs(expected).max())))


def evaluated(bsdf, directions, wavelengths=None):
    """The BRDF for light from the first vectors to the second ones, (channels, n)."""
    w_i, w_r = directions[:3], directions[3:]
    si = interaction(w_r)
    if wavelengths is not None:
        si.wavelengths = mi.Color4f(wavelengths) if hasattr(mi, "Color4f") else type(si.wavelengths)(wavelengths)
    value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(*(mi.Float(c) for c in w_i)))
    return np.array(value) / w_i[2]


def scalar_error(folder, file, directions, expected):
    """The same in a variant without a compiler, one pair after another, both ways that light can be traced."""
    bsdf, _ = loaded(folder, file, "scalar_rgb")
    si, errors = mi.SurfaceInteraction3f(), []
    for pair, f in zip(directions.T[:SCALAR_PAIRS].tolist(), expected, strict=False):
        w_i, w_r = mi.Vector3f(pair[:3]), mi.Vector3f(pair[3:])
        for mode, wi, wo in ((mi.TransportMode.Radiance, w_r, w_i), (mi.TransportMode.Importance, w_i, w_r)):
            si.wi = wi
            errors.append(abs(bsdf.eval(mi.BSDFContext(mode), si, wo)[0] / (f * wo.z) - 1))
    return max(errors)


def chi_square(bsdf, theta):
    """The probability that directions differ so much from their density by chance, and what Mitsuba says of that.

    Mitsuba's own BSDFAdapter leaves out directions in which nothing is reflected in single precision: far from a lobe
    of diffraction there are some, and they are drawn like others.
    """
    t, a = math.radians(theta), math.radians(AZIMUTH)
    wi = [math.sin(t) * math.cos(a), math.sin(t) * math.sin(a), math.cos(t)]

    def drawn(numbers):
        si = interaction([[c] * dr.width(numbers) for c in wi])
        bs, _ = bsdf.sample(mi.BSDFContext(), si, numbers[0], mi.Point2f(numbers[1], numbers[2]))
        return bs.wo, dr.select(bs.pdf > 0, mi.Float(1), mi.Float(0))

    def density(wo):
        return bsdf.pdf(mi.BSDFContext(), interaction([[c] * dr.width(wo) for c in wi]), wo)

    test = ChiSquareTest(
        domain=SphericalDomain(),
        sample_func=drawn,
        pdf_func=density,
        sample_dim=3,
        sample_count=SAMPLES,
        res=101,
        ires=32,
    )
    passed = bool(test.run(test_count=3 * MODELS, quiet=True))
    return float(np.ravel(np.array(test.p_value))[0]), passed


def furnace(bsdf, theta, seed):
    """Mean weight of light that is sent in at an angle, and its standard error."""
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, SAMPLES)
    t = math.radians(theta)
    si = interaction([[math.sin(t)] * SAMPLES, [0.0] * SAMPLES, [math.cos(t)] * SAMPLES])
    _, weight = bsdf.sample(mi.BSDFContext(mi.TransportMode.Importance), si, sampler.next_1d(), sampler.next_2d())
    found = np.array(weight)[0].astype(float)
    return found.mean(), found.std() / math.sqrt(SAMPLES)


def gradients(bsdf, directions):
    """Derivatives of the sum of f cos(theta_r) by every parameter; light is traced from the source."""
    si, found = interaction(directions[:3]), {}
    wo = mi.Vector3f(*(mi.Float(c) for c in directions[3:]))
    parameters = mi.traverse(bsdf)
    for name in (name for name, _ in parameters):
        dr.enable_grad(parameters[name])
        dr.backward(dr.sum(bsdf.eval(mi.BSDFContext(mi.TransportMode.Importance), si, wo).x))
        found[name] = float(np.array(dr.grad(parameters[name]))[0])
        dr.disable_grad(parameters[name])
    return found


def picture(plugin, about):
    """The sphere under parallel light."""
    x, y, z = about["light"]
    view = mi.ScalarTransform4f().look_at(origin=[0, 0, 4], target=[0, 0, 0], up=[0, 1, 0])
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2},
        "sensor": {
            "type": "orthographic",
            "sampler": {"type": "multijitter"},
            "to_world": view @ mi.ScalarTransform4f().scale([about["reach"], about["reach"], 1]),
            "film": {
                "type": "hdrfilm",
                "width": about["pixels"],
                "height": about["pixels"],
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
            },
        },
        "light": {"type": "directional", "direction": [-x, -y, -z], "irradiance": {"type": "rgb", "value": 1.0}},
        "sphere": {"type": "sphere", "bsdf": {"type": plugin}},
    }
    return np.array(mi.render(mi.load_dict(scene), spp=SPP, seed=1))[..., 0]


def checked(folder, name, place, about, data):
    """What is kept of one model."""
    file = about[name]["file"].removesuffix(".py")
    scalar = scalar_error(folder, file, data["directions"], data[f"{name} f"])
    bsdf, plugin = loaded(folder, file)
    chi = [chi_square(bsdf, theta) for theta in TILTED]
    apart = []
    for k, theta in enumerate(about["angles"]):
        (mean, error), (known, known_error) = furnace(bsdf, theta, 3 * place + k), data[f"{name} furnace"][k]
        apart.append((mean - known) / math.hypot(error, known_error, ROUNDING * known))
    found, slopes = gradients(bsdf, data["directions"]), data[f"{name} slopes"]
    sphere, expected = picture(plugin, about), data[f"{name} sphere"]
    return {
        "eval": float(f"{relative(evaluated(bsdf, data['directions'])[0], data[f'{name} f']):.2g}"),
        "eval scalar": float(f"{scalar:.2g}"),
        "chi-square p": [float(f"{p:.3g}") for p, _ in chi],
        "chi-square passed": [passed for _, passed in chi],
        "furnace": [round(z, 2) for z in apart],
        "gradient": {
            n: float(f"{abs(found[n] - s) / max(abs(s), 1e-4 * np.abs(slopes).max()):.2g}")
            for n, s in zip(about[name]["parameters"], slopes, strict=True)
        },
        "sphere sum": float(f"{abs(sphere.sum() / expected.sum() - 1):.1g}"),
        "sphere rms": float(f"{np.sqrt(np.mean((sphere - expected) ** 2)) / expected.max():.1g}"),
    }


def many(folder, data):
    """The largest errors of a surface with channels, and of one with wavelengths."""
    directions = data["directions"][:, :200]
    colours, _ = loaded(folder, "ggx_channel_mitsuba")
    known = np.stack([data[f"channel {c}"][:200] for c in "RGB"])
    found = {"channels": relative(evaluated(colours, directions), known)}
    one, _ = loaded(folder, "ggx_channel_mitsuba", "llvm_ad_mono", channel="G")
    found["a channel in a mono variant"] = relative(evaluated(one, directions)[0], known[1])
    spectral, _ = loaded(folder, "ggx_wavelength_mitsuba", "llvm_ad_spectral")
    ends = {w: data[f"wavelength {w}"][:200] for w in ("450.0", "550.0", "650.0")}
    between = 0.75 * ends["550.0"] + 0.25 * ends["650.0"]
    known = np.stack([ends["450.0"], between, ends["650.0"], ends["450.0"]])
    found["wavelengths"] = relative(evaluated(spectral, directions, [450.0, 575.0, 700.0, 400.0]), known)
    polarised, _ = loaded(folder, "ggx_wavelength_mitsuba", "llvm_ad_mono_polarized", wavelength=550.0)
    matrix = evaluated(polarised, directions)
    found["element 00 in a polarised variant"] = relative(matrix[0, 0, 0], ends["550.0"])
    found["other elements"] = float(np.abs(matrix.reshape(16, -1)[1:]).max())
    return {name: float(f"{error:.2g}") for name, error in found.items()}


def main(folder):
    about = json.loads((folder / "expected.json").read_text(encoding="utf-8"))
    data = dict(np.load(folder / "expected.npz"))
    names = [name for name in about if f"{name} f" in data]
    write(
        "mitsuba_plugin.json",
        {
            "peer": "Mitsuba",
            "version": mi.__version__,
            "drjit": dr.__version__,
            "variant": VARIANT,
            "eval": f"largest difference of f over f, or over {SEEN:g} of its largest value",
            "pairs": len(data["directions"].T),
            "chi-square p": f"wi at {TILTED} deg; passed at 0.01 for all {3 * MODELS} together",
            "furnace": f"difference of the reflectance at {about['angles']} deg over its standard error",
            "gradient": "relative difference from central differences in double precision",
            "sphere": f"an image of {about['pixels']}^2 pixels, {SPP} samples each, against quadrature",
        },
        {name: checked(folder, name, k, about, data) for k, name in enumerate(names)}
        | {"several sets": many(folder, data)},
        {name: about[name]["values"] for name in names},
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
