"""Exported surfaces in Eradiate's kernel, for tests/exporting/test_radio_peers.py. Knows nothing of gonio.

    python tests/crosscheck/eradiate_peer.py FOLDER     writes tests/reference/peers/eradiate_export.json

FOLDER is what export_files.py wrote. The kernel is Eradiate's Mitsuba (eradiate-mitsuba), in double precision.
"""

import importlib.metadata
import json
import sys
from pathlib import Path

import mitsuba as mi
import yaml
from peers import write

mi.set_variant("scalar_mono_double")
RENAMED = {"lambertian": "diffuse"}  # Eradiate's own name, and its kernel's


def value(bsdf, light, view):
    """The BRDF [1/sr]: eval gives it times the cosine of the light."""
    interaction = mi.SurfaceInteraction3f()
    interaction.wi = mi.Vector3f(view)
    interaction.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    found = bsdf.eval(mi.BSDFContext(), interaction, mi.Vector3f(light))
    return float(found[0]) / light[2]


def main(folder):
    pairs = json.loads((folder / "pairs.json").read_text())
    columns, surfaces = {}, {}
    for path in sorted(folder.glob("*.yml")):
        surface = yaml.safe_load(path.read_text(encoding="utf-8"))
        kind = RENAMED.get(surface["type"], surface["type"])
        bsdf = mi.load_dict(surface | {"type": kind})
        columns[path.stem] = [float(f"{value(bsdf, p['light'], v):.12g}") for p in pairs for v in p["views"]]
        surfaces[path.stem] = surface
    about = {
        "peer": "Eradiate's kernel, scalar_mono_double",
        "version": importlib.metadata.version("eradiate-mitsuba"),
        "value": "f [1/sr]",
    }
    write("eradiate_export.json", about, {"pairs": pairs} | columns, surfaces)


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
