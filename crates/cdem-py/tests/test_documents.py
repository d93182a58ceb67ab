"""What documents tell a reader to type in Python does what they say."""

import re
import shutil

import pytest

import cdem
from conftest import PACKAGE, ROOT

PAGES = [ROOT / "README.md", PACKAGE / "README.md", ROOT / "book/src/tutorials/python.md"]


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with the examples that documents speak of, one of them run."""
    monkeypatch.setenv("MPLBACKEND", "agg")
    for name, example in {"two-prisms-2d": "two-prisms-2d", "my-slope": "slope-2d", ".": "two-prisms-2d"}.items():
        source = ROOT / "examples" / example
        (tmp_path / name).mkdir(exist_ok=True)
        for file in (*source.glob("*.toml"), *source.glob("*.msh")):
            shutil.copy(file, tmp_path / name)
    simulation = cdem.Simulation(tmp_path / "two-prisms-2d" / "scene.toml")
    simulation.record(tmp_path / "two-prisms-2d" / "scene-results")
    simulation.run()
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_code_of_a_page_runs_from_top_to_bottom(page, place, capsys):
    """All in one session. What stands in a block of text right below a block of code is what that
    prints.
    """
    pattern = r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?"
    blocks = re.findall(pattern, page.read_text(), flags=re.M | re.S)
    assert blocks
    names = {}
    for code, printed in blocks:
        capsys.readouterr()
        exec(compile(code, str(page), "exec"), names)
        if printed:
            assert capsys.readouterr().out == printed
