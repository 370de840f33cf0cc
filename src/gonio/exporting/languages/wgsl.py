"""WGSL, the shading language of WebGPU."""

from collections.abc import Sequence

from gonio.exporting.languages.c import rows
from gonio.exporting.languages.language import CALL, Printed
from gonio.exporting.languages.shading import OWN, VECTOR, Arguments, Shading

_WORDS = (
    "alias break case const const_assert continue continuing default diagnostic discard else enable false fn for if "
    "let loop override requires return struct switch true var while NULL Self abstract active alignas alignof as asm "
    "asm_fragment async attribute auto await become cast catch class co_await co_return co_yield coherent "
    "column_major common compile compile_fragment concept const_cast consteval constexpr constinit crate debugger "
    "decltype delete demote demote_to_helper do dynamic_cast enum explicit export extends extern external fallthrough "
    "filter final finally friend from fxgroup get goto groupshared highp impl implements import inline instanceof "
    "interface layout lowp macro macro_rules match mediump meta mod module move mut mutable namespace new nil "
    "noexcept noinline nointerpolation non_coherent noncoherent noperspective null nullptr of operator package "
    "packoffset partition pass patch pixelfragment precise precision premerge priv protected pub public readonly ref "
    "regardless register reinterpret_cast require resource restrict self set shared sizeof smooth snorm static "
    "static_assert static_cast std subroutine super target template this thread_local throw trait try type typedef "
    "typeid typename typeof union unless unorm unsafe unsized use using varying virtual volatile wgsl where with "
    "writeonly yield array atomic bool f16 f32 i32 u32 vec2 vec3 vec4 mat2x2 mat3x3 mat4x4 ptr sampler"
)
_FUNCTIONS = (
    "abs acos acosh asin asinh atan atan2 atanh ceil clamp cos cosh cross degrees determinant distance dot exp exp2 "
    "faceForward floor fma fract frexp inverseSqrt ldexp length log log2 max min mix modf normalize pow quantizeToF16 "
    "radians reflect refract round saturate sign sin sinh smoothstep sqrt step tan tanh transpose trunc select all "
    "any bitcast"
)


class WGSL(Shading):
    """WGSL: a choice is the function `select`, whose value for false comes first."""

    name = "wgsl"
    title = "WGSL"
    suffix = ".wgsl"
    reserved = frozenset((*_WORDS.split(), *_FUNCTIONS.split())) | OWN

    def identifier(self, name: str) -> str:
        """A name does not begin with two underscores."""
        return super().identifier(f"v{name}" if name.startswith("__") else name)

    def select(self, condition: Printed, x: Printed, y: Printed) -> Printed:
        """A call."""
        return f"select({y[0]}, {x[0]}, {condition[0]})", CALL

    def let(self, name: str, value: str, boolean: bool) -> str:
        """A value of the block."""
        return f"let {name}: {'bool' if boolean else 'f32'} = {value};"

    def loop(self, total: str, index: str, size: int, inside: Sequence[str], added: str) -> list[str]:
        """A for loop."""
        body = [f"{self.indent}{line}" for line in (*inside, f"{total} += {added};")]
        head = f"for (var {index}: i32 = 0; {index} < {size}; {index}++) {{"
        return [f"var {total}: f32 = 0.0;", head, *body, "}"]

    def table(self, name: str, numbers: Sequence[float]) -> list[str]:
        """An array of the module."""
        size = len(numbers)
        return [f"var<private> {name}: array<f32, {size}> = array<f32, {size}>(", *rows(numbers, self), ");"]

    def function(self, name: str, arguments: Sequence[str], inside: Sequence[str], result: str) -> list[str]:
        """A function of numbers."""
        given = ", ".join(f"{a}: f32" for a in arguments)
        return [f"fn {name}({given}) -> f32 {{", *self._body(*inside, f"return {result};"), "}"]

    def gives_number(self, name: str, arguments: Arguments, inside: Sequence[str], result: str) -> list[str]:
        """A function that gives one number."""
        return [f"fn {name}({_declared(arguments)}) -> f32 {{", *self._body(*inside, f"return {result};"), "}"]

    def gives_array(self, name: str, arguments: Arguments, inside: Sequence[str], results: Sequence[str]) -> list[str]:
        """A function that returns an array."""
        kind = f"array<f32, {len(results)}>"
        return [
            f"fn {name}({_declared(arguments)}) -> {kind} {{",
            *self._body(*inside, f"return {kind}({', '.join(results)});"),
            "}",
        ]

    def takes_array(self, name: str, size: int, function: str, arguments: Sequence[str]) -> list[str]:  # noqa: ARG002
        """A value."""
        return [f"let {name} = {function}({', '.join(arguments)});"]

    def _body(self, *lines: str) -> list[str]:
        return [f"{self.indent}{line}" for line in lines]


def _declared(arguments: Arguments) -> str:
    return ", ".join(f"{n}: {'vec3<f32>' if size == VECTOR else f'array<f32, {size}>'}" for n, size in arguments)


WGSL_LANGUAGE = WGSL()
