"""What gonio-best misses of 48 public materials, as a table: `make prior`.

Writes src/gonio/completion/rgl_residuals.csv. The materials are those of the RGL database (CC0), as the networks of
Neural-BRDF (MIT) stand for them: no measurements, but a source of how residuals of a fit go together. Each is averaged
over its channels and over the four directions that an isotropic, reciprocal surface cannot tell apart, fitted in
logarithms, and what is left of lg of the BRDF is written at the nodes of a grid, in thousandths.
"""

import csv
import sys
from pathlib import Path

import numpy as np

from gonio import Problem, catalogue
from gonio.completion.prior import AZIMUTHS, DIFFERENCES, HALVES, TABLE
from gonio.fitting import fit
from gonio.measured.dataset import make_scan

NETWORKS = Path(__file__).resolve().parents[2] / "shared" / "data" / "prior" / "rgl_networks.npz"
STEEPEST = np.cos(np.radians(85.0))
LEAST = 1e-5  # 1/sr: below it a network says nothing
MODEL = "gonio-best"


def network(layers: list[np.ndarray], theta_h: np.ndarray, theta_d: np.ndarray, phi_d: np.ndarray) -> np.ndarray:
    """The BRDF [1/sr] of a material in three channels."""
    half = [np.sin(theta_h), np.zeros_like(theta_h), np.cos(theta_h)]
    x = np.stack([*half, np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d)], axis=-1)
    for kernel, bias in ((layers[0], layers[1]), (layers[2], layers[3])):
        x = np.maximum(x @ kernel + bias, 0)
    return np.maximum(np.exp(x @ layers[4] + layers[5]) - 1, 0)


def main() -> int:
    if not NETWORKS.is_file():
        print(f"no networks at {NETWORKS}: nothing to do")
        return 0
    arrays = np.load(NETWORKS, allow_pickle=False)
    names = sorted({name.split("/")[0] for name in arrays})
    grid = np.radians(np.stack(np.meshgrid(HALVES, DIFFERENCES, AZIMUTHS, indexing="ij"), axis=-1).reshape(-1, 3))
    theta_h, theta_d, phi_d = grid.T
    d = np.stack([np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d)], axis=-1)
    light = np.stack(
        [np.cos(theta_h) * d[:, 0] + np.sin(theta_h) * d[:, 2], d[:, 1],
         np.cos(theta_h) * d[:, 2] - np.sin(theta_h) * d[:, 0]], axis=-1
    )  # fmt: skip
    half = np.stack([np.sin(theta_h), 0 * theta_h, np.cos(theta_h)], axis=-1)
    view = 2 * np.sum(light * half, axis=-1, keepdims=True) * half - light
    above = (light[:, 2] > STEEPEST) & (view[:, 2] > STEEPEST)
    theta = [np.degrees(np.arccos(np.clip(w[:, 2], -1, 1))) for w in (light, view)]
    phi = np.degrees(np.arctan2(view[:, 1], view[:, 0]) - np.arctan2(light[:, 1], light[:, 0])) % 360
    columns = []
    for name in names:
        layers = [arrays[f"{name}/{k}"].astype(float) for k in range(6)]
        alike = (phi_d, -phi_d, np.pi + phi_d, np.pi - phi_d)
        brdf = np.mean([network(layers, theta_h, theta_d, p) for p in alike], axis=(0, 2))
        used = above & (brdf > LEAST)
        scan = make_scan(theta[0][used], theta[1][used], brdf[used], phi[used])
        modelled = fit(Problem(catalogue[MODEL], scan, weighting="log")).brdf(scan)
        missed = np.full(len(brdf), np.nan)
        missed[used] = 1000 * np.log10(brdf[used] / modelled)
        columns.append(missed)
        print(name, f"{np.sqrt(np.nanmean(missed**2)):.0f}", flush=True)
    with TABLE.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        for row in np.stack(columns, axis=-1):
            writer.writerow(["" if np.isnan(v) else round(v) for v in row])
    return 0


if __name__ == "__main__":
    sys.exit(main())
