"""The declaration of a model, and what it refuses."""

from typing import Annotated

import numpy as np
import pytest

from gonio import Geometry, Model, catalogue
from gonio.model import Dimensionless, Parameter

Width = Annotated[float, Parameter(1.0, 0.1, 5.0, "a width")]
Other = Annotated[float, Parameter(2.0, 0.1, 5.0, "another width")]


def lobe(g, a: Width) -> Dimensionless:
    """A lobe."""
    return g.cos_r**a


def other_lobe(g, a: Other) -> Dimensionless:
    """Another lobe."""
    return g.cos_i**a


def undeclared(g, a: float) -> Dimensionless:
    """No Parameter."""
    return g.cos_r**a


def without_unit(g, a: Width):
    """No unit."""
    return g.cos_r**a


def test_shape_is_read_from_the_signatures():
    model = Model(name="m", title="t", cite="c", terms={"one": lobe, "two": lobe})
    assert model.weights == ("one", "two")
    assert list(model.shape) == ["a"]
    assert model.shape["a"].upper == 5.0


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ({"one": lobe, "two": other_lobe}, "declare 'a' differently"),
        ({"a": lobe}, "both a weight and a shape parameter"),
        ({"one": undeclared}, "needs one Parameter"),
    ],
)
def test_bad_declarations_are_refused(terms, message):
    with pytest.raises(ValueError, match=message):
        Model(name="m", title="t", cite="c", terms=terms)


def test_a_term_needs_its_unit():
    with pytest.raises(ValueError, match="return annotation"):
        Model(name="m", title="t", cite="c", terms={"one": without_unit})


def test_default_outside_its_bounds():
    with pytest.raises(ValueError, match=r"outside 0\.1\.\.1"):
        Parameter(2.0, 0.1, 1.0, "too wide")


def test_values_by_name():
    model = catalogue["cauchy-lorentz"]
    g = Geometry.in_plane(30.0, 30.0)
    assert model(g, {"ks": 397, "sigma": 0.142}) == pytest.approx(397 * 2.6310081, rel=1e-6)
    with pytest.raises(ValueError, match="at least one weight: ks, kdd, kid"):
        model(g, {"sigma": 0.142})
    with pytest.raises(ValueError, match="no parameter 'sigm'"):
        model(g, {"ks": 1.0, "sigm": 0.1})
    with pytest.raises(KeyError, match="nearest: cauchy-lorentz"):
        catalogue["cauchy-lorenz"]


def test_values_may_differ_by_direction():
    model = catalogue["torrance-sparrow"]
    theta_r = np.array([20.0, 30.0])
    both = model(Geometry.in_plane(30.0, theta_r), {"ks": np.array([1.0, 2.0]), "sigma": np.array([0.1, 0.2])})
    for k, (weight, slope) in enumerate([(1.0, 0.1), (2.0, 0.2)]):
        assert both[k] == pytest.approx(model(Geometry.in_plane(30.0, theta_r[k]), {"ks": weight, "sigma": slope}))
