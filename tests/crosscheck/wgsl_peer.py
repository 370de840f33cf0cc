"""WGSL modules compiled by wgpu (naga) and run: the values of every model.

    python tests/crosscheck/wgsl_peer.py FOLDER     writes tests/reference/peers/wgsl.json

FOLDER is what wgsl_files.py wrote. Knows nothing of gonio. Needs a driver of Vulkan or OpenGL, such as Mesa's llvmpipe
(Debian: mesa-vulkan-drivers, or libegl1 and libgl1-mesa-dri).
"""

import platform
import sys
from pathlib import Path

import numpy as np
import peers
import wgpu

_MAIN = """
@group(0) @binding(0) var<storage, read> given: array<f32>;
@group(0) @binding(1) var<storage, read_write> found: array<f32>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = id.x;
    if (k < arrayLength(&found)) {
        let light = vec3<f32>(given[6u * k], given[6u * k + 1u], given[6u * k + 2u]);
        let view = vec3<f32>(given[6u * k + 3u], given[6u * k + 4u], given[6u * k + 5u]);
        found[k] = coating(light, view);
    }
}
"""


def run(device, module, rows):
    """The value of a module for each pair of directions."""
    usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
    given = device.create_buffer_with_data(data=rows.tobytes(), usage=usage)
    found = device.create_buffer(size=4 * len(rows), usage=usage)
    shader = device.create_shader_module(code=module + _MAIN)
    pipeline = device.create_compute_pipeline(layout="auto", compute={"module": shader, "entry_point": "main"})
    entries = [{"binding": k, "resource": {"buffer": b}} for k, b in enumerate((given, found))]
    group = device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries)
    encoder = device.create_command_encoder()
    work = encoder.begin_compute_pass()
    work.set_pipeline(pipeline)
    work.set_bind_group(0, group)
    work.dispatch_workgroups((len(rows) + 63) // 64)
    work.end()
    device.queue.submit([encoder.finish()])
    return np.frombuffer(device.queue.read_buffer(found), dtype="f4")


def main(folder):
    adapter = wgpu.gpu.request_adapter_sync(power_preference="low-power")
    device = adapter.request_device_sync()
    rows = np.load(folder / "pairs.npy")
    columns = {"pairs": [[float(f"{v:.9g}") for v in row] for row in rows.tolist()]}
    for file in sorted(folder.glob("*.wgsl")):
        values = run(device, file.read_text(encoding="utf-8"), rows)
        columns[file.stem] = [float(f"{v:.9g}") for v in values.tolist()]
    about = {
        "program": f"wgpu {wgpu.__version__} (naga)",
        "device": f"{adapter.info['device']}, {adapter.info['backend_type']}",
        "python": platform.python_version(),
        "quantity": "BRDF in 1/sr for the vectors to the light and to the viewer in `pairs`, in single precision",
    }
    peers.write("wgsl.json", about, columns, {})


if __name__ == "__main__":
    main(Path(sys.argv[1]))
