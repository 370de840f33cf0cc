"""
Polarised light
===============

Some models are Mueller matrices. Unpolarised light that a dielectric reflects near its Brewster angle is polarised.
"""

import matplotlib.pyplot as plt
import numpy as np

import gonio
from gonio.polarisation import degree_of_linear_polarisation, reflected

model = gonio.catalogue["priest-mueller"]
theta = np.linspace(1.0, 85.0, 85)
mirror = gonio.Geometry.from_degrees(theta, theta, 180.0)
figure, ax = plt.subplots(figsize=(5, 3), layout="constrained")
for index, extinction, name in ((1.5, 0.0, "glass"), (1.4, 7.6, "aluminium")):
    mueller = model.mueller(mirror, {model.weights[0]: 1.0, "index": index, "extinction": extinction})
    ax.plot(theta, degree_of_linear_polarisation(reflected(mueller)), label=name)
ax.set(xlabel="θ [deg], in the mirror direction", ylabel="degree of linear polarisation")
ax.legend()
