"""The Klems XML that gonio writes, as Radiance and pyWinCalc read it: direct-hemispherical values of six scans.

`make crosscheck` writes the files anew and rewrites reference/peers/klems.json. Here they are converted again and what
gonio reads in them is compared with what the programs read then. Where a writer has changed its values on purpose,
the stored ones are of other files, and `make crosscheck` makes them anew.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from crosscheck.klems_files import MEASURED, PROJECTED, SCANS, converted, hemispherical, source_values

PEER = json.loads((Path(__file__).parent / "reference" / "peers" / "klems.json").read_text(encoding="utf-8"))
AGREED = 1e-3  # of the value
PACKED = 3e-4  # of the value: Radiance keeps a chromaticity of few bits for each column, which moves its luminance
DIGITS = 1e-6  # of the value: seven digits are kept
PROGRAMS = {"radiance": PACKED, "pywincalc": DIGITS, "glazing system": DIGITS}


def stored(name, block):
    """The peers' values of one block of a scan by program."""
    columns = {program: PEER["columns"].get(f"{name} | {block} | {program}") for program in PROGRAMS}
    return {program: np.array(values) for program, values in columns.items() if values}


@pytest.mark.parametrize("name", SCANS)
def test_programs_read_what_gonio_reads(name, tmp_path, request):
    if name in MEASURED:
        request.getfixturevalue("shared_scans")  # skips where there are none
    found = hemispherical(converted(name, tmp_path))
    assert list(found) == PEER["surfaces"][name]["blocks"]
    for block, values in found.items():
        programs = stored(name, block)
        assert {"pywincalc", *(["radiance"] if "Visible" in block else [])} <= programs.keys()
        for program, expected in programs.items():
            assert values.shape == expected.shape == (145,)
            np.testing.assert_allclose(values, expected, rtol=AGREED, atol=0, err_msg=f"{block} by {program}")
    for block, expected in source_values(name).items():
        np.testing.assert_allclose(found[block], expected, rtol=0, atol=AGREED, err_msg=f"{block} of the scan itself")


@pytest.mark.parametrize("name", SCANS)
def test_the_stored_values_of_the_programs_agree(name):
    for block in PEER["surfaces"][name]["blocks"]:
        own = np.array(PEER["columns"][f"{name} | {block} | gonio"])
        for program, values in stored(name, block).items():
            np.testing.assert_allclose(values, own, rtol=PROGRAMS[program], atol=0, err_msg=f"{block} by {program}")


def test_what_is_stored_tells_directions_sides_and_bands_apart():
    """No two blocks agree, and none with itself turned or mirrored: a wrong order of patches cannot pass."""
    name = "four directions"
    blocks = PEER["surfaces"][name]["blocks"]
    assert len(blocks) == 8
    ring = slice(1 + 8 + 16, 1 + 8 + 16 + 20)  # patches about 30 deg
    columns = [stored(name, block)["pywincalc"][ring] for block in blocks]
    for k, values in enumerate(columns):
        others = [*columns[:k], *columns[k + 1 :], values[::-1], *(np.roll(values, n) for n in range(1, len(values)))]
        assert min(np.abs(other / values - 1).max() for other in others) > 10 * AGREED
    assert all("glazing system" in stored(name, block) for block in blocks)


def test_the_patches_are_the_whole_hemisphere():
    assert PROJECTED.sum() == pytest.approx(np.pi, rel=1e-14)
    assert PEER["surfaces"].keys() == SCANS.keys()
    assert len(SCANS) == 6
