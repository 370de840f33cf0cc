"""
Into a renderer's format, and what that costs
=============================================

A scan of a few directions becomes a table over the hemisphere. Gaps are filled only where that is asked for, here by
the fitted model, and the file is read back and compared with the scan.
"""

import gonio
from gonio.resampling.difference import difference
from gonio.resampling.resample import Filling

scan = gonio.sample("coating")
solution = gonio.fit(scan, "ggx", held={"index": 1.5, "extinction": 0.0})
written = gonio.convert(
    scan, "coating.bsdf", "zemax", filling=Filling(("reciprocity",), solution.brdf, "ggx"), force=True
)
print(f"{written.path}: {100 * written.modelled:.0f} % of the values are the model's")
for words in written.left_out:
    print("left out:", words)

# %%
# The file against the scan, at the directions that were measured.

error = difference(gonio.read("coating.bsdf"), scan)
print(f"rms {100 * error.rms:.2f} %, bias {100 * error.bias:.2f} %")

# %%
# What a renderer reads: values over the whole hemisphere.

gonio.plot(gonio.read("coating.bsdf"), kind="hemisphere")
