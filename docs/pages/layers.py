"""Put the figures of benchmarks/wavelengths.json between the marks of docs/howto/layers.md: part of `make pages`."""

import math
import re

from _pages import BENCHMARKS, DOCS, table, write

RECORD, PAGE = BENCHMARKS / "wavelengths.json", DOCS / "howto" / "layers.md"
BEGIN, END = "<!-- from benchmarks/wavelengths.json -->", "<!-- end -->"


def text(found: dict) -> str:
    """What both fits came to, and what the shared height costs."""
    one, several, plain, several_plain = found["fits"].values()
    loss, plain_loss = (
        100 * (a["log10_rmse"] / b["log10_rmse"] - 1) for a, b in ((one, several), (plain, several_plain))
    )
    rows = [
        (which, f"`{fit['model']}`", fit["free"], f"{fit['log10_rmse']:.4f}", heights(fit))
        for which, fit in found["fits"].items()
    ]
    return "\n".join(
        [
            f"Made by `make wavelengths` on {found['date']} ({found['machine']}), {one['points']} points.",
            "",
            table(("fit", "model", "values", "lg RMSE", "rms height [µm]"), rows, 2, 1),
            "",
            f"One height costs {loss:.1f} % of lg RMSE, with {several['free'] - one['free']} values fewer. Where the material's values are shared as",
            f"well, it costs {plain_loss:.1f} %: then the phase alone has to make up for how the material changes with wavelength.",
        ]
    )


def heights(fit: dict) -> str:
    """The rms height itself, or that of each phase: h wavelength/(4 pi)."""
    values = fit["values"]
    if "sigma" in values:
        return f"{values['sigma']:.4f}"
    phases = {float(name[2:-1]): value for name, value in values.items() if name.startswith("h[")}
    return ", ".join(f"{h * nm / 1000 / (4 * math.pi):.4f} ({nm:g} nm)" for nm, h in phases.items())


def page(found: dict) -> str:
    """The page with the figures of a record between its marks."""
    inside = re.compile(f"{re.escape(BEGIN)}\n.*{re.escape(END)}", re.DOTALL)
    return inside.sub(lambda _: f"{BEGIN}\n{text(found)}\n{END}", PAGE.read_text(encoding="utf-8"))


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make wavelengths")
