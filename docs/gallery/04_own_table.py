"""
From a table to a figure for a journal
======================================

`gonio.scan` takes arrays, as they come from a spreadsheet or from a program of your own. A figure on axes of your own
has the size and the type that the journal asks for.
"""

import matplotlib.pyplot as plt
import numpy as np

import gonio

theta_r = np.array([-60.0, -40.0, -20.0, 0.0, 10.0, 20.0, 25.0, 30.0, 35.0, 40.0, 50.0, 60.0, 70.0])
at_10 = [0.0345, 0.0327, 0.0416, 0.0839, 0.112, 0.0879, 0.0677, 0.0572, 0.048, 0.0464, 0.0383, 0.0358, 0.0352]
at_30 = [0.0321, 0.0321, 0.034, 0.0423, 0.0572, 0.0987, 0.123, 0.14, 0.14, 0.117, 0.0751, 0.0563, 0.0502]
scan = gonio.scan([[10.0], [30.0]], theta_r, [at_10, at_30])
solution = gonio.fit(scan, "ggx", held={"index": 1.5, "extinction": 0.0})

# %%
# One column of a journal is 85 mm wide.

MM = 1 / 25.4
with plt.rc_context({"font.size": 8}):
    figure, ax = plt.subplots(figsize=(85 * MM, 60 * MM), layout="constrained")
    solution.plot(ax=ax)
figure.savefig("fit.pdf")
