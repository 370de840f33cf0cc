"""
Values that vary smoothly with wavelength
=========================================

A rough surface looks smoother at longer wavelengths. With `smooth`, the width has a value at each wavelength and a
penalty on its curvature, whose strength follows from the data.
"""

import numpy as np

import gonio

ggx, angles = gonio.catalogue["ggx"], np.arange(-70.0, 71.0, 5.0)
parts = [
    gonio.simulate(
        ggx, {"rho_s": 0.3, "rho_d": 0.1, "width": 0.3 - 1e-4 * nm}, [20.0, 50.0], angles,
        noise=0.05, seed=k, wavelength=nm,
    )
    for k, nm in enumerate(np.arange(450.0, 801.0, 50.0))
]  # fmt: skip
scan = gonio.join({str(k): part for k, part in enumerate(parts)}).drop_vars("scan")

solution = gonio.fit(
    scan, "ggx", held={"index": 1.5, "extinction": 0.0}, smooth={"width": "wavelength"}, weighting="relative"
)
solution.plot("spectra")
