"""What a stored fit must hold to be taken up again: each fault in one sentence that names it and its byte."""

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, simulate
from gonio.files import FormatError
from gonio.fitting import Solution, fit


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """The Dataset of a file that `Solution.save` wrote, whole in memory."""
    model = catalogue["torrance-sparrow"]
    values = {"ks": 0.4, "kd": 0.1, "sigma": 0.2}
    path = tmp_path_factory.mktemp("fit") / "fit.nc"
    fit(Problem(model, simulate(model, values, [20.0, 50.0], np.arange(-70, 71, 10.0), noise=0.01))).save(path)
    return xr.load_dataset(path, engine="scipy")


def value(number):
    def change(data):
        data["value"][2] = number
        return data

    return change


FAULTS = {
    "sigma is -0.2, below zero": value(-0.2),
    "sigma is 1e-300, too near to zero": value(1e-300),
    "a value is larger than any": value(1e200),
    "an uncertainty is below zero": lambda data: data.assign(uncertainty=-data["uncertainty"]),
    "has no variable held": lambda data: data.drop_vars("held"),
    "value is not an array of numbers": lambda data: data.assign(value=("parameter", ["a", "b", "c"])),
    "attribute weighting is 'heavy'": lambda data: data.assign_attrs(weighting="heavy"),
    "attribute points is 'many', not a number": lambda data: data.assign_attrs(points="many"),
    "number of points or of values is not one": lambda data: data.assign_attrs(points=-1),
    "fit of 'phongg', which is not in the catalogue": lambda data: data.assign_attrs(model="phongg"),
    "parameters are not those of ggx": lambda data: data.assign_attrs(model="ggx"),
    "scan_brdf holds not one value for each of the 31 points": lambda data: data.assign_attrs(points=31),
    "has no variable scan_weight": lambda data: data.drop_vars("scan_weight"),
    "scan_theta_r is outside 0 to 90 deg": lambda data: data.assign(scan_theta_r=data["scan_theta_r"] + 60),
    "scan_weight is below zero": lambda data: data.assign(scan_weight=-data["scan_weight"]),
    "scan_brdf holds what is no number": lambda data: data.assign(scan_brdf=data["scan_brdf"] / 0),
    "scan_phi has the dimensions": lambda data: data.assign(scan_phi=("step", data["scan_phi"].values[:1])),
    "the attribute answer cannot be read": lambda data: data.assign_attrs(answer='{"verdict": {}}'),
    r"the attribute answer cannot be read \(it is no answer": lambda data: data.assign_attrs(answer="[" * 100_000),
    r"the attribute answer cannot be read \(Expecting": lambda data: data.assign_attrs(answer="{"),
    "holds no solution of a fit": lambda data: data.assign_attrs(content="a song"),
}


def test_what_is_whole_is_loaded(stored, tmp_path):
    stored.to_netcdf(tmp_path / "fit.nc", engine="scipy")
    assert Solution.load(tmp_path / "fit.nc").values == pytest.approx({"ks": 0.4, "kd": 0.1, "sigma": 0.2}, rel=0.1)


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_is_named(stored, tmp_path, fault):
    path = tmp_path / "fit.nc"
    FAULTS[fault](stored.copy(deep=True)).to_netcdf(path, engine="scipy")
    with pytest.raises(FormatError, match=rf"fit\.nc, byte \d+: .*{fault}") as refused:
        Solution.load(path)
    assert "\n" not in str(refused.value)
