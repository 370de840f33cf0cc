"""The XML of WINDOW as gonio writes it: what pyWinCalc and Radiance need, and what is said where they see nothing."""

import re

import pytest
import xarray as xr

from gonio import convert, read, write
from samples.radiance import BANDS, COARSE, WAVELENGTH, block, file, matrix, texts

FRONT = "Reflection Front"


def written(folder, text):
    path = folder / "file.xml"
    path.write_text(text, encoding="utf-8")
    return path


def matrix_scan(folder):
    return read(written(folder, texts()["columns"]))


MATERIAL = """<Material>
<Name>Weave &amp; film</Name>
<ProductName>W 5500</ProductName>
<Manufacturer>Nobody</Manufacturer>
<Thickness unit="Millimeter">1.25</Thickness>
<DeviceType>Woven shade</DeviceType>
<ThermalConductivity unit="WPerMeterK">0.15</ThermalConductivity>
<AirPermeability>0.2</AirPermeability>
<EmissivityFront>0.79626</EmissivityFront>
<EmissivityBack>0.7</EmissivityBack>
<TIR>0.10916</TIR>
<EffectiveOpennessFraction>0.04</EffectiveOpennessFraction>
<PermeabilityFactor>0.049855</PermeabilityFactor>
<OpticalProperties>
<Transmittance>0.1</Transmittance>
<ReflectanceFront>0.2</ReflectanceFront>
<ReflectanceBack>0.25</ReflectanceBack>
<Comments>at the normal</Comments>
</OpticalProperties>
<Color>white</Color>
<AERCAcceptance>@</AERCAcceptance>
<Comments>two layers</Comments>
<Width unit="Meter">1.5</Width>
<Height unit="Meter">2</Height>
<Openness>0.05</Openness>
</Material>
"""
BANDS_OF_WINDOW = (("Visible", "CIE D65", "CIE Y"), ("Solar", "ASTM E891", "None"))


def window_file():
    """A file as WINDOW writes it: a WavelengthData for each direction, spectra that differ between the two ranges."""
    parts = []
    for n, (name, source, detector) in enumerate(BANDS_OF_WINDOW):
        spectra = f"<SourceSpectrum>{source}</SourceSpectrum>\n<DetectorSpectrum>{detector}</DetectorSpectrum>\n"
        for m, direction in enumerate(("Transmission Front", "Transmission Back", FRONT, "Reflection Back")):
            data = WAVELENGTH.format(
                unit="Integral", name=name, blocks=block(direction, COARSE, matrix(40 * n + 9 * m))
            )
            parts.append(data.replace("<WavelengthDataBlock>", f"{spectra}<WavelengthDataBlock>"))
    text = file("Columns", BANDS, *parts)
    return text[: text.index("<Material>")] + MATERIAL + text[text.index("<DataDefinition>") :]


def test_every_element_of_a_material_and_the_spectra_of_each_range_come_back(tmp_path):
    scan = read(written(tmp_path, window_file()))
    write(scan, tmp_path / "again.xml")
    text = (tmp_path / "again.xml").read_text(encoding="utf-8")
    assert MATERIAL in text
    xr.testing.assert_equal(read(tmp_path / "again.xml"), scan)
    found = re.findall(r">(\w+)</Wavelength>\n<SourceSpectrum>(.*)</S.*>\n<DetectorSpectrum>(.*)</D", text)
    assert sorted(found) == sorted(4 * BANDS_OF_WINDOW)


def test_each_direction_has_a_wavelength_data_of_its_own(tmp_path):
    """PyWinCalc reads the first block of each and passes over the rest."""
    write(read(written(tmp_path, window_file())), tmp_path / "again.xml")
    parts = (tmp_path / "again.xml").read_text(encoding="utf-8").split("<WavelengthData>")[1:]
    assert [part.count("<WavelengthDataBlock>") for part in parts] == 8 * [1]


@pytest.mark.parametrize(
    "line",
    [
        "Thickness: thin",
        "Thickness: 2 mm",
        "EmissivityFront: unknown",
        "TIR: nan",
        "Width: 3 mm beam",
        "OpticalProperties Transmittance: much",
    ],
)
def test_a_word_for_a_number_stays_a_remark(line, tmp_path):
    """PyWinCalc refuses the whole file for one, and takes a length in an unknown unit as it stands."""
    write(matrix_scan(tmp_path).assign_attrs(provenance=line), tmp_path / "again.xml")
    text = (tmp_path / "again.xml").read_text(encoding="utf-8")
    assert line in text[: text.index("-->")]
    assert '<Thickness unit="Meter">0</Thickness>' in text
    assert len(re.findall("<(Emissivity|TIR|Width|Optical[A-Z])", text)) == 0


def test_a_thickness_without_a_unit_is_in_metres(tmp_path):
    write(matrix_scan(tmp_path).assign_attrs(provenance="Thickness: 0.002"), tmp_path / "again.xml")
    assert '<Thickness unit="Meter">0.002</Thickness>' in (tmp_path / "again.xml").read_text(encoding="utf-8")


def test_what_a_scan_has_no_place_for_is_left_out_with_a_word(tmp_path):
    absorbed = block("Absorbed Front", COARSE, "0.1 " * 5)
    blocks = block(FRONT, COARSE, matrix(1)) + "\n" + absorbed
    text = file("Columns", BANDS, WAVELENGTH.format(unit="Integral", name="Visible", blocks=blocks))
    shape = "<Geometry><BlindWidth>0.016</BlindWidth></Geometry>"
    text = text.replace("<DataDefinition>", f"{shape}\n<DataDefinition>")
    history = read(written(tmp_path, text)).attrs["history"]
    assert "left out Absorbed Front, which is not scattered" in history
    assert "left out Geometry, the shape of the layer" in history


@pytest.mark.parametrize(
    ("name", "values", "seen"),
    [
        ("channel", ["Visible"], True),
        ("channel", ["Solar"], True),
        ("channel", ["633 nm"], True),
        ("wavelength", [633.0], True),
        ("channel", ["Visible", "Solar"], True),
        ("channel", ["X", "Y", "Z"], True),
        ("channel", ["R", "G", "B"], False),
        ("wavelength", [450.0, 550.0], False),
    ],
)
def test_radiance_sees_a_file_or_the_history_says_that_it_does_not(name, values, seen, tmp_path):
    scan = matrix_scan(tmp_path).isel(channel=0, drop=True)
    scan = scan.expand_dims({name: values}).transpose("mode", "side", name, ...)
    done = convert(scan, tmp_path / "again.xml")
    text = (tmp_path / "again.xml").read_text(encoding="utf-8")
    assert ('<Wavelength unit="Integral">Visible</Wavelength>' in text) == seen
    assert (f"choose one with --select {name}={values[0]}" in done.scan.attrs["history"]) != seen
    renamed = len(values) == 1 and values != ["Visible"]
    assert list(done.left_out) == ([f"{name} {values[0]}, stored as Visible"] if renamed else [])
