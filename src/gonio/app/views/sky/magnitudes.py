"""A light curve as plain data and for people."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.app.output import figure, table, uncertain
from gonio.door.text import clip
from gonio.outside import shortened
from gonio.photometry import Facet, Pass

Values = npt.NDArray[np.float64]

MOST_ROWS = 40  # that are shown to people
MOST_NAMES = 3  # of facets whose share has a column
DARK = "dark"


def times_of(seen: Pass) -> Any:
    """Times for an axis: dates where all are ISO 8601, numbers where all are, else None."""
    texts = [text.removesuffix("Z") for text in seen.time]
    try:
        return np.array([float(text) for text in texts])
    except ValueError:
        pass
    try:
        return np.array(texts, dtype="datetime64[ms]")
    except ValueError:
        return None


def record(curve: xr.Dataset, seen: Pass) -> dict[str, Any]:
    """The curve as plain data."""
    columns = ("magnitude", "uncertainty", "uncertainty_systematic", "ratio", "phase_angle", "distance")
    out: dict[str, Any] = {
        "band": curve.attrs["band"],
        "system": curve.attrs["system"],
        "sun": curve.attrs["sun"],
        "time": seen.time,
        **{name: curve[name].values.tolist() for name in columns},
        "share": {str(n): curve["share"].sel(facet=n).values.tolist() for n in curve["facet"].values},
    }
    if found := agreement(curve["magnitude"].values, seen.measured):
        out["observed"] = found
    return out


def agreement(computed: Values, measured: Values) -> dict[str, float]:
    """How the computed magnitudes differ from the observed ones; empty where fewer than two can be compared."""
    both = np.isfinite(computed) & np.isfinite(measured)
    if both.sum() < 2:
        return {}
    difference = (computed - measured)[both]
    spread = computed[both].std() * measured[both].std()
    correlation = float(np.corrcoef(computed[both], measured[both])[0, 1]) if spread > 0 else math.nan
    return {
        "count": int(both.sum()),
        "bias": float(difference.mean()),
        "scatter": float(difference.std(ddof=1)),
        "correlation": correlation,
    }


def lines(curve: xr.Dataset, seen: Pass, facets: Sequence[Facet]) -> Iterator[Any]:
    """The curve for people."""
    names = [str(n) for n in curve["facet"].values]
    shown = names if 1 < len(names) <= MOST_NAMES else []
    parts = (f"{clip(n, 12)} [%]" for n in shown)
    rows = table("time", f"{curve.attrs['band']} [mag]", "phase [deg]", "d [km]", *parts)
    for k in range(min(curve.sizes["time"], MOST_ROWS)):
        one = curve.isel(time=k)
        m = float(one["magnitude"])
        systematic = float(one["uncertainty_systematic"])
        value = _written(m, float(one["uncertainty"]), systematic)
        shares = (_share(float(one["share"].sel(facet=n))) for n in shown)
        phase, distance = f"{float(one['phase_angle']):.1f}", f"{float(one['distance']) / 1e3:.4g}"
        rows.add_row(seen.time[k], value, phase, distance, *shares)
    yield rows
    if (rest := curve.sizes["time"] - MOST_ROWS) > 0:
        yield f"and {rest} more rows: --json FILE has all"
    stated = curve.attrs
    yield (
        f"{stated['band']} in the {stated['system']} system, in which the sun has {stated['sun']:g} mag; "
        "± is the standard uncertainty of the fits, with areas and values of models as exact"
    )
    if missed := _missed(facets):
        yield missed
    if dark := int((~np.isfinite(curve["magnitude"].values)).sum()):
        count = curve.sizes["time"]
        yield f"no light at {dark} of {count} times: no facet is lit and seen, or the Earth hides the sun"
    if found := agreement(curve["magnitude"].values, seen.measured):
        yield (
            f"computed less observed at {found['count']} times: mean {found['bias']:+.2f} mag, standard deviation "
            f"{found['scatter']:.2f} mag; correlation {figure(found['correlation'])}"
        )


def _written(m: float, random: float, systematic: float) -> str:
    """A magnitude with its uncertainty, which values of models do not have."""
    if not math.isfinite(m):
        return DARK
    return uncertain(m, random, systematic) if random > 0 or systematic > 0 else f"{m:.3f}"


def _share(part: float) -> str:
    return figure(100 * part) if math.isfinite(part) else ""


def _missed(facets: Sequence[Facet]) -> str:
    """By how much fits miss angles that they were not shown, in magnitudes; empty where no fit was validated."""
    found = {}
    for k, one in enumerate(facets, start=1):
        if one.solution is not None:
            error = one.solution.answer.get("validated", {}).get("log10_rmse")
            if isinstance(error, int | float):
                found[one.name or f"facet {k}"] = 2.5 * error
    if not found:
        return ""
    listed = [f"{name} by {figure(error)} mag" for name, error in found.items()]
    return shortened("the fits missed angles that they were not shown, in rms: ", listed, "")
