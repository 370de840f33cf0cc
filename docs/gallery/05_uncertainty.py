"""
How sure a fit is
=================

The table of a fit has a standard uncertainty for each value. A profile asks the question again without assuming that
the model is linear: how much worse does the fit become where one value is held elsewhere? The grey line marks the
95 % interval.
"""

import matplotlib.pyplot as plt

import gonio
from gonio.fitting.certainty.band import band
from gonio.fitting.certainty.profile import profile

scan = gonio.sample("coating")
problem = gonio.Problem(gonio.catalogue["ggx"], scan, held={"extinction": 0.0}, weighting="uncertainty")
solution = gonio.fit(problem)
index = profile(problem, solution, "index")
print(f"index {index.value:.4f}, 95 % from {index.lower:.4f} to {index.upper:.4f}")

figure, ax = plt.subplots(figsize=(5, 3), layout="constrained")
ax.plot(index.at, index.rise**2)
ax.axhline(index.factor**2, color="0.6", linewidth=0.8)
ax.set(xlabel="index", ylabel="rise of the error")

# %%
# The uncertainty of the curve itself, at one incidence angle.

curve = scan.isel(direction=scan["theta_i"].values == 40)
fitted = band(solution, curve)
relative = fitted["uncertainty"] / fitted["brdf"]
print(f"the fitted BRDF is known to {100 * relative.min().item():.2f} to {100 * relative.max().item():.2f} %")
