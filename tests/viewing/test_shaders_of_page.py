"""The shaders of the page in a browser: each model equals its NumPy formula, and a table is read as its file is."""

import math

import numpy as np
import pytest

from gonio import catalogue
from gonio.exporting.source import pairs
from gonio.formats.merl import directions
from gonio.geometry import Geometry
from gonio.measured.dataset import make_scan
from gonio.viewing.assembled import in_one_file
from gonio.viewing.session import Opened, Session
from viewing.opened import READY, opened

pytestmark = pytest.mark.xdist_group("pages")

# SwiftShader's exp, sin and pow are right to some 5e-4; the printed formulas lose less than that in single precision.
RTOL = 1e-3
# It is a difference of angles: SwiftShader's acos and atan may be wrong by 4096 units in the last place, as Vulkan lets
# them, and where both directions nearly agree in azimuth more digits are lost.
WORSE = {"oren-nayar": 5e-3}
# A driver takes minutes for the sums within sums of the first; the page draws it from a table.
TABULATED = "modified-beckmann-kirchhoff"
SLOW = ("beckmann-kirchhoff", "exponential-power", "generalised-harvey-shack", "he-torrance", "student-t")
FEWER = 60  # pairs for these

DRAW = """
async ({ text, values, pre, pairs, extra }) => {
  const count = pairs.length / 8;
  const gl = document.createElement("canvas").getContext("webgl2");
  gl.getExtension("EXT_color_buffer_float");
  const shader = (kind, source) => {
    const made = gl.createShader(kind);
    gl.shaderSource(made, source);
    gl.compileShader(made);
    return made;
  };
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `#version 300 es
in vec2 at; void main() { gl_Position = vec4(at, 0.0, 1.0); }`));
  const fragment = shader(gl.FRAGMENT_SHADER, text);
  gl.attachShader(program, fragment);
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return gl.getShaderInfoLog(fragment);
  gl.useProgram(program);
  const texture = (unit, width, height, internal, format, numbers) => {
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, height, 0, format, gl.FLOAT, numbers);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  };
  const place = (name) => gl.getUniformLocation(program, name);
  if (values) gl.uniform1fv(place("brdf_values"), values);
  if (pre?.length && place("brdf_pre")) gl.uniform1fv(place("brdf_pre"), pre);
  const rows = extra ? extra.numbers.length / extra.width : 0;
  if (extra) texture(1, extra.width, rows, gl.R32F, gl.RED, Float32Array.from(extra.numbers));
  if (extra) gl.uniform1i(place("numbers"), 1);
  texture(2, 2, count, gl.RGBA32F, gl.RGBA, Float32Array.from(pairs));
  gl.uniform1i(place("listed"), 2);
  gl.activeTexture(gl.TEXTURE3);
  const target = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, target);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 1, count, 0, gl.RGBA, gl.FLOAT, null);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
  gl.viewport(0, 0, 1, count);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 3, -1, -1, 3]), gl.STATIC_DRAW);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(gl.getAttribLocation(program, "at"), 2, gl.FLOAT, false, 0, 0);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  const read = new Float32Array(4 * count);
  gl.readPixels(0, 0, 1, count, gl.RGBA, gl.FLOAT, read);
  gl.getExtension("WEBGL_lose_context").loseContext();
  return Array.from({ length: count }, (_, k) => read[4 * k]);
}
"""

LISTED = """
out vec4 colour;
uniform sampler2D listed;
void main() {
    int k = int(gl_FragCoord.y);
    colour = vec4(brdf(texelFetch(listed, ivec2(0, k), 0).xyz, texelFetch(listed, ivec2(1, k), 0).xyz));
}
"""


@pytest.fixture(scope="module")
def page(chromium, tmp_path_factory):
    """One page, in one file, with every model."""
    scan = make_scan([30.0, 30.0], [-20.0, 20.0], [0.1, 0.2])
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(in_one_file(Session([Opened("scan", scan)], model="lambert"), list(catalogue)), encoding="utf-8")
    with opened(chromium, path) as shown:
        shown.wait_for_selector(READY)
        yield shown


def listed(geometry, count=None):
    """Pairs of directions as the texture has them: both vectors, each with a number more."""
    vectors = [geometry.x_i, geometry.y_i, geometry.z_i, None, geometry.x_r, geometry.y_r, geometry.z_r, None]
    size = np.size(geometry.z_i)
    columns = [np.zeros(size) if v is None else np.broadcast_to(v, size) for v in vectors]
    return np.stack(columns, axis=1)[:count].astype(np.float32)


def drawn(page, source, given, **more):
    """What the browser computes: a list of numbers, or what it says of a shader that it does not compile."""
    text = page.evaluate(
        "async ({ source, ending }) => { const s = await import('gonio/shading.js');"
        " const whole = source.text ? s.ofModel(source.text) : s.ofTable(...source.table);"
        " return whole.slice(0, whole.indexOf(s.VIEWS)) + ending; }",
        {"source": source, "ending": LISTED},
    )
    found = page.evaluate(DRAW, {"text": text, "pairs": given.ravel().tolist(), **more})
    assert not isinstance(found, str), found
    return np.array(found, dtype=float)


@pytest.mark.parametrize("name", [n for n in catalogue if n != TABULATED])
def test_the_shader_of_a_model_equals_numpy(name, page):
    model = catalogue[name]
    given = listed(pairs(), FEWER if name in SLOW else None)
    values = {p: model.shape[p].default if p in model.shape else 0.5 for p in model.parameters}
    text, pre = page.evaluate(
        "async ({ name, values }) => [await (await import('gonio/source.js')).shader(name),"
        " (await import(`model/${name}.js`)).pre(values)]",
        {"name": name, "values": list(values.values())},
    )
    found = drawn(page, {"text": text}, given, values=list(values.values()), pre=pre)
    both = given.astype(float)
    expected = np.asarray(model(Geometry(*both[:, :3].T, *both[:, 4:7].T), values), dtype=float)
    # Grazing directions are those that a view draws in its last pixel: single precision has no digits for them.
    shown = (both[:, 2] > 0.01) & (both[:, 6] > 0.01)
    rtol = WORSE.get(name, RTOL)
    np.testing.assert_allclose(found[shown], expected[shown], rtol=rtol, atol=RTOL * 1e-3 * np.nanmax(expected[shown]))


@pytest.mark.parametrize(("shape", "around"), [((9, 8, 12), math.pi), ((5, 4, 360), 2 * math.pi)])
def test_the_shader_of_a_table_finds_each_cell(shape, around, page):
    """At the middle of a cell the published reader returns its number (see gonio.formats.merl); so does the shader."""
    at = directions(shape)
    above = (at["theta_i"].values < 89) & (at["theta_r"].values < 89)
    geometry = Geometry.from_degrees(*(at[name].values[above] for name in ("theta_i", "theta_r", "phi")))
    numbers = np.arange(math.prod(shape), dtype=float).reshape(shape)
    padded = np.zeros(-(-numbers.size // 2048) * 2048)
    padded[: numbers.size] = numbers.ravel()
    extra = {"width": 2048, "numbers": padded.tolist()}
    found = drawn(page, {"table": [list(shape), 2048, around]}, listed(geometry), extra=extra)
    np.testing.assert_array_equal(found, numbers[above])
