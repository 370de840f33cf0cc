"""OSL, the Open Shading Language of Blender's Cycles, Arnold and others."""

from collections.abc import Sequence

from gonio.exporting.languages.c import rows
from gonio.exporting.languages.shading import OWN, VECTOR, Arguments, Shading

_WORDS = (
    "and break closure color continue do else emit float for if illuminance illuminate int matrix normal not or "
    "output point public return string struct vector void while bool case catch char class const delete default "
    "double enum extern false friend goto inline long new operator private protected short signed sizeof static "
    "switch template this throw true try typedef uniform union unsigned varying virtual volatile shader surface "
    "displacement volume P I N Ng u v dPdu dPdv Ps time dtime dPdtime Ci M_PI M_E"
)
_FUNCTIONS = (
    "degrees radians cos sin tan asin acos atan atan2 sincos sinh cosh tanh pow exp exp2 expm1 log log2 log10 logb "
    "sqrt inversesqrt cbrt hypot abs fabs sign floor ceil round trunc fmod mod min max clamp mix select isnan isinf "
    "isfinite erf erfc cross dot length distance normalize faceforward reflect refract fresnel rotate transform noise "
    "step linearstep smoothstep luminance emission diffuse area Dx Dy Dz filterwidth calculatenormal"
)
_CLOSURES = (
    "absorption ambient_occlusion anisotropic_vdf ashikhmin_velvet background base bssrdf conductor_bsdf debug "
    "dielectric_bsdf diffuse diffuse_ramp diffuse_toon draine fournier_forand glossy_toon hair_chiang hair_huang "
    "henyey_greenstein holdout layer medium_vdf microfacet oren_nayar phong phong_ramp ray_portal_bsdf rayleigh "
    "reflection refraction sheen sheen_bsdf subsurface top translucent transparent uniform_edf ward"
)
# Names of the shader that is written.
_SHADER = "light_direction irradiance BSDF view to_light to_view radiance frame_x frame_y frame_z"


class OSL(Shading):
    """OSL: it has no constants outside functions, and truth values are whole numbers."""

    name = "osl"
    title = "OSL"
    suffix = ".osl"
    reserved = frozenset((*_WORDS.split(), *_FUNCTIONS.split(), *_CLOSURES.split(), *_SHADER.split())) | OWN
    tables_are_local = True

    def literal(self, value: float | bool) -> str:
        """Truth values are numbers."""
        return str(int(value)) if isinstance(value, bool) else super().literal(value)

    def let(self, name: str, value: str, boolean: bool) -> str:
        """A variable."""
        return f"{'int' if boolean else 'float'} {name} = {value};"

    def table(self, name: str, numbers: Sequence[float]) -> list[str]:
        """An array of a function."""
        content = rows(numbers, self)
        content[-1] = content[-1].rstrip(",")
        return [f"float {name}[{len(numbers)}] = {{", *content, "};"]

    def function(self, name: str, arguments: Sequence[str], inside: Sequence[str], result: str) -> list[str]:
        """A function of numbers."""
        given = ", ".join(f"float {a}" for a in arguments)
        return [f"float {name}({given}) {{", *self._body(*inside, f"return {result};"), "}"]

    def gives_number(self, name: str, arguments: Arguments, inside: Sequence[str], result: str) -> list[str]:
        """A function that gives one number."""
        return [f"float {name}({_declared(arguments)}) {{", *self._body(*inside, f"return {result};"), "}"]

    def gives_array(self, name: str, arguments: Arguments, inside: Sequence[str], results: Sequence[str]) -> list[str]:
        """A function that fills an array, as none is returned."""
        given = ", ".join(filter(None, (_declared(arguments), f"output float result[{len(results)}]")))
        written = [f"result[{k}] = {value};" for k, value in enumerate(results)]
        return [f"void {name}({given}) {{", *self._body(*inside, *written), "}"]

    def takes_array(self, name: str, size: int, function: str, arguments: Sequence[str]) -> list[str]:
        """A variable that the function fills."""
        return [f"float {name}[{size}];", f"{function}({', '.join((*arguments, name))});"]

    def _body(self, *lines: str) -> list[str]:
        return [f"{self.indent}{line}" for line in lines]


def _declared(arguments: Arguments) -> str:
    return ", ".join(f"vector {name}" if size == VECTOR else f"float {name}[{size}]" for name, size in arguments)


OSL_LANGUAGE = OSL()
