"""Materials that gonio writes, opened by the programs' own libraries: usd-core, MaterialX, pygltflib, glTF-Validator.

Run by `make crosscheck` with the Python that has them: arguments are the folder with coating.glb, .usda and .mtlx, and
optionally the command of Node and the folder of the npm package gltf-validator. Writes
tests/reference/peers/materials.json.
"""

import json
import subprocess
import sys
from datetime import date
from importlib.metadata import version
from pathlib import Path

OUT = Path(__file__).resolve().parents[1] / "reference" / "peers" / "materials.json"
SCRIPT = """
const v = require('gltf-validator'), fs = require('fs');
v.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1])))
  .then((r) => console.log(JSON.stringify({version: v.version(), ...r.issues})));
"""


def usd(file: Path) -> dict[str, object]:
    from pxr import Usd, UsdShade

    stage = Usd.Stage.Open(str(file))
    (material,) = [p for p in stage.Traverse() if p.GetTypeName() == "Material"]
    shader, _, _ = UsdShade.Material(material).ComputeSurfaceSource()
    (sphere,) = [p for p in stage.Traverse() if p.GetTypeName() == "Sphere"]
    bound, _ = UsdShade.MaterialBindingAPI(sphere).ComputeBoundMaterial()
    values = {i.GetBaseName(): i.Get() for i in shader.GetInputs()}
    values["diffuseColor"] = list(values["diffuseColor"])
    return {"surface": shader.GetIdAttr().Get(), "bound": str(bound.GetPath()), "values": values}


def materialx(file: Path) -> dict[str, object]:
    import MaterialX

    document, library = MaterialX.createDocument(), MaterialX.createDocument()
    MaterialX.readFromXmlFile(document, str(file))
    MaterialX.loadLibraries(MaterialX.getDefaultDataLibraryFolders(), MaterialX.getDefaultDataSearchPath(), library)
    document.importLibrary(library)
    valid, said = document.validate()
    (surface,) = [n for n in document.getNodes() if n.getCategory() == "open_pbr_surface"]
    return {"valid": valid, "said": said, "values": {i.getName(): i.getValueString() for i in surface.getInputs()}}


def gltf(file: Path) -> dict[str, object]:
    import pygltflib

    one = pygltflib.GLTF2().load(str(file)).materials[0]
    plain = one.pbrMetallicRoughness
    return {
        "baseColorFactor": plain.baseColorFactor,
        "metallicFactor": plain.metallicFactor,
        "roughnessFactor": plain.roughnessFactor,
        "extensions": one.extensions,
    }


def main() -> None:
    folder, *validator = sys.argv[1:]
    files = {suffix: Path(folder) / f"coating.{suffix}" for suffix in ("glb", "usda", "mtlx")}
    record = {
        "date": date.today().isoformat(),
        "versions": {name: version(name) for name in ("usd-core", "materialx", "pygltflib")},
        "usd": usd(files["usda"]),
        "materialx": materialx(files["mtlx"]),
        "gltf": gltf(files["glb"]),
    }
    if validator:
        node, package = validator
        done = subprocess.run(
            [node, "-e", SCRIPT, str(files["glb"].resolve())], cwd=package, capture_output=True, text=True, check=True
        )
        record["gltf-validator"] = json.loads(done.stdout)
    OUT.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
