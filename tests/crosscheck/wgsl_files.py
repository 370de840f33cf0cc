"""WGSL modules of every model, and pairs of directions, for wgsl_peer.py.

    python tests/crosscheck/wgsl_files.py FOLDER

Writes FOLDER/MODEL.wgsl, whose function is called `coating`, and FOLDER/pairs.npy: vectors to the light and to the
viewer (N, 6) in single precision. Values are those of values_of.
"""

import sys
from pathlib import Path

import numpy as np

from gonio import catalogue
from gonio.exporting.source import pairs
from gonio.exporting.subject import of_model
from gonio.exporting.targets.shaders.wgsl import with_numbers

WEIGHT = 0.5  # of every term
GAMMA = 45.0  # deg: the diffuse lobe of gonio-best is nearly constant at its default


def values_of(model):
    """Every weight, and a diffuse lobe that shows; the other shape parameters have their defaults."""
    return dict.fromkeys(model.weights, WEIGHT) | ({"gamma": GAMMA} if "gamma" in model.shape else {})


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    np.save(folder / "pairs.npy", np.stack(np.broadcast_arrays(*pairs()), axis=-1).astype("f4"))
    for name, model in catalogue.items():
        lines = with_numbers(of_model(model, values_of(model)), "coating")
        (folder / f"{name}.wgsl").write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
