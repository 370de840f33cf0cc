"""Does the slope of a fit agree with that of the surface? `make slopes` writes benchmarks/slopes.json.

Scans are simulated by wave optics from surfaces whose heights are known, and facet models are fitted to them.
docs/pages/fitted_slopes.py makes a page of the results.
"""

import json
import math
import sys
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from figures import machine
from gonio import Problem, catalogue, simulate
from gonio.fitting import fit
from gonio.topography import effective_slope, gaussian_structure, phase_variance
from gonio.topography.light.agreement import fitted_slope

RECORD = Path(__file__).resolve().parent / "slopes.json"
SURFACES = (  # rms height and correlation length [um], and what it is like
    (0.07, 1.414, "copper of the paper"),
    (0.142, 1.414, "aluminium of the paper"),
    (0.206, 1.414, "SR107 of the paper"),
    (0.5, 5.0, ""),
    (1.5, 10.0, ""),
)
THEORIES = ("beckmann-kirchhoff", "generalised-harvey-shack")
INDEX = {"index": 1.37, "extinction": 7.62}  # aluminium at 632.8 nm
MODELS: dict[str, dict[str, float]] = {"torrance-sparrow": {}, "beckmann": INDEX, "ggx": INDEX}  # and what is held
THETA_I, THETA_R, WAVELENGTH = [20.0, 30.0, 40.0, 50.0], np.arange(-80, 81, 1.0), 0.6328


def fitted(theory: str, rms: float, length: float) -> dict[str, float]:
    """The slope per axis that each model finds in the scan of a surface."""
    values = {"scale": 1.0, "sigma": rms, "length": length, "wavelength": WAVELENGTH} | INDEX
    scan = simulate(catalogue[theory], values, THETA_I, THETA_R, wavelength=1000 * WAVELENGTH)
    found = {}
    for name, held in MODELS.items():
        found[name] = fitted_slope(fit(Problem(catalogue[name], scan, held=held, weighting="uniform"))).value
    return found


def row(rms: float, length: float, like: str) -> dict[str, Any]:
    """One surface: what is true of it, and what the fits say."""
    return {
        "rms": rms,
        "length": length,
        "like": like,
        "g": phase_variance(rms, 40, WAVELENGTH),
        "true": math.sqrt(2) * rms / length,
        "effective": effective_slope(gaussian_structure(rms, length), 40, WAVELENGTH)[1],
        "fitted": {theory: fitted(theory, rms, length) for theory in THEORIES},
    }


def main() -> int:
    record = {"machine": machine(), "date": date.today().isoformat(), "theta_i": THETA_I}
    record |= {
        "theta_r": [float(THETA_R[0]), float(THETA_R[-1]), 1.0],
        "wavelength_nm": 1000 * WAVELENGTH,
        "index": INDEX,
    }
    record["rows"] = [row(*surface) for surface in SURFACES]
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    for one in record["rows"]:
        print(one)
    return 0


if __name__ == "__main__":
    sys.exit(main())
