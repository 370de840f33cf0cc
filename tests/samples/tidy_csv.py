"""Tidy CSV in all its variants: in plane and out of it, with units, sets and strangers, and without."""

from pathlib import Path

import numpy as np

from gonio import write
from gonio.measured.dataset import make_scan

LITERAL = {
    "least.csv": "theta_i_deg,theta_r_deg,brdf_sr-1\n30,-10,0.1\n30,10,0.25\n",
    "radians.csv": "# unit: rad\ntheta_i_rad,theta_r_rad,phi_rad,brdf_a.u.\n0.5,0.25,3.14,2\n0.5,0.75,0,3e-2\n",
    "micrometres.csv": 'theta_i_deg,theta_r_deg,wavelength_um,brdf_sr-1,std_sr-1,"remark, quoted"\n'
    '45,45,10.6,1.5,0.1,"a ""word"", two"\n45,-45,10.6,,0,\n',
}


def samples(folder: Path) -> list[Path]:
    """A full scan by the writer, and what people type."""
    full = make_scan(
        np.repeat([10.0, 30.0, 60.0], 4),
        np.tile([0.0, 20.0, 45.25, 89.0], 3),
        np.linspace(0.1, 1.2, 12) / 3,
        np.tile([0.0, 90.5, 180.0, 360.0], 3),
        phi_i=np.repeat([0.0, 45.0, 90.0], 4),
        uncertainty=np.full(12, 0.01),
        coordinates={"channel": np.tile(["R", "G"], 6), "mode": np.repeat(["reflection", "transmission"], 6)},
        variables={
            "uncertainty_systematic": (np.full(12, 0.02), "sr-1"),
            "mask": (np.tile(np.array([0, 1], dtype=np.int8), 6), "1"),
            "temperature": (np.linspace(20, 22, 12), "1"),
        },
        provenance="material: aluminium, ünpolished\nsource: a test",
        history="made by hand",
    )
    path = folder / "full.csv"
    write(full, path, to="tidy-csv")
    written = [path]
    for name, text in LITERAL.items():
        written.append(folder / name)
        written[-1].write_text(text, encoding="utf-8")
    return written
