"""Against independent implementations at 1 000 random geometries: Mitsuba 3 and NIST's SCATMECH.

`make crosscheck` runs the peers and rewrites tests/reference/peers; here their values are read and compared with those
of the models themselves. Where a peer's formula is another one, its value is brought into the model's form by
crosscheck/forms.py, which knows the formulas and nothing of gonio; docs/verification.md lists every difference.

Mitsuba computes in single precision, so 1e-6 of the value is some ten of its roundings. That is met wherever its
formula is well conditioned. Where it is not, the tolerance is 1e-6 times the condition that is named beside the case.
Rounding has no preferred sign, but a difference in form has: the mean over the geometries is held to 1e-7.
"""

import functools
import json
from pathlib import Path

import numpy as np
import pytest

from crosscheck import forms
from gonio import Geometry, catalogue

PEERS = Path(__file__).parent / "reference" / "peers"
GRID = 2**24
AGREED = 1e-6
DOUBLE = 1e-11  # SCATMECH computes in double precision and loses digits near retroreflection; values go down to 1e-280
FLUSHED = 1e-20  # Mitsuba's distribution times cos(alpha) is 0 below


@functools.cache
def peer(name):
    return json.loads((PEERS / name).read_text(encoding="utf-8"))


def facets(name, **shape):
    return lambda g: catalogue[name](g, {"rho_s": 1.0, "rho_d": 0.0} | shape)


def disney(**shape):
    values = {"scale": 1.0, "clearcoat": 0.0, "base": 0.5, "metallic": 0.0, "specular": 0.0, "roughness": 0.75} | shape
    return lambda g: catalogue["disney"](g, values)


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


ALPHA = 0.75**2  # of the highlight of the principled material
NO_HIGHLIGHT = forms.schlick_highlight(ALPHA, 1.0, 0.0)
MITSUBA = {
    "diffuse": (lambda g: catalogue["lambert"](g, {"rho": 0.5}) + 0 * g.cos_i, forms.as_it_is, well),
    "ggx 0.25": (facets("ggx", width=0.25, index=1.375, extinction=7.625), forms.correlated_ggx(0.25), well),
    "ggx 0.5": (facets("ggx", width=0.5, index=0.25, extinction=3.375), forms.correlated_ggx(0.5), well),
    "ggx 0.75": (facets("ggx", width=0.75, index=1.5, extinction=1.0), forms.correlated_ggx(0.75), well),
    **{
        name: (facets("beckmann", m=0.5, index=1.375, extinction=7.625), forms.correlated_beckmann(0.5), condition)
        for name, condition in (("beckmann lobe", well), ("beckmann", exponent))
    },
    "base": (disney(), NO_HIGHLIGHT, well),
    "flat": (disney(subsurface=0.75), NO_HIGHLIGHT, well),
    "sheen": (disney(sheen=0.5), NO_HIGHLIGHT, well),
    "metal": (disney(metallic=1.0), forms.as_it_is, well),
    **{
        f"brushed {anisotropic:g}": (
            disney(metallic=1.0, anisotropic=anisotropic),
            forms.as_it_is,
            functools.partial(stretch, anisotropic=anisotropic),
        )
        for anisotropic in (0.25, 0.5, 0.75, 1.0)
    },
    "dielectric": (disney(specular=0.5), forms.schlick_highlight(ALPHA, 1.5, 0.5), well),
    "clearcoat": (disney(scale=0.0, clearcoat=1.0, gloss=0.0), forms.over_four_cosines, cancellation),
}


@pytest.mark.parametrize("name", MITSUBA)
def test_mitsuba(name):
    data = peer("mitsuba.json")
    where = data["surfaces"][name]["geometries"]
    w_i, w_r = np.array(data["columns"][f"directions {where}"]).reshape(2, 3, -1) / GRID
    g = Geometry(*w_i, *w_r)
    evaluate, form, condition = MITSUBA[name]
    value = np.array(data["columns"][name], dtype=np.float32).astype(float) / g.z_r
    found = evaluate(g)
    assert found.shape == value.shape == (1000,)
    kept = value > 0
    assert (forms.beckmann(g.tan_alpha_squared, 0.5) * g.cos_alpha)[~kept].max(initial=0.0) < FLUSHED
    value, found, w_i, w_r = value[kept], found[kept], w_i[:, kept], w_r[:, kept]
    g = Geometry(*w_i, *w_r)
    expected, added = (form(v, forms.Pairs(w_i, w_r)) for v in (value, 0 * value))
    error = (found - expected) / (expected - added)  # of the peer's own part, whose rounding it is
    assert np.abs(error / condition(g)).max() <= AGREED
    assert abs(np.mean(error / condition(g))) <= AGREED / 10


def test_every_surface_is_compared():
    assert peer("mitsuba.json")["surfaces"].keys() == MITSUBA.keys()
    assert peer("scatmech.json")["surfaces"].keys() == SCATMECH.keys()
    assert peer("scatmech_mueller.json")["surfaces"].keys() <= SCATMECH.keys()


ALUMINIUM = {"index": 1.37, "extinction": 7.62}
GLASS = {"index": 1.5, "extinction": 0.0}
WAVELENGTH = 0.6328


def grooved(total_slope):
    return lambda g: catalogue["torrance-sparrow"](g, {"ks": 1.0, "kd": 0.0, "sigma": total_slope / 2**0.5})


def unmasked(total_slope, **index):
    return lambda g: catalogue["priest"](g, {"ks": 1.0, "sigma": total_slope / 2**0.5} | index)


def obscured(g):
    shape = {"s": 0.4, "tau": np.degrees(0.3), "Omega": np.degrees(0.6)} | GLASS
    return catalogue["maxwell-beard"](g, {"B": 1.0, "rho_D": 0.0, "rho_V": 0.0} | shape)


def rayleigh_rice(a, b, c, **index):
    shape = {"A": a / WAVELENGTH**4, "B": b, "C": c, "wavelength": WAVELENGTH} | index
    return lambda g: catalogue["rayleigh-rice"](g, shape)


def grooved_ellipsoids(g):
    """GGX of width 1/4 as the hyper-Cauchy distribution of exponent 2."""
    return catalogue["wellems"](g, {"ks": 1.0, "s": 0.25 / 2**0.5, "q": 2.0, "index": 1.7, "extinction": 0.5})


SCATMECH = {
    "unmasked aluminium": (unmasked(0.4, **ALUMINIUM), forms.as_it_is),
    "unmasked glass": (unmasked(0.3, **GLASS), forms.as_it_is),
    "grooved copper": (grooved(0.4), forms.without_fresnel(0.25, 3.4)),
    "grooved glass": (grooved(0.6), forms.without_fresnel(1.5, 0.0)),
    "obscured glass": (obscured, forms.cauchy_for_gaussian(0.4, 0.4, 1.5)),
    "ellipsoids": (facets("ggx", width=0.4, index=0.25, extinction=3.4), forms.masked_ggx(0.4)),
    "grooved ellipsoids": (grooved_ellipsoids, forms.as_it_is),
    "rough aluminium": (rayleigh_rice(1e-4, 2.0, 2.5, **ALUMINIUM), forms.as_it_is),
    "rough glass": (rayleigh_rice(1e-3, 20.0, 1.5, **GLASS), forms.as_it_is),
}


def scatmech_directions():
    """Unit vectors w_i and w_r (3, n), from the angles in SCATMECH's own frame."""
    theta_i, theta_s, phi_s = np.radians(peer("scatmech.json")["columns"]["angles"])
    w_i = np.array([-np.sin(theta_i), 0 * theta_i, np.cos(theta_i)])
    return w_i, np.array([np.sin(theta_s) * np.cos(phi_s), np.sin(theta_s) * np.sin(phi_s), np.cos(theta_s)])


def scatmech_geometry():
    theta_i, theta_s, phi_s = np.array(peer("scatmech.json")["columns"]["angles"])
    return Geometry.from_degrees(theta_i, theta_s, 180 + phi_s)


@pytest.mark.parametrize("name", SCATMECH)
def test_scatmech(name):
    evaluate, form = SCATMECH[name]
    found = evaluate(scatmech_geometry())
    assert found.shape == (1000,)
    expected = form(np.array(peer("scatmech.json")["columns"][name]), forms.Pairs(*scatmech_directions()))
    np.testing.assert_allclose(found, expected, rtol=DOUBLE, atol=0)


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
    """The amplitudes whose squares church1989 adds, which gonio's value has, give SCATMECH's elements in its frame."""
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
    shift2 = (sin_i**2 + sin_r**2 - 2 * sin_i * sin_r * np.cos(p)) * (2.0 / WAVELENGTH) ** 2  # times B^2
    factor = 16 * np.pi**2 * c_i * c_r * abs(e - 1) ** 2 * 1e-4 / WAVELENGTH**4 * (1 + shift2) ** (-2.5 / 2)
    found = SCATMECH["rough aluminium"][0](scatmech_geometry())
    np.testing.assert_allclose(found, factor * matrix[:, 0, 0], rtol=DOUBLE, atol=0)
