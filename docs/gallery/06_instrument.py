"""
A detector that is wider than the lobe
======================================

A detector of finite size averages the BRDF over its cone, so that a narrow lobe looks wider and lower than it is. With
the half-angles of source and detector, gonio averages the model in the same way, and finds the width of the surface.
"""

import numpy as np

import gonio
from gonio.measured.instrument import Instrument

ggx = gonio.catalogue["ggx"]
true = {"rho_s": 0.5, "rho_d": 0.05, "width": 0.02, "index": 1.5, "extinction": 0.0}
detector = Instrument(detector_half_angle=1.5)
scan = gonio.simulate(ggx, true, [20.0, 50.0], np.arange(0.0, 70.5, 0.5), noise=0.01, instrument=detector)

held = {"index": 1.5, "extinction": 0.0}
ignored = gonio.fit(scan, "ggx", held=held, weighting="relative")
folded = gonio.fit(scan, "ggx", held=held, weighting="relative", instrument=detector)
for name, fit in {"ignored": ignored, "folded in": folded}.items():
    print(f"detector {name:9}: width {fit.values['width']:.4f}; true {true['width']}")

# %%
# The curves of both fits, near the specular angle.

gonio.plot(scan, {"detector ignored": ignored, "detector folded in": folded})
