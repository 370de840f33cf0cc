"""On which side of a polygon Radiance shows a file's reflection, by rtrace. Knows nothing of gonio.

    python tests/crosscheck/radiance_sides_peer.py     writes tests/reference/peers/radiance_sides.json

A polygon in the plane z = 0 is lit by a source of half angle 0.05 deg and radiance 1/omega, so that its radiance over
the cosine of incidence is the BSDF. It is seen from its front, where its normal points, and from its back.
"""

import math
import os
import subprocess
import tempfile
from pathlib import Path

import pyradiance
from peers import write
from radiance_files import opaque

ROOT = Path(pyradiance.__file__).parent
HALF_ANGLE, INCIDENCE = 0.05, 40.0  # deg
VIEWS = (10.0, 40.0, 60.0)  # deg, in the half-plane of the mirror direction
FILES = {"both sides": ("Front", "Back"), "front alone": ("Front",), "back alone": ("Back",)}
SCENE = """void light sun 0 0 3 {L} {L} {L}
sun source lamp 0 0 4 {x} 0 {z} {angle}
void BSDF surface 6 0 file.xml 0 1 0 . 0 0
surface polygon plate 0 0 12 -1 -1 0 1 -1 0 1 1 0 -1 1 0
"""


def radiances(folder, sign):
    """The BSDF [1/sr] at VIEWS from the polygon's front (sign 1) or back (-1)."""
    light, omega = math.radians(INCIDENCE), 2 * math.pi * (1 - math.cos(math.radians(HALF_ANGLE)))
    scene = SCENE.format(L=1 / omega, x=math.sin(light), z=sign * math.cos(light), angle=2 * HALF_ANGLE)
    (folder / "scene.rad").write_text(scene)
    (folder / "scene.oct").write_bytes(run(folder, ["oconv", "scene.rad"]))
    rays = []
    for view in map(math.radians, VIEWS):
        x, z = -math.sin(view), sign * math.cos(view)
        rays.append(f"{5 * x} 0 {5 * z} {-x} 0 {-z}")
    options = ["-h", "-ab", "0", "-dj", "0", "-ds", "0", "-dt", "0", "-dc", "1", "scene.oct"]
    found = run(folder, ["rtrace", *options], "\n".join(rays).encode())
    return [float(f"{float(line.split()[0]) / math.cos(light):.5g}") for line in found.decode().splitlines()]


def run(folder, command, given=b""):
    environment = os.environ | {"PATH": f"{ROOT / 'bin'}:{os.environ['PATH']}", "RAYPATH": f".:{ROOT / 'lib'}"}
    program = [str(ROOT / "bin" / command[0]), *command[1:]]
    return subprocess.run(program, cwd=folder, env=environment, input=given, capture_output=True, check=True).stdout


def main():
    columns = {}
    for name, sides in FILES.items():
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "file.xml").write_text(opaque(sides))
            for side, sign in (("front", 1), ("back", -1)):
                columns[f"{name} | {side}"] = radiances(Path(folder), sign)
    about = {
        "peer": "pyradiance",
        "version": pyradiance.__version__,
        "value": "radiance over cos(theta_i) of a polygon seen from its front and its back: the BSDF [1/sr]",
        "theta_i": INCIDENCE,
        "theta_r": VIEWS,
    }
    write("radiance_sides.json", about, columns, {name: {"sides": sides} for name, sides in FILES.items()})


if __name__ == "__main__":
    main()
