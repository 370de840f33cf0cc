"""Writes docs/fitted-slopes.md from benchmarks/slopes.json."""

from typing import Any

from _pages import BENCHMARKS, DOCS, measured, table, write

RECORD, PAGE = BENCHMARKS / "slopes.json", DOCS / "fitted-slopes.md"
MODELS = ("torrance-sparrow", "beckmann", "ggx")
THEORIES = {"beckmann-kirchhoff": "Kirchhoff", "generalised-harvey-shack": "Harvey-Shack"}
ROUGH = 50


def cells(row: dict[str, Any]) -> list[object]:
    start = [f"{row['rms']:g}, {row['length']:g}", row["like"], f"{row['g']:.3g}", f"{row['true']:.4f}"]
    fits = [f"{row['fitted'][theory][model]:.4f}" for theory in THEORIES for model in MODELS]
    return [*start, f"{row['effective']:.4f}" if row["g"] > 1 else "none", *fits]


def page(record: dict[str, Any]) -> str:
    heads = ["rms height, length [µm]", "like", "g at 40°", "true slope", "s_eff at 40°"]
    heads += [f"{name}: {model}" for name in THEORIES.values() for model in MODELS]
    first, last, step = record["theta_r"]
    angles = ", ".join(f"{angle:g}" for angle in record["theta_i"])
    rough = [row for row in record["rows"] if row["g"] > ROUGH]
    off = max(abs(row["fitted"]["beckmann-kirchhoff"]["beckmann"] / row["true"] - 1) for row in rough)
    al = next(row for row in record["rows"] if row["like"].startswith("aluminium"))
    ggx = [
        row["fitted"]["beckmann-kirchhoff"]["ggx"] / row["fitted"]["beckmann-kirchhoff"]["beckmann"] - 1
        for row in record["rows"]
    ]
    return f"""# Fitted slopes and true slopes

{measured("make slopes", record["date"], record["machine"])}

Does the slope that a facet model finds in a scan agree with the slope of the surface? Here the surfaces are known: heights are
Gaussian, and so is their autocorrelation, so that the rms slope per axis is √2 times the rms height over the correlation length.
Their scans are computed by wave optics ([Beckmann-Kirchhoff](models/beckmann-kirchhoff.md) and
[generalised Harvey-Shack](models/generalised-harvey-shack.md)) for {record["wavelength_nm"]:g} nm and the index of aluminium, at incidence angles of
{angles} deg and receiver angles from {first:g} to {last:g} deg in steps of {step:g} deg. Facet models are fitted to them with uniform weights. All slopes are
per axis: `sigma` of torrance-sparrow, `m` of beckmann over √2, and `width` of ggx over √2.

g is the variance of the phase, (4π Sq cos θᵢ/λ)²; s_eff is the slope over the distance within which heights turn the phase by 1 rad.

{table(heads, map(cells, record["rows"]), 2)}

- For g above {ROUGH} Gaussian facets find the slope of the surface: here within {100 * off:.1f} % from Kirchhoff scans.
- Below that the width of the lobe is no slope of the surface. For g = {al["g"]:.2g} the fit finds
  {al["fitted"]["generalised-harvey-shack"]["beckmann"]:.3f} to {al["fitted"]["beckmann-kirchhoff"]["beckmann"]:.3f} where the surface has {al["true"]:.3f}.
- Slopes of GGX have no rms. Its width over √2 is {100 * min(ggx):.0f} to {100 * max(ggx):.0f} % larger than what Beckmann's facets find in the same scans.
- A lobe that is as wide as the diffraction of its correlation length, g near 1, is no lobe of facets: these fits are bad.
- Harvey-Shack does not tend to facets, however rough the surface is: its obliquity factor is 1.

The numbers depend by a few percent on the directions that are fitted. For a map and a fit of your own,
`gonio topography map.sdf --compare fit.nc` fits the same model to the scan that the map predicts ([how](howto/topography.md)).
"""


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make slopes")
