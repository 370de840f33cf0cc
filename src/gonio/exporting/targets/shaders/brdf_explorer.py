"""Disney's BRDF Explorer: a `.brdf` file, whose sliders are the parameters of the model.

The program (github.com/wdas/brdf, src/brdf/BRDFBase.cpp) puts the shader into templates of its own, in GLSL 1.30 or
4.10; a port to the web does so in GLSL ES 3.00. It leaves out lines that begin with `#`, also in the shader.
"""

import math
from collections.abc import Iterator

from gonio.exporting.languages.glsl import FUNCTIONS, GLSL_LANGUAGE
from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.exporting.targets.shaders.functions import Functions
from gonio.exporting.targets.shaders.glsl import commented
from gonio.exporting.targets.shaders.proof import proof_of
from gonio.symbols.formula import formula_of

CALL = "BRDF(w_i, w_r, vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0)).x"
# What the templates declare beside the shader, which a slider cannot be called.
_TEMPLATES = (
    "incidentVector incidentTheta incidentPhi brightness gamma exposure useNDotL useLogPlot phiD thetaD thetaH "
    "nSamples sampleMultOn colorMask samplingMode passNumber stepSize totalSamples renderWithIBL useIBLImportance "
    "useMIS useBRDFImportance envCube envRotMatrix envRotMatrixInverse probTex marginalProbTex texDims "
    "projectionMatrix modelViewMatrix showChroma useThetaHSquared worldSpaceVert eyeSpaceVert vtx_position vtx_normal "
    "texCoord fragColor albedoData lightDistanceFromCenter PI_ RGB2L Sqr rotate rotate_vector modifyLog rand hash "
    "BRDF main esNormal esTangent esBitangent viewVec tsSampleDir tsViewVec iSamples fSamples fInvSamples w_i w_r"
)
TAKEN = frozenset(_TEMPLATES.split()) | FUNCTIONS


def slider(parameter: str) -> str:
    """What the slider of a parameter is called, which is a name in the shader."""
    name = GLSL_LANGUAGE.identifier(parameter)
    return f"{name}_" if name in TAKEN else name


def sliders(subject: Subject) -> Iterator[tuple[str, float, float, float]]:
    """Name, smallest, largest and first value of every slider: bounds of shape parameters, twice a weight or 1."""
    for parameter in subject.model.parameters:
        value = subject.values[parameter]
        shape = subject.model.shape.get(parameter)
        lower, upper = (shape.lower, shape.upper) if shape else (min(0.0, 2 * value), max(1.0, 2 * value))
        widest = max(1.0, 10 * abs(value))  # a slider has two ends
        lower, upper = (bound if math.isfinite(bound) else math.copysign(widest, bound) for bound in (lower, upper))
        yield slider(parameter), lower, upper, value


def shader_of(subject: Subject, name: str) -> list[str]:
    """The function BRDF(L, V, N, X, Y), and what it calls."""
    known = GLSL_LANGUAGE.identifier(name)
    known = f"{known}_brdf" if known in (*TAKEN, *map(slider, subject.model.parameters)) else known
    places = {p: slider(p) for p in subject.model.parameters}
    return [
        *Functions(GLSL_LANGUAGE, formula_of(subject.model), known, places, prepares=True).lines(),
        "",
        "vec3 BRDF(vec3 L, vec3 V, vec3 N, vec3 X, vec3 Y) {",
        "    vec3 w_light = vec3(dot(L, X), dot(L, Y), dot(L, N));",
        "    vec3 w_view = vec3(dot(V, X), dot(V, Y), dot(V, N));",
        f"    return vec3({known}(w_light, w_view));",
        "}",
    ]


def make(subject: Subject, request: Request) -> Made:
    """The content of the file."""
    what = f"{request.name}: {subject.model.title}, for Disney's BRDF Explorer."
    renamed = [p for p in subject.model.parameters if slider(p) != p]
    lines = [
        "analytic",
        "",
        *commented(subject, what, "#"),
        "",
        "::begin parameters",
        *(f"float {name} {lower:.9g} {upper:.9g} {value:.9g}" for name, lower, upper, value in sliders(subject)),
        "::end parameters",
        "",
        "::begin shader",
        "",
        *shader_of(subject, request.name),
        "",
        "::end shader",
    ]
    told = f"the program has another use for {', '.join(renamed)}: these sliders have an underscore more"
    remarks = (told,) if renamed else ()
    return Made({request.out.name: "\n".join(lines) + "\n"}, remarks)


def check(subject: Subject, request: Request) -> Proof:
    """The shader of the file, compiled and run where that is possible, with every slider where it begins."""
    text = request.out.read_text(encoding="utf-8")
    shader = text.partition("::begin shader\n")[2].partition("::end shader")[0]
    return proof_of(subject, shader, CALL, {name: value for name, _, _, value in sliders(subject)})


BRDF_EXPLORER = Target(
    name="brdf-explorer",
    title="Disney's BRDF Explorer",
    suffixes=(".brdf",),
    writes="an analytic BRDF with a slider for every parameter",
    make=make,
    check=check,
)
