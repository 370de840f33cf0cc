"""A bench that is computed: the physics of a goniometer with a fixed source, seeded, on a clock that need not wait.

The detector gets the power

    P(t) = Phi(t) tau (kappa(theta_i, theta_r) Omega cos(theta_r) f + s) + P_background

with f the model's BRDF over the detector's aperture, kappa the part of the beam within its field of view, s stray
light; it shows P with dark, drift, noise and the limits of the range that it was given. The arm stands in the beam near
the source. A simulated clock lets a scan of six hours take a second.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gonio.acquisition.device import BEAM, Bench, InPlane
from gonio.acquisition.simulated.devices import (
    FAULTS,
    Electronics,
    Fault,
    Faults,
    SimulatedAxis,
    SimulatedClock,
    SimulatedDetector,
    SimulatedMonitor,
    SimulatedSelector,
    SimulatedShutter,
)
from gonio.acquisition.simulated.light import (
    STEADY,
    Diffuse,
    Laser,
    Light,
    Mirror,
    Optics,
    Scattering,
    Surface,
    Value,
    kappa,
    speckles,
)
from gonio.model import Model

__all__ = [
    "FAULTS",
    "STEADY",
    "Diffuse",
    "Electronics",
    "Fault",
    "Laser",
    "Mirror",
    "Optics",
    "Scattering",
    "SimulatedBench",
    "SimulatedClock",
    "Surface",
    "kappa",
    "speckles",
]

FILTER = "nd"  # the one filter of the simulated bench


class SimulatedBench(Bench):
    """A bench of simulated devices, with targets sample, standard, trap and none, a filter and a monitor.

    model: a Model with its values (a value that is a mapping changes with theta_i), or a Surface, such as a Mirror.
    parts: `laser` (a Laser), `electronics` (Electronics), `standard` (the Surface that lies there for readings of it),
    and `stated`: entries of `instrument` that differ from the truth of `optics`, such as an `aperture_radius` that is
    known with an error, or `filter_transmittance`.
    faults: what goes wrong. seed: of everything that is drawn. clock: one that does not wait, unless it is given.
    """

    def __init__(
        self,
        model: Model | Surface,
        values: Mapping[str, Value] | None = None,
        optics: Optics | None = None,
        faults: Sequence[Fault] = (),
        seed: int = 0,
        clock: SimulatedClock | None = None,
        **parts: Any,
    ) -> None:
        self.optics, clock = optics or Optics(), clock or SimulatedClock()
        laser, electronics, standard, stated = _parts(**parts)
        surface = Scattering(model, values or {}) if isinstance(model, Model) else model
        surfaces: dict[str, Surface | None] = {"sample": surface, "standard": standard, "trap": Diffuse(0.0)}
        surfaces["none"] = None
        self.light, self.going_wrong = Light(self.optics, surfaces, seed), Faults(list(faults))
        rngs = np.random.default_rng(seed).spawn(2)
        self.source = SimulatedMonitor(laser, self.optics.power, clock, rngs[0])
        known = (float(stated.pop("filter_transmittance", self.optics.filter_transmittance)), 0.0)
        self._filters, self._targets = SimulatedSelector([FILTER], {FILTER: known}), SimulatedSelector(list(surfaces))
        self._targets.select("sample")
        self._table = SimulatedAxis("table", clock, self.going_wrong)
        self._arm = SimulatedAxis("arm", clock, self.going_wrong, true=BEAM)
        super().__init__(
            stage=InPlane(self._table, self._arm),
            detector=SimulatedDetector(electronics, self._power, clock, self.going_wrong, rngs[1]),
            shutter=SimulatedShutter(self.going_wrong),
            monitor=self.source,
            filters=self._filters,
            targets=self._targets,
            instrument=_instrument(self.optics) | dict(stated),
            clock=clock,
        )

    def _power(self) -> float:
        """What reaches the detector at this moment [W]."""
        if not self.shutter.is_open:
            return 0.0
        tau = self.optics.filter_transmittance if self._filters.at else 1.0
        part = self.light.part(self._targets.at, self._table.true, self._arm.true, tau)
        return self.source.source() * part + self.optics.background


def _parts(
    laser: Laser | None = None,
    electronics: Electronics | None = None,
    standard: Surface | None = None,
    stated: Mapping[str, Any] | None = None,
) -> tuple[Laser, Electronics, Surface, dict[str, Any]]:
    """What else may be given to a simulated bench, with what stands for it."""
    return laser or Laser(), electronics or Electronics(), standard or Diffuse(0.99), dict(stated or {})


def _instrument(optics: Optics) -> dict[str, Any]:
    """What a bench states of itself."""
    known: dict[str, Any] = {"instrument": "simulated", "wavelength": optics.wavelength, "fill": "under"}
    if np.isfinite(optics.view_radius):
        known |= {"fill": f"beam:{optics.beam_radius:g},{optics.view_radius:g}", "field_of_view": optics.view_radius}
    return known | {"aperture_radius": optics.aperture_radius, "distance": optics.distance}
