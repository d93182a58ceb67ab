"""
The engine of the package `cdem`; not for direct use.
"""

from _typeshed import Incomplete, SupportsGetItem
from os import PathLike
from pathlib import Path
from typing import Any, SupportsFloat, SupportsIndex, final

__all__ = ["Mesh", "Run", "Source", "schema", "seconds", "written"]

@final
class Mesh:
    """
    Points, cells and named groups of cells.
    """
    def __new__(cls, /, name: str, points: Incomplete, cells: SupportsGetItem[int, tuple[str, Incomplete]], groups: SupportsGetItem[int, tuple[str, SupportsIndex, SupportsGetItem[int, tuple[SupportsIndex, SupportsGetItem[int, SupportsIndex]]]]]) -> Mesh:
        """
        Creates a mesh; `name` is its name in messages.
        """

@final
class Run:
    """
    A simulation, and its results if it writes any.
    """
    def __new__(cls, /, source: Source, meshes: SupportsGetItem[int, tuple[str | PathLike[str], Mesh]], threads: SupportsIndex) -> Run:
        """
        A run at t = 0. `meshes` are meshes from arrays, by their paths in the scene.
        """
    def advance(self, /, until: SupportsFloat | SupportsIndex, steps: SupportsIndex, seconds: SupportsFloat | SupportsIndex) -> tuple[bool, int]:
        """
        Steps up to a time, s, the end, a number of steps, or a number of wall-clock seconds.
        Returns true if that time or the end is reached, and the number of steps.
        """
    def blocks(self, /) -> dict:
        """
        All blocks now, with their ranges in the arrays.
        """
    def cells(self, /) -> tuple[list[str], Any]:
        """
        Shapes of all cells, and the points of all cells in one array.
        """
    def close(self, /) -> None:
        """
        Ends the results, with a checkpoint.
        """
    def contacts(self, /) -> dict:
        """
        Live contact points now.
        """
    @property
    def dimension(self, /) -> int:
        """
        Dimension of the scene: 2 or 3.
        """
    @property
    def end(self, /) -> float:
        """
        End of the scene, s.
        """
    def ended_contacts(self, /) -> dict:
        """
        Contacts that have ended since the last call. A run with results writes them to its
        folder instead.
        """
    def field(self, /, name: str) -> tuple[Any, int]:
        """
        A field of points or cells, flat, and its number of components.
        """
    @property
    def finished(self, /) -> bool:
        """
        True if the end is reached.
        """
    @property
    def folder(self, /) -> Path | None:
        """
        Results folder; None if no results are written.
        """
    def history(self, /) -> dict:
        """
        Energies, momenta and counts now.
        """
    @staticmethod
    def load(folder: str | PathLike[str], is_recorded: bool, threads: SupportsIndex) -> Run:
        """
        The run in a results folder, at its last checkpoint. If `is_recorded`, results continue in
        that folder.
        """
    def positions(self, /) -> Any:
        """
        Positions of all points, flat, m.
        """
    def record(self, /, folder: str | PathLike[str], scene: str | PathLike[str], force: bool) -> None:
        """
        Begins to write results to a folder. Paths of meshes are relative to the file `scene`.
        """
    def save(self, /, folder: str | PathLike[str] | None, scene: str | PathLike[str], force: bool) -> None:
        """
        Writes a checkpoint to the results folder, or to a new folder.
        """
    @property
    def scene(self, /) -> str:
        """
        The scene as TOML, with all defaults filled in and all changes of loads.
        """
    def set_load(self, /, number: SupportsIndex, kind: str, value: str) -> None:
        """
        Changes a load from now on. `kind` is "pressure" or "traction"; `value` is JSON.
        """
    def set_velocities(self, /, block: str | None, values: Incomplete, components: SupportsIndex) -> None:
        """
        Sets the velocities, m/s, of the points of a block, or of all points. `values` are flat,
        with `components` each.
        """
    @property
    def step_index(self, /) -> int:
        """
        Number of coarse steps so far.
        """
    @property
    def step_size(self, /) -> float:
        """
        Length of the coarse step, s.
        """
    @property
    def time(self, /) -> float:
        """
        Time, s.
        """
    def warnings(self, /) -> list[str]:
        """
        Warnings for the user.
        """

@final
class Source:
    """
    Contents of a scene: the text of a file, or the keys of a dictionary.
    """
    def __new__(cls, /, text: str, is_file: bool, path: str | PathLike[str]) -> Source: ...

def schema() -> str:
    """
    The JSON Schema of a scene, as text.
    """

def seconds(text: str) -> float:
    """
    Seconds from text with a unit.
    """

def written(source: Source) -> str:
    """
    A scene as TOML, checked, with all defaults filled in.
    """
