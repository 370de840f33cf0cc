"""All that is told of a height map at once: for the command line, the figure, and one call in Python."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import xarray as xr

from gonio.topography.correlation import CorrelationLengths, Structure, correlation_lengths, lags, structure
from gonio.topography.filters import outliers
from gonio.topography.heights import pitch, share_missing, sides
from gonio.topography.levelling import level
from gonio.topography.light.band import Seen, seen_by_light
from gonio.topography.light.facets import FacetWidths, facet_widths
from gonio.topography.slopes import AUTO, Slopes, slopes
from gonio.topography.spectrum import Spectrum, spectrum
from gonio.topography.statistics import Statistics, statistics
from gonio.topography.subareas import spread


@dataclass(frozen=True, eq=False)
class Summary:
    """What is known of a levelled map; lengths in um, angles in degrees.

    spread: standard deviation of each parameter over the four quarters of the map, each levelled by a plane; NaN for a
    map that is too small. outliers: how many points stand out, none of which is left out. seen: what light of the
    wavelength sees; None where no wavelength is given, or where its band is empty, with the reason in `unseen`.
    """

    heights: xr.Dataset
    statistics: Statistics
    spread: Statistics
    slopes: Slopes
    lengths: CorrelationLengths
    widths: FacetWidths
    structure: Structure
    spectrum: Spectrum
    outliers: int
    seen: Seen | None = None
    unseen: str = ""

    @property
    def pitch(self) -> tuple[float, float]:
        """Distances of neighbouring points along x and y."""
        return pitch(self.heights)

    @property
    def sides(self) -> tuple[float, float]:
        """Width and height of the map."""
        return sides(self.heights)

    @property
    def missing(self) -> float:
        """The share of points that are not in use."""
        return share_missing(self.heights)

    @property
    def range(self) -> float:
        """The highest minus the lowest height, as Sz."""
        return self.statistics.Sz


def summarise(
    heights: xr.Dataset,
    *,
    wavelength: float | None = None,
    theta_i: Iterable[float] = (0.0, 30.0, 60.0),
    least: float = 0.0,
    operator: str = AUTO,
) -> Summary:
    """Tell all that a height map says.

    Parameters
    ----------
    heights : xarray.Dataset
        The map, levelled and filtered as it is to be told.
    wavelength : float, optional
        Of the light whose band is told [nm].
    theta_i : iterable of float
        Incidence angles [deg].
    least : float
        The least frequency that counts for light [1/um], such as 1/spot; 0 takes that of the map.
    operator : str
        That of slopes: forward, central or seven-point; without it seven-point where the map has room for it.

    Returns
    -------
    Summary
        Parameters with their spread over the map, correlation lengths, facet widths, spectrum and structure function.

    Raises
    ------
    ValueError
        The operator is not known or wider than the map, or the wavelength is not above 0.

    """
    found, gradient = lags(heights), slopes(heights, operator)
    surface, frequencies = structure(heights, found), spectrum(heights)
    whole = statistics(heights, operator)
    of_places = spread(heights, lambda part: statistics(level(part), operator))
    seen, unseen = None, ""
    if wavelength is not None:
        try:
            seen = seen_by_light(heights, wavelength / 1000, theta_i, least, (frequencies, surface))
        except ValueError as error:
            unseen = str(error)
    return Summary(
        heights=heights,
        statistics=whole,
        spread=Statistics(*([math.nan] * len(whole) if of_places is None else of_places.tolist())),
        slopes=gradient,
        lengths=correlation_lengths(heights, found),
        widths=facet_widths(gradient),
        structure=surface,
        spectrum=frequencies,
        outliers=int(outliers(heights).sum()),
        seen=seen,
        unseen=unseen,
    )
