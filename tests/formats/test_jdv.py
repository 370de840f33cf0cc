"""The two layouts of the RT-300S text: the same numbers in both, and every error's place."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gonio import read
from gonio.files import FormatError
from gonio.formats import recognise
from gonio.formats.rt300s.jdv import FORMAT
from gonio.measured.check import check
from places import FILES
from samples.jdv import GONIOMETER, RAYWIZ, samples

FOLDER = FILES / "rt300s"
needs_files = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no measured files at {FOLDER}")


def saved(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "text.anything"
    path.write_bytes(text.replace("\n", "\r").encode())
    return path


def test_both_layouts_by_hand(tmp_path):
    for path in samples(tmp_path):
        scan = read(path)
        assert scan["theta_i"].values.tolist() == [0] * 6 + [60] * 6
        assert scan["theta_r"].values.tolist() == [30, 0, 30] * 4
        assert scan["phi"].values.tolist() == [0, 180, 180, 350, 170, 170] * 2  # azimuths -90 and -80 deg
        assert scan["brdf"].values.tolist() == [-1.5, 2.25, 3, 4, 5, 6, -1.5, 2.25, 3, 4, 5, 7]
        assert scan["brdf"].attrs["units"] == "a.u."
        assert scan["scan"].values.tolist() == ["Sample 0"] * 6 + ["Sample 60"] * 6
        assert "Date: 7/12/2011" in scan.attrs["provenance"]


@needs_files
def test_the_samples_of_the_exporter_hold_the_same_numbers():
    goniometer, raywiz = (read(FOLDER / f"test_{name}.jdv") for name in ("jdv", "raywiz"))
    assert recognise(FOLDER / "test_jdv.jdv") is recognise(FOLDER / "test_raywiz.jdv") is FORMAT
    xr.testing.assert_equal(goniometer, raywiz)
    assert list(dict.fromkeys(goniometer["scan"].values.tolist())) == [
        "Sample 0",
        "Sample 60",
        "Sample 0 (2)",
        "Sample 60 (2)",
    ]
    assert not goniometer["brdf"].values[:12].any()
    assert goniometer["brdf"].values[12:15].tolist() == [-26875.9, -30410.93, -48523.83]
    assert goniometer["brdf"].values[-1] == -42487.36
    assert "every value of Sample 0, Sample 60 is zero" in goniometer.attrs["history"]


def test_all_zero_is_read_and_flagged(tmp_path):
    text = RAYWIZ.format(incidence=10, last=0)
    for number in ("-1.5", "2.25", "\t5", "\n3\t", "\t4"):
        text = text.replace(number, number.replace(number.strip(), "0"))
    scan = read(saved(tmp_path, text))
    assert "scan" not in scan.coords
    assert not np.any(scan["brdf"].values)
    assert "every value is zero" in scan.attrs["history"]
    assert any("every brdf value is zero" in f.what for f in check(scan))


@pytest.mark.parametrize(
    ("layout", "old", "new", "place", "what"),
    [
        (GONIOMETER, "RT-300S", "RT-400", "line 1", "neither BRDF(RT-300S) nor"),
        (GONIOMETER, "SampleID", "Sample", "line 2", "SampleID: was expected"),
        (GONIOMETER, "Incidence:\t10", "Incidence:\tx", "line 4", "the incidence angle is 'x'"),
        (GONIOMETER, "Incidence:\t10", "Incidence:\t100", "line 11", "outside 0 to 90"),
        (GONIOMETER, "-30,30,30", "-30,30", "line 5", "2 numbers where Polar: has three"),
        (GONIOMETER, "-30,30,30", "-30,30,0", "line 5", "does not lead"),
        (GONIOMETER, "-30,30,30", "-30,30,7", "line 5", "does not lead"),
        (GONIOMETER, "-30,30,30", "-30,30,1e-300", "line 5", "does not lead"),
        (GONIOMETER, "-30,30,30", "-30,1e300,30", "line 5", "outside -90 to 90"),
        (GONIOMETER, "-30,30,30", "-30,30,0.01", "line 6", "promises 12002 values"),
        (GONIOMETER, "\t-30\t0\t30", "\t-30\t1\t30", "line 9", "polar angle is not that"),
        (GONIOMETER, "\n-80", "\n-70", "line 11", "azimuth is not that"),
        (GONIOMETER, "2.25", "inf", "line 10", "not a finite number"),
        (RAYWIZ, "1\t1\t2", "2\t1\t2", "line 4", "more than one incidence angle"),
        (RAYWIZ, "1\t1\t2", "1\t1\t999999", "line 5", "steps from -30 to 30"),
        (RAYWIZ, "-90\t-80", "-90\t-280", "line 5", "outside -180 to 180"),
        (RAYWIZ, "3\t0", "3", "line 11", "ends after 5 of 6"),
    ],
)
def test_errors_name_their_line(tmp_path, layout, old, new, place, what):
    text = layout.format(incidence=10, last=0)
    assert old in text
    with pytest.raises(FormatError) as error:
        FORMAT.read(saved(tmp_path, text.replace(old, new, 1)))
    assert what in error.value.what
    assert error.value.where == place
