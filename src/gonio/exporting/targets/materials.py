"""glTF, USD and MaterialX: a material with a sphere to look at, or the material alone."""

import json
import math
import re
import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from gonio.door.binary import mapped
from gonio.exporting.heading import heading
from gonio.exporting.materials.fitted import RGB, Material, material
from gonio.exporting.materials.physically_based import GLTF, OPENPBR, USD
from gonio.exporting.source import pairs
from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.model import Model

QUANTITY = "parameters of a material, linear colours; the renderer multiplies by the cosine itself"
RINGS, SECTORS = 32, 64  # of the sphere

_JSON, _BINARY = 0x4E4F534A, 0x004E4942  # kinds of chunks in a .glb
_FLOAT, _UNSIGNED = 5126, 5125  # kinds of numbers
_ARRAY, _ELEMENTS = 34962, 34963  # kinds of buffers


def _heading(subject: Subject, found: Material, title: str) -> list[str]:
    told = heading(subject, f"Material of {title}, fitted to {subject.model.name}", quantity=QUANTITY, frame="none")
    return [*told, "", *(f"{name} = {value:.4g}" for name, value in found.numbers.items())]


def _numbers(found: Material) -> dict[str, float]:
    return {**found.shape, **{f"base_{k}": v for k, v in zip(RGB, found.colour, strict=True)}, **found.numbers}


def glb(subject: Subject, request: Request) -> Made:
    """A binary glTF: a sphere of radius 1 with the material."""
    found = material(subject, GLTF, "glTF")
    positions, indices = _sphere()
    vertices, faces = positions.astype("<f4").tobytes(), indices.astype("<u4").tobytes()
    document = {
        "asset": {"version": "2.0", "generator": "gonio", "extras": {"gonio": _heading(subject, found, "glTF 2.0")}},
        "extensionsUsed": ["KHR_materials_specular"],
        "materials": [_gltf_material(request.name, found)],
        **_scene(request.name, positions, indices, len(vertices), len(faces)),
    }
    text = json.dumps(document, ensure_ascii=True).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), _JSON) + text
    chunks += struct.pack("<II", len(vertices) + len(faces), _BINARY) + vertices + faces
    content = struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
    return Made({request.out.name: content}, found.remarks, _numbers(found))


def _gltf_material(name: str, found: Material) -> dict[str, object]:
    return {
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*(_rounded(c) for c in found.colour), 1.0],
            "metallicFactor": _rounded(found.shape["metallic"]),
            "roughnessFactor": _rounded(found.shape["roughness"]),
        },
        "extensions": {"KHR_materials_specular": {"specularFactor": _rounded(found.shape["specular"])}},
    }


def _scene(name: str, positions: np.ndarray, indices: np.ndarray, vertices: int, faces: int) -> dict[str, object]:
    """One node with the sphere, and where its points and triangles lie in the buffer, by their numbers of bytes."""
    return {
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": name}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 0}, "indices": 1, "material": 0}]}],
        "accessors": [
            {
                **{"bufferView": 0, "componentType": _FLOAT, "count": len(positions), "type": "VEC3"},
                **{"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()},
            },
            {"bufferView": 1, "componentType": _UNSIGNED, "count": indices.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": vertices, "target": _ARRAY},
            {"buffer": 0, "byteOffset": vertices, "byteLength": faces, "target": _ELEMENTS},
        ],
        "buffers": [{"byteLength": vertices + faces}],
    }


def _sphere() -> tuple[np.ndarray, np.ndarray]:
    """Points of a unit sphere, which are its normals too, and its triangles, seen from outside."""
    polar = np.linspace(0, math.pi, RINGS + 1)[:, None]
    azimuth = np.linspace(0, 2 * math.pi, SECTORS + 1)[None, :]
    x, y, z = np.sin(polar) * np.cos(azimuth), np.cos(polar) + 0 * azimuth, -np.sin(polar) * np.sin(azimuth)
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32).astype(float)
    row, column = (k.ravel() for k in np.indices((RINGS, SECTORS)))
    first = row * (SECTORS + 1) + column
    below = first + SECTORS + 1
    upper, lower = np.stack([first, below, first + 1], -1)[row > 0], np.stack([first + 1, below, below + 1], -1)
    return points, np.concatenate([upper, lower[row < RINGS - 1]])


def usda(subject: Subject, request: Request) -> Made:
    """A text of USD: a sphere with the material."""
    found = material(subject, USD, "UsdPreviewSurface")
    colour = ", ".join(f"{_rounded(c):g}" for c in found.colour)
    comments = "\n".join(f"# {line}".rstrip() for line in _heading(subject, found, "UsdPreviewSurface"))
    name = request.name
    text = f"""#usda 1.0
(
    defaultPrim = "{name}"
    upAxis = "Y"
)
{comments}

def Xform "{name}"
{{
    def Sphere "Sphere" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {{
        double radius = 1
        rel material:binding = </{name}/Material>
    }}

    def Material "Material"
    {{
        token outputs:surface.connect = </{name}/Material/Surface.outputs:surface>

        def Shader "Surface"
        {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = ({colour})
            float inputs:metallic = {_rounded(found.shape["metallic"]):g}
            float inputs:roughness = {_rounded(found.shape["roughness"]):g}
            float inputs:ior = {_rounded(found.shape["ior"]):g}
            int inputs:useSpecularWorkflow = 0
            token outputs:surface
        }}
    }}
}}
"""
    return Made({request.out.name: text}, found.remarks, _numbers(found))


def mtlx(subject: Subject, request: Request) -> Made:
    """A document of MaterialX: an OpenPBR surface."""
    found = material(subject, OPENPBR, "OpenPBR")
    told = "\n".join(re.sub("--+", "-", line).rstrip() for line in _heading(subject, found, "OpenPBR Surface 1.1"))
    values = {
        "base_weight": ("float", "1"),
        "base_color": ("color3", ", ".join(f"{_rounded(c):g}" for c in found.colour)),
        "base_metalness": ("float", f"{_rounded(found.shape['metallic']):g}"),
        "base_diffuse_roughness": ("float", "0"),
        "specular_weight": ("float", "1"),
        "specular_color": ("color3", "1, 1, 1"),
        "specular_roughness": ("float", f"{_rounded(found.shape['roughness']):g}"),
        "specular_ior": ("float", f"{_rounded(found.shape['ior']):g}"),
    }
    inputs = "\n".join(
        f'    <input name="{n}" type="{kind}" value={quoteattr(v)} />' for n, (kind, v) in values.items()
    )
    text = f"""<?xml version="1.0"?>
<!--
{told}
-->
<materialx version="1.39" colorspace="lin_rec709">
  <open_pbr_surface name="{request.name}_surface" type="surfaceshader">
{inputs}
  </open_pbr_surface>
  <surfacematerial name="{request.name}" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="{request.name}_surface" />
  </surfacematerial>
</materialx>
"""
    return Made({request.out.name: text}, found.remarks, _numbers(found))


def _rounded(value: float) -> float:
    """With six digits, which is what the programs keep."""
    return float(f"{value:.6g}")


def read_glb(content: bytes) -> dict[str, float | list[float]]:
    """The parameters in a .glb."""
    (length,) = struct.unpack_from("<I", content, 12)
    (one,) = json.loads(content[20 : 20 + length])["materials"]
    plain = one["pbrMetallicRoughness"]
    return {
        "colour": plain["baseColorFactor"][:3],
        "metallic": plain["metallicFactor"],
        "roughness": plain["roughnessFactor"],
        "specular": one["extensions"]["KHR_materials_specular"]["specularFactor"],
    }


def read_usda(content: bytes) -> dict[str, float | list[float]]:
    """The parameters in a .usda that gonio wrote."""
    text = content.decode()
    found = {n: float(v) for n, v in re.findall(r"float inputs:(\w+) = (\S+)", text)}
    (colour,) = re.findall(r"diffuseColor = \(([^)]*)\)", text)
    return {**found, "colour": [float(c) for c in colour.split(",")]}


def read_mtlx(content: bytes) -> dict[str, float | list[float]]:
    """The parameters in a .mtlx that gonio wrote."""
    found = dict(re.findall(r'<input name="(\w+)" type="\w+" value="([^"]*)"', content.decode()))
    colour = [float(c) for c in found["base_color"].split(",")]
    names = {"metallic": "base_metalness", "roughness": "specular_roughness", "ior": "specular_ior"}
    return {"colour": colour} | {ours: float(found[theirs]) for ours, theirs in names.items()}


def _bytes(file: Path) -> bytes:
    with mapped(file) as content:
        return bytes(content)


Read = Callable[[bytes], Mapping[str, float | list[float]]]


def _check(model: Model, title: str, read: Read) -> Callable[[Subject, Request], Proof]:
    """The parameters of the written file, read again, against those that were fitted, as values of the BRDF."""

    def check(subject: Subject, request: Request) -> Proof:
        written, fitted = dict(read(_bytes(request.out))), material(subject, model, title)
        colour = written.pop("colour")
        geometry, error = pairs(), 0.0
        for mine, theirs in zip(fitted.colour, colour, strict=True):  # type: ignore[arg-type]
            right = model(geometry, {**fitted.shape, "base": mine, "one": 1.0})
            found = model(geometry, {**written, "base": theirs, "one": 1.0})
            scale = np.where(right == 0, 1.0, np.abs(right))
            error = max(error, float(np.max(np.abs(found - right) / scale)))
        return Proof("its parameters read again, as values of the material's BRDF", error, DIGITS_ERROR)

    return check


DIGITS_ERROR = 1e-3  # six digits of a roughness, whose fourth power stands in a narrow lobe

GLTF_TARGET = Target(
    "gltf", "glTF 2.0", (".glb",), "a sphere with the nearest material, fitted", glb, _check(GLTF, "glTF", read_glb)
)
USD_TARGET = Target(
    "usd",
    "USD",
    (".usda",),
    "a sphere with the nearest UsdPreviewSurface, fitted",
    usda,
    _check(USD, "UsdPreviewSurface", read_usda),
)
MATERIALX_TARGET = Target(
    "materialx",
    "MaterialX",
    (".mtlx",),
    "the nearest OpenPBR surface, fitted",
    mtlx,
    _check(OPENPBR, "OpenPBR", read_mtlx),
)
