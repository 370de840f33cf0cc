"""The declaration of a file format: how it is recognised, read and written, and what it can store."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

# A BRDF (n,) at directions theta_i, theta_r, phi, phi_i [deg] (n,), NaN where there is none.
Evaluate = Callable[..., npt.NDArray[np.float64]]
SIGNED = 0  # the rank of formats whose files begin with something that no other file begins with


class Means(NamedTuple):
    """Means over the places of a layout, NaN for gaps.

    partial: how many are over a part of their place alone, since the rest has no value. how: in words for the history.
    """

    values: npt.NDArray[np.float64]
    partial: int
    how: str


@dataclass(frozen=True)
class Holds:
    """What a file of one format can store. `gonio.convert` leaves out the rest of a scan and reports it, or refuses.

    `azimuths`: directions out of the plane of incidence. `anisotropic`: surfaces turned about their normal (phi_i).
    `reflection`, `transmission`: which of the two a file can say that it is of. `relative`: a mark for relative data; a
    format without it is never given relative data. `gaps`: missing values. `negative`: values below zero.
    `channels`: the groups of channels that a file can name, such as R, G and B; without any, all names.
    `alone`: the channel as which one wavelength or one channel alone is stored, for programs that look for no other;
    `alone_among`: channels of which, where all are there, the file stores one under that name.
    `monochrome`: whether values without a channel can be stored; where they cannot, they stand in each channel alike.
    `sets`: the coordinates (of dataset.SETS) along which a file can hold several sets of directions; one set of any
    kind always fits. `variables`: the variables beside brdf that are kept, `*` for all. `quantity`: the attribute
    `quantity` that a scan must have, for formats that store something other than a BRDF.
    """

    azimuths: bool = True
    anisotropic: bool = False
    reflection: bool = True
    transmission: bool = False
    relative: bool = False
    gaps: bool = False
    negative: bool = True
    channels: tuple[tuple[str, ...], ...] = ()
    alone: str = ""
    alone_among: tuple[str, ...] = ()
    monochrome: bool = True
    sets: tuple[str, ...] = ()
    variables: tuple[str, ...] = ()
    quantity: str = ""

    @property
    def modes(self) -> tuple[str, ...]:
        """The modes that a file can be of."""
        return ("reflection",) * self.reflection + ("transmission",) * self.transmission


@dataclass(frozen=True)
class Format:
    """One file format, declared at the end of the module that reads it.

    `name` is what `--to` and `gonio formats` call it, `title` what a message calls it, `suffix` the usual suffix.
    `recognises(head)` gets the first bytes of a file (for a directory, the names in it, one a line), never its name.
    Formats are asked in ascending order of `rank`: those without a signature have a high rank and are asked last.
    `read(path)` returns the scan; it raises FormatError with the place in the file.
    `write(scan, path)` is None for a format that is only read; it raises ValueError for a scan that does not fit.
    `layout(scan)` returns the directions that the format stores for a scan, as a Dataset of coordinates on the format's
    own dimensions; `write` then gets a scan on exactly these, NaN only where `holds.gaps` or below the horizon. Without
    a layout a format stores the scan's own directions, and `write` gets any scan that `holds` allows.
    `means(onto, evaluate, turned)` is for a format whose values are means over patches of directions: those of a
    function of directions, over the patches whose centres are `onto`; `turned` says whether it depends on phi_i.
    `exact_means(part, onto)` is the same for one set of a scan of the format's own that is constant in parts; None for
    others.
    `reflectances(part)` gives, for one set of a scan of the format's own, incidence angles theta_i and phi_i [deg] and
    the exact directional-hemispherical reflectances there; None where the set is in another form.
    `evaluate(scan, theta_i, theta_r, phi, phi_i)` is the format's own interpolation [deg], where it defines one.
    `remark(scan)` is a sentence that a user of the written file has to know, empty where there is none to say.
    """

    name: str
    title: str
    suffix: str
    recognises: Callable[[bytes], bool]
    read: Callable[[Path], xr.Dataset]
    write: Callable[[xr.Dataset, Path], None] | None = None
    layout: Callable[[xr.Dataset], xr.Dataset] | None = None
    means: Callable[[xr.Dataset, Evaluate, bool], Means] | None = None
    exact_means: Callable[[xr.Dataset, xr.Dataset], Means | None] | None = None
    reflectances: Callable[[xr.Dataset], tuple[npt.NDArray[np.float64], ...] | None] | None = None
    evaluate: Evaluate | None = None
    remark: Callable[[xr.Dataset], str] | None = None
    holds: Holds = field(default_factory=Holds)
    rank: int = SIGNED

    def __repr__(self) -> str:
        return f"<Format {self.name}: {self.title}>"
