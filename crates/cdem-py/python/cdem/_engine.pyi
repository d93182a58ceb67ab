"""
The engine behind the package `cdem`: not for direct use.
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
        `name` is what messages call it.
        """

@final
class Run:
    """
    A simulation, and the results that it writes, if any.
    """
    def __new__(cls, /, source: Source, meshes: SupportsGetItem[int, tuple[str | PathLike[str], Mesh]], threads: SupportsIndex) -> Run:
        """
        A run at its start. `meshes` are those at hand, under the path that the scene names.
        """
    def advance(self, /, until: SupportsFloat | SupportsIndex, steps: SupportsIndex, seconds: SupportsFloat | SupportsIndex) -> tuple[bool, int]:
        """
        Steps until a time, s, the end, or for so many steps or seconds of wall-clock time;
        whether that time or the end is reached, and how many steps were made.
        """
    def blocks(self, /) -> dict:
        """
        All blocks now, and where they lie in the arrays.
        """
    def cells(self, /) -> tuple[list[str], Any]:
        """
        Kinds of all cells, and the points of all of them in a row.
        """
    def close(self, /) -> None:
        """
        Ends the results here, with a checkpoint to go on from.
        """
    def contacts(self, /) -> dict:
        """
        Live contact points now.
        """
    @property
    def dimension(self, /) -> int:
        """
        2 in the plane, 3 in space.
        """
    @property
    def end(self, /) -> float:
        """
        End of the scene, s.
        """
    def ended_contacts(self, /) -> dict:
        """
        Contacts that have ended since this was last asked; of a run that writes results they
        go there.
        """
    def field(self, /, name: str) -> tuple[Any, int]:
        """
        A field of points or cells, flat, and the number of its components.
        """
    @property
    def finished(self, /) -> bool:
        """
        Whether the end is reached.
        """
    @property
    def folder(self, /) -> Path | None:
        """
        Folder of the results, if they are written.
        """
    def history(self, /) -> dict:
        """
        Energies, momenta and counts now.
        """
    @staticmethod
    def load(folder: str | PathLike[str], is_recorded: bool, threads: SupportsIndex) -> Run:
        """
        The run in a folder of results, from its last checkpoint; `is_recorded`: it goes on
        writing to that folder.
        """
    def positions(self, /) -> Any:
        """
        Places of all points, flat, m.
        """
    def record(self, /, folder: str | PathLike[str], scene: str | PathLike[str], force: bool) -> None:
        """
        Begins to write results to a folder; meshes are relative to that of the file `scene`.
        """
    def save(self, /, folder: str | PathLike[str] | None, scene: str | PathLike[str], force: bool) -> None:
        """
        Writes a checkpoint: to the folder of the results, or to a new one.
        """
    @property
    def scene(self, /) -> str:
        """
        The scene as TOML, every default filled in, loads as they have become.
        """
    def set_load(self, /, number: SupportsIndex, kind: str, value: str) -> None:
        """
        Has a load push otherwise from now on: `kind` is "pressure" or "traction", `value` as
        JSON.
        """
    def set_velocities(self, /, block: str | None, values: Incomplete, components: SupportsIndex) -> None:
        """
        Gives the points of a block, or all, other velocities, m/s: flat, of so many components
        each.
        """
    @property
    def step_index(self, /) -> int:
        """
        Coarse steps made.
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
        What the user should know.
        """

@final
class Source:
    """
    What a scene says: the text of a file, or the keys of a dictionary.
    """
    def __new__(cls, /, text: str, is_file: bool, path: str | PathLike[str]) -> Source: ...

def schema() -> str:
    """
    The JSON Schema of a scene, as text.
    """

def seconds(text: str) -> float:
    """
    Seconds, of a text with a unit.
    """

def written(source: Source) -> str:
    """
    A scene as TOML, checked, every default filled in.
    """
