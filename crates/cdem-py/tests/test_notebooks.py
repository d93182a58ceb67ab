"""The notebooks run from top to bottom."""

from textwrap import dedent

import nbformat
import pytest
from nbclient import NotebookClient

from conftest import PACKAGE

NOTEBOOKS = sorted((PACKAGE / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    notebook = nbformat.read(path, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "it is kept without outputs"
    NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    assert not [output.text for output in outputs if output.get("name") == "stderr"]


def test_progress_is_one_output_of_a_cell():
    """Every line of a stream would stay."""
    code = """
    import cdem
    material = {"name": "rock", "young_modulus": 1e9, "poisson_ratio": 0.2, "density": 1e3}
    box = {"min": [0, 0], "max": [1, 1], "divisions": [1, 1]}
    block = {"name": "a", "material": "rock", "shape": {"box": box}}
    time = {"end": 0.5, "step": 1e-6}
    scene = {"dimension": 2, "time": time, "material": [material], "block": [block]}
    cdem.Simulation(scene, threads=1).run(progress=True)
    """
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(dedent(code))])
    NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    [output] = notebook.cells[0].outputs
    assert output.output_type == "display_data"
    assert "100 %" in output.data["text/plain"]


def test_there_are_notebooks():
    assert len(NOTEBOOKS) == 4
