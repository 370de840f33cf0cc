"""`gonio import`: what it prints, what it writes and what it refuses."""

import json

import numpy as np

from gonio import read

TABLE = "AOI;AOS;BSDF\n10,0;-60,0;0,0123\n10,0;10,0;0,383\n30,0;30,0;0,41\n"


def table(tmp_path, text=TABLE):
    path = tmp_path / "my table.csv"
    path.write_text(text)
    return path


def test_without_out_nothing_is_written_and_the_mapping_is_shown(run, tmp_path):
    path = table(tmp_path)
    code, out, err = run("import", path)
    assert (code, err) == (0, "")
    assert "theta_i: column 'AOI' [deg] (deg, as angles exceed 2 pi)" in out
    assert "brdf: column 'BSDF' [1/sr]" in out
    assert "0.0123" in out
    assert f"nothing is written yet: gonio import '{path}' --out scan.csv\n" in out
    assert list(tmp_path.iterdir()) == [path]


def test_out_is_written_once_with_the_mapping_in_its_history(run, tmp_path):
    path, out = table(tmp_path), tmp_path / "scan.csv"
    code, said, _ = run("import", path, "--out", out)
    assert code == 0
    assert said.index("theta_i: column") < said.index("wrote")
    scan = read(out)
    np.testing.assert_array_equal(scan["brdf"].values, [0.0123, 0.383, 0.41])
    assert "theta_r: column 'AOS' [deg]" in scan.attrs["history"]
    code, said, err = run("import", path, "--out", out)
    assert (code, said) == (1, "")
    assert "exists: choose another name, or --force" in err
    assert run("import", path, "--out", out, "--force")[0] == 0
    code, _, err = run("import", path, "--out", path, "--force")
    assert (code, "which is read" in err) == (1, True)


def test_json_has_the_mapping(run, tmp_path):
    code, out, _ = run("import", table(tmp_path), "--json", "-", "--out", tmp_path / "scan.csv")
    record = json.loads(out)
    assert code == 0
    assert [one["target"] for one in record["mapping"]] == ["theta_i", "theta_r", "brdf"]
    assert record["layout"] == "long"
    assert record["values"] == 3
    assert record["first"][0]["theta_r"] == 60
    assert (tmp_path / "scan.csv").exists()


def test_columns_may_be_said_once_each(run, tmp_path):
    path = table(tmp_path, "a,b,c\n10,20,0.1\n30,20,0.3\n")
    code, out, _ = run("import", path, "--columns", "a=theta_i", "--columns", "b=theta_r,c=brdf:a.u.")
    assert code == 0
    assert "brdf: column 'c' [a.u.]" in out


def test_a_lobe_on_the_source_side_is_warned_of_with_the_remedy(run, tmp_path):
    path = table(tmp_path, "theta_i_deg,theta_r_deg,brdf_sr-1\n30,40,0.01\n30,30,0.02\n30,-20,0.3\n30,-30,0.42\n")
    code, _, err = run("import", path)
    assert code == 0
    assert "warning: the largest values lie on the side of the source" in err
    assert "--flip turns it" in err
    assert run("import", path, "--flip")[2] == ""


def test_a_workbook_is_refused_with_the_command_that_reads_it(run, tmp_path):
    from workbooks import write

    path = write(tmp_path / "book.xlsx", {"data": [["AOI", "AOS", "BRDF"], [10.0, 5.0, 0.1]]})
    code, _, err = run("info", path)
    assert code == 1
    assert err.endswith(f"save its table as CSV, or read it by gonio import {path} --out scan.csv\n")
    assert run("import", path)[0] == 0


def test_a_damaged_workbook_is_one_line(run, tmp_path):
    from workbooks import write

    whole = write(tmp_path / "book.xlsx", {"data": [["AOI", "AOS", "BRDF"], [10.0, 5.0, 0.1]]}).read_bytes()
    for cut in (10, 300, len(whole) - 40):
        path = tmp_path / "cut.xlsx"
        path.write_bytes(whole[:cut])
        code, out, err = run("import", path)
        assert (code, out) == (1, "")
        assert err.count("\n") == 1
        assert str(path) in err
