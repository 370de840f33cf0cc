"""Retroreflectors: a lobe about the back direction beside facets and a diffuse part."""

from gonio.model import Model
from gonio.models.gonio2026 import gonio_best
from gonio.models.walter2007 import ggx
from gonio.optics.backward import back_lobe

REVERSED = "a scan whose angles have the wrong sign would look like a retroreflector, so no search tries it by itself"

ggx_retro = Model(
    name="ggx-retro",
    title="GGX facets, diffuse, back lobe",
    cite="belcour2014",
    terms={**ggx.terms, "rho_r": back_lobe},
    only_named=REVERSED,
)

gonio_best_retro = Model(
    name="gonio-best-retro",
    title="gonio-best and a back lobe",
    cite="belcour2014",
    terms={**gonio_best.terms, "rho_r": back_lobe},
    only_named=REVERSED,
)
