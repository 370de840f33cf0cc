"""What people ask of a fit: its points and predictions, its residuals and metrics, tables, reports and figures.

A fit of one scan keeps the points that it was fitted to (`scan`). What is computed with the rooms above this one is in
`gonio.results` and `gonio.reporting`: a solution finds these functions there by their names, on first use, as `gonio`
finds its public names.
So a report knows solutions, and a solution depends on no report, on Matplotlib or on pandas.
"""

import functools
import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from gonio.fitting.schema import MOST_KEPT, SCAN
from gonio.geometry import Geometry
from gonio.measured import dataset as scans

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame


class Readable:
    """The part of a Solution that people read; `dataset` is as `fitting.schema` declares it."""

    dataset: xr.Dataset

    @property
    def has_scan(self) -> bool:
        """Whether the solution holds the points that it was fitted to."""
        return f"{SCAN}brdf" in self.dataset

    @functools.cached_property
    def scan(self) -> xr.Dataset:
        """The points that were fitted, as a flat scan.

        ValueError where the solution does not hold them: a lane of `fit_many`, or more than `schema.MOST_KEPT` points.
        """
        if not self.has_scan:
            raise ValueError(
                f"this solution does not hold the points that it was fitted to (those of many scans and more than "
                f"{MOST_KEPT} are not kept): solution.with_scan(scan) has them, and solution.predict(scan) needs none"
            )
        kept = {str(n).removeprefix(SCAN): v for n, v in self.dataset.data_vars.items() if str(n).startswith(SCAN)}
        kept.pop("weight")
        coords = {name: kept.pop(name) for name in list(kept) if name not in ("brdf", "uncertainty")}
        history = str(self.dataset.attrs["data_history"])
        scan = xr.Dataset(
            {name: (v.dims, v.values, {"units": self.dataset.attrs["unit"]}) for name, v in kept.items()},
            coords={
                n: (v.dims, v.values, {"units": "degree"} if n in scans.DIRECTIONS else {}) for n, v in coords.items()
            },
            attrs={"history": history} | scans.said_to_be_simulated(history),
        )
        if "wavelength" in scan.coords:
            scan["wavelength"].attrs["units"] = "nm"
        return scan

    def predict(self, where: "xr.Dataset | Geometry", **coordinates: Any) -> xr.DataArray:
        """The fitted BRDF at directions, as the instrument of the fit reads it.

        Parameters
        ----------
        where : xarray.Dataset or Geometry
            A scan, or a Dataset of directions [deg], flat or on a grid; or a Geometry of any shape.
        **coordinates
            Values of `wavelength`, `channel`, `scan` .. that the directions do not say themselves, one for all of
            them.

        Returns
        -------
        xarray.DataArray
            Values [unit of the fit] on the dimensions of the scan with its coordinates, NaN where a node is below the
            horizon.

        Raises
        ------
        ValueError
            A direction belongs to no group of the fit, or does not say to which one.

        """
        return _reader("predicted")(self, where, coordinates)

    @property
    def residuals(self) -> xr.DataArray:
        """The fitted BRDF less the measured one (points,) [unit of the fit], with the coordinates of the points.

        Raises ValueError where the solution does not hold its scan; so do `metrics` and `plot`.
        """
        return _reader("residuals")(self)

    @functools.cached_property
    def metrics(self) -> dict[str, float]:
        """The figures of merit of `comparison.METRICS` by name, over the points that were fitted."""
        return _reader("metrics_of")(self)

    def to_dataframe(self) -> "DataFrame":
        """The values as a table of pandas, one row a value.

        Returns
        -------
        pandas.DataFrame
            `parameter`; `set`, the group of the value, as `theta_i=30`, empty for a value that holds everywhere;
            `value`, `unit`, `standard uncertainty`; `low` and `high`, the 95 % interval within the bounds of the fit;
            and `status`: fitted, at its bound, not determined or held.

        Raises
        ------
        ImportError
            Pandas is not installed.

        """
        return _reader("dataframe")(self)

    def plot(self, kind: str = "curves", ax: "Axes | None" = None, **words: Any) -> "Figure":
        """Draw the fit with its scan, as `gonio.plot(solution.scan, solution, kind, ax)` does.

        Parameters
        ----------
        kind : str
            `curves`, `residuals` or another kind of `gonio.plot`.
        ax : matplotlib.axes.Axes, optional
            Axes to draw `curves` or `residuals` on.
        **words
            Those of `gonio.plot`, such as `size="85x60mm"` and `font=8`.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, not yet saved unless `out` names a file.

        """
        return _reader("plot")(self.scan, self, kind, ax, **words)

    def report(self, path: str | Path, force: bool = False, about: Any = None) -> Path:
        """Write a report: a page with figures, tables and checks, or what `print(solution)` says as text.

        Parameters
        ----------
        path : str or Path
            The file: `.html` for the page, `.md` or `.txt` for text.
        force : bool
            Whether a file that exists is replaced.
        about : mapping or path, optional
            What a scan cannot say of the sample and the instrument, as `gonio.report` takes it.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        FileExistsError
            The file exists, and `force` is not set.
        ValueError
            The suffix is another.

        """
        return _reader("report", "gonio.reporting")(self, path, about=about, force=force)

    def __repr__(self) -> str:
        return _reader("in_a_line")(self)

    def __str__(self) -> str:
        """A report of at most 30 lines, whatever the number of values."""
        return _reader("as_text")(self)

    def _repr_html_(self) -> str:
        """The same report as a fragment of HTML for notebooks, below 20 kB."""
        return _reader("as_html", "gonio.reporting")(self)


def _reader(name: str, room: str = "gonio.results") -> Any:
    """A function of the rooms above, by name: reports and figures know a Solution, and never the reverse."""
    return getattr(importlib.import_module(room), name)
