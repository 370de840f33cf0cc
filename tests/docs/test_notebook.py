"""Notebooks: the first cell that somebody writes, and the tour of the docs."""

import pytest

from places import ROOT

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


TOUR = ROOT / "docs" / "notebook.ipynb"


def test_the_tour_runs_from_top_to_bottom(tmp_path):
    notebook = nbformat.read(TOUR, as_version=4)
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(cell.outputs == [] and cell.execution_count is None for cell in code), "strip the outputs"
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    told = [out for cell in code for out in cell.outputs if out.output_type in ("stream", "error")]
    assert told == []
    assert {path.name for path in tmp_path.iterdir()} == {"coating.js", "coating.html"}
    shown = [out.data for cell in code for out in cell.outputs if "data" in out]
    (page,) = [data for data in shown if "application/vnd.jupyter.widget-view+json" in data]
    assert page["image/svg+xml"].startswith("<svg ")
    assert any("'width': 0.25" in data.get("text/plain", "") for data in shown)
