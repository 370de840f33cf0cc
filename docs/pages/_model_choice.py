"""The first part of docs/models/index.md: which model for which kind of surface, from benchmarks/validated.json."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from _pages import BENCHMARKS

Models = Mapping[str, Mapping[str, Any]]

# Kinds of surfaces, and the scans of docs/real-surfaces.md that are of that kind.
SMOOTH_METAL = (
    "jsss_mwir_aluminium",
    "jsss_mwir_aluminium_anodised",
    "jsss_mwir_copper",
    "jsss_mwir_stainless_steel_brushed",
    "merl_aluminium_lumos",
)
BLASTED_METAL = ("jsss_mwir_aluminium_sandblasted", "jsss_mwir_steel_sandblasted")
PAINT = ("jsss_mwir_reference_paint_rough", "jsss_mwir_reference_paint_smooth", "rgl_colodur_napoli_4f")
BLACK = ("ualoft_aeroglaze", "ualoft_anoblack_ec1_al6061", "ualoft_anoblack_nite_steel", "ualoft_singularity")
DIFFUSE = ("rgl_paper_white",)


def paragraph() -> str:
    """The advice, with the mean left-out errors of the models that it names."""
    scans = json.loads((BENCHMARKS / "validated.json").read_text(encoding="utf-8"))["scans"]

    def told(kind: Sequence[str], *names: str) -> str:
        best = ranked(scans, kind)
        return ", ".join(f"[`{name}`]({name}.md) {best[name]}" for name in names)

    return (
        "If you are not sure, run `gonio fit SCAN`: it tries all models and takes the one that predicts best. The "
        "percentages here are mean errors at incidence angles that the fit had not seen, on "
        "[measured scans](../real-surfaces.md). "
        f"**Smooth, brushed or anodised metal** ({len(SMOOTH_METAL)} scans): "
        f"{told(SMOOTH_METAL, 'gonio-best', 'binomial', 'rayleigh-rice', 'ggx', 'beckmann')}; the foot of the peak falls "
        "far more slowly than a Gaussian, so take a model with a tail or with two scales. "
        f"**Sandblasted metal** ({len(BLASTED_METAL)}): "
        f"{told(BLASTED_METAL, 'wu-five-reciprocal', 'sgd', 'gonio-best', 'torrance-sparrow')}; the lobe is broad, and simple "
        "facet models come near. "
        f"**Paint** ({len(PAINT)}): {told(PAINT, 'gonio-best', 'sgd', 'ggx', 'beckmann')}; a gloss peak with a tail over a "
        "diffuse body. "
        f"**Black coating** ({len(BLACK)}): {told(BLACK, 'gonio-best', 'sgd', 'student-t', 'ggx', 'torrance-sparrow')}; what "
        "is left is surface reflection, so take a Fresnel factor, which the last of these lacks. "
        f"**Rough diffuse** (white paper, {len(DIFFUSE)}): "
        f"{told(DIFFUSE, 'gonio-best', 'torrance-sparrow', 'lambert', 'oren-nayar')}; a weak broad lobe over an ideal diffuse "
        "floor is enough. "
        "**Mirror-like scatter** (polished optics): no measured scan is of this kind; take "
        "[`harvey-shack`](harvey-shack.md) or [`abg`](abg.md), whose numbers stray-light programs read, or "
        "[`rayleigh-rice`](rayleigh-rice.md), whose parameters are those of the height spectrum: they depend on the "
        "distance to the mirror direction in direction cosines, as the scatter of polished surfaces does. "
        "**Brushed metal that was turned** between scans, and **retroreflectors**: no measured scan here is of these kinds; "
        "[`gonio-best-grain`](gonio-best-grain.md) and three more have two widths and the azimuth of the grain, "
        "[`gonio-best-retro`](gonio-best-retro.md) and [`ggx-retro`](ggx-retro.md) a lobe back to the source "
        "([how](../howto/grain.md))."
    )


def ranked(scans: Mapping[str, Any], kind: Sequence[str]) -> dict[str, str]:
    """Mean left-out error of every model over the scans of a kind, as a part of the value."""
    models = [scans[name]["models"] for name in kind]
    errors = {name: [one[name]["left_out"] for one in models] for name in models[0]}
    return {name: f"{100 * (10 ** np.mean(values) - 1):.0f} %" for name, values in errors.items() if None not in values}
