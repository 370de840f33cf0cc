"""Text from outside, made harmless without loss."""

import csv
import io

from hypothesis import given
from hypothesis import strategies as st

from gonio.outside import FORMULA, as_cell, from_cell, printable


@given(st.text())
def test_what_is_printed_can_be_printed(text):
    assert printable(text).isprintable()
    assert printable(text, keep="\n").replace("\n", "").isprintable()


def test_what_can_be_printed_stays_and_the_rest_is_its_escape():
    assert printable("µm ± [s] <b>") == "µm ± [s] <b>"
    assert printable("\x1b[2J\u202eü\n") == "\\x1b[2J\\u202eü\\n"


@given(st.text(st.sampled_from("'=+-@\ta1 ,\"")) | st.text())
def test_a_cell_is_no_formula_and_comes_back(text):
    assert not as_cell(text).startswith(FORMULA)
    assert from_cell(as_cell(text)) == text
    written = io.StringIO()
    csv.writer(written).writerow([as_cell("=cmd|' /C calc'!A0")])
    assert written.getvalue().startswith("'=")


def test_ordinary_cells_stay_as_they_are():
    for text in ("", "R", "a=b", "'quoted'", "it's", "12"):
        assert as_cell(text) == text
