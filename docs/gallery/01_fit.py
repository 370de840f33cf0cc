"""
A first fit
===========

`gonio.fit` of a scan and a model finds the values of least error, and says how sure they are. The scan is simulated and
comes with gonio; `gonio.read("scan.csv")` reads yours. Here the index of refraction is held, as that of the binder is
known; without a model, `gonio.fit(scan)` tries the whole catalogue.
"""

import gonio

scan = gonio.sample("coating")
solution = gonio.fit(scan, "ggx", held={"index": 1.5, "extinction": 0.0})
print(solution)

# %%
# Measured points and the fitted curves, on a linear scale above and a logarithmic one below. A thin line marks the
# specular angle.

solution.plot()
