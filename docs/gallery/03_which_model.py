"""
Which model
===========

`gonio.compare` fits several models, leaves out each incidence angle in turn, and ranks the models by how well they
predict it. A model with more parameters always fits better; it does not always predict better.
"""

import gonio

scan = gonio.sample("coating")
models = [gonio.catalogue[name] for name in ("ggx", "torrance-sparrow", "ward", "phong")]
ranking = gonio.compare(scan, models, left_out="theta_i", weighting="relative")

print(f"{'model':18} {'free':>4} {'fitted':>8} {'predicted':>9}   relative error")
for row in ranking:
    fitted, predicted = row.metrics["delta"], row.validated["delta"]
    print(f"{row.solution.model.name:18} {row.free_parameters:4} {fitted:8.4f} {predicted:9.4f}")

# %%
# The best two over the measured points.

gonio.plot(scan, ranking[:2])
