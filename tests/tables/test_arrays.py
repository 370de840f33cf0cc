"""Scans of arrays and of data frames."""

import numpy as np
import pytest

from gonio import from_pandas, read, scan, write


def test_arrays_are_broadcast(tmp_path):
    made = scan(np.array([10, 30])[:, None], [-40, 0, 40], [[1, 2, 3], [4, 5, 6]], uncertainty=0.1, wavelength=650)
    assert made["theta_i"].values.tolist() == [10, 10, 10, 30, 30, 30]
    assert made["theta_r"].values.tolist() == [40, 0, 40] * 2
    assert made["phi"].values.tolist() == [0, 180, 180] * 2
    assert made["brdf"].values.tolist() == [1, 2, 3, 4, 5, 6]
    assert set(made["uncertainty"].values.tolist()) == {0.1}
    write(made, tmp_path / "scan.csv")
    assert read(tmp_path / "scan.csv")["wavelength"].values.tolist() == [650] * 6


def test_an_azimuth_and_relative_data():
    made = scan(30, [20, 40], [1, np.nan], phi=[0, 90], unit="a.u.", phi_i=[0, 45], channel=["R", "R"])
    assert made["phi"].values.tolist() == [0, 90]
    assert made["phi_i"].values.tolist() == [0, 45]
    assert made["brdf"].attrs["units"] == "a.u."
    assert made["channel"].values.tolist() == ["R", "R"]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"theta_i": 100}, "theta_i is 100 deg, outside 0 to 90"),
        ({"theta_r": np.nan}, "theta_r is nan deg, outside -90 to 90"),
        ({"theta_r": -10, "phi": 0}, "outside 0 to 90"),
        ({"phi": np.inf}, "phi has values that are not finite"),
        ({"brdf": np.inf}, "brdf has values that are infinite"),
        ({"brdf": "bright"}, "brdf is not an array of numbers"),
        ({"brdf": []}, "there are no values"),
        ({"brdf": [1, 2], "theta_r": [1, 2, 3]}, "do not fit together"),
        ({"unit": "cd"}, "neither 'sr-1' nor"),
        ({"colour": "R"}, "a scan has no 'colour'"),
        ({"wavelength": -1}, "not a positive number"),
        ({"mode": "through"}, "mode is 'through'"),
    ],
)
def test_arrays_that_are_no_scan(given, said):
    with pytest.raises(ValueError, match=said):
        scan(**({"theta_i": 30, "theta_r": 20, "brdf": 1.0} | given))


FRAME = {"AOI": [10, 30], "AOS": [-60.0, 30.0], "BRF [%]": [50.0, None], "note": ["a", "b"]}


def frames():
    import pandas

    class Frame:
        """A frame of another library: names, and columns by name."""

        columns = tuple(FRAME)

        def __getitem__(self, name):
            return FRAME[name]

    return {"pandas": pandas.DataFrame(FRAME), "dict": FRAME, "another": Frame()}


@pytest.mark.parametrize("kind", ["pandas", "dict", "another"])
def test_a_data_frame_is_read_as_a_file_of_it(tmp_path, kind):
    made = from_pandas(frames()[kind])
    assert made["theta_r"].values.tolist() == [60, 30]
    np.testing.assert_allclose(made["brdf"].values, [0.5 / np.pi, np.nan])
    assert made["note"].values.tolist() == ["a", "b"]


def test_a_data_frame_with_names_of_its_own():
    frame = {"incidence": [10, 30], "rot": [-60.0, 30.0], "y": [1.0, 2.0]}
    made = from_pandas(frame, columns={"rot": "theta_r", "y": "signal"}, flip=True)
    assert made["phi"].values.tolist() == [180, 0]
    assert made["brdf"].attrs["units"] == "a.u."
    with pytest.raises(ValueError, match="DataFrame, line 1: no heading says which column is theta_r and brdf"):
        from_pandas(frame)


@pytest.mark.parametrize("frame", [{}, {"AOI": [1, 2], "AOS": [1]}, {"AOI": [[1, 2]]}, {"AOI": []}])
def test_what_is_no_frame(frame):
    with pytest.raises(ValueError, match="the frame has no"):
        from_pandas(frame)
