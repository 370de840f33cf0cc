"""Height maps from files: every own format to the last digit, those of instruments, and what is refused."""

import struct
import sys
import time
from itertools import pairwise

import numpy as np
import pytest

import gonio
import height_files as made
from gonio.files import FormatError
from gonio.topography import level, make_heights, statistics
from gonio.topography.heights import pitch
from places import SHARED

TOPOGRAPHY = SHARED / "topography"


def real(name):
    if not (TOPOGRAPHY / name).exists():
        pytest.skip("the measured height maps are not beside the project")
    return TOPOGRAPHY / name


def same(heights, missing=None, digits=6):
    wanted = made.HEIGHTS.copy()
    if missing:
        wanted[missing] = np.nan
        assert heights["mask"].values[missing] == 1
    np.testing.assert_allclose(heights["z"].values, wanted, atol=10.0**-digits)
    np.testing.assert_allclose(pitch(heights), made.PITCH, rtol=1e-9)
    assert {heights[name].attrs["units"] for name in ("z", "x", "y")} == {"um"}


def test_the_standards_own_example():
    """The ASCII example of ISO 25178-71: 7 points in each of 4 profiles, 1 um apart."""
    heights = gonio.read_heights(real("sdf-1.sdf"))
    assert heights["z"].shape == (4, 7)
    assert pitch(heights) == (1.0, 1.0)
    assert heights["z"].values[0].tolist() == pytest.approx([1.0, 0.99874, 0.99495, 0.98865, 0.97986, 0.96858, 1.0])
    assert heights["z"].values[3, 6] == pytest.approx(0.97986)
    assert "S2 Softgauges Example" in heights.attrs["provenance"]
    assert "ManufacID: ISOTC213" in heights.attrs["provenance"]


def test_sdf_in_text(tmp_path):
    same(gonio.read_heights(made.sdf_text(tmp_path / "a.sdf")))
    same(gonio.read_heights(made.sdf_text(tmp_path / "b.sdf", missing=(2, 3))), missing=(2, 3))


@pytest.mark.parametrize("dtype", ["<f8", "<f4", "<i4", "<u4", "<i2", "<u2"])
def test_sdf_in_binary(tmp_path, dtype):
    """Whole numbers mark a missing point by the extreme of their type, floating ones by NaN."""
    same(gonio.read_heights(made.sdf_binary(tmp_path / "a.sdf", dtype, missing=(4, 7))), missing=(4, 7), digits=4)


@pytest.mark.parametrize("dtype", ["<f8", "<f4", "<i4", "<i2"])
def test_x3p(tmp_path, dtype):
    """Pixels need not be square, whole numbers have a step and an offset, and bits say which points are valid."""
    same(gonio.read_heights(made.x3p(tmp_path / "a.x3p", dtype)), digits=4)
    heights = gonio.read_heights(made.x3p(tmp_path / "b.x3p", dtype, missing=(0, 5)))
    same(heights, missing=(0, 5), digits=4)
    assert "Model: test" in heights.attrs["provenance"]


@pytest.mark.parametrize(
    ("separator", "head", "stated"),
    [
        (",", "", {"pitch": made.PITCH}),
        (";", "# panel 7\n", {"pitch": made.PITCH}),
        ("\t", "", {"pitch": made.PITCH, "unit": "um"}),
        (" ", made.GWYDDION, {}),
        ("  ", "", {"pitch": made.PITCH}),
    ],
)
def test_matrices_in_text(tmp_path, separator, head, stated):
    same(gonio.read_heights(made.text(tmp_path / "a.txt", separator, head), **stated))


def test_matrices_of_numpy(tmp_path):
    for z in (made.HEIGHTS, np.asfortranarray(made.HEIGHTS), made.HEIGHTS.astype(">f8")):
        same(gonio.read_heights(made.npy(tmp_path / "a.npy", z), pitch=made.PITCH))
    nanometres = gonio.read_heights(made.npy(tmp_path / "b.npy", 1000 * made.HEIGHTS), pitch=made.PITCH, unit="nm")
    same(nanometres)
    assert "took heights in nm" in nanometres.attrs["history"]


def test_a_matrix_that_does_not_say_its_pitch_is_refused_with_the_remedy(tmp_path):
    for path in (made.npy(tmp_path / "a.npy"), made.text(tmp_path / "a.csv")):
        with pytest.raises(FormatError, match=r"how far its points are apart: give the pitch in um \(pitch=0.5"):
            gonio.read_heights(path)
    with pytest.raises(ValueError, match="which says pitch and unit itself"):
        gonio.read_heights(made.sdf_text(tmp_path / "a.sdf"), pitch=1.0)
    with pytest.raises(ValueError, match="unit of heights 'inch' is not known: give m, mm, um, nm or pm"):
        gonio.read_heights(made.npy(tmp_path / "a.npy"), pitch=1.0, unit="inch")


def test_an_array_of_objects_is_never_loaded(tmp_path):
    np.save(tmp_path / "a.npy", np.array([[1, None], [2, 3]], dtype=object))
    with pytest.raises(FormatError, match=r"byte 10: holds elements of the type '\|O'"):
        gonio.read_heights(tmp_path / "a.npy", pitch=1.0)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"<SizeX>12<": "<SizeX>13<"}, r"bindata/data.bin has 864 bytes, and the matrix needs 936"),
        ({"<SizeZ>1<": "<SizeZ>2<"}, r"main.xml, line 8: SizeZ is 2: gonio reads one layer"),
        ({"<DataType>D</DataType></CZ>": "<DataType>Q</DataType></CZ>"}, "DataType is Q, and I, L, F, D are known"),
        ({"0.5e-6": "nothing"}, "Increment is 'nothing', not a finite number"),
        ({"bindata/data.bin": "elsewhere.bin"}, "names elsewhere.bin, which the archive does not hold"),
        ({"<MD5ChecksumPointData>": "<MD5ChecksumPointData>00"}, "another checksum than the file says"),
        (
            {"<AxisType>I</AxisType><DataType>D</DataType><Increment>0.5": "<AxisType>A</AxisType><Increment>0.5"},
            "CX is of",
        ),
    ],
)
def test_a_wrong_x3p_says_where(tmp_path, change, said):
    with pytest.raises(FormatError, match=said):
        gonio.read_heights(made.x3p(tmp_path / "a.x3p", changes=change))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("NumPoints = 12", "NumPoints = 13", r"line 2[0-9]: holds 108 of the 117 heights that the header promises"),
        ("NumPoints = 12", "NumPoints = 11", r"line 2[0-9]: holds more than the 99 heights"),
        ("NumPoints = 12", "NumPoints = many", "line 3: NumPoints is 'many', not a number of points"),
        ("Zscale = 1.0E-6\n", "", "line 11: the header does not say Zscale"),
        ("Compression = 0", "Compression = 1", "line 9: is compressed"),
        ("Xscale = 0.5E-6", "Xscale = 5", "line 5: the side along x is 6e.07 um .* maps are 1 um to 1 m wide"),
        ("Xscale = 0.5E-6", "Xscale = 5e-9", r"line 5: the side along x is 0.06 um \(12 points of 0.005 um\)"),
        ("Zscale = 1.0E-6", "Zscale = 0", "every height is the same"),
        ("Zscale = 1.0E-6", "Zscale = 1", "more than 1 m: check the unit of the heights"),
        ("Zscale = 1.0E-6", "Zscale = 0.1", "no surface is so steep; check the unit of the heights"),
    ],
)
def test_a_wrong_sdf_says_where(tmp_path, old, new, said):
    path = made.sdf_text(tmp_path / "a.sdf")
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(FormatError, match=said):
        gonio.read_heights(path)


def test_too_many_missing_points_are_refused(tmp_path):
    z = made.HEIGHTS.copy()
    z.ravel()[: z.size // 5] = np.nan
    assert gonio.read_heights(made.npy(tmp_path / "a.npy", z), pitch=1.0)["mask"].values.sum() == z.size // 5
    z.ravel()[: z.size // 5 + 1] = np.nan
    with pytest.raises(FormatError, match=r"20.4 % of the points are missing, more than 20 %: measure again"):
        gonio.read_heights(made.npy(tmp_path / "b.npy", z), pitch=1.0)


def test_a_line_of_heights_is_no_map():
    with pytest.raises(ValueError, match="give rows of at least 2 heights"):
        make_heights(np.ones((1, 5)), 1.0)


def test_a_file_of_an_instrument_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
    path = tmp_path / "a.lext"
    path.write_bytes(b"II*\0" + bytes(100))
    with pytest.raises(
        FormatError, match=r"byte 0: is no height map that gonio reads by itself .*pip install 'gonio\["
    ):
        gonio.read_heights(path)


@pytest.fixture
def instruments():
    """SurfaceTopography, which the extra `gonio[topography]` installs."""
    return pytest.importorskip("SurfaceTopography", reason="the extra `topography` is not installed")


@pytest.mark.usefixtures("instruments")
def test_the_alicona_map_to_six_digits():
    """al3d-1: raw and after a least-squares plane, as two other packages and own code have it (surface.md, B.2)."""
    heights = gonio.read_heights(real("al3d-1.al3d"))
    assert heights["z"].shape == (296, 200)
    assert pitch(heights) == pytest.approx((0.438027, 0.438027))
    raw, plane = statistics(heights), statistics(level(heights))
    assert [raw.Sa, raw.Sq, raw.Ssk, raw.Sku] == pytest.approx([6.394044, 7.688266, -0.033113, 2.249766], abs=6e-7)
    assert [plane.Sa, plane.Sq, plane.Ssk, plane.Sku] == pytest.approx(
        [0.230196, 0.289822, -0.004977, 3.071278], abs=6e-7
    )
    for operator, slope in {"forward": 0.089658, "central": 0.087390, "seven-point": 0.085853}.items():
        assert statistics(level(heights), operator).Sdq == pytest.approx(slope, abs=6e-7), operator


@pytest.mark.usefixtures("instruments")
def test_the_zygo_map_has_the_right_counts():
    """metropro-1: phase_res 1 is 32768 counts, not 4096, which would make the heights eight times larger."""
    heights = gonio.read_heights(real("metropro-1.dat"))
    assert heights["z"].shape == (480, 640)
    assert statistics(heights).Sq == pytest.approx(0.075288, abs=6e-7)
    assert "vendor: Zygo" in heights.attrs["provenance"]


@pytest.mark.usefixtures("instruments")
@pytest.mark.parametrize(
    "content", [b"II*\0" + bytes(100), b"II*\0" + 40 * b"a", b"hello\n", bytes(range(256)) * 9], ids=range(4)
)
def test_what_no_reader_knows_is_refused_in_one_line(tmp_path, caplog, content):
    path = tmp_path / "a.lext"
    path.write_bytes(content)
    with pytest.raises(FormatError, match="byte 0: is no height map that SurfaceTopography reads") as caught:
        gonio.read_heights(path)
    assert str(caught.value).isprintable()
    assert "and none of SDF, X3P, NPY" in str(caught.value)
    assert "tried" not in str(caught.value)  # what each of forty readers of another package says
    assert caplog.records == []  # of other packages, which would reach standard error


def lext(path, counts, missing=None, photometric=4, name=b"INVALID"):
    """A TIFF as Olympus LEXT writes it: a page that describes the heights in picometres, and the page of heights.

    missing: points that were not measured, on a page of one bit a point.
    """
    sides = "".join(
        f"<HeightDataPerPixel{a}>{v}</HeightDataPerPixel{a}><HeightDataUnit{a}>0</HeightDataUnit{a}>"
        for a, v in (("X", 625000), ("Y", 500000), ("Z", 100))
    )
    told = f"<?xml version='1.0'?><TiffTagDescData><HeightInfo>{sides}</HeightInfo></TiffTagDescData>".encode()
    scale = "".join(
        f"<MakerCalibrationValue{a}>{v}</MakerCalibrationValue{a}>"
        for a, v in (("X", 1000000), ("Y", 1000000), ("Z", 1020000))
    )
    inner = "ImageCommonSettingsInfo"
    device = f"<?xml version='1.0'?><ExifTagDescData><{inner}>{scale}</{inner}></ExifTagDescData>".encode()
    rows, columns = counts.shape
    content = bytearray(b"II*\0" + bytes(4))

    def put(data):
        content.extend(bytes(-len(content) % 2))
        at = len(content)
        content.extend(data)
        return at

    def directory(entries):
        def field(tag, kind, count, value):
            raw = value if isinstance(value, bytes) else struct.pack("<I", value)
            return struct.pack("<HHI", tag, kind, count) + (
                raw.ljust(4, b"\0") if len(raw) <= 4 else struct.pack("<I", put(raw))
            )

        packed = [field(*entry) for entry in sorted(entries)]
        return put(struct.pack("<H", len(packed)) + b"".join(packed) + bytes(4))

    def page(description, pixels, bits, more=(), shape=(rows, columns), kind=1):
        data = put(pixels)
        size = [(256, 4, 1, shape[1]), (257, 4, 1, shape[0]), (258, 3, 1, bits), (259, 3, 1, 1), (262, 3, 1, kind)]
        strips = [(273, 4, 1, data), (277, 3, 1, 1), (278, 4, 1, shape[0]), (279, 4, 1, len(pixels))]
        return directory([*size, (270, 2, len(description) + 1, description + b"\0"), *strips, *more])

    exif = directory([(41995, 2, len(device) + 1, device + b"\0")])
    first = page(told, bytes(rows * columns), 8, [(34665, 4, 1, exif)])
    second = page(b"HEIGHT", counts.astype("<u2").tobytes(), 16)
    pages = [first, second]
    if missing is not None:
        pages.append(page(name, np.packbits(missing, axis=1).tobytes(), 1, shape=missing.shape, kind=photometric))
    content[4:8] = struct.pack("<I", first)
    for this, following in pairwise(pages):
        end = this + 2 + 12 * struct.unpack_from("<H", content, this)[0]
        content[end : end + 4] = struct.pack("<I", following)
    path.write_bytes(bytes(content))
    return path


@pytest.mark.usefixtures("instruments")
def test_a_file_of_the_papers_microscope(tmp_path):
    """Olympus LEXT: counts times HeightDataPerPixelZ times MakerCalibrationValueZ times 1e-12 are micrometres."""
    counts = np.arange(9000, 9120, dtype="<u2").reshape(10, 12)
    heights = gonio.read_heights(lext(tmp_path / "a.lext", counts))
    assert pitch(heights) == pytest.approx((0.625, 0.5))
    np.testing.assert_allclose(heights["z"].values, counts.astype(float) * 100 * 1.02e6 * 1e-12, rtol=1e-9)


@pytest.mark.usefixtures("instruments")
@pytest.mark.parametrize(("photometric", "name"), [(4, b"INVALID"), (1, b"Invalid"), (4, b"")])
def test_points_that_a_microscope_did_not_measure_are_missing(tmp_path, photometric, name):
    """Their counts are whatever the microscope left there, here a pit of all the depth."""
    counts = np.arange(9000, 9120, dtype="<u2").reshape(10, 12)
    missing = np.zeros((10, 12), dtype=bool)
    missing[2, 3] = missing[9, 11] = missing[4, 8:10] = True
    counts[missing] = 0
    heights = gonio.read_heights(lext(tmp_path / "a.lext", counts, missing, photometric, name))
    np.testing.assert_array_equal(np.isnan(heights["z"].values), missing)
    np.testing.assert_array_equal(heights["mask"].values == 1, missing)
    assert statistics(heights).Sz < 0.02
    whole = gonio.read_heights(lext(tmp_path / "b.lext", counts, 0 * missing, photometric, name))
    assert not np.isnan(whole["z"].values).any()


@pytest.mark.usefixtures("instruments")
def test_a_mask_of_another_size_is_refused(tmp_path):
    counts = np.arange(9000, 9120, dtype="<u2").reshape(10, 12)
    with pytest.raises(FormatError, match=r"missing points and that of heights differ in size: 9 x 12 and 10 x 12"):
        gonio.read_heights(lext(tmp_path / "a.lext", counts, np.zeros((9, 12), dtype=bool)))


@pytest.mark.usefixtures("instruments")
def test_too_many_points_that_were_not_measured_are_refused(tmp_path):
    counts = np.arange(9000, 9120, dtype="<u2").reshape(10, 12)
    with pytest.raises(FormatError, match=r"30.0 % of the points are missing"):
        gonio.read_heights(lext(tmp_path / "a.lext", counts, np.arange(120).reshape(10, 12) < 36))


def test_a_wide_row_is_read_in_a_moment(tmp_path):
    """Rows of many columns once took a time that grew with the square of their number."""
    path = tmp_path / "wide.csv"
    path.write_text("\n".join(",".join(str((k * row) % 7) for k in range(20_000)) for row in (1, 2)) + "\n")
    begun = time.process_time()
    assert gonio.read_heights(path, pitch=1.0)["z"].shape == (2, 20_000)
    assert time.process_time() - begun < 1.5  # it took 20 s
