"""The first cell of a notebook: a scan, its fit, and a result that is shown as a table."""

import pytest

nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed")
nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed")

FIRST_CELL = 'import gonio\n\ngonio.fit(gonio.sample("coating"))'


def test_the_first_cell_fits_a_sample(tmp_path):
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(FIRST_CELL)])
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    (result,) = [out for out in notebook.cells[0].outputs if out.output_type == "execute_result"]
    assert "ggx describes this scan" in result.data["text/html"]
    assert "<table>" in result.data["text/html"]
    assert not [out for out in notebook.cells[0].outputs if out.output_type in ("stream", "error")]
