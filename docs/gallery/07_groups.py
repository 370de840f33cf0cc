"""
A weight for each incidence angle
=================================

The paper of gonio's family of models gives each incidence angle a specular weight of its own. `grouped` does so for any
weight or shape parameter. Here `gonio.published` has the paper's constants of aluminium, and the scan is simulated.
"""

import numpy as np

import gonio

paper = gonio.published["Al"]
angles = [30.0, 40.0, 50.0]
values = {name: paper.values[name] for name in paper.values}
model = gonio.catalogue[paper.model]
scan = gonio.simulate(model, values, angles, np.arange(-80.0, 81.0, 2.0), noise=0.01, unit=paper.unit)

solution = gonio.fit(scan, model, grouped={"ks": "theta_i"}, weighting="uniform")
print(solution.to_dataframe()[["parameter", "set", "value", "standard uncertainty"]].to_string(index=False))

# %%
# The components: what each term adds to the sum.

solution.plot("components")
