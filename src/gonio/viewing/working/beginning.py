"""The first answer of a page: the model that it begins with is fitted to each scan that comes without a fit."""

from collections.abc import Callable
from typing import Any

import xarray as xr

from gonio.fitting.fitting import fit
from gonio.fitting.objective.automatic import AUTO
from gonio.fitting.objective.problem import Problem
from gonio.fitting.solution import Solution
from gonio.model import Model
from gonio.viewing.session import Session

Told = Callable[[float, str], None]


def _unheard(_fraction: float, _name: str) -> None:
    """Do nothing with the progress."""


def fit_first(session: Session, name: str = "", told: Told = _unheard) -> list[str]:
    """Fit the session's model to its scans that have no fit, and keep the fits with them; returns what could not be.

    name: of each fit, that of the model unless another is given. told: called with the fraction that is done, and the
    name of the model. Nothing is fitted where the session has values or a state to begin with, and no scan of which a
    page does not show every value (`Opened.fittable`).
    """
    if not session.begins_with_fits:
        return []
    model = session.models[session.model]
    waiting = [one for one in session.opened if not one.fits and one.fittable]
    failed = []
    for k, one in enumerate(waiting):
        try:
            one.fits[name or model.name] = _fitted(one.scan, model, k / len(waiting), 1 / len(waiting), told)
        except ValueError as error:
            failed.append(f"{one.name}: {model.name} was not fitted, so that the page begins at its defaults: {error}")
    return failed


def _fitted(scan: xr.Dataset, model: Model, done: float, share: float, told: Told) -> Solution:
    """As the button "Fit" of the page does."""
    told(done, model.name)
    options: dict[str, Any] = {"weighting": AUTO}
    return fit(Problem(model, scan, **options), progress=lambda part: told(done + share * part, model.name))
