"""The page as a Jupyter widget: its values are read and set from Python, and the kernel fits."""

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any

import anywidget
import traitlets

from gonio.fitting.fitting import fit
from gonio.fitting.objective.from_scan import freeing
from gonio.fitting.objective.problem import Problem
from gonio.fitting.solution import Solution
from gonio.model import Model
from gonio.results.sparkline import sparkline
from gonio.viewing.assembled import in_one_file, written
from gonio.viewing.fits import record
from gonio.viewing.session import FIT, Opened, Session
from gonio.viewing.values import Layout, of_fit, of_model

FROM_PAGE, TO_PAGE = "gonio-page", "gonio-kernel"
PICTURE = (640, 300)  # pixels of the picture that stands for the page in a saved notebook


class View(anywidget.AnyWidget):  # type: ignore[misc]
    """A page with sliders below a cell.

    Attributes
    ----------
    values : mapping
        The values on the sliders by name, `rho_s[30]` for one of a group. Setting it moves the sliders; those that are
        not named stay. It cannot be changed in place. `view.observe(function, "values")` tells of every change.
    solution : Solution or None
        The fit that is shown first, and after "Fit" the new one.
    model : Model
        The model whose sliders are shown.

    """

    _esm = files("gonio.viewing").joinpath("widget.js").read_text(encoding="utf-8")
    _page = traitlets.Unicode().tag(sync=True)
    values = traitlets.Any()
    solution = traitlets.Any(allow_none=True)

    def __init__(self, session: Session) -> None:
        self._session = session
        self._fit = "" if session.begin_with_model or not self._opened.fits else FIT
        self._model = session.models[session.model]
        self._all: dict[str, float] = {}
        self._from_page = False
        self._count = 0
        super().__init__(_page=in_one_file(session, session.needed(), notebook=True))
        self.solution = self._opened.fits.get(FIT)
        self._take(self._layout, self._first())
        self.on_msg(self._told)

    @property
    def model(self) -> Model:
        """The model whose sliders are shown."""
        return self._layout.model

    def write(self, path: str | Path, force: bool = False) -> Path:
        """Write the page to a file that opens in any browser, with the fits that were made."""
        return written(in_one_file(self._session, self._session.needed()), Path(path), force)

    @property
    def _opened(self) -> Opened:
        return self._session.opened[0]

    @property
    def _layout(self) -> Layout:
        return of_fit(self._opened, self._fit) if self._fit else of_model(self._opened, self._model)

    def _first(self) -> dict[str, float]:
        """The values that the page begins with: those of the fit, or the best weights for the first shape."""
        layout = self._layout
        if self._fit:
            return dict(self._opened.fits[self._fit].values)
        shape = {name: parameter.default for name, parameter in self._model.shape.items()}
        given = layout.checked(shape | dict(self._session.values))
        weights = [w for w in self._model.weights if w not in self._session.values]
        if weights:
            found = fit(self._problem(layout, given, [p for p in self._model.parameters if p not in weights]))
            given |= {name: found.values.get(name, 0.0) for own in layout.names for name in own if name not in given}
        return given

    def _problem(self, layout: Layout, values: Mapping[str, float], held: list[str]) -> Problem:
        """What is fitted: as the fit that is shown was, or as the scan asks for, with some parameters held."""
        names = dict(zip(layout.model.parameters, layout.names, strict=True))
        labels = dict(zip(layout.model.parameters, layout.labels, strict=True))
        by = dict(zip(layout.model.parameters, layout.by, strict=True))
        options: dict[str, Any] = {"weighting": self._opened.columns.header["weighting"]}
        if self._fit:
            shown = self._opened.fits[self._fit]
            attrs = shown.dataset.attrs
            options = {"weighting": attrs["weighting"], "loss": attrs["loss"], "instrument": shown.instrument}
            options["smooth"] = shown.smooth
        free = [name for name in layout.model.parameters if name not in held and not by[name]]
        return Problem(
            layout.model,
            self._opened.scan,
            bounds=freeing(layout.model, free),
            grouped={name: tuple(by[name].split(",")) for name in by if by[name]},
            held={
                name: {label: values[full] for label, full in zip(labels[name], names[name], strict=True)}
                if by[name]
                else values[name]
                for name in held
            },
            **options,
        )

    @traitlets.validate("values")  # type: ignore[untyped-decorator]
    def _checked(self, proposal: Any) -> Mapping[str, float]:
        if not isinstance(proposal["value"], Mapping):
            raise traitlets.TraitError('values is a mapping: view.values = {"width": 0.2}')
        new = proposal["value"] if self._from_page else self._layout.checked(proposal["value"])
        return MappingProxyType(self._all | dict(new))

    @traitlets.observe("values")  # type: ignore[untyped-decorator]
    def _moved(self, change: Any) -> None:
        self._all = dict(change["new"])
        if not self._from_page:
            layout = self._layout
            self.send({"kind": "values", "model": layout.model.name, "values": layout.nested(self._all)})

    def _take(self, layout: Layout, values: dict[str, float]) -> None:
        """Values that the page has already, which are not sent back to it."""
        self._from_page = True
        self._all = {name: values[name] for own in layout.names for name in own}
        try:
            self.values = self._all
        finally:
            self._from_page = False

    def _told(self, _widget: Any, content: Any, _buffers: Any) -> None:
        """A message of the page; what has not the form of one is left."""
        if not isinstance(content, dict) or content.get("gonio") != FROM_PAGE:
            return
        kind = content.get("kind")
        if kind == "ready":
            layout = self._layout
            self.send({"kind": "values", "model": layout.model.name, "values": layout.nested(self._all)})
        elif kind in ("values", "fit"):
            try:
                self._show(content)
                if kind == "fit":
                    self._fitted(content)
            except (ValueError, KeyError) as error:
                self.send({"kind": "error", "text": str(error.args[0] if error.args else error)})

    def _show(self, content: Mapping[str, Any]) -> None:
        """What the page shows now: a fit, or a model, and its values."""
        name, model = str(content.get("fit", "")), str(content.get("model", ""))
        if (name and name not in self._opened.fits) or (not name and model not in self._session.models):
            raise ValueError("the page shows what the kernel does not have")
        self._fit, self._model = name, self._session.models[model] if not name else self._model
        self._take(self._layout, self._layout.named(content.get("values")))

    def _fitted(self, content: Mapping[str, Any]) -> None:
        layout, places = self._layout, content.get("locked")
        count = len(layout.model.parameters)
        if not isinstance(places, list) or not all(isinstance(k, int) and 0 <= k < count for k in places):
            raise ValueError("the page does not say which values are held")
        held = [layout.model.parameters[k] for k in places]
        solution: Solution = fit(self._problem(layout, self._all, held))
        self._count += 1
        self._fit = f"{FIT} {self._count}"
        self._opened.fits[self._fit] = solution
        self._take(self._layout, self._first())
        self.solution = solution
        self.send({"kind": "fit", "set": 0, "name": self._fit, "record": record(solution, self._opened.columns)})

    def send(self, content: Any, buffers: Any = None) -> None:
        """Send a message to the page."""
        super().send({**content, "gonio": TO_PAGE}, buffers)

    def _repr_mimebundle_(self, **kwargs: Any) -> Any:
        """The widget; and a picture for where no kernel is, such as a notebook that was saved."""
        found = super()._repr_mimebundle_(**kwargs)
        if found is None:
            return None
        data, metadata = found if isinstance(found, tuple) else (found, {})
        shown = self._opened.fits.get(FIT)
        picture = sparkline(self._opened.scan, shown.brdf if shown else None, PICTURE, labelled=True)
        return data | ({"image/svg+xml": picture} if picture else {}), metadata

    def __repr__(self) -> str:
        return f"<View: {self.model.name}; values, solution, model, write(path)>"
