"""One rms height for three wavelengths of a real coating, against one phase for each: `make wavelengths`.

Writes benchmarks/wavelengths.json, which docs/howto/layers.md is made from. The surface's own values are shared (width,
tail and slope); what its material does (reflectance at the normal, and the two diffuse lobes) has one value a
wavelength, in the first two fits, and is shared as well in the last two.
"""

import json
import platform
import sys
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from gonio import Problem, catalogue
from gonio.comparison.assessment import assess
from gonio.fitting import fit
from surfaces import DATA, coating_at_four_wavelengths

RESULT = Path(__file__).resolve().parent / "wavelengths.json"
LEAST = 600.0  # nm: at the shortest wavelength, 386 nm, the phase of the coating is another (howto/layers.md)
BY_WAVELENGTH = dict.fromkeys(("f0", "gamma", "s"), "wavelength")
FITS: dict[str, tuple[str, dict[str, str]]] = {
    "one rms height": ("gonio-best-spectral", BY_WAVELENGTH),
    "one phase a wavelength": ("gonio-best", BY_WAVELENGTH | {"h": "wavelength"}),
    "one rms height, all shared": ("gonio-best-spectral", {}),
    "one phase a wavelength, all else shared": ("gonio-best", {"h": "wavelength"}),
}


def problem(which: str) -> Problem:
    model, grouped = FITS[which]
    return Problem(catalogue[model], coating_at_four_wavelengths(LEAST), weighting="log", grouped=grouped)


def record(which: str) -> dict[str, Any]:
    asked = problem(which)
    row = assess(asked, fit(asked))
    uncertain = row.solution.uncertainties
    return {
        "model": asked.model.name,
        "values": {name: row.solution.values[name] for name in asked.names},
        "uncertainties": {name: float(uncertain[name]) for name in asked.names if np.isfinite(uncertain[name])},
        "free": len(asked.names),
        "points": len(asked.measured),
        "log10_rmse": row.metrics["log10_rmse"],
        "status": row.solution.status.name,
    }


def main() -> int:
    if not DATA.is_dir():
        print(f"no measured data at {DATA}: nothing to do")
        return 0
    machine = f"{platform.machine()}, Python {platform.python_version()}, NumPy {np.__version__}"
    results = {"machine": machine, "date": date.today().isoformat(), "fits": {which: record(which) for which in FITS}}
    RESULT.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
