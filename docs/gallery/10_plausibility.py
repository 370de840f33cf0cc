"""
Does it obey physics?
=====================

A passive surface reflects no negative light, no more light than falls on it, and the same with source and detector
exchanged. `gonio.check` looks for mistakes of a scan, `gonio.plausibility` for laws that a model breaks.
"""

from functools import partial

import matplotlib.pyplot as plt
import numpy as np

import gonio
from gonio.plausibility import hemispherical_reflectance, reciprocity

for finding in gonio.check(gonio.sample("metal")):
    print(finding)

# %%
# Phong's lobe as it was first written is not reciprocal; a later form is, with a reflectance that falls towards grazing.

figure, ax = plt.subplots(figsize=(5, 3), layout="constrained")
theta_i = np.arange(0.0, 90.0, 5.0)
for name in ("phong", "modified-phong"):
    model = gonio.catalogue[name]
    brdf = partial(model, values=dict(zip(model.weights, (0.6, 0.1), strict=True)))
    verdict = reciprocity(brdf)
    print(f"{name:14} reciprocity {'holds' if verdict.holds else 'fails, most at ' + verdict.where}")
    ax.plot(theta_i, [hemispherical_reflectance(brdf, angle) for angle in theta_i], label=name)
ax.axhline(1.0, color="0.6", linewidth=0.8)
ax.set(xlabel="θᵢ [deg]", ylabel="reflectance", ylim=(0, 1.1))
ax.legend()
