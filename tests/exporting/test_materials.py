"""Materials of picture programs: their specifications' formulas written once more, and the files read again."""

import json
import math
import struct
import xml.etree.ElementTree as ET

import numpy as np
import pytest

import gonio
from gonio import Geometry
from gonio.exporting import targets
from gonio.exporting.materials.fitted import material
from gonio.exporting.materials.physically_based import GLTF, OPENPBR, USD
from gonio.exporting.subject import Subject, of_model
from gonio.exporting.target import Request
from gonio.exporting.targets.materials import read_glb, read_mtlx, read_usda
from gonio.plausibility import hemispherical_reflectance

LAMBERT = gonio.catalogue["lambert"]
READ = {"gltf": read_glb, "usd": read_usda, "materialx": read_mtlx}
MODELS = {"gltf": GLTF, "usd": USD, "materialx": OPENPBR}
PAIRS = Geometry.from_degrees([0.0, 30.0, 60.0, 80.0], [10.0, 35.0, 55.0, 70.0], [0.0, 180.0, 150.0, 90.0])


def vectors(g):
    return np.stack(np.broadcast_arrays(*g[:3]), -1), np.stack(np.broadcast_arrays(*g[3:]), -1)


def specular_brdf(g, alpha):
    """Appendix B.3.2 of glTF 2.0: V D with the height-correlated V, in vectors."""
    light, view = vectors(g)
    half = light + view
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    n_l, n_v, n_h = light[:, 2], view[:, 2], half[:, 2]
    h_l, h_v = (half * light).sum(-1), (half * view).sum(-1)
    a2 = alpha**2
    distribution = a2 / (math.pi * (n_h**2 * (a2 - 1) + 1) ** 2)
    lambda_l, lambda_v = ((np.sqrt(1 + a2 * (1 - c**2) / c**2) - 1) / 2 for c in (n_l, n_v))
    masking = 1 / (1 + lambda_l + lambda_v)
    assert np.allclose(h_l, h_v)
    return masking * distribution / (4 * n_l * n_v), 1 - np.abs(h_v)


def test_gltf():
    """mix(dielectric, metal) of appendix B.3.5, with KHR_materials_specular."""
    base, metallic, rough, strength = 0.6, 0.3, 0.45, 0.7
    lobe, grazing = specular_brdf(PAIRS, rough**2)
    f_dielectric = strength * (0.04 + 0.96 * grazing**5)
    dielectric = base / math.pi * (1 - f_dielectric) + lobe * f_dielectric
    metal = lobe * (base + (1 - base) * grazing**5)
    values = {"base": base, "one": 1.0, "metallic": metallic, "roughness": rough, "specular": strength}
    np.testing.assert_allclose(GLTF(PAIRS, values), (1 - metallic) * dielectric + metallic * metal, rtol=1e-12)


@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_usd_preview(metallic):
    """F0 and F90 of the specification: a metal has both at its colour, a dielectric F90 = 1."""
    base, rough, ior = 0.6, 0.45, 1.7
    lobe, grazing = specular_brdf(PAIRS, rough**2)
    r0 = ((1 - ior) / (1 + ior)) ** 2
    fresnel = r0 + (1 - r0) * grazing**5
    expected = base * lobe if metallic else base / math.pi * (1 - fresnel) + fresnel * lobe
    values = {"base": base, "one": 1.0, "metallic": metallic, "roughness": rough, "ior": ior}
    np.testing.assert_allclose(USD(PAIRS, values), expected, rtol=1e-12)


def test_openpbr_lets_through_what_it_does_not_reflect():
    """At every angle of view, base colour 1: reflected and let through are all of it, to 0.002."""
    shape = {"metallic": 0.0, "roughness": 0.6, "ior": 1.6}

    def swapped(g):
        """The albedo is that towards the viewer."""
        return OPENPBR(Geometry(*g[3:], *g[:3]), {"base": 1.0, "one": 1.0, **shape})

    for theta in (0.0, 40.0, 75.0):
        assert hemispherical_reflectance(swapped, theta, 200) == pytest.approx(1.0, abs=3e-3)


def made(name: str, subject: Subject, tmp_path):
    suffix = targets()[name].suffixes[0]
    request = Request(tmp_path / f"coating{suffix}", "coating")
    result = targets()[name].make(subject, request)
    (content,) = result.files.values()
    request.out.write_bytes(content if isinstance(content, bytes) else content.encode())
    return request, result


@pytest.mark.parametrize("name", READ)
def test_a_lambertian_comes_back(name, tmp_path):
    """As a base colour of 0.5; USD's dielectric always rises at grazing incidence."""
    request, _ = made(name, of_model(LAMBERT, {"rho": 0.5}), tmp_path)
    written = READ[name](request.out.read_bytes())
    assert written.pop("colour") == pytest.approx([0.5] * 3)
    values = {"base": 0.5, "one": 1.0, **written}
    near = Geometry.from_degrees([0.0, 20.0], [10.0, 30.0], 180.0)
    np.testing.assert_allclose(MODELS[name](near, values), 0.5 / math.pi, rtol=1e-3)
    assert targets()[name].check(of_model(LAMBERT, {"rho": 0.5}), request).holds


@pytest.mark.parametrize("name", READ)
def test_its_own_material_comes_back(name, tmp_path):
    """Values without noise are found again, to what a search of seconds reaches."""
    values = {"base": 0.3, "one": 1.0, "metallic": 0.0, "roughness": 0.45}
    request, result = made(name, of_model(MODELS[name], values), tmp_path)
    written = READ[name](request.out.read_bytes())
    assert written["colour"] == pytest.approx([0.3] * 3, rel=0.01)
    assert written["roughness"] == pytest.approx(0.45, rel=0.01)
    assert written["metallic"] < 0.02
    assert result.numbers["log10_rmse"] < 0.003
    assert set(result.numbers) >= {"peak_error", "reflectance_error_0", "reflectance_error_45", "reflectance_error_75"}
    assert any("the nearest one" in remark for remark in result.remarks)


def in_channels(levels: dict[str, float], by: str = "channel") -> Subject:
    sets = {label: {"rho": level} for label, level in levels.items()}
    return Subject(LAMBERT, sets, by, origin="three channels")


def test_channels_make_a_colour(tmp_path):
    request, result = made("gltf", in_channels({"B": 0.1, "G": 0.3, "R": 0.6}), tmp_path)
    assert read_glb(request.out.read_bytes())["colour"] == pytest.approx([0.6, 0.3, 0.1])
    assert any("linear Rec.709" in remark for remark in result.remarks)


def test_other_sets_are_refused():
    with pytest.raises(ValueError, match=r"choose one by --select wavelength=450"):
        material(in_channels({"450": 0.1, "550": 0.3}, "wavelength"), GLTF, "glTF")


def test_a_colour_above_one_ends_there_with_a_word(tmp_path):
    request, result = made("usd", of_model(LAMBERT, {"rho": 1.4}), tmp_path)
    assert read_usda(request.out.read_bytes())["colour"] == pytest.approx([1.0] * 3)
    assert any("ends at 1" in remark for remark in result.remarks)


def test_materialx_is_xml_and_its_comment_ends_where_it_should(tmp_path):
    hostile = Subject(LAMBERT, {"": {"rho": 0.5}}, origin="a --> <b>file</b> -- x")
    request, _ = made("materialx", hostile, tmp_path)
    root = ET.fromstring(request.out.read_text())
    assert [child.tag for child in root] == ["open_pbr_surface", "surfacematerial"]


def test_a_glb_is_whole(tmp_path):
    """Lengths as glTF 2.0 asks for, and triangles that look outwards."""
    request, _ = made("gltf", of_model(LAMBERT, {"rho": 0.5}), tmp_path)
    content = request.out.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", content)
    assert (magic, version, length) == (b"glTF", 2, len(content))
    (text,) = struct.unpack_from("<I", content, 12)
    document = json.loads(content[20 : 20 + text])
    assert text % 4 == 0
    binary = content[20 + text + 8 :]
    assert document["buffers"][0]["byteLength"] == len(binary)
    split = document["bufferViews"][1]["byteOffset"]
    points = np.frombuffer(binary[:split], "<f4").reshape(-1, 3).astype(float)
    triangles = np.frombuffer(binary[split:], "<u4").reshape(-1, 3)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1, atol=1e-6)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    assert (np.linalg.norm(normal, axis=1) > 1e-4).all()
    assert ((normal * (a + b + c)).sum(axis=1) > 0).all()
