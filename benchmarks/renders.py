"""Two measured surfaces rendered by Mitsuba 3 with the steps of docs/howto/mitsuba.md, and the light that they reflect.

    python benchmarks/renders.py model FOLDER      with gonio: the reflectance of each fitted model
    python benchmarks/renders.py pictures FOLDER   with Mitsuba: docs/images, renders.json, and the table of the page

FOLDER holds the fits and the files that `gonio fit` and `gonio export` wrote (make renders).
"""

import datetime
import importlib
import json
import platform
import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "howto" / "mitsuba.md"
SURFACES = {"anoblack-nite": "AnoBlack NiTE", "starlink-array": "Starlink solar array"}
ANGLES = (0.0, 45.0, 75.0, 85.0)
SAMPLES = 1_000_000


def model(folder):
    """The directional-hemispherical reflectance of each fit, and its standard error."""
    from gonio.exporting.subject import of_solution
    from gonio.fitting.solution import Solution
    from gonio.sampling import hemispherical_reflectance

    found = {}
    for name in SURFACES:
        subject = of_solution(Solution.load(folder / name / "solution.nc"))
        estimates = [hemispherical_reflectance(subject.model, subject.values, t, SAMPLES) for t in ANGLES]
        found[name] = {"model": subject.model.name, "reflectance": [[e.value, e.standard_error] for e in estimates]}
    (folder / "renders.json").write_text(json.dumps(found), encoding="utf-8")


def pictures(folder):
    """The pictures, and the reflectance in Mitsuba."""
    import drjit as dr
    import mitsuba as mi

    sys.path.insert(0, str(folder))
    known, kept = json.loads((folder / "renders.json").read_text(encoding="utf-8")), {}
    for name, title in SURFACES.items():
        module = f"{name.replace('-', '_')}_mitsuba"
        picture = ROOT / "docs" / "images" / f"mitsuba-{name}.png"
        exec(scene_of_the_page().replace("coating_mitsuba", module).replace("ball.png", str(picture)), {})
        bsdf = mi.load_dict({"type": importlib.import_module(module).NAME})
        found = [reflectance(bsdf, theta, seed) for seed, theta in enumerate(ANGLES)]
        kept[title] = known[name] | {"in Mitsuba": found}
    about = {
        "date": datetime.date.today().isoformat(),
        "machine": f"{platform.machine()}, {platform.system()}",
        "mitsuba": mi.__version__,
        "drjit": dr.__version__,
        "theta_i": ANGLES,
    }
    text = json.dumps({"about": about, "surfaces": kept}, indent=1)
    (ROOT / "benchmarks" / "renders.json").write_text(text + "\n", encoding="utf-8")
    page = PAGE.read_text(encoding="utf-8")
    between = re.compile(r"(?<=<!-- renders -->\n\n).*?(?=<!-- end of renders -->)", re.DOTALL)
    PAGE.write_text(between.sub(lambda _: table(kept), page), encoding="utf-8")


def scene_of_the_page():
    """The block of Python of the page that writes a picture."""
    blocks = re.findall(r"```python[^\n]*\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    return next(block for block in blocks if "write_bitmap" in block)


def reflectance(bsdf, theta, seed):
    """Mean weight of light that is sent in at an angle [deg], and its standard error."""
    import drjit as dr
    import mitsuba as mi

    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, SAMPLES)
    si = dr.zeros(mi.SurfaceInteraction3f, SAMPLES)
    si.wi = mi.Vector3f(dr.sin(dr.deg2rad(theta)), 0, dr.cos(dr.deg2rad(theta)))
    _, weight = bsdf.sample(mi.BSDFContext(mi.TransportMode.Importance), si, sampler.next_1d(), sampler.next_2d())
    found = weight.numpy()[0].astype(float)
    return [found.mean(), found.std() / SAMPLES**0.5]


def table(kept):
    """The reflectances, model and Mitsuba beside each other."""
    lines = ["| surface, model | " + " | ".join(f"{t:g}°" for t in ANGLES) + " |", "|---" * (len(ANGLES) + 1) + "|"]
    for title, found in kept.items():
        pairs = zip(found["reflectance"], found["in Mitsuba"], strict=True)
        cells = (f"{in_mitsuba:.4f} ({in_mitsuba / known - 1:+.2%})" for (known, _), (in_mitsuba, _) in pairs)
        lines.append(f"| {title}, `{found['model']}` | " + " | ".join(cells) + " |")
    return "\n".join(
        [*lines, "", "In brackets the difference from the model, as both draw directions at random.", "", ""]
    )


if __name__ == "__main__":
    {"model": model, "pictures": pictures}[sys.argv[1]](Path(sys.argv[2]))
