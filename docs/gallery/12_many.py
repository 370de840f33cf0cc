"""
A hundred scans at once
=======================

`gonio.fit_many` fits every scan of a stack by one problem, compiled and in batches, and `solution_of` gives one of them
as an ordinary solution.
"""

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

import gonio
from gonio.fitting import solution_of

model, angles = gonio.catalogue["torrance-sparrow"], np.arange(-70.0, 71.0, 5.0)
slopes = np.linspace(0.1, 0.4, 100)
scans = [
    gonio.simulate(model, {"ks": 0.3, "kd": 0.1, "sigma": slope}, [20.0, 50.0], angles, noise=0.02, seed=k)
    for k, slope in enumerate(slopes)
]
stack = xr.concat(scans, "sample", data_vars=["brdf", "uncertainty"], coords="minimal", compat="equals")
fits = gonio.fit_many(gonio.Problem(model, scans[0], weighting="relative"), stack, covariance="")
print(solution_of(fits.isel(sample=42)))

# %%
# The slopes that the scans were simulated with, and those that were found.

figure, ax = plt.subplots(figsize=(4, 3), layout="constrained")
ax.plot(slopes, fits["value"].sel(parameter="sigma"), ".")
ax.axline((0.1, 0.1), slope=1, color="0.6", linewidth=0.8)
ax.set(xlabel="true slope sigma", ylabel="fitted slope sigma")
