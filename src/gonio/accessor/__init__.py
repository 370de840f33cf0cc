"""`scan.gonio`: what gonio does with a scan, as methods of the Dataset.

xarray knows the accessor once a scan was read or made. The functions are those of `gonio`, and are found by name when
they are called: they are above this room, which loads none of them.
"""

import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gonio.comparison.assessment import Row
    from gonio.fitting.solution import Solution
    from gonio.measured.check import Finding
    from gonio.model import Model
    from gonio.resampling.conversion import Conversion
    from gonio.resampling.hemisphere import Reflectance

NEEDED = ("brdf", "theta_i", "theta_r", "phi")


@xr.register_dataset_accessor("gonio")  # type: ignore[no-untyped-call]
class Accessor:
    """The functions of gonio that take a scan, for one scan: `scan.gonio.fit("ggx")` is `gonio.fit(scan, "ggx")`.

    It is there on every Dataset; a method raises ValueError where the Dataset is no scan.

    Parameters
    ----------
    dataset : xarray.Dataset
        The scan.

    """

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

    def __repr__(self) -> str:
        if _lacking(self._dataset):
            return "<gonio: this Dataset is no scan>"
        return f"<gonio: a scan of {self._dataset['brdf'].size} values; plot, check, fit, compare, view, report, ..>"

    @property
    def _scan(self) -> xr.Dataset:
        if lacking := _lacking(self._dataset):
            raise ValueError(
                f"this Dataset has no {lacking}: a scan needs brdf and the coordinates theta_i, theta_r and phi"
            )
        return self._dataset

    def plot(self, solutions: Any = None, kind: str = "curves", ax: "Axes | None" = None, **words: Any) -> "Figure":
        """Draw the scan and fits to it: `gonio.plot`, which has the arguments."""
        return _of("gonio", "plot")(self._scan, solutions, kind, ax, **words)

    def check(self) -> "list[Finding]":
        """Everything that is wrong with the scan, the worst first: `gonio.check`."""
        return _of("gonio", "check")(self._scan)

    def fit(self, model: "Model | str | Sequence[Model | str]" = (), **options: Any) -> "Solution":
        """Fit the scan, by the best model of the catalogue unless one is named: `gonio.fit`, which has the options."""
        return _of("gonio", "fit")(self._scan, model, **options)

    def compare(self, models: "Sequence[Model | str]", **options: Any) -> "list[Row]":
        """Fit several models, by name or as such, and rank them: `gonio.compare`, which has the options."""
        catalogue = _of("gonio", "catalogue")
        chosen = [catalogue[one] if isinstance(one, str) else one for one in models]
        return _of("gonio", "compare")(self._scan, chosen, **options)

    def view(self, solution: "Solution | None" = None, **options: Any) -> Any:
        """Look at the scan, and a fit of it, on a page with sliders: `gonio.view`, which has the options."""
        return _of("gonio", "view")(self._scan, solution, **options)

    def report(self, path: str | Path, **options: Any) -> Path:
        """Fit the best model, and write all that is known on one page: `gonio.report`, which has the options."""
        return _of("gonio", "report")(self._scan, path, **options)

    def convert(self, path: str | Path, to: str = "", **options: Any) -> "Conversion":
        """Write the scan in another format, on the grid of that: `gonio.convert`, which has the options."""
        return _of("gonio", "convert")(self._scan, path, to, **options)

    def reflectance(self) -> "list[Reflectance]":
        """The directional-hemispherical reflectance [1] of every set at its incidence angles.

        Each has `value` and `covered`, the part of the hemisphere [1] that was measured: what was not measured adds
        nothing. Empty for data that are relative, or of one plane alone.
        """
        return _of("gonio.resampling.hemisphere", "reflectances")(self._scan)


def _lacking(dataset: xr.Dataset) -> str:
    return ", ".join(name for name in NEEDED if name not in dataset.variables)


def _of(room: str, name: str) -> Any:
    return getattr(importlib.import_module(room), name)
