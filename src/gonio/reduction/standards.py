"""What readings are compared with: the incident beam itself, or a standard of certified reflectance."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import xarray as xr

from gonio.measured.causes import causes
from gonio.measured.dataset import ABSOLUTE, points, unit
from gonio.reduction.steps.detector import Known

NEAR = 0.05  # deg: to which a standard is read at its certified direction
FORM = "VALUE:factor@theta_i,theta_r, as 0.991+-0.002:factor@0,45"
_CERTIFICATE = re.compile(r"([^:@]+):([\w/-]+)@\s*([-+\d.eE]+)\s*,\s*([-+\d.eE]+)\s*")


ONE = Known(1.0)


# What a file of readings may state of the set-up, by the attribute of its Dataset.
STATED = {"radius": "aperture_radius", "distance": "distance", "tau": "filter_transmittance"}


@dataclass(frozen=True)
class Absolute:
    """Readings against the incident beam: f = V' / (V'_i/tau) / (Omega cos theta_r) for a spot that is seen whole.

    radius, distance: of the detector's aperture, in one unit. tau: the transmittance of the filter behind which the
    incident beam was read. incident: its reading without dark, where the readings hold none. share: the part of the
    beam's power that lies on the area seen, for a beam that is wider than the field of view.
    """

    radius: Known
    distance: Known
    tau: Known = ONE
    incident: Known | None = None
    share: Known | None = None

    def __post_init__(self) -> None:
        for name in ("radius", "distance", "tau", "incident", "share"):
            if (known := getattr(self, name)) is not None and not known.value > 0:
                raise ValueError(f"--absolute {name} is {known.value:g}: give a number above zero")

    @classmethod
    def parsed(cls, text: str, stated: Mapping[str, Any] = MappingProxyType({})) -> "Absolute":
        """`radius=4.75+-0.005,distance=500+-0.5,tau=1e-3+-1e-5`; ValueError for anything else.

        stated: what the file of the readings says of itself (STATED): it stands for what is not named, and the word
        `stated` alone names nothing.
        """
        names = ("radius", "distance", "tau", "incident", "share")
        found: dict[str, Any] = {}
        for part in (p for p in text.split(",") if p.strip() and p.strip() != "stated"):
            name, _, value = (piece.strip() for piece in part.partition("="))
            if name not in names or name in found:
                raise ValueError(
                    f"--absolute {part.strip()!r}: give each of {', '.join(names)} once at most, NAME=VALUE"
                )
            found[name] = Known.parsed(value, f"--absolute {name}")
        for name, attribute in STATED.items():
            if name not in found and attribute in stated:
                spread = float(stated.get(f"{attribute}_uncertainty", 0.0))
                found[name] = Known(float(stated[attribute]), spread)
        if lacking := [name for name in ("radius", "distance") if name not in found]:
            raise ValueError(
                f"--absolute says no {lacking[0]}: the solid angle follows from the aperture's radius and distance"
            )
        return cls(**found)


@dataclass(frozen=True)
class Relative:
    """Readings against a standard, of which f is known at one direction, or at each direction of `scan`.

    brdf: f of the standard [1/sr] at theta_i and the signed theta_r [deg], with its standard uncertainty.
    scan: its BRDF in place of that. signal: its reading without dark, where the readings hold none.
    """

    brdf: Known | None = None
    theta_i: float = 0.0
    theta_r: float = 0.0
    scan: xr.Dataset | None = None
    signal: Known | None = None

    def __post_init__(self) -> None:
        if (self.brdf is None) is (self.scan is None):
            raise ValueError("a standard has either one certified value or a scan of them")
        if self.scan is not None and unit(self.scan) != ABSOLUTE:
            raise ValueError("the scan of the standard is in a.u.: a certificate states 1/sr, or a reflectance factor")
        if self.brdf is not None and not self.brdf.value > 0:
            raise ValueError(f"the standard's value is {self.brdf.value:g}: give a number above zero")
        if not (0 <= self.theta_i < 90 and -90 < self.theta_r < 90):
            raise ValueError(
                f"the standard's direction is {self.theta_i:g}, {self.theta_r:g} deg: give angles below 90"
            )
        if self.signal is not None and not self.signal.value > 0:
            raise ValueError(f"the standard's signal is {self.signal.value:g}: give a number above zero")

    @classmethod
    def parsed(cls, text: str, signal: Known | None = None) -> "Relative":
        """`1.02086:factor@0,45`, or `0.325:brdf@0,45`, each with `VALUE+-U` where the certificate states U (k = 1).

        Raises ValueError for a hemispherical certificate, which says nothing about one direction, and for what is none.
        """
        found = _CERTIFICATE.fullmatch(text.strip())
        kind = found[2].lower() if found else (text.partition(":")[2].partition("@")[0] or "")
        if kind in ("8/d", "8/h", "d/8", "0/d", "hemispherical", "reflectance", "albedo"):
            raise ValueError(
                f"--standard {text!r} is a hemispherical reflectance, which says nothing about one direction: give the "
                f"reflectance factor of one, {FORM}"
            )
        if found is None or kind not in ("factor", "brdf"):
            raise ValueError(f"--standard {text!r} is no certificate and no file: write {FORM}, or name a scan")
        value = Known.parsed(found[1].strip(), "--standard")
        size = math.pi if kind == "factor" else 1.0
        brdf = Known(value.value / size, value.uncertainty / size)
        return cls(brdf, float(found[3]), float(found[4]), signal=signal)

    def at(self, theta_i: float, theta_r: float, phi: float, sets: dict[str, Any]) -> Known | None:
        """The certified f [1/sr] at a direction, theta_r unsigned and with phi; None where there is none.

        sets: wavelength and polarisation of the reading, which a scan of several has to have.
        """
        if self.brdf is not None:
            signed = theta_r if math.cos(math.radians(phi)) < 0 else -theta_r
            near = abs(theta_i - self.theta_i) < NEAR and abs(signed - self.theta_r) < NEAR
            # At normal incidence both sides are one direction of an isotropic standard.
            either = self.theta_i < NEAR and theta_i < NEAR and abs(theta_r - abs(self.theta_r)) < NEAR
            return self.brdf if near or either else None
        assert self.scan is not None
        flat = points(self.scan)
        found = np.ones(flat.sizes["direction"], dtype=bool)
        for name, value in (("theta_i", theta_i), ("theta_r", theta_r)):
            found &= np.abs(flat[name].values - value) < NEAR
        around = np.abs((flat["phi"].values - phi + 180.0) % 360.0 - 180.0) < NEAR
        found &= around | (np.minimum(flat["theta_i"].values, flat["theta_r"].values) < NEAR)
        for name, value in sets.items():
            if name in flat.coords and found.any():
                values = flat[name].values
                found &= np.isclose(values, value) if values.dtype.kind in "fiu" else values.astype(str) == str(value)
        rows = np.flatnonzero(found)
        if not len(rows):
            return None
        own = flat.isel(direction=rows)
        parts = [np.nan_to_num(own["uncertainty"].values)] if "uncertainty" in own else []
        shifts = [*parts, *causes(own).values()]
        u = np.sqrt(np.sum(np.square([np.mean(s) for s in shifts]))) if shifts else 0.0
        return Known(float(own["brdf"].values.mean()), float(u))
