"""What tests share: examples, small scenes, the command."""

import os
import subprocess
from pathlib import Path

import pytest

import cdem

ROOT = Path(__file__).resolve().parents[3]
PACKAGE = ROOT / "crates" / "cdem-py"


@pytest.fixture
def prisms():
    """Two prisms collide: the case of the paper, from its file."""
    return cdem.Scene.read(ROOT / "examples" / "two-prisms-2d" / "scene.toml")


@pytest.fixture
def bar():
    """A bar of ten squares that is held at its left end and may be drawn at its right."""
    scene = cdem.Scene(dimension=2)
    scene.time.end = 2e-3
    scene.material.add(name="rock", young_modulus="1 GPa", poisson_ratio=0.25, density=1000.0)
    shape = {"box": {"min": [0.0, 0.0], "max": [1.0, 0.1], "divisions": [10, 1]}}
    scene.block.add(name="bar", material="rock", element="quad4", shape=shape)
    scene.boundary.add(group="bar.xmin", velocity={"x": 0.0, "y": 0.0})
    scene.load.add(group="bar.xmax", traction=[0.0, 0.0])
    return scene


class Command:
    """The command `cdem`."""

    def __init__(self, path):
        self.path = path

    def __call__(self, *arguments, status=0):
        """Runs it to its end, which must be as expected."""
        told = self.start(*arguments)
        _, errors = told.communicate()
        assert told.returncode == status, errors
        return errors

    def start(self, *arguments):
        """Starts it."""
        call = [self.path, *map(str, arguments)]
        return subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.fixture(scope="session")
def command():
    """The command `cdem`, where CDEM_COMMAND says it is: ./test does."""
    path = os.environ.get("CDEM_COMMAND")
    if not path:
        pytest.skip("CDEM_COMMAND does not name the command cdem")
    return Command(path)


def files(folder):
    """All files of a run but the one that tells of times, by their names."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != "summary.json"
    }
