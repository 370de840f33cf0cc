"""All names, units and quantities that gonio understands in a table, declared in one place.

A name is compared without case, blanks and marks (`squeezed`), so that `Theta_i`, `theta i` and `θi` are one. Names of
directions are made of a word for the side and a word for the kind of angle, in either order. What is in no list here is
not understood, and no reader guesses it.
"""

import math
import re
import unicodedata
from dataclasses import dataclass

# What a column may be. The first ones are directions, in the order in which a message proposes them.
INCIDENT = ("theta_i", "elevation_i")
REFLECTED = ("theta_r", "elevation_r", "specular_offset", "arm")
AZIMUTHS = ("phi", "phi_i", "phi_r")
ANGLES = (*INCIDENT, *REFLECTED, *AZIMUTHS)
VALUES = ("brdf", "signal")
UNCERTAINTIES = ("uncertainty", "uncertainty_systematic")
TEXTS = ("channel", "scan", "mode", "side", "polarisation")
IGNORE = "ignore"  # a column that is left out because the user says so
TARGETS = (*ANGLES, "wavelength", *UNCERTAINTIES, *VALUES, *TEXTS, "mask", IGNORE)


@dataclass(frozen=True)
class Unit:
    """A unit of a table: its kind, and its size in gonio's unit of that kind (degree, nm, 1/sr)."""

    kind: str
    size: float = 1.0


ANGLE, LENGTH, ABSOLUTE, RELATIVE, SIGNAL, PERCENT, ONE = "angle", "length", "1/sr", "a.u.", "signal", "percent", "1"
UNITS = {
    "deg": Unit(ANGLE),
    "rad": Unit(ANGLE, 180.0 / math.pi),
    "mrad": Unit(ANGLE, 0.18 / math.pi),
    "gon": Unit(ANGLE, 0.9),
    "nm": Unit(LENGTH),
    "um": Unit(LENGTH, 1e3),
    "mm": Unit(LENGTH, 1e6),
    "m": Unit(LENGTH, 1e9),
    "angstrom": Unit(LENGTH, 0.1),
    "sr-1": Unit(ABSOLUTE),
    "a.u.": Unit(RELATIVE),
    "V": Unit(SIGNAL),
    "percent": Unit(PERCENT, 0.01),
    "1": Unit(ONE),
}
# Spellings of units, compared in lower case and without blanks and braces. "Grad" is none: it is a degree in German and
# a gon elsewhere.
UNIT_SPELLINGS = {
    "deg": "deg degs degr degree degrees °",
    "rad": "rad rads radian radians",
    "mrad": "mrad milliradian milliradians",
    "gon": "gon gons gradian gradians",
    "nm": "nm nanometer nanometers nanometre nanometres",
    "um": "um μm micron microns micrometer micrometers micrometre micrometres",
    "mm": "mm millimeter millimeters millimetre millimetres",
    "m": "m meter meters metre metres",
    "angstrom": "å angstrom angstroms ångström ångstrom",
    "sr-1": "sr-1 sr^-1 sr^(-1) sr**-1 sr**(-1) 1/sr /sr persr per_sr steradian-1 steradian^-1 1/steradian"
    " persteradian w/w/sr w/(w*sr) w/(wsr) w/w*sr",
    "a.u.": "a.u. a.u au arb.u. arb.u arb.units arb.unit arbunits arb. arbitrary arbitraryunits arbitraryunit rel."
    " rel.units rel.u. relative r.u.",
    "V": "v mv μv a ma μa na pa w mw μw nw w/sr mw/sr μw/sr counts count cts adu dn",
    "percent": "% percent pct percentage prozent",
    "1": "1 - none unitless dimensionless",
}  # fmt: skip
BRACKETS_ONLY = ("m", "V", "1")  # short or common words, which are units in brackets alone

# The spellings of a tidy CSV's names (docs/conventions.md), which belong to its grammar, in any case and with their
# underscores. The lists below add what other tables use.
SPELLINGS = {
    "theta_i": ("theta_in", "aoi", "incidence_angle", "angle_of_incidence", "source_zenith", "zenith_i", "sza"),
    "theta_r": ("theta_out", "theta_o", "theta_s", "aos", "view_zenith", "detector_zenith", "zenith_r", "vza"),
    "phi": (
        "dphi", "d_phi", "delta_phi", "phi_rel", "rel_phi", "relative_azimuth", "rel_azimuth", "azimuth_difference",
        "delta_azimuth", "raa",
    ),
    "phi_r": (
        "phi_out", "phi_o", "phi_s", "phi_v", "azimuth", "azimuth_r", "azimuth_out", "azimuth_o", "azimuth_s",
        "view_azimuth", "detector_azimuth", "vaa",
    ),
    "phi_i": ("phi_in", "azimuth_i", "azimuth_in", "source_azimuth", "saa"),
    "wavelength": ("lambda", "wl", "wave_length"),
    "brdf": ("bsdf", "btdf", "f_r", "fr"),
    "uncertainty": ("std", "u", "sigma", "stddev", "standard_uncertainty", "unc"),
    "uncertainty_systematic": ("u_systematic", "systematic_uncertainty"),
    "polarisation": ("polarization",),
}  # fmt: skip

# Words for the two sides of a direction, and for its angles.
SIDE_I = (
    "i in inc incidence incident incoming source src light lamp illumination illuminating illum sun solar entrance "
    "irradiation"
)
SIDE_R = (
    "r s o v out outgoing ref refl reflected reflection scatter scattered scattering scat detector det detection "
    "receiver receiving receive viewing view viewer sensor observer observation observing obs measure measurement "
    "measured measuring emission emitted emergence exit camera"
)
POLAR = "theta zenith zen polar angle polarangle zenithangle angleof z"
AZIMUTH = "phi azimuth azim azi az azimuthal azimuthangle azimuthalangle a"
ELEVATION = "elevation elev el altitude alt elevationangle"
SHORT = 3  # letters: a side of fewer stands with no kind of angle of one or two letters (`ai` says nothing)
# Names that are no pair of such words.
ALONE = {
    "theta_i": "incidence incident incoming illumination aoi einfallswinkel einfall einfallwinkel "
    "einstrahlwinkel angledincidence",
    "theta_r": "viewing view scatter detector receiver observation outgoing aos angleofscatter angleofscattering "
    "detektorwinkel streuwinkel ausfallswinkel ausfall ausfallwinkel beobachtungswinkel messwinkel reflexionswinkel",
    "phi": "phi azimuthdifference deltaazimuth relativeazimuthangle relazi relativephi reldphi",
    "phi_r": "azimuth azimuthangle azimut azimutwinkel",
    "specular_offset": "specularoffset anglefromspecular fromspecular offsetfromspecular offspecular offspecularangle "
    "thetafromspecular degreesfromspecular thetaminusthetaspecular thetarminusthetai thetasminusthetai",
    "arm": "arm armangle goniometerarm detectorarm armposition",
    "wavelength": "wavelength wvl lam lambda0 wellenlänge wellenlange wellenlaenge longueurdonde",
    "channel": "channel band colour color kanal",
    "uncertainty": "u unc uncertainty std stdev stddev sd sigma standarddeviation standarduncertainty stdunc stderr "
    "standarderror error err unsicherheit standardunsicherheit absoluteuncertainty combineduncertainty",
    "scan": "scan",
    "mode": "mode",
    "side": "side",
    "polarisation": "polarisation polarization pol",
    "mask": "mask",
}
EXPANDED = "expandeduncertainty uexpanded expanded erweiterteunsicherheit"
RELATIVE_UNCERTAINTY = "relativeuncertainty relativeunc reluncertainty relunc urel relu relativestandarduncertainty"
# What means one of these where nothing better is there: `angle` beside a known incidence angle is the detector's.
WEAK = {
    "theta_r": "angle theta winkel position goniometerangle stageangle",
    "brdf": "value values data result messwert wert",
}


@dataclass(frozen=True)
class Quantity:
    """What values are: how a message calls them, and the spellings of their names."""

    title: str
    spellings: str
    flags: str = ""  # other names that --quantity takes


_BRDF = ("brdf", "bsdf", "btdf", "fr")
_COS = ("cos", "cosine", *(f"{c}theta{s}" for c in ("cos", "cosine") for s in ("", "r", "s", "o", "out", "v", "det")))
QUANTITIES = {
    "brdf": Quantity(
        "BRDF",
        "brdf bsdf btdf fr brdfvalue bsdfvalue brdfvalues bsdfvalues bidirectionalreflectancedistributionfunction "
        "bidirectionalscatteringdistributionfunction bidirectionalscatterdistributionfunction "
        "bidirectionaltransmittancedistributionfunction bidirectionaltransmissiondistributionfunction",
        "bsdf btdf",
    ),
    "ccbsdf": Quantity(
        "BRDF times cos(theta_r)",
        " ".join(
            [
                "ccbrdf ccbsdf ccbtdf cosinecorrected coscorrected",
                *(f"{c}corrected{q}" for q in _BRDF for c in ("cosine", "cos")),
                *(f"{q}{cos}" for q in _BRDF for cos in _COS),
                *(f"{q}{t}{cos}" for q in _BRDF for t in ("x", "times") for cos in _COS),
                *(f"{cos}{q}" for q in _BRDF for cos in _COS),
            ]
        ),
        "ccbrdf ccbtdf",
    ),
    "reflectance-factor": Quantity(
        "reflectance factor, pi times the BRDF",
        "brf reflectancefactor rfactor rf reflfactor reffactor bidirectionalreflectancefactor "
        "reflectionfactor reflexionsgrad reflectancefactorr pibrdf brdfpi pixbrdf brdfxpi",
        "brf radiance-factor",
    ),
    "radiant-intensity": Quantity(
        "radiant intensity, proportional to BRDF times cos(theta_r)",
        "radiantintensity iperincidentw radiantintensityperincidentw radiantintensityperincidentpower iperincidentpower"
        " iperw radiantintensityperw intensityperincidentw intensityperincidentpower iperincidentwatt "
        "radiantintensityperincidentwatt normalisedradiantintensity normalizedradiantintensity",
    ),
    "log10-brdf": Quantity(
        "common logarithm of the BRDF",
        " ".join(f"{log}{q}" for q in _BRDF for log in ("log10", "lg", "log10of", "lgof", "decadiclog")),
    ),
    "dolp": Quantity(
        "degree of linear polarisation",
        "dolp dlp dop degreeoflinearpolarisation degreeoflinearpolarization degreeofpolarisation degreeofpolarization "
        "linearpolarisation linearpolarization polarisationsgrad",
    ),
    "signal": Quantity(
        "detector signal, proportional to BRDF times cos(theta_r)",
        "signal detectorsignal voltage photocurrent counts detectorcounts detectorvoltage detectorreading",
    ),
}
PER_INCIDENT = ("incident", "perw", "normalised", "normalized")  # within a name: it is divided by the power that falls
# Names of values that may be several quantities: only --quantity can tell.
# A radiance factor is pi f to the CIE, and pi f cos(theta_i) to planetary photometry.
UNCLEAR = "reflectance radiancefactor radf refl reflectivity r rho intensity i power radiance " + " ".join(
    f"{log}{q}" for q in _BRDF for log in ("log", "ln", "loge", "logof")
)
COLOURS = (("r", "g", "b"), ("red", "green", "blue"), ("x", "y", "z"))  # of columns that are channels where all stand
GAPS = ("", "nan", "n/a", "na", "#n/a", "-", "--", "—", "–", "null", "none", "nil")  # cells without a value
_GREEK = str.maketrans({"θ": "theta", "ϑ": "theta", "φ": "phi", "ϕ": "phi", "λ": "lambda", "σ": "sigma", "π": "pi",
                        "δ": "delta", "−": "-"})  # fmt: skip


def plain(text: str) -> str:
    """The text in one spelling of each character: no superscripts, no Greek, one kind of minus."""
    return unicodedata.normalize("NFKC", text).replace("Θ", "θ").replace("Δ", "δ").replace("Φ", "φ").translate(_GREEK)


def squeezed(text: str) -> str:
    """The letters and digits of a name, in lower case."""
    return re.sub(r"[^\w]|_", "", plain(text).casefold())


def unit_of(text: str) -> str:
    """The unit of UNITS that a text spells; empty where it spells none."""
    return _UNITS.get(re.sub(r"[\s{}·⋅]", "", plain(text).casefold()), "")


def _pairs(sides: str, kinds: str) -> set[str]:
    pairs = ((s, k) for s in sides.split() for k in kinds.split() if len(s) >= SHORT or len(k) > 2)
    return {name for s, k in pairs for name in (k + s, s + k, s + k + "angle", k + "angle" + s)}


def _names() -> dict[str, str]:
    found = {
        "theta_i": _pairs(SIDE_I, POLAR),
        "theta_r": _pairs(SIDE_R, POLAR),
        "phi_i": _pairs(SIDE_I, AZIMUTH),
        "phi_r": _pairs(SIDE_R, AZIMUTH),
        "elevation_i": _pairs(SIDE_I, ELEVATION),
        "elevation_r": _pairs(SIDE_R, ELEVATION),
    }
    for target in (t for t in TARGETS if t not in (*VALUES, IGNORE)):
        spelt = {*ALONE.get(target, "").split(), squeezed(target), *map(squeezed, SPELLINGS.get(target, ()))}
        found[target] = found.get(target, set()) | spelt
    for q in ("", *_BRDF, *(s for of in QUANTITIES.values() for s in of.spellings.split())):
        found["uncertainty"] |= {f"{u}{q}" for u in ("u", "unc", "uncertainty", "std", "sigma", "uncertaintyof")}
        found["uncertainty"] |= {f"{q}{u}" for u in ("unc", "uncertainty", "std", "error", "err", "stddev") if q}
    return {name: target for target, names in found.items() for name in names}


_UNITS = {spelling: unit for unit, spelt in UNIT_SPELLINGS.items() for spelling in spelt.split()}
NAMES = _names()  # a squeezed name, and what it is
WEAK_NAMES = {name: target for target, names in WEAK.items() for name in names.split()}
QUANTITY_NAMES = {name: quantity for quantity, of in QUANTITIES.items() for name in of.spellings.split()}
UNCLEAR_NAMES = frozenset(UNCLEAR.split())
EXPANDED_NAMES = frozenset(EXPANDED.split())
RELATIVE_NAMES = frozenset(RELATIVE_UNCERTAINTY.split())
FLAGS = {name: quantity for quantity, of in QUANTITIES.items() for name in (quantity, *of.flags.split())}
SUFFIXES = sorted((s for s, unit in _UNITS.items() if unit not in BRACKETS_ONLY), key=len, reverse=True)
