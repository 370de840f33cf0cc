"""
Does it obey physics?
=====================

A passive surface reflects no negative light, no more light than falls on it, and the same with source and detector
exchanged. `gonio.check` looks for mistakes of a scan, `gonio.plausibility` for broken laws of a model.
"""

from functools import partial

import gonio
from gonio import plausibility

scan = gonio.sample("metal")
for finding in gonio.check(scan):
    print(finding)

# %%
# With every weight at 1, Phong's lobe as it was first written is not reciprocal and reflects more than it receives. The
# modified form is reciprocal; weights that add up to 1 or less keep its energy.

for name in ("phong", "modified-phong"):
    model = gonio.catalogue[name]
    brdf = partial(model, values=dict.fromkeys(model.weights, 1.0))
    for verdict in (plausibility.reciprocity(brdf), plausibility.energy(brdf, "sr-1")):
        print(f"{name:14} {verdict.law:12} {'holds' if verdict.holds else 'fails'}; worst: {verdict.where}")
