"""Small ASTM files with the columns of the public Cornell data."""

from pathlib import Path

import numpy as np


def _rows(columns: int, turned: bool = True) -> str:
    lines = []
    for theta_i in (0.0, 0.5236):
        for theta_s in (0.0, 0.5236, 1.2217):
            for phi_s in (-3.1416, -1.5708, 0.0, 1.5708):
                angles = [theta_i, *([0.0] if turned else []), theta_s, phi_s]
                values = [
                    round(0.1 * (k + 1) * (1 + np.cos(theta_s)) * (1.5 - np.cos(phi_s)), 5) for k in range(columns)
                ]
                lines.append(",".join(map(repr, [*angles, *map(float, values)])))
    return "\n".join(lines) + "\n"


VARIANTS = {
    "rgb.astm": "MATERIAL blue paint\nDATE 1999-01-01\nNUM_POINTS 24\nVARS theta_i,phi_i,theta_s,phi_s,R,G,B\n"
    + _rows(3),
    "spectral.astm": "NUM_POINTS 24\r\nVARS theta_i,phi_i,theta_s,phi_s,450nm,650.5nm\r\n"
    + _rows(2).replace("\n", "\r\n"),
    "whole.astm": "VARS theta_i,theta_s,phi_s,Integrated 380 to 780\n" + _rows(1, turned=False),
    "turned.astm": "NUM_POINTS 2\nVARS theta_i, phi_i, theta_s, phi_s, X, Y, Z\n"
    "0.5236, 0.7854, 0.5236, 3.927, 0.1, 0.2, -0.001\n0.5236, 1.5708, 0.7854, 3.927, 0.3, 0.1, 0.2\n",
}


def samples(folder: Path) -> list[Path]:
    """One file of each variant that the reader knows."""
    paths = [folder / name for name in VARIANTS]
    for path in paths:
        path.write_text(VARIANTS[path.name], encoding="utf-8", newline="")
    return paths
