"""What a table does not say for certain is an error of one line, with the command that settles it."""

import re
import shlex

import numpy as np
import pytest

from gonio import read, read_table
from gonio.app.cli import main
from gonio.files import FormatError

ROWS = "10,-60,0.1\n10,10,0.5\n30,30,0.6\n"
# A table, what the error says, and the flags that its command has beside --out.
ASKED = {
    "two values": (
        "AOI,AOS,BRDF,ccBRDF\n10,-60,.1,.05\n",
        "may each be the values",
        "--columns BRDF=brdf,ccBRDF=ignore",
    ),
    "twice": ("AOI,AOS,BRDF,BRDF\n10,-60,.1,.05\n", "may each be the values", "--columns 3=brdf,4=ignore"),
    "two incidences": (
        "AOI,theta_i,AOS,BRDF\n10,20,5,.1\n",
        "may each be theta_i",
        "--columns AOI=theta_i,theta_i=ignore",
    ),
    "reflectance": (f"AOI,AOS,reflectance\n{ROWS}", "one of several quantities", "--quantity reflectance-factor"),
    "which logarithm": (f"AOI,AOS,log BRDF\n{ROWS}", "one of several quantities", "--quantity log10-brdf"),
    "BRDF in percent": (
        f"AOI,AOS,BRDF [%]\n{ROWS}",
        "in percent, which no brdf is",
        "--quantity reflectance-factor:percent",
    ),
    "volts": (f"AOI,AOS,BRDF [V]\n{ROWS}", "detector's signal", "--quantity signal"),
    "two titles": (f"BRF or BRDF\nAOI,AOS,value\n{ROWS}", "names brdf and reflectance-factor", "--quantity brdf"),
    "no unit": ("theta_i,theta_r,brdf\n0.5,-1.2,.1\n", "no unit", "--columns theta_i=theta_i:rad,theta_r=theta_r:rad"),
    "near the normal": (
        "theta_i,theta_r,brdf\n5,-6,.1\n",
        "no unit",
        "--columns theta_i=theta_i:deg,theta_r=theta_r:deg",
    ),
    "phi in radians": (
        "theta_i,theta_r,phi,brdf\n30,20,3.14159,.1\n",
        "degrees or radians",
        "--columns theta_i=theta_i:deg,theta_r=theta_r:deg,phi=phi:deg",
    ),
    "unit not known": (
        f"AOI [grad],AOS [deg],BRDF\n{ROWS}",
        "'grad' where a unit",
        "--columns 'AOI [grad]=theta_i:deg'",
    ),
    "wavelength": ("lambda,AOI,AOS,BRDF\n0.65,10,7,.1\n", "without a unit", "--columns lambda=wavelength:um"),
    "expanded": ("AOI,AOS,BRDF,U\n10,7,.1,.01\n", "not by which factor k", "--columns U=uncertainty:k=2"),
    "percent of percent": (
        "AOI,AOS,BRF [%],u [%]\n10,7,1,2\n",
        "relative or percentage points",
        "--columns 'u [%]=uncertainty:percent:relative'",
    ),
    "no names": (ROWS, "not understood: number 1", "--columns 1=theta_i,2=theta_r,3=brdf"),
    "other names": ("AOI,rot,val\n10,5,.1\n", "not understood: 'rot', 'val'", "--columns rot=theta_r,val=brdf"),
    "another angle": ("AOI,AOS,tilt [deg],BRDF\n10,5,2,.1\n", "may be an angle", "--columns 'tilt [deg]=ignore'"),
    "an index": (",AOI,AOS,BRDF\n0,10,5,.1\n", "is not understood", "--columns 1=ignore"),
    "numbers as headings": ("AOI,AOS,450,550\n10,5,.1,.2\n", "may be wavelengths", "--values '[0-9]*'"),
    "matrix without names": (
        "x,10,30\n0,.1,.2\n20,.2,.3\n",
        "nothing says whether the rows",
        "--layout matrix --rows theta_r",
    ),
    "matrix turned": ("AOI,10,30\n-20,.1,.2\n20,.2,.3\n", "never below zero", "--rows theta_r"),
    "unit of a corner": (
        "Winkel [Grad],10 deg,30 deg\n-20,.1,.2\n20,.2,.3\n",
        "'Grad' where a unit",
        "--columns 'Winkel [Grad]=theta_r:deg'",
    ),
    "names exchanged": (
        "phi_i theta_i phi_o theta_o brdf\n5 -180 -60 0 .1\n41 -180 41 0 .2\n",
        "polar angle phi and the azimuth theta",
        "--columns theta_i=phi_i,phi_i=theta_i,theta_o=phi_r,phi_o=theta_r",
    ),
}


@pytest.mark.parametrize("name", ASKED)
def test_a_question_ends_in_the_command_that_settles_it(tmp_path, monkeypatch, capsys, name):
    text, said, flags = ASKED[name]
    path = tmp_path / "my table.csv"
    path.write_text(text)
    with pytest.raises(FormatError) as caught:
        read_table(path)
    message = str(caught.value)
    assert said in message
    assert "\n" not in message
    command = f"gonio import {shlex.quote(str(path))} {flags} --out scan.csv"
    assert message.endswith(command)
    with pytest.raises(FormatError) as refused:  # and gonio read, info, fit, .. end in the same command
        read(path)
    assert command in str(refused.value) or name == "no names"
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", shlex.split(command))
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0, capsys.readouterr().err
    assert np.isfinite(read(tmp_path / "scan.csv")["brdf"]).all()


@pytest.mark.parametrize(
    ("text", "where", "said"),
    [
        ("AOI,AOS,BRDF\n10,0,-60,0,0,0123\n10,0,10,0,0,5000\n", "line 1", "decimal commas and commas between"),
        ("AOI,AOS,BRDF\n10,-60,0,0123\n10,10,0,5000\n", "line 2", "are these decimal commas"),
        ("AOI;AOS;BRDF\n10,5;-60;0.1\n", "line 1", "the numbers differ"),
        ('AOI,AOS,BRDF\n10,5,"1,234.5"\n10,6,1\n10,7,2\n', "line 2", "'1,234.5', not a number"),
        ("AOI,AOS,BRDF\n10,5,.1\n10,,.2\n", "line 3", "theta_r is empty"),
        ("AOI,AOS,BRDF\n10,5,.1\n10,x,.2\n", "line 3", "theta_r is 'x', not a number"),
        ("AOI,AOS,BRDF\n10,5,.1\n10,7,<0.1\n", "line 3", "'<0.1', not a number"),
        ("AOI,AOS,BRDF\n10,5,.1\n10,95,.2\n", "line 3", "theta_r is 95 deg, outside -90 to 90, at 1 of 2 values"),
        ("AOI,AOS,BRDF\n-10,50,.1\n", "line 2", "theta_i is -10 deg, outside 0 to 90"),
        ("AOI,AOS,BRDF\n10,50,0\n10,60,\n", "line 2", "every value is zero or missing"),
        ("AOI,phi,specular_offset,BRDF\n10,180,5,1\n30,0,9,1\n", "line 2", "in the plane of incidence"),
        ("detector angle,450 nm\n-60,.1\n", "line 1", "no column is theta_i"),
        ("hello\nworld\n", "line 1", "holds no rows of numbers"),
        ("", "byte 0", "is empty"),
    ],
)
def test_what_no_flag_mends(tmp_path, text, where, said):
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(FormatError) as caught:
        read_table(path)
    assert f"{path}, {where}" in str(caught.value)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        ({"layout": "wide"}, "none of long, matrix, blocks or sheets"),
        ({"rows": "phi"}, "neither theta_i or theta_r"),
        ({"quantity": "albedo"}, "none of brdf, ccbsdf"),
        ({"quantity": "log10-brdf:percent"}, "is not in percent"),
        ({"quantity": "brdf:nm"}, "only percent"),
        ({"columns": "AOI"}, "not of the form"),
        ({"columns": "AOI=angle"}, "'angle' is none of theta_i"),
        ({"columns": "AOI=theta_i:nm"}, "theta_i is not in nm"),
        ({"columns": "AOI=theta_i:furlong"}, "no unit that is known"),
        ({"columns": {"AOI": "theta_i:k=2"}}, "only an uncertainty"),
        ({"columns": {"u": "uncertainty:k=0"}}, "above 0"),
        ({"columns": {"AoX": "theta_i"}}, "is no heading; there are 'AOI', 'AOS', 'BRDF'"),
        ({"values": "*nm"}, "fits none of the headings"),
        ({"sheet": "A"}, "has no sheet 'A'"),
    ],
)
def test_flags_that_say_nothing_of_the_table_are_refused(tmp_path, flags, said):
    path = tmp_path / "table.csv"
    path.write_text(f"AOI,AOS,BRDF\n{ROWS}")
    with pytest.raises(ValueError, match=re.escape(said)):
        read_table(path, **flags)


def test_two_sheets_that_nothing_tells_apart(tmp_path):
    from workbooks import write

    rows = [["AOI", "AOS", "BRDF"], [10.0, 5.0, 0.1], [30.0, 5.0, 0.1]]
    path = write(tmp_path / "book.xlsx", {"black": rows, "white": rows})
    with pytest.raises(FormatError, match=r"--sheet black --out scan\.csv"):
        read_table(path)
    assert read_table(path, sheet="white")["brdf"].size == 2
