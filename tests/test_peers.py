"""Against independent implementations at 1 000 random geometries: Mitsuba 3 and NIST's SCATMECH.

`make crosscheck` runs the peers and rewrites tests/reference/peers; here their values are read. What differs in form is
composed of gonio's own parts:

- Mitsuba multiplies the masking of both directions and takes Walter's rational fit for Beckmann's. Its principled
  material has an exact dielectric Fresnel factor where burley2012 has Schlick's, and leaves
  1/(4 cos theta_i cos theta_r) out of the clearcoat. All else agrees as it stands.
- SCATMECH's rms slopes are total, its azimuth 0 is forward, and its spectrum has a unit. Its basis psps is gonio's.

Mitsuba computes in single precision, so 1e-6 of the value is some ten of its roundings. That is met wherever its
formula is well conditioned. Where it is not, the tolerance is 1e-6 times the condition that is named beside the case.
Rounding has no preferred sign, but a difference in form has: the mean over the geometries is held to 1e-7.
"""

import functools
import json
from pathlib import Path

import numpy as np
import pytest

from gonio import Geometry, catalogue
from gonio.optics.facets import beckmann_slopes, ggx_slopes, reflected
from gonio.optics.fresnel import unpolarised, with_fresnel
from gonio.optics.masking import ggx_lambda, maxwell_beard, smith_uncorrelated

PEERS = Path(__file__).parent / "reference" / "peers"
GRID = 2**24
AGREED = 1e-6
DOUBLE = 1e-11  # SCATMECH computes in double precision and loses digits near retroreflection; values go down to 1e-280
FLUSHED = 1e-20  # Mitsuba's distribution times cos(alpha) is 0 below


@functools.cache
def peer(name):
    return json.loads((PEERS / name).read_text(encoding="utf-8"))


def ggx(g, alpha, index, extinction):
    masking = smith_uncorrelated(ggx_lambda(g.cos_i, alpha), ggx_lambda(g.cos_r, alpha))
    return unpolarised(g.cos_beta, index, extinction) * reflected(g, ggx_slopes(g, alpha), masking)


def beckmann(g, m, index, extinction):
    masking = rational(g.cos_i, m) * rational(g.cos_r, m)
    return unpolarised(g.cos_beta, index, extinction) * reflected(g, beckmann_slopes(g, m), masking)


def rational(cos, m):
    """Walter's fit of Beckmann's masking (formulas 3.2)."""
    x = cos / (m * np.sqrt(1 - cos**2))
    return np.where(x < 1.6, (3.535 * x + 2.181 * x**2) / (1 + 2.276 * x + 2.577 * x**2), 1.0)


def disney(g, base, metallic=0.0, specular=0.0, **shape):
    shape = {"base": base, "metallic": metallic, "specular": specular, "roughness": 0.75} | shape
    return catalogue["disney"].basis(g, shape)["scale"]


def body(g, **shape):
    """The principled model without its highlight, which alone is left when the base is black and no sheen is there."""
    return disney(g, 0.5, **shape) - disney(g, 0.0)


def brushed(g, anisotropic):
    return disney(g, 0.5, metallic=1.0, anisotropic=anisotropic)


def clearcoat(g):
    return catalogue["disney"].basis(g, {"gloss": 0.0})["clearcoat"] * 4 * g.cos_i * g.cos_r


def well(g):
    return np.ones_like(g.cos_i)


def exponent(g):
    """An error in the exponent x of exp(-x) is x times as large in the value."""
    return 1 + g.tan_alpha_squared / 0.5**2


def cancellation(g):
    """An error in c = (1 - a^2) cos^2 alpha is c/(1 - c) times as large in 1/(1 - c), the distribution; a = 0.1."""
    c = (1 - 0.1**2) * g.cos_alpha**2
    return 1 + c / (1 - c)


def stretch(g, anisotropic):
    """An error in 0.9 a is 0.9 a/(1 - 0.9 a) times as large in 1 - 0.9 a, and half of that in the aspect, its root."""
    return 1 + 0.9 * anisotropic / (1 - 0.9 * anisotropic) / 2 + 0 * g.cos_i


MITSUBA = {
    "diffuse": (lambda g: catalogue["lambert"](g, {"rho": 0.5}) + 0 * g.cos_i, well),
    "ggx 0.25": (lambda g: ggx(g, 0.25, 1.375, 7.625), well),
    "ggx 0.5": (lambda g: ggx(g, 0.5, 0.25, 3.375), well),
    "ggx 0.75": (lambda g: ggx(g, 0.75, 1.5, 1.0), well),
    "beckmann lobe": (lambda g: beckmann(g, 0.5, 1.375, 7.625), well),
    "beckmann": (lambda g: beckmann(g, 0.5, 1.375, 7.625), exponent),
    "base": (body, well),
    "flat": (lambda g: body(g, subsurface=0.75), well),
    "sheen": (lambda g: body(g, sheen=0.5), well),
    "metal": (lambda g: disney(g, 0.5, metallic=1.0), well),
    **{
        f"brushed {anisotropic:g}": (
            functools.partial(brushed, anisotropic=anisotropic),
            functools.partial(stretch, anisotropic=anisotropic),
        )
        for anisotropic in (0.25, 0.5, 0.75, 1.0)
    },
    "dielectric": (lambda g: body(g) + ggx(g, 0.75**2, 1.5, 0.0), well),
    "clearcoat": (clearcoat, cancellation),
}


@pytest.mark.parametrize("name", MITSUBA)
def test_mitsuba(name):
    data = peer("mitsuba.json")
    where = data["surfaces"][name]["geometries"]
    g = Geometry(*(np.array(row) / GRID for row in data["columns"][f"directions {where}"]))
    evaluate, condition = MITSUBA[name]
    expected = np.array(data["columns"][name], dtype=np.float32).astype(float) / g.z_r
    found = evaluate(g)
    assert found.shape == expected.shape == (1000,)
    kept = expected > 0
    assert (beckmann_slopes(g, 0.5) * g.cos_alpha)[~kept].max(initial=0.0) < FLUSHED
    error = (found / np.where(kept, expected, 1.0) - 1)[kept]
    assert np.abs(error / condition(g)[kept]).max() <= AGREED
    assert abs(np.mean(error / condition(g)[kept])) <= AGREED / 10


def test_every_surface_is_compared():
    assert peer("mitsuba.json")["surfaces"].keys() == MITSUBA.keys()
    assert peer("scatmech.json")["surfaces"].keys() == SCATMECH.keys()
    assert peer("scatmech_mueller.json")["surfaces"].keys() <= SCATMECH.keys()


ALUMINIUM = {"index": 1.37, "extinction": 7.62}
GLASS = {"index": 1.5, "extinction": 0.0}
WAVELENGTH = 0.6328


def grooved(g, total_slope, n, k):
    facets = with_fresnel(catalogue["torrance-sparrow"].terms["ks"], n, k)
    return facets(g, sigma=total_slope / 2**0.5)


def unmasked(g, total_slope, **index):
    return catalogue["priest"](g, {"ks": 1.0, "sigma": total_slope / 2**0.5} | index)


def obscured(g):
    masking = maxwell_beard(g, np.degrees(0.3), np.degrees(0.6))
    return unpolarised(g.cos_beta, 1.5, 0.0) * reflected(g, beckmann_slopes(g, 0.4), masking)


def rayleigh_rice(g, a, b, c, **index):
    shape = {"B": b, "C": c, "wavelength": WAVELENGTH} | index
    return catalogue["rayleigh-rice"](g, {"A": a / WAVELENGTH**4} | shape)


def ellipsoids(g):
    """Unmasked GGX of width 0.8/2: half-ellipsoids have that distribution."""
    return unpolarised(g.cos_beta, 0.25, 3.4) * reflected(g, ggx_slopes(g, 0.4), 1.0)


def grooved_ellipsoids(g):
    """GGX of width 1/4 as the hyper-Cauchy distribution of exponent 2."""
    return catalogue["wellems"](g, {"ks": 1.0, "s": 0.25 / 2**0.5, "q": 2.0, "index": 1.7, "extinction": 0.5})


SCATMECH = {
    "unmasked aluminium": lambda g: unmasked(g, 0.4, **ALUMINIUM),
    "unmasked glass": lambda g: unmasked(g, 0.3, **GLASS),
    "grooved copper": lambda g: grooved(g, 0.4, 0.25, 3.4),
    "grooved glass": lambda g: grooved(g, 0.6, 1.5, 0.0),
    "obscured glass": obscured,
    "ellipsoids": ellipsoids,
    "grooved ellipsoids": grooved_ellipsoids,
    "rough aluminium": lambda g: rayleigh_rice(g, 1e-4, 2.0, 2.5, **ALUMINIUM),
    "rough glass": lambda g: rayleigh_rice(g, 1e-3, 20.0, 1.5, **GLASS),
}


def scatmech_geometry():
    theta_i, theta_s, phi_s = np.array(peer("scatmech.json")["columns"]["angles"])
    return Geometry.from_degrees(theta_i, theta_s, 180 + phi_s)


@pytest.mark.parametrize("name", SCATMECH)
def test_scatmech(name):
    found = SCATMECH[name](scatmech_geometry())
    assert found.shape == (1000,)
    np.testing.assert_allclose(found, peer("scatmech.json")["columns"][name], rtol=DOUBLE, atol=0)


def mueller_shares(name):
    """SCATMECH's sixteen elements over element 00, (1000, 4, 4), kept to half of 1e-8."""
    shares = np.array(peer("scatmech_mueller.json")["columns"][name]).T / 1e8
    return np.insert(shares, 0, 1.0, axis=1).reshape(-1, 4, 4)


def test_scatmech_mueller_elements_of_facets():
    """All sixteen, in SCATMECH's basis psps as it stands."""
    values = {"ks": 1.0, "sigma": 0.4 / 2**0.5} | ALUMINIUM
    matrix = catalogue["priest-mueller"].mueller(scatmech_geometry(), values)
    f00 = np.array(peer("scatmech.json")["columns"]["unmasked aluminium"])
    np.testing.assert_allclose(matrix[..., 0, 0], f00, rtol=DOUBLE, atol=0)
    shares = matrix / f00[:, None, None]
    np.testing.assert_allclose(shares, mueller_shares("unmasked aluminium"), rtol=0, atol=0.51e-8)


def test_scatmech_mueller_elements_of_rayleigh_rice():
    """The amplitudes whose squares church1989 adds give SCATMECH's elements by gonio's Stokes parameters."""
    theta_i, theta_s, p = np.radians(peer("scatmech.json")["columns"]["angles"])
    e = (1.37 + 7.62j) ** 2
    (sin_i, c_i), (sin_r, c_r) = ((np.sin(t), np.cos(t)) for t in (theta_i, theta_s))
    q_i, q_r = np.sqrt(e - sin_i**2), np.sqrt(e - sin_r**2)
    s_i, s_r, p_i, p_r = 1 / (c_i + q_i), 1 / (c_r + q_r), 1 / (e * c_i + q_i), 1 / (e * c_r + q_r)
    # rows are the scattered s and p, columns the incident ones (formulas 7.8)
    ss, ps = np.cos(p) * s_i * s_r, -q_i * np.sin(p) * p_i * s_r
    sp, pp = -q_r * np.sin(p) * s_i * p_r, (e * sin_i * sin_r - q_i * q_r * np.cos(p)) * p_i * p_r
    jones = np.moveaxis(np.array([[ss, ps], [sp, pp]]), -1, 0)
    coherence = np.einsum("nab,ncd->nacbd", jones, jones.conj()).reshape(-1, 4, 4)
    stokes = np.array([[1, 0, 0, 1], [1, 0, 0, -1], [0, 1, 1, 0], [0, 1j, -1j, 0]])  # of EsEs*, EsEp*, EpEs*, EpEp*
    matrix = (stokes @ coherence @ np.linalg.inv(stokes)).real
    np.testing.assert_allclose(matrix / matrix[:, :1, :1], mueller_shares("rough aluminium"), rtol=0, atol=0.51e-8)
