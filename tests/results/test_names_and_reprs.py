"""What a console shows of gonio's things, public names, and a model in one line."""

import importlib
import pkgutil
from functools import partial
from typing import Annotated

import numpy as np
import pytest

import gonio
from gonio import Geometry, Model, Problem, catalogue, fit, simulate
from gonio.formats import formats
from gonio.model import Dimensionless, Parameter, PerSteradian, TermUnit
from results.conftest import HOSTILE, spectrum, surface


def test_the_catalogue_is_a_short_table():
    text = repr(gonio.catalogue)
    assert len(text) <= 3000
    assert len(text.splitlines()) == len(catalogue) + 1
    assert "cauchy-lorentz" in text
    assert "0x" not in text


def test_models_are_short():
    for model in catalogue.values():
        assert len(repr(model)) <= 300
        assert repr(model).startswith(f"<Model {model.name}: ")
    assert "gamma 1 to 720 deg" in repr(catalogue["cauchy-lorentz"])
    assert "no shape parameters" in repr(catalogue["lambert"])


def test_formats_are_short(tmp_path):
    assert {repr(one) for one in formats().values()} >= {"<Format zemax: Zemax BSDF>"}
    assert repr(gonio.write(surface(), tmp_path / "scan.csv")).startswith("<Format tidy-csv")
    assert len(repr(formats())) <= 3000


def test_problems_are_one_paragraph():
    problem = Problem(catalogue["ggx"], surface(), held={"index": 1.5}, grouped={"rho_s": "theta_i"}, weighting="log")
    text = repr(problem)
    assert text == (
        "<Problem: ggx to 30 points in sr-1, log weighting; "
        "rho_s by theta_i, rho_d, width, index held at 1.5, extinction>"
    )
    assert len(repr(Problem(catalogue["sgd"], spectrum(30)))) <= 300


def test_a_bound_method_is_short_too(single):
    assert len(repr(single.parameters)) < 400


def test_public_names_are_not_hidden_by_modules():
    """A module of gonio that has the name of a public function would take its place once it is imported (F19)."""
    modules = {module.name for module in pkgutil.iter_modules(gonio.__path__)}
    assert not modules & set(gonio.__all__)
    importlib.import_module("gonio.fitting.fitting")
    importlib.import_module("gonio.plotting.curves")
    assert callable(gonio.fit)
    assert callable(gonio.plot)
    assert callable(gonio.compare)


def test_a_name_that_is_one_level_down_is_told():
    for name, home in gonio._BELOW.items():
        assert hasattr(importlib.import_module(home), name), name
        # gonio.derived is a module, which is there once it was imported
        if name != "derived":
            with pytest.raises(AttributeError, match=f"one level down: from {home} import {name}"):
                getattr(gonio, name)


def lobe(g, width, height=2.0):
    return height * np.exp(-g.tan_alpha_squared / width**2)


def test_a_model_of_a_plain_function_in_one_line():
    model = Model.from_function(lobe, {"width": (0.05, 1.0), "height": (1.0, 4.0)}, units={"width": "deg"})
    assert model.name == "lobe"
    assert model.shape["width"] == Parameter(np.sqrt(0.05), 0.05, 1.0, "width", "deg")
    assert model.shape["height"].default == 2.0
    scan = simulate(
        model, {"scale": 0.3, "width": 0.3, "height": 2.0}, [10.0, 40.0], np.arange(-60, 61, 10.0), noise=0.01
    )
    solution = fit(Problem(model, scan, held={"height": 2.0}))
    assert solution.values == pytest.approx({"scale": 0.3, "width": 0.3, "height": 2.0}, rel=0.05)
    assert "lobe (lobe) fitted to" in str(solution)
    g = Geometry.in_plane(10.0, 30.0)
    assert float(model(g, solution.values)) == pytest.approx(
        solution.values["scale"] * lobe(g, solution.values["width"])
    )


def test_lambdas_partial_functions_and_constants_are_models(tmp_path):
    flat = Model.from_function(lambda g: 1 / np.pi)
    assert (flat.name, flat.weights, flat.shape) == ("model", ("scale",), {})
    assert float(flat(Geometry.in_plane(10.0, 20.0), {"scale": np.pi})) == pytest.approx(1.0)
    fixed = Model.from_function(partial(lobe, height=1.0), {"width": (0.1, 1.0), "height": (0.5, 2.0)}, name="fixed")
    assert fixed.shape["height"].default == 1.0
    solution = fit(Problem(fixed, surface()))
    solution.save(tmp_path / "own.nc")
    assert type(solution).load(tmp_path / "own.nc", fixed).values == solution.values


def test_declared_arguments_keep_their_declaration():
    def half(g: Geometry, width: Width, power) -> Dimensionless:
        return np.exp(-power * g.cos_i / width)

    model = Model.from_function(half, {"power": (-1.0, 3.0)}, unit="deg-1")
    assert model.shape["width"].help == "width of the lobe"
    assert model.shape["power"].default == 1.0
    assert model.term_unit("scale") == "deg-1"


Width = Annotated[float, Parameter(1.0, 0.5, 2.0, "width of the lobe")]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Model.from_function(lobe), r"lobe needs bounds of 'width': bounds=\{'width': \(lower, upper\)\}"),
        (lambda: Model.from_function(lobe, {"widht": (0, 1)}), "lobe has no argument 'widht'; it has width, height"),
        (lambda: Model.from_function(lambda: 1.0), "takes no argument: its first is the Geometry"),
        (
            lambda: Model.from_function(lambda g: 1.0, unit="sr"),
            "no term has the unit 'sr': choose one of sr-1, deg-1, 1",
        ),
        (lambda: Model.from_function(lambda g, a: a, {"a": (1, 0)}), "the bounds of a are 1 to 0: give two finite"),
        (lambda: Model.from_function(lambda g, a: a, {"a": (0, np.inf)}), "the bounds of a are 0 to inf"),
        (lambda: Model.from_function(lambda g, a: a, {}, units={"a": "deg"}), "units name 'a', and bounds do not"),
        (lambda: Model.from_function(lambda g, scale: scale, {"scale": (0, 1)}), "cannot be both a weight and a shape"),
        (lambda: Model("empty"), "empty has no terms: give at least one by its weight"),
    ],
)
def test_what_is_no_model_is_refused_with_the_remedy(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_a_term_without_a_unit_is_refused_where_the_model_is_made():
    """F24: it was taken, and refused in the middle of a fit."""

    def bare(g: Geometry):
        return g.cos_i

    def undeclared(g: Geometry, a) -> PerSteradian:
        return a * g.cos_i

    with pytest.raises(ValueError, match=r"term bare needs its unit .*PerSteradian.*Model.from_function\(bare, ..\)"):
        Model(name="bare", terms={"k": bare})
    with pytest.raises(ValueError, match=r"argument 'a' of term undeclared needs one Parameter .*from_function"):
        Model(name="undeclared", terms={"k": undeclared})


def test_cite_and_title_may_be_left_out():
    def even(g: Geometry) -> PerSteradian:
        return g.cos_i

    model = Model(name="even", terms={"k": even})
    assert (model.title, model.cite) == ("even", "")
    assert model.term_unit("k") == TermUnit("sr-1").unit


@pytest.mark.parametrize(
    ("written", "offered"),
    [("GGX", "did you mean ggx?"), ("Cauchy_Lorentz", "nearest: cauchy-lorentz"), ("qqq", "nearest: ")],
)
def test_an_unknown_name_offers_three(written, offered):
    """F34: `GGX` listed all 48 models."""
    with pytest.raises(KeyError) as refused:
        catalogue[written]
    text = refused.value.args[0]
    assert offered in text
    assert text.count(",") <= 2
    if offered == "nearest: ":
        assert len(text.partition("nearest: ")[2].split(", ")) == 3


def test_names_in_reports_are_clipped():
    scan = gonio.join({HOSTILE * 50: surface(), "b": surface()})
    solution = fit(Problem(catalogue["lambert"], scan))
    assert len(str(solution)) < 3000
    assert len(repr(solution)) <= 300
    assert len(solution._repr_html_()) < 20_000
