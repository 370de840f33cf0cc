"""OSL: a shader that shows the surface in one directional light, as renderers let OSL mix only lobes of their own."""

import json
import math

from gonio.exporting.languages.osl import OSL_LANGUAGE
from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.exporting.targets.shaders.functions import Functions
from gonio.exporting.targets.shaders.glsl import commented
from gonio.exporting.targets.shaders.proof import formula_alone
from gonio.outside import printable
from gonio.symbols.formula import formula_of

PREVIEW = (
    "The shader shows one directional light without shadows and without light from other surfaces: OSL has no BRDFs of "
    "one's own, only the lobes of its renderer"
)
# The tangent is that of the surface's first coordinate, and any where a surface has none.
_BODY = """\
    vector frame_z = normalize(N);
    vector view = dot(I, frame_z) > 0.0 ? I : -I; // Cycles has I from the surface, the specification to it
    vector frame_x = dPdu - dot(dPdu, frame_z) * frame_z;
    if (length(frame_x) < 1e-6) {{
        frame_x = abs(frame_z[0]) < 0.9 ? vector(1.0, 0.0, 0.0) : vector(0.0, 1.0, 0.0);
        frame_x = frame_x - dot(frame_x, frame_z) * frame_z;
    }}
    frame_x = normalize(frame_x);
    vector frame_y = cross(frame_z, frame_x);
    vector to_light = normalize(light_direction);
    vector to_view = normalize(view);
    vector w_i = vector(dot(to_light, frame_x), dot(to_light, frame_y), dot(to_light, frame_z));
    vector w_r = vector(dot(to_view, frame_x), dot(to_view, frame_y), dot(to_view, frame_z));
    float radiance = 0.0;
    if (w_i[2] > 0.0 && w_r[2] > 0.0) {{
        float values[{count}] = {{ {values} }};
        radiance = {name}(values, w_i, w_r) * w_i[2] * irradiance;
    }}
    BSDF = radiance * emission();"""


def lines_of(subject: Subject, name: str) -> list[str]:
    """The shader NAME, whose parameters are those of the model, and its functions."""
    parameters = subject.model.parameters
    values = f"values[{len(parameters)}]"
    places = {p: f"values[{k}]" for k, p in enumerate(parameters)}
    functions = Functions(
        OSL_LANGUAGE,
        formula_of(subject.model),
        f"{name.rstrip('_')}_brdf",
        places,
        ((values.partition("[")[0], len(parameters)),),
        prepares=True,
    )
    names = {p: OSL_LANGUAGE.identifier(p) for p in parameters}
    return [
        *functions.lines(),
        "",
        f"shader {OSL_LANGUAGE.identifier(name)}(",
        *(f"    {_parameter(subject, p, names[p])}," for p in parameters),
        '    vector light_direction = vector(0.0, 0.0, 1.0) [[ string help = "to the light" ]],',
        '    float irradiance = 1.0 [[ string help = "of a surface that faces the light" ]],',
        "    output closure color BSDF = 0)",
        "{",
        *_BODY.format(count=len(parameters), values=", ".join(names.values()), name=functions.name).splitlines(),
        "}",
    ]


def _parameter(subject: Subject, parameter: str, name: str) -> str:
    shape = subject.model.shape.get(parameter)
    help_ = printable(shape.help if shape else "weight") + f", {subject.unit(parameter)}"
    hints = [f"string help = {json.dumps(help_)}"]
    if shape:
        limits = {"min": shape.lower, "max": shape.upper}
        hints += [f"float {n} = {OSL_LANGUAGE.literal(v)}" for n, v in limits.items() if math.isfinite(v)]
    return f"float {name} = {OSL_LANGUAGE.literal(subject.values[parameter])} [[ {', '.join(hints)} ]]"


def make(subject: Subject, request: Request) -> Made:
    """The content of the file."""
    what = f"{request.name}: {subject.model.title}, as OSL: the surface in one directional light."
    lines = [*commented(subject, what), "", *lines_of(subject, request.name)]
    return Made({request.out.name: "\n".join(lines) + "\n"}, (PREVIEW,))


def check(subject: Subject, request: Request) -> Proof:  # noqa: ARG001
    """Nothing here runs OSL: its formula is."""
    return formula_alone(subject, "nothing here runs OSL")


OSL_TARGET = Target(
    name="osl",
    title="OSL",
    suffixes=(".osl",),
    writes="a shader for Blender's Cycles and others: the surface in one directional light",
    make=make,
    check=check,
)
