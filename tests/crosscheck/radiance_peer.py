"""BSDF values by Radiance's own library, and files by its own tools, for tests/test_peers.py. Knows nothing of gonio.

    python tests/crosscheck/radiance_peer.py     writes tests/reference/peers/radiance.json

The files are those of radiance_files.py, asked at 1 000 random pairs of directions, and files that Radiance's
bsdf2klems and bsdf2ttree make of a formula, and bsdf2klems of that tree, kept as text. Angles are hundredths of a
degree, so that they are exact on either side, and no border of a patch is met by chance.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyradiance
from peers import write
from radiance_files import FILES

SEED = 20241124
COUNT = 1000
ROOT = Path(pyradiance.__file__).parent
LOBE = (
    "lobe(ix,iy,iz,ox,oy,oz) = 0.05 + if(iz, 0.02, 0.05)"
    " + if(iz*oz, 0.1, 0.02)*exp(-8*((ix+ox)*(ix+ox)+(iy+oy{skew})*(iy+oy{skew})))"
)
TOOLS = {
    "bsdf2klems": ("bsdf2klems", ["-q", "-n", "16", "+forward"], LOBE.format(skew="-0.2")),
    "bsdf2ttree": ("bsdf2ttree", ["-t3", "-g", "3", "-n", "64", "+forward"], LOBE.format(skew="")),
}
TREE_TO_KLEMS = ["-q", "-n", "1024"]  # so many samples a pair of patches


def directions(random):
    """theta_in, phi_in, theta_out, phi_out [0.01 deg] in Radiance's frame; theta beyond 90 deg is behind."""
    theta = np.degrees(np.arccos(random.uniform(-1.0, 1.0, (2, COUNT))))
    theta = np.where(np.abs(theta - 90) < 0.5, 45.0, theta)
    phi = random.uniform(0.0, 360.0, (2, COUNT))
    odd = [np.floor(v * 100) / 100 + 0.005 for v in (theta[0], phi[0], theta[1], phi[1])]
    return [np.rint(v * 1000).astype(int).tolist() for v in odd]


def tool_text(name):
    command, options, formula = TOOLS[name]
    return run(command, *options, "-e", formula, "lobe")


def tree_to_klems(tree):
    with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
        file.write(tree)
        file.flush()
        return run("bsdf2klems", *TREE_TO_KLEMS, file.name).replace(file.name, "tree.xml")


def run(command, *arguments):
    environment = os.environ | {"PATH": f"{ROOT / 'bin'}:{os.environ['PATH']}", "RAYPATH": str(ROOT / "lib")}
    found = subprocess.run([ROOT / "bin" / command, *arguments], env=environment, capture_output=True, check=True)
    return found.stdout.decode().replace(f"{ROOT / 'bin'}/", "")  # a comment names the program with its folder


def evaluate(text, pairs):
    """In a process of its own: the library is not made to let go of one file and load the next."""
    with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
        file.write(text)
        file.flush()
        command = [sys.executable, __file__, file.name]
        found = subprocess.run(command, input=json.dumps(pairs), capture_output=True, check=True, text=True, timeout=60)
    return json.loads(found.stdout)


def query(path, pairs):
    data = pyradiance.bsdf.load_file(path)
    found = [pyradiance.bsdf.query(data, *(v / 1000 for v in pair))[1] for pair in zip(*pairs, strict=True)]
    return [float(np.format_float_positional(np.float32(v), unique=True)) for v in found]


def main():
    pairs = directions(np.random.default_rng(SEED))
    texts = {name: make() for name, make in FILES.items()}
    made = {name: tool_text(name) for name in TOOLS}
    write(
        "radiance.json",
        {
            "peer": "pyradiance",
            "version": pyradiance.__version__,
            "precision": "single; values that vary over the hemisphere to 3e-4 of themselves",
            "seed": SEED,
            "value": "BSDF [1/sr], the luminance that bsdf.query returns",
            "directions": "theta and phi of the incident direction, then of the outgoing one, in 0.001 deg",
        },
        {"directions": pairs} | {name: evaluate(text, pairs) for name, text in (texts | made).items()},
        {name: {"command": TOOLS[name][1], "formula": TOOLS[name][2], "file": text} for name, text in made.items()}
        | {"tree2klems": {"command": TREE_TO_KLEMS, "of": "bsdf2ttree", "file": tree_to_klems(made["bsdf2ttree"])}},
    )


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(json.dumps(query(sys.argv[1], json.load(sys.stdin))))
    else:
        main()
