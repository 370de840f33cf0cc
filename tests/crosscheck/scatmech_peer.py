"""BRDF values of NIST's SCATMECH at 1 000 random geometries, for tests/test_peers.py. Knows nothing of gonio.

    python tests/crosscheck/scatmech_peer.py     writes tests/reference/peers/scatmech.json and scatmech_mueller.json

Traps: the slope s of its Gaussian is the total rms slope, sqrt(2) times that of one axis. phi_s = 0 is the forward
half-plane: light comes from -x, w_i = (-sin ti, 0, cos ti) and w_r = (sin ts cos ps, sin ts sin ps, cos ts), so that
phi_r - phi_i = 180 deg + phi_s. Maxwell and Beard's angles are in radians. A spectrum is two-dimensional, A [um^4] over
the spatial frequency [1/um].

Mueller matrices are in its basis psps: s = k x z/|k x z| and p = k x s on both rays, k the direction of travel, with
S1 > 0 along s, S2 > 0 along s + p and S3 = 2 Im(Es* Ep), fields going as exp(-i w t). These are gonio's own.
"""

import math
from importlib.metadata import version

import numpy as np
from peers import write
from pySCATMECH.brdf import BRDF_Model

SEED = 20240708
COUNT = 1000
GRAZING = 85.0
SCALE = 10**8  # Mueller elements are kept as integers: multiples of 1e-8 of element 00
ALUMINIUM, COPPER, GLASS, ABSORBER = "(1.37,7.62)", "(0.25,3.4)", "(1.5,0)", "(1.7,0.5)"
WAVELENGTH = "0.6328"


def geometries(random):
    """Angles (theta_i, theta_s, phi_s) [deg] uniform over the hemisphere, rounded to the digits that are kept."""
    cosines = random.uniform(math.cos(math.radians(GRAZING)), 1.0, (2, COUNT))
    return [*np.degrees(np.arccos(cosines)).round(4).tolist(), random.uniform(-180.0, 180.0, COUNT).round(4).tolist()]


def facets(substrate, slopes, shadow):
    return ("Shadowed_Facet_BRDF_Model", {"substrate": substrate, "sdf": slopes, "shadow": shadow})


def shadow(name, **parameters):
    return {"": f"{name}_Shadow_Function"} | parameters


def gaussian(s):
    return {"": "Gaussian_Slope_Distribution_Function", "s": repr(s)}


def ellipsoids(radius, height):
    """Half-ellipsoids that fill the plane: slopes of the distribution that is called GGX, of width height/radius."""
    density = 1 / (math.pi * radius**2)
    axes = {"rx": repr(radius), "ry": repr(radius), "rz": repr(height), "density": repr(density)}
    return {"": "Ellipsoid_Slope_Distribution_Function"} | axes


def rayleigh_rice(substrate, a, b, c):
    spectrum = {"": "ABC_PSD_Function", "A": a, "B": b, "C": c}
    return ("Microroughness_BRDF_Model", {"substrate": substrate, "psd": spectrum})


UNIT, GROOVES = shadow("Unit"), shadow("Torrance_Sparrow")
MAXWELL_BEARD = shadow("Maxwell_Beard", tau="0.3", Omega="0.6")
SURFACES = {
    "unmasked aluminium": facets(ALUMINIUM, gaussian(0.4), UNIT),
    "unmasked glass": facets(GLASS, gaussian(0.3), UNIT),
    "grooved copper": facets(COPPER, gaussian(0.4), GROOVES),
    "grooved glass": facets(GLASS, gaussian(0.6), GROOVES),
    "obscured glass": facets(GLASS, gaussian(0.4), MAXWELL_BEARD),
    "ellipsoids": facets(COPPER, ellipsoids(2.0, 0.8), UNIT),
    "grooved ellipsoids": facets(ABSORBER, ellipsoids(4.0, 1.0), GROOVES),
    "rough aluminium": rayleigh_rice(ALUMINIUM, "1e-4", "2", "2.5"),
    "rough glass": rayleigh_rice(GLASS, "1e-3", "20", "1.5"),
}
POLARISED = ["unmasked aluminium", "rough aluminium"]


def model_of(name, parameters):
    """The model, its nested parameters under the key None that SCATMECH wants."""
    own = {k: {n or None: w for n, w in v.items()} if isinstance(v, dict) else v for k, v in parameters.items()}
    return BRDF_Model(name, {"lambda": WAVELENGTH} | own)


def matrices(surface, angles):
    """Mueller matrices (COUNT, 4, 4) [1/sr] in the basis psps."""
    model = model_of(*surface)
    places = np.radians(angles).T.tolist()
    return np.array([model.MuellerBRDF(*place, coords="psps") for place in places])


def kept(matrix):
    """Rows of the sixteen elements over element 00, without element 00 itself, in units of 1/SCALE."""
    shares = matrix.reshape(-1, 16) / matrix[:, 0, :1]
    return np.rint(SCALE * shares[:, 1:]).astype(int).T.tolist()


def main():
    angles = geometries(np.random.default_rng(SEED))
    found = {name: matrices(surface, angles) for name, surface in SURFACES.items()}
    about = {
        "peer": "pySCATMECH",
        "version": version("pySCATMECH"),
        "precision": "double",
        "wavelength": f"{WAVELENGTH} um",
        "seed": SEED,
    }
    surfaces = {name: {"model": model} | parameters for name, (model, parameters) in SURFACES.items()}
    write(
        "scatmech.json",
        about | {"value": "element 00 [1/sr]", "angles": "theta_i, theta_s, phi_s [deg]; phi_s = 0 is forward"},
        {"angles": angles} | {name: matrix[:, 0, 0].tolist() for name, matrix in found.items()},
        surfaces,
    )
    write(
        "scatmech_mueller.json",
        about | {"value": f"elements 01, 02, .. 33 over element 00, times {SCALE}", "angles": "those of scatmech.json",
                 "basis": "psps: s = k x z/|k x z|, p = k x s on both rays, S3 = 2 Im(Es* Ep)"},
        {name: kept(found[name]) for name in POLARISED},
        {name: surfaces[name] for name in POLARISED},
    )  # fmt: skip


if __name__ == "__main__":
    main()
