"""
What a fit misses
=================

A figure of residuals tells noise from structure. Here a Gaussian lobe and Lambert's law are fitted to a metal whose lobe
has long tails: the residuals change sign together instead of scattering about zero.
"""

import gonio

scan = gonio.sample("metal")
solution = gonio.fit(scan, "torrance-sparrow", weighting="relative")
solution.plot("residuals")

# %%
# A lobe with a free tail, on aluminium of known index and extinction, leaves only noise.

better = gonio.fit(scan, "student-t", weighting="relative", held={"index": 1.37, "extinction": 7.6})
better.plot("residuals")

# %%
# Four figures of merit of each fit; smaller is better.

for fit in (solution, better):
    print(fit.model.name, {name: round(value, 4) for name, value in fit.metrics.items()})
