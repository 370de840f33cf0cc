"""A sphere of docs/howto/shaders.md, rendered by Cycles from a shader that gonio wrote; no part of `make renders`.

    python benchmarks/cycles_picture.py coating.osl PICTURE.png

Knows nothing of gonio. Needs Blender as a Python module, 900 MB: pip install bpy==5.0.1, for Python 3.11.
"""

import sys
from pathlib import Path

import bpy
from mathutils import Vector

SIZE, SAMPLES = 320, 64
LIGHT, IRRADIANCE = "vector light_direction = vector(0.0, 0.0, 1.0)", "float irradiance = 1.0"
FROM = Vector((-0.6, -0.7, 0.5)).normalized()


def compiled(shader: Path) -> Path:
    """The shader with its light where the picture has it."""
    text = shader.read_text(encoding="utf-8")
    import _cycles  # which bpy brings

    assert LIGHT in text, "the shader has another light than this script looks for"
    text = text.replace(LIGHT, "vector light_direction = vector({:.6f}, {:.6f}, {:.6f})".format(*FROM))
    source, target = shader.with_name("lit.osl"), shader.with_name("lit.oso")
    source.write_text(text.replace(IRRADIANCE, "float irradiance = 4.0"), encoding="utf-8")
    assert _cycles.osl_compile(str(source), str(target))
    return target


def main() -> None:
    shader, picture = map(Path, sys.argv[1:])
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.shading_system, scene.cycles.device = "CYCLES", True, "CPU"
    scene.cycles.samples, scene.cycles.use_denoising = SAMPLES, False
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.file_format = "PNG"
    scene.world = bpy.data.worlds.new("grey")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.8, 0.8, 0.8, 1.0)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128, radius=1)
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.ortho_scale = "ORTHO", 2.4
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.collection.objects.link(scene.camera)
    scene.camera.location = (0.0, -6.0, 2.0)
    scene.camera.rotation_euler = scene.camera.location.to_track_quat("Z", "Y").to_euler()
    material = bpy.data.materials.new("coating")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    script = nodes.new("ShaderNodeScript")
    script.mode, script.filepath = "EXTERNAL", str(compiled(shader))
    if not script.outputs:  # this Blender makes no sockets of the shader
        script.outputs.new("NodeSocketShader", "BSDF")
    output = nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(script.outputs[0], output.inputs["Surface"])
    ball.data.materials.append(material)
    scene.render.filepath = str(picture.resolve())
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()
