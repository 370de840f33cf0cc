"""
Fit
===
"""

import numpy as np

import gonio

scan = gonio.simulate(
    gonio.catalogue["ggx"],
    {"rho_s": 0.3, "rho_d": 0.1, "width": 0.2},
    [20.0, 50.0],
    np.arange(-70.0, 71.0, 5.0),
    noise=0.01,
)
solution = gonio.fit(scan, "ggx", held={"index": 1.5, "extinction": 0.0})
print(solution)

# %%
# And more
figure = solution.plot()
