"""OSL shaders compiled by Blender and rendered by Cycles: a plane in the light of one direction, for every model.

    python tests/crosscheck/osl_peer.py FOLDER     writes tests/reference/peers/osl.json

FOLDER is what osl_files.py wrote. Knows nothing of gonio. Needs Blender as a Python module, which is no part of
`make crosscheck` because it takes 900 MB: pip install bpy==5.0.1, for Python 3.11.
"""

import math
import platform
import sys
from pathlib import Path

import bpy
import numpy as np
import peers
from mathutils import Vector

PAIRS = ((0, 0, 0), (30, 30, 180), (40, 30, 170), (60, 50, 180), (20, 70, 90))  # theta_i, theta_r, phi [deg]
LIGHT = "vector light_direction = vector(0.0, 0.0, 1.0)"


def scene():
    """A plane that an orthographic camera sees, and nothing that shines."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    made = bpy.context.scene
    made.render.engine = "CYCLES"
    made.cycles.shading_system = True
    made.cycles.device = "CPU"
    made.cycles.samples = 4
    made.cycles.use_denoising = False
    made.render.resolution_x = made.render.resolution_y = 4
    made.view_settings.view_transform = "Raw"
    made.render.image_settings.file_format = "OPEN_EXR"
    made.render.image_settings.color_depth = "32"
    made.world = bpy.data.worlds.new("dark")
    made.world.use_nodes = True
    made.world.node_tree.nodes["Background"].inputs[1].default_value = 0.0
    # Cycles takes an edge of a triangle for dPdu, here the diagonal: the camera sees one of the two, with that along x.
    bpy.ops.mesh.primitive_plane_add(size=10, location=(0, 2.8, 0), rotation=(0, 0, 0.75 * math.pi))
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.ortho_scale = "ORTHO", 0.1
    made.camera = bpy.data.objects.new("camera", camera)
    made.collection.objects.link(made.camera)
    return made, bpy.context.object


def paint(plane, oso):
    """The plane gets the shader: this Blender makes no sockets of a Script node, so they are made here."""
    material = bpy.data.materials.new(oso.stem)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    script = nodes.new("ShaderNodeScript")
    script.mode, script.filepath = "EXTERNAL", str(oso)
    if not script.outputs:
        script.outputs.new("NodeSocketShader", "BSDF")
    output = nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(script.outputs[0], output.inputs["Surface"])
    plane.data.materials.clear()
    plane.data.materials.append(material)


def render(made, view, file):
    """The radiance that the camera sees."""
    made.camera.location = 5 * view
    made.camera.rotation_euler = view.to_track_quat("Z", "Y").to_euler()
    made.render.filepath = str(file)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(file))
    image.colorspace_settings.name = "Non-Color"
    value = float(np.array(image.pixels[:]).reshape(-1, 4)[:, 0].mean())
    bpy.data.images.remove(image)
    return value


def direction(theta, azimuth):
    theta, azimuth = math.radians(theta), math.radians(azimuth)
    return Vector((math.sin(theta) * math.cos(azimuth), math.sin(theta) * math.sin(azimuth), math.cos(theta)))


def main(folder):
    import _cycles  # there once Blender is

    made, plane = scene()
    columns = {"pairs": [list(pair) for pair in PAIRS]}
    for file in sorted(p for p in folder.glob("*.osl") if not p.stem.startswith("_")):
        columns[file.stem] = []
        text = file.read_text(encoding="utf-8")
        assert LIGHT in text, file
        for k, (theta_i, theta_r, phi) in enumerate(PAIRS):
            x, y, z = direction(theta_i, 0)
            turned = folder / f"_{file.stem}_{k}.osl"
            light = LIGHT.replace("0.0, 0.0, 1.0", f"{x:.9f}, {y:.9f}, {z:.9f}")
            turned.write_text(text.replace(LIGHT, light), encoding="utf-8")
            oso = turned.with_suffix(".oso")
            if not _cycles.osl_compile(str(turned), str(oso)):
                raise SystemExit(f"{turned}: does not compile")
            paint(plane, oso)
            columns[file.stem].append(float(f"{render(made, direction(theta_r, phi), folder / '_out.exr'):.9g}"))
    about = {
        "program": f"Blender {bpy.app.version_string}, Cycles, OSL {_cycles.osl_version_string}",
        "python": platform.python_version(),
        "quantity": "BRDF times cos theta_i, in 1/sr, at theta_i, theta_r and phi in degrees in `pairs`",
    }
    peers.write("osl.json", about, columns, {})


if __name__ == "__main__":
    main(Path(sys.argv[1]))
