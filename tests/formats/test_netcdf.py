"""NetCDF files that hold variables as no scan can have them are refused at the byte where these begin."""

import numpy as np
import pytest
from scipy.io import netcdf_file

from gonio import read
from gonio.files import FormatError


def written(path, unit, axis):
    """A dense scan whose theta_r has the dimensions `axis`."""
    with netcdf_file(path, "w") as file:
        file.createDimension("theta_i", 2)
        file.createDimension("theta_r", 3)
        brdf = file.createVariable("brdf", "d", ("theta_i", "theta_r"))
        brdf[:], brdf.units = 1.0, unit
        for name, dims in (("theta_i", ("theta_i",)), ("theta_r", axis), ("phi", ("theta_r",))):
            variable = file.createVariable(name, "d", dims)
            variable[:] = np.arange(1.0, 1.0 + variable[:].size).reshape(variable.shape)
    return path


def test_the_written_file_is_read_where_nothing_is_wrong(tmp_path):
    assert read(written(tmp_path / "scan.nc", "sr-1", ("theta_r",)))["brdf"].shape == (2, 3)


def test_an_axis_of_two_dimensions_is_refused(tmp_path):
    path = written(tmp_path / "scan.nc", "sr-1", ("theta_i", "theta_r"))
    with pytest.raises(FormatError, match=r"byte \d+: theta_r has not one value for each step along its axis"):
        read(path)


def test_a_unit_that_is_no_text_is_refused(tmp_path):
    path = written(tmp_path / "scan.nc", np.array([97, 46], dtype=np.int32), ("theta_r",))
    with pytest.raises(FormatError, match=r"byte \d+: brdf has the unit '\[97 46\]': it needs sr-1, or a.u."):
        read(path)
