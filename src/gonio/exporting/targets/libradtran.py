"""libRadtran: a table of parameters over wavelength for its option brdf_rpv_file or brdf_ambrals_file.

libRadtran's RPV takes rho0 for the hot spot too (disort's bdref), and a factor for the whole: with rho0 = rc and the
factor r0/rc it is this model for every rc (libRadtran user's guide, brdf_rpv_file).
"""

import numpy as np

from gonio.exporting.heading import heading
from gonio.exporting.source import proved
from gonio.exporting.subject import Subject, Values
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.geometry import Geometry
from gonio.models.lambert import lambert
from gonio.models.rahman1993 import rpv
from gonio.models.wanner1995 import ross_li

EVERYWHERE = (100.0, 100_000.0)  # nm, beyond what libRadtran computes
KERNELS = ("iso", "vol", "geo")
COLUMNS = {rpv: ("rho0", "k", "theta", "scale"), ross_li: KERNELS, lambert: KERNELS}
OPTIONS = {rpv: "brdf_rpv_file", ross_li: "brdf_ambrals_file", lambert: "brdf_ambrals_file"}
QUANTITY = "libRadtran's parameters, from which it computes the reflectance factor, pi f"
FRAME = "wavelengths in nm; libRadtran interpolates the parameters linearly between them"


def make(subject: Subject, request: Request) -> Made:
    """The table, with a row for each wavelength."""
    if subject.model not in COLUMNS:
        raise ValueError(
            f"libRadtran has no surface {subject.model.name}: fit rpv or ross-li, "
            "as in gonio export SCAN --model rpv --to libradtran"
        )
    rows, remarks = _rows(subject)
    option, columns = OPTIONS[subject.model], COLUMNS[subject.model]
    what = f"{request.name}: {subject.model.title}, for libRadtran: {option} {request.out.name}"
    comment = [f"# {line}".rstrip() for line in heading(subject, what, frame=FRAME, quantity=QUANTITY)]
    table = [" ".join(f"{v:.9g}" for v in (nm, *_numbers(subject, values))) for nm, values in rows]
    text = "\n".join([*comment, "#", f"# wavelength {' '.join(columns)}", *table, ""])
    hint = f"in uvspec's input: {option} {request.out.name}, with rte_solver disort or mystic"
    return Made({request.out.name: text}, (hint, *remarks))


def _rows(subject: Subject) -> tuple[list[tuple[float, Values]], tuple[str, ...]]:
    """Wavelengths [nm] with their values."""
    if subject.by == "wavelength" and len(subject.sets) > 1:
        return [(float(label), subject.sets[label]) for label in sorted(subject.sets, key=float)], ()
    values = subject.values
    known = "" if subject.wavelength is None else f", which belong to {subject.wavelength:g} nm"
    alike = f"one set of values{known}, stands for every wavelength from {EVERYWHERE[0]:g} to {EVERYWHERE[1]:g} nm"
    return [(nm, values) for nm in EVERYWHERE], (alike,)


def _numbers(subject: Subject, values: Values) -> tuple[float, ...]:
    if subject.model is ross_li:
        return values["fiso"], values["fvol"], values["fgeo"]
    if subject.model is lambert:
        return values["rho"], 0.0, 0.0
    if values["rc"] <= 0:
        raise ValueError(
            "rc is 0, and libRadtran's RPV has its hot spot from rho0, which cannot be 0: "
            "hold it above 0 in the fit, as by --hold rc=0.01"
        )
    return values["rc"], values["k"], values["theta"], values["r0"] / values["rc"]


def check(subject: Subject, request: Request) -> Proof:
    """The first row read back, in this program's formula; libRadtran is not run."""
    text = request.out.read_text(encoding="utf-8")
    first = next(line for line in text.splitlines() if not line.startswith("#"))
    numbers = [float(v) for v in first.split()[1:]]
    one = subject if len(subject.sets) == 1 else subject.one(min(subject.sets, key=float))

    def run(geometry: Geometry) -> np.ndarray:
        return np.asarray((rpv if subject.model is rpv else ross_li)(geometry, values))

    values = _of_rpv(*numbers) if subject.model is rpv else dict(zip(ross_li.weights, numbers, strict=True))
    how = "libRadtran is not run: the parameters of the file were read back"
    return proved(one, how, run, limit=1e-6)  # nine digits, and kernels that nearly cancel


def _of_rpv(rho0: float, k: float, theta: float, scale: float) -> dict[str, float]:
    return {"r0": rho0 * scale, "k": k, "theta": theta, "rc": rho0}


LIBRADTRAN = Target(
    name="libradtran",
    title="libRadtran",
    suffixes=(".dat", ".txt"),
    writes="a table over wavelength for brdf_rpv_file or brdf_ambrals_file: rpv, ross-li and lambert",
    make=make,
    check=check,
)
