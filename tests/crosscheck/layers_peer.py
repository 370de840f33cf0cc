"""Coated bodies of Mitsuba 3 and SCATMECH and films of tmm, for tests/test_layers_peer.py. Knows nothing of gonio.

    python tests/crosscheck/layers_peer.py mitsuba|scatmech|tmm     writes tests/reference/peers/layers_NAME.json

Each peer may be installed in an environment of its own. Mitsuba's smooth plastic is its body alone where its specular
reflectance is 0; nonlinear, it has Saunderson's denominator. Its Fresnel reflectance of uniform light is a polynomial,
and it computes in single precision. SCATMECH integrates the boundary's reflectance from within in steps of 0.2 deg.
"""

import importlib
import itertools
import math
import sys
from importlib.metadata import version

import numpy as np
from peers import write

SEED = 20240709
COUNT = 200
GRAZING = 85.0
INDICES, RHOS = (1.3, 1.5, 1.8), (0.1, 0.5, 0.96)
WAVELENGTH = 0.6328  # um
SUBSTRATES = {"aluminium": (1.37, 7.62), "copper": (0.25, 3.4), "glass": (1.5, 0.0)}
STACKS = {  # index, extinction and thickness [um] of the films, the outermost first
    "thin": [(1.457, 0.0, 0.1)],
    "thick film": [(1.457, 0.0, 0.3)],
    "dense": [(1.77, 0.0, 0.05)],
    "absorbing": [(2.1, 0.3, 0.08)],
    "two": [(1.38, 0.0, 0.115), (2.3, 0.0, 0.069)],
    "five": [(1.45, 0.0, 0.11), (2.3, 0.0, 0.07), (1.45, 0.0, 0.11), (2.3, 0.01, 0.07), (1.45, 0.0, 0.2)],
}
THETA = [0.0, 10.0, 25.0, 40.0, 55.0, 70.0, 80.0, 88.0]


def pairs():
    """theta_i and theta_r [deg] of random pairs, to the digits that are kept; no azimuth matters to a body."""
    cosines = np.random.default_rng(SEED).uniform(math.cos(math.radians(GRAZING)), 1.0, (2, COUNT))
    return np.degrees(np.arccos(cosines)).round(4)


def name_of(n, rho):
    return f"n {n:g} rho {rho:g}"


def mitsuba():
    """BRDF of `plastic` without its mirror."""
    mi = importlib.import_module("mitsuba")
    mi.set_variant("scalar_rgb")
    angles = pairs()
    columns = {"angles": angles.tolist()}
    surfaces = {}
    for n, rho in itertools.product(INDICES, RHOS):
        material = {
            "type": "plastic",
            "int_ior": n,
            "ext_ior": 1.0,
            "diffuse_reflectance": {"type": "spectrum", "value": rho},
            "specular_reflectance": {"type": "spectrum", "value": 0.0},
            "nonlinear": True,
        }
        bsdf, context, interaction = mi.load_dict(material), mi.BSDFContext(), mi.SurfaceInteraction3f()
        found = []
        for theta_i, theta_r in np.radians(angles).T.tolist():
            interaction.wi = [math.sin(theta_i), 0.0, math.cos(theta_i)]
            out = mi.Vector3f([0.0, math.sin(theta_r), math.cos(theta_r)])
            found.append(float(f"{bsdf.eval(context, interaction, out)[0] / math.cos(theta_r):.9g}"))
        columns[name_of(n, rho)] = found
        surfaces[name_of(n, rho)] = material
    about = {"peer": "Mitsuba", "version": mi.__version__, "variant": "scalar_rgb", "precision": "single"}
    return about, columns, surfaces


def scatmech():
    """Element 00 of the diffuse subsurface model without a film."""
    model_of = importlib.import_module("pySCATMECH.brdf").BRDF_Model
    angles = pairs()
    columns = {"angles": angles.tolist()}
    surfaces = {}
    for n, rho in itertools.product(INDICES, RHOS):
        parameters = {"lambda": f"{WAVELENGTH}", "substrate": f"({n},0)", "reflectance": f"{rho}"}
        table = {None: "Table_Reflectance", "table": parameters["reflectance"]}
        model = model_of("Diffuse_Subsurface_BRDF_Model", parameters | {"reflectance": table})
        places = [(*pair, math.pi / 2) for pair in np.radians(angles).T.tolist()]
        columns[name_of(n, rho)] = [float(model.MuellerBRDF(*place, coords="psps")[0][0]) for place in places]
        surfaces[name_of(n, rho)] = {"model": "Diffuse_Subsurface_BRDF_Model"} | parameters
    return {"peer": "pySCATMECH", "version": version("pySCATMECH"), "precision": "double"}, columns, surfaces


def tmm():
    """Reflectances of s and of p, coherent films and a thick coat."""
    tmm_core = importlib.import_module("tmm")
    columns, surfaces = {"theta": THETA}, {}
    for (name, films), (below, (n, k)) in itertools.product(STACKS.items(), SUBSTRATES.items()):
        indices = [1.0, *(complex(*film[:2]) for film in films), complex(n, k)]
        thicknesses = [math.inf, *(film[2] for film in films), math.inf]
        for p in "sp":
            columns[f"{name} on {below} {p}"] = [
                float(tmm_core.coh_tmm(p, indices, thicknesses, math.radians(theta), WAVELENGTH)["R"])
                for theta in THETA
            ]
        surfaces[f"{name} on {below}"] = {"films": films, "index": n, "extinction": k}
    for below, (n, k) in SUBSTRATES.items():
        for p in "sp":
            columns[f"coat on {below} {p}"] = [
                float(
                    tmm_core.inc_tmm(
                        p, [1.0, 1.5, complex(n, k)], [math.inf, 1000.0, math.inf], ["i", "i", "i"],
                        math.radians(theta), WAVELENGTH,
                    )["R"]
                )
                for theta in THETA
            ]  # fmt: skip
        surfaces[f"coat on {below}"] = {"coat": 1.5, "index": n, "extinction": k}
    about = {"peer": "tmm", "version": version("tmm"), "precision": "double", "wavelength": f"{WAVELENGTH} um"}
    return about, columns, surfaces


def main():
    name = sys.argv[1]
    about, columns, surfaces = {"mitsuba": mitsuba, "scatmech": scatmech, "tmm": tmm}[name]()
    if name != "tmm":
        about |= {"seed": SEED, "value": "BRDF [1/sr]", "angles": "theta_i, theta_r [deg]"}
    else:
        about |= {"value": "reflectances of s and p", "theta": "[deg]"}
    write(f"layers_{name}.json", about, columns, surfaces)


if __name__ == "__main__":
    main()
