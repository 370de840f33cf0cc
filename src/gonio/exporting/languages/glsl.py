"""GLSL: what is printed is valid in OpenGL ES 3.00 (WebGL 2) and in every GLSL from 1.30 on."""

from collections.abc import Sequence
from typing import ClassVar

from gonio.exporting.languages.c import rows
from gonio.exporting.languages.shading import OWN, VECTOR, Arguments, Shading

_WORDS = (
    "attribute const uniform varying buffer shared coherent volatile restrict readonly writeonly atomic_uint layout "
    "centroid flat smooth noperspective patch sample break continue do for while switch case default if else "
    "subroutine in out inout float double int void bool true false invariant precise discard return struct lowp "
    "mediump highp precision common partition active asm class union enum typedef template this resource goto inline "
    "noinline public static extern external interface long short half fixed unsigned superp input output filter "
    "sizeof cast namespace using packed main hvec2 hvec3 hvec4 fvec2 fvec3 fvec4 dvec2 dvec3 dvec4 sampler1D "
    "sampler2D sampler3D samplerCube sampler2DRect image1D image2D image3D imageBuffer row_major uint vec2 vec3 vec4 "
    "ivec2 ivec3 ivec4 uvec2 uvec3 uvec4 bvec2 bvec3 bvec4 mat2 mat3 mat4"
)
_FUNCTIONS = (
    "radians degrees sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh pow exp log exp2 log2 sqrt "
    "inversesqrt abs sign floor trunc round roundEven ceil fract mod modf min max clamp mix step smoothstep isnan "
    "isinf fma frexp ldexp length distance dot cross normalize ftransform faceforward reflect refract outerProduct "
    "transpose determinant inverse lessThan greaterThan equal any all not texture dFdx dFdy fwidth noise1 noise2 "
    "noise3 noise4"
)
FUNCTIONS = frozenset(_FUNCTIONS.split())
KEYWORDS = frozenset(_WORDS.split())


class GLSL(Shading):
    """GLSL: constants of a block are plain variables, as ES 3.00 wants constant values for `const`."""

    name = "glsl"
    title = "GLSL"
    suffix = ".glsl"
    reserved = KEYWORDS | FUNCTIONS | OWN
    functions: ClassVar = {"atan2": "atan"}

    def identifier(self, name: str) -> str:
        """Two underscores in a row and a leading `gl_` belong to GLSL."""
        while "__" in name:
            name = name.replace("__", "_")
        return super().identifier(f"v_{name}" if name.startswith("gl_") else name)

    def let(self, name: str, value: str, boolean: bool) -> str:
        """A variable of the block."""
        return f"{'bool' if boolean else 'float'} {name} = {value};"

    def table(self, name: str, numbers: Sequence[float]) -> list[str]:
        """A constant array of the shader."""
        content = rows(numbers, self)
        content[-1] = content[-1].rstrip(",")  # a comma after the last element is an error
        return [f"const float {name}[{len(numbers)}] = float[{len(numbers)}](", *content, ");"]

    def function(self, name: str, arguments: Sequence[str], inside: Sequence[str], result: str) -> list[str]:
        """A function of numbers."""
        given = ", ".join(f"float {a}" for a in arguments)
        return [f"float {name}({given}) {{", *self._body(*inside, f"return {result};"), "}"]

    def gives_number(self, name: str, arguments: Arguments, inside: Sequence[str], result: str) -> list[str]:
        """A function that gives one number."""
        return [f"float {name}({_declared(arguments)}) {{", *self._body(*inside, f"return {result};"), "}"]

    def gives_array(self, name: str, arguments: Arguments, inside: Sequence[str], results: Sequence[str]) -> list[str]:
        """A function that returns an array."""
        kind = f"float[{len(results)}]"
        return [
            f"{kind} {name}({_declared(arguments)}) {{",
            *self._body(*inside, f"return {kind}({', '.join(results)});"),
            "}",
        ]

    def takes_array(self, name: str, size: int, function: str, arguments: Sequence[str]) -> list[str]:
        """A variable."""
        return [f"float {name}[{size}] = {function}({', '.join(arguments)});"]

    def _body(self, *lines: str) -> list[str]:
        return [f"{self.indent}{line}" for line in lines]


def _declared(arguments: Arguments) -> str:
    return ", ".join(f"vec3 {name}" if size == VECTOR else f"float {name}[{size}]" for name, size in arguments)


GLSL_LANGUAGE = GLSL()
