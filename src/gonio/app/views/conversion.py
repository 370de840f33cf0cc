"""What became of a scan on its way into a file, as plain data and for people."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from gonio.app.output import strong
from gonio.app.views import energy
from gonio.resampling.conversion import ENDS, Conversion, in_words

if TYPE_CHECKING:
    import xarray as xr

MOSTLY = 0.5  # of the values: a file with more of a model's is called mostly a model


def record(done: Conversion) -> dict[str, Any]:
    """A conversion as plain data."""
    error = done.error
    return {
        "file": str(done.path),
        "format": done.format.name,
        "values": int(done.scan["brdf"].size),
        "left_out": list(done.left_out),
        "history": done.scan.attrs["history"].splitlines(),
        "modelled": done.modelled,
        "reflectance": energy.record(done.reflectances),
        "error": {
            "rms": error.rms,
            "rms_steep": error.rms_steep,
            "bias": error.bias,
            "log10_rmse": error.log10_rmse,
            "largest": error.largest,
            "where": error.where,
            "lost": error.missing,
            "directions": error.count,
            "against": "means over patches" if done.format.means else "values",
        },
    }


def lines(done: Conversion, since: "xr.Dataset") -> Iterator[Any]:
    """The same for people, with what the history of the data says more than that of `since`."""
    yield f"wrote {done.path} as {done.format.title}, {done.scan['brdf'].size} values"
    for line in done.left_out:
        yield f"left out: {line}"
    for line in done.scan.attrs["history"].splitlines()[len(since.attrs["history"].splitlines()) :]:
        yield line
    yield from _provisos(done)
    yield f"as the file reads now: {in_words(done.error, done.format)}"
    if done.reflectances:
        yield f"reflectance of the file: {energy.in_words(energy.record(done.reflectances))}"


def _provisos(done: Conversion) -> Iterator[Any]:
    """That most of a file is a model, and that it ends before grazing incidence; else nothing."""
    if done.modelled > MOSTLY:
        share = f"{100 * done.modelled:.3g} % of the values are the model's, not measured"
        yield strong("mostly a model", f": {share}: the file is no more certain than the model between your data")
    if done.format.layout is not None and done.last_incidence < ENDS:
        yield (
            f"the file ends at theta_i {done.last_incidence:.4g} deg: beyond, a program that reads it repeats the last "
            "angle or darkens the rim"
        )
