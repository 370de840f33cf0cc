"""A surface scatter DLL for OpticStudio, as C: any isotropic model, exact, drawn by its own samplers.

OpticStudio hands a DLL an array of numbers, of which it has to change a few (support.zemax.com, How to create a user
defined scattering function; How to write user-defined sources and scatter functions in Fortran). There the specular ray
comes in and the scattered ray goes out, with an energy relative to what can be scattered: here BRDF cos(theta_r) over
the probability density of the direction, whose mean is the reflectance.
"""

import ctypes
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gonio.exporting.heading import heading
from gonio.exporting.languages.c import C_LANGUAGE, commented
from gonio.exporting.languages.language import Writer
from gonio.exporting.mixture import Mixture, mixture
from gonio.exporting.source import pairs
from gonio.exporting.stand_in import REPORTED, reflectance
from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.exporting.targets.c import compiled, compiler, source
from gonio.files import temporary_folder
from gonio.geometry import Geometry
from gonio.model import Sampler, Term
from gonio.optics.diffuse import lambertian
from gonio.optics.sampling import COSINE
from gonio.outside import printable
from gonio.symbols.formula import INCIDENCE, NUMBERS, REFLECTION, density_of, draw_of

Array = npt.NDArray[np.float64]

SIZE = 60  # numbers of the array that OpticStudio hands over, for a check
CALLS = 2000
LIMIT = 1e-9  # a relative error: a lobe of 0.001 rad loses six digits of a direction's last
TURNED = 37.0  # deg, by which both directions are turned to see whether a model minds
STEEPEST = 75.0  # deg of incidence, up to which the largest energy of a ray is looked for

_NOTES = (
    "A surface scatter DLL for OpticStudio. Compiled and tested outside OpticStudio: gonio compiles this file, calls",
    "it many times, and compares directions and energies with the model. Not verified, as it needs OpticStudio:",
    "that it loads there, importance sampling, sequential mode. Compare what a detector reads with the reflectance.",
    "",
    "  {gcc}",
    "  cl /O2 /LD {file}     in a 64-bit prompt of Visual Studio; not tried",
    "",
    "Put the DLL into Documents/Zemax/DLL/SurfaceScatter. Object Properties, Coat/Scatter: Scatter Model User",
    "Defined, Scatter Fraction 1, this DLL; the object reflects all (MIRROR), as the energies hold the reflectance.",
    "The DLL has no parameters and keeps nothing between calls, so that threads do not meet.",
    "It reflects: a ray that is refracted would be scattered as if it were reflected.",
)


def make(subject: Subject, request: Request) -> Made:
    """The content of the C file."""
    _refuse_brushed(subject)
    found = mixture(subject)
    highest, least = _energies(subject, found)
    told: tuple[str, ...] = (
        "compiled and tested outside OpticStudio: loading it there is yours to try",
        f"the energy of a single ray is up to {highest:.3g} times what comes in, and their mean is the reflectance",
    )
    if found.unsampled:
        told += (f"{', '.join(found.unsampled)} is drawn by the cosine law alone: a narrow lobe needs many rays",)
    if least < 0:
        told += ("the model is negative in some directions, and no ray has a negative energy: it is 0 there",)
    reflected = {angle: reflectance(subject.model, subject.values, angle) for angle in subject.theta_i or REPORTED}
    angle, most = max(reflected.items(), key=lambda item: item[1])
    if most > 1 + 1e-3:
        told += (f"the model reflects {most:.4g} of the light at theta_i {angle:g} deg: more than it gets",)
    text = "\n".join(_lines(subject, request, found, told[1:]))
    return Made(
        {request.out.name: f"{text}\n"}, told, {"largest_relative_energy": highest, "highest_reflectance": most}
    )


def _refuse_brushed(subject: Subject) -> None:
    """ValueError for a model that depends on where the surface's x axis is, which OpticStudio does not tell."""
    g = pairs()
    angle = np.radians(TURNED)

    def turned(x: Array, y: Array) -> tuple[Array, Array]:
        return np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y

    other = Geometry(*turned(g.x_i, g.y_i), g.z_i, *turned(g.x_r, g.y_r), g.z_r)
    here, there = (np.asarray(subject.brdf(x)) for x in (g, other))
    if not np.allclose(here, there, rtol=1e-6, atol=1e-12 * float(np.max(here))):
        raise ValueError(
            f"{subject.model.name} reflects otherwise when the surface is turned, and OpticStudio does not tell a DLL "
            "how it lies: give equal widths along and across, or write a table of the scan (gonio convert --to zemax)"
        )


def _energies(subject: Subject, found: Mixture) -> tuple[float, float]:
    """The largest relative energy of a ray at the directions of a grid, and the least, which may be negative."""
    theta_i, theta_r, phi = np.meshgrid(
        np.linspace(0, STEEPEST, 6), np.linspace(0, 89, 90), np.linspace(0, 180, 19), indexing="ij"
    )
    g = Geometry.from_degrees(theta_i, theta_r, phi)
    energies = np.asarray(subject.brdf(g)) * g.z_r / found.density(g)
    return float(np.max(energies)), float(np.min(energies))


def _lines(subject: Subject, request: Request, found: Mixture, told: Sequence[str]) -> list[str]:
    name, file, dll = request.name, printable(request.out.name), printable(request.out.stem)
    gcc = f"x86_64-w64-mingw32-gcc -O2 -shared -static-libgcc -o {dll}.dll {file}"
    notes = [line.format(gcc=gcc, file=file) for line in _NOTES]
    comment = [*heading(subject, f"{name}: {subject.model.title}, for OpticStudio."), "", *notes, "", *told]
    formula = source(subject, name, request.out.stem)
    begins = formula.index(" */") + 1
    writer = Writer(C_LANGUAGE, f"{name}_draw")
    samplers = [(lobe.sampler, lobe.term, found.shape(lobe), lobe.share) for lobe in found.lobes]
    functions: list[str] = []
    for k, (sampler, term, shape, _) in enumerate([*samplers, (COSINE, lambertian, {}, found.cosine)], start=1):
        functions += _sampler(writer, f"{name}_{k}", sampler, term, shape)
    return [
        *commented(comment),
        f"#define {name.upper()}_API static inline",
        *formula[begins:],
        "",
        "#include <stdint.h>",
        "#include <string.h>",
        "",
        *writer.shared(),
        *functions,
        *_mixed(name, [share for *_, share in samplers], found.cosine),
        *_RANDOM.replace("NAME", name).splitlines(),
        *_ENTRY.replace("NAME", name).splitlines(),
    ]


def _sampler(writer: Writer, name: str, sampler: Sampler, term: Term, shape: dict[str, float]) -> list[str]:
    """NAME_draw and NAME_density of one sampler."""
    drawn, density = draw_of(sampler, term), density_of(sampler, term)
    lines = []
    for formula, signature, into in (
        (drawn, f"void {name}_draw(const double w_i[3], const double u[2], double w_r[3])", "w_r"),
        (density, f"double {name}_density(const double w_i[3], const double w_r[3])", ""),
    ):
        statements, results = writer.whole(formula)
        places = {n: f"w_i[{k}]" for k, n in enumerate(INCIDENCE)} | {n: f"u[{k}]" for k, n in enumerate(NUMBERS)}
        if not into:
            places |= {n: f"w_r[{k}]" for k, n in enumerate(REFLECTION)}
        places |= {n: C_LANGUAGE.literal(value) for n, value in shape.items()}
        used = {str(node.value) for node in formula.nodes if node.op == "input"}
        body = [f"const double {C_LANGUAGE.identifier(n)} = {places[n]};" for n in places if n in used]
        body += statements
        body += [f"{into}[{k}] = {r};" for k, r in enumerate(results)] if into else [f"return {results[0]};"]
        unused = [a for a in ("w_i", *(("u",) if into else ("w_r",))) if not any(f"{a}[" in line for line in body)]
        body[0:0] = [f"(void){a};" for a in unused]
        lines += ["", f"static inline {signature} {{", *(f"    {line}" for line in body), "}"]
    return lines


def _mixed(name: str, shares: Sequence[float], cosine: float) -> list[str]:
    """NAME_drawn and NAME_drawn_density of all samplers in their shares; the cosine law comes last."""
    last = len(shares) + 1
    literal = C_LANGUAGE.literal
    lines, reached = [], 0.0
    for k, share in enumerate(shares, start=1):
        reached += share
        lines.append(f"    if (u[0] < {literal(reached)}) {{ {name}_{k}_draw(w_i, u + 1, w_r); return; }}")
    densities = [f"{literal(s)} * {name}_{k}_density(w_i, w_r)" for k, s in enumerate((*shares, cosine), start=1)]
    return [
        "",
        "/* A direction from three numbers in 0..1, and its probability density, 1/sr. */",
        f"static inline void {name}_drawn(const double w_i[3], const double u[3], double w_r[3]) {{",
        *lines,
        f"    {name}_{last}_draw(w_i, u + 1, w_r);",
        "}",
        "",
        f"static inline double {name}_drawn_density(const double w_i[3], const double w_r[3]) {{",
        f"    return {' + '.join(densities)};",
        "}",
    ]


_RANDOM = """
/* Random numbers from the seed of the call: Steele, Lea and Flood's splitmix64 (OOPSLA 2014). */
static inline uint64_t NAME_mixed(uint64_t z) {
    z += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

static inline uint64_t NAME_stirred(uint64_t state, double number) {
    uint64_t bits;
    memcpy(&bits, &number, sizeof bits);
    return NAME_mixed(state ^ bits);
}

static inline double NAME_uniform(uint64_t *state) {
    *state = NAME_mixed(*state);
    return (double)(*state >> 11) / 9007199254740992.0;
}
"""

_ENTRY = """
#ifdef _WIN32
#define NAME_EXPORT __declspec(dllexport)
#else
#define NAME_EXPORT
#endif

NAME_EXPORT int UserScatterDefinition(double *data);
NAME_EXPORT int UserParamNames(char *data);

/* data[4..6]: direction of the specular ray, and of the scattered one on return; data[7..9]: normal of the surface;
 * data[10]: 1 on return, the ray is scattered; data[12]: its relative energy on return; data[16]: random seed.
 */
NAME_EXPORT int UserScatterDefinition(double *data) {
    double n[3], s[3], along[3], across[3], w_i[3], w_r[3], u[3];
    double normal = 0.0, specular = 0.0, cosine = 0.0, energy = 0.0, length = 0.0;
    for (int k = 0; k < 3; ++k) {
        normal += data[7 + k] * data[7 + k];
        specular += data[4 + k] * data[4 + k];
    }
    for (int k = 0; k < 3; ++k) {
        n[k] = data[7 + k] / sqrt(normal);
        s[k] = data[4 + k] / sqrt(specular);
        cosine += n[k] * s[k];
    }
    if (cosine < 0.0) { /* the normal may point to either side */
        for (int k = 0; k < 3; ++k) n[k] = -n[k];
        cosine = -cosine;
    }
    const double sign = n[2] < 0.0 ? -1.0 : 1.0; /* a frame about the normal: Duff et al., JCGT 6(1) (2017) */
    const double a = -1.0 / (sign + n[2]), b = n[0] * n[1] * a;
    along[0] = 1.0 + sign * n[0] * n[0] * a; along[1] = sign * b; along[2] = -sign * n[0];
    across[0] = b; across[1] = sign + n[1] * n[1] * a; across[2] = -n[1];
    w_i[0] = w_i[1] = 0.0;
    w_i[2] = cosine;
    for (int k = 0; k < 3; ++k) {
        w_i[0] -= s[k] * along[k];
        w_i[1] -= s[k] * across[k];
    }
    uint64_t state = NAME_mixed(0);
    state = NAME_stirred(state, data[16]);
    for (int k = 1; k < 10; ++k) state = NAME_stirred(state, data[k]); /* seeds may repeat, rays do not */
    for (int k = 0; k < 3; ++k) u[k] = NAME_uniform(&state);
    NAME_drawn(w_i, u, w_r);
    if (w_r[2] > 0.0) energy = NAME(w_i, w_r) * w_r[2] / NAME_drawn_density(w_i, w_r);
    if (!(energy > 0.0) || energy > 1e300) { /* light that is lost below the horizon: a ray without energy */
        energy = 0.0;
        w_r[0] = -w_i[0]; w_r[1] = -w_i[1]; w_r[2] = w_i[2];
    }
    for (int k = 0; k < 3; ++k) {
        data[4 + k] = w_r[0] * along[k] + w_r[1] * across[k] + w_r[2] * n[k];
        length += data[4 + k] * data[4 + k];
    }
    for (int k = 0; k < 3; ++k) data[4 + k] /= sqrt(length);
    data[10] = 1.0;
    data[12] = energy;
    return 0;
}

/* The names of the parameters in the dialog: there are none. */
NAME_EXPORT int UserParamNames(char *data) {
    data[0] = '\\0';
    return 0;
}
"""


def scattered(library: Path, rays: Array, seeds: Array) -> tuple[Array, Array]:
    """What the library gives for specular rays (n, 3) at the normal z: directions (n, 3) and relative energies (n,)."""
    run = ctypes.CDLL(str(library)).UserScatterDefinition
    run.restype, run.argtypes = ctypes.c_int, [ctypes.c_void_p]
    data = np.zeros((len(rays), SIZE))
    data[:, 0], data[:, 4:7], data[:, 9], data[:, 16] = SIZE, rays, 1.0, seeds
    start, step = data.ctypes.data, data.strides[0]
    for k in range(len(rays)):
        if run(start + k * step) or data[k, 10] != 1:
            raise ValueError(f"{library}: UserScatterDefinition does not scatter ray {k}")
    return data[:, 4:7], data[:, 12]


def check(subject: Subject, request: Request) -> Proof:
    """The written file, compiled and called: the energies against those of the model and of the mixture's density."""
    if not (program := compiler()):
        raise ValueError(f"{request.out}: no C compiler is here to prove it with: install gcc, or leave --check out")
    random = np.random.default_rng(5)
    z, azimuth = random.uniform(0.1, 1.0, CALLS), random.uniform(0, 2 * np.pi, CALLS)
    sine = np.sqrt(1 - z**2)
    rays = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), z], axis=1)
    with temporary_folder() as folder:
        library = compiled(program, request.out, folder / "scatter.so")
        directions, energies = scattered(library, rays, np.arange(CALLS, dtype=float))
    g = Geometry(-rays[:, 0], -rays[:, 1], rays[:, 2], *directions.T)
    kept = energies > 0
    expected = np.asarray(subject.brdf(g)) * g.z_r / mixture(subject).density(g)
    error = float(np.max(np.abs(energies / expected - 1)[kept])) if kept.any() else np.inf
    how = f"compiled by {Path(program).name} and called {CALLS} times; {np.sum(~kept)} rays were lost at the horizon"
    return Proof(how, error, LIMIT)


ZEMAX_DLL = Target(
    name="zemax-dll",
    title="a scatter DLL of OpticStudio",
    suffixes=(".c",),
    writes="C of a surface scatter DLL, exact and sampled; compiled and tested outside OpticStudio",
    make=make,
    check=check,
)
