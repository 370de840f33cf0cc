"""
A model of one's own
====================

`Model.from_function` takes a plain function of a Geometry and its shape parameters. The fit finds the factor `scale`;
the bounds say where the other values are looked for.
"""

import numpy as np

import gonio


def sheen(geometry, power, floor):
    """A rise towards grazing over a constant."""
    return floor + (1 - geometry.cos_r) ** power


model = gonio.Model.from_function(sheen, {"power": (0.5, 8.0), "floor": (0.01, 10.0)})
scan = gonio.simulate(
    model, {"scale": 0.2, "power": 3.0, "floor": 0.4}, [30.0], np.arange(-80.0, 81.0, 4.0), noise=0.02
)
solution = gonio.fit(scan, model)
print(solution)

# %%
# All figures and exports work with it as with a model of the catalogue.

solution.plot()
