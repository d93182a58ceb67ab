"""Results of a run, read from its folder."""

from __future__ import annotations

import csv
import json
import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, overload

import numpy as np

from cdem.errors import ResultsError
from cdem.scene import Scene


#: Advice on a damaged file.
_TORN = "the file has changed since the run wrote it: load the run and go on, or run it again"


class Results:
    """Results of a run, from `read_results`: tables in pandas or NumPy, frames in PyVista or
    meshio.

    Each access reads its file, also during a run. An unreadable file raises `ResultsError`.
    The columns of tables are those of the files, in SI units, with vectors by component, such as
    `vx`, `vy`, `vz`.
    """

    folder: Path
    """The folder."""

    def __init__(self, folder: str | os.PathLike[str], tables: str | None = None) -> None:
        self.folder = Path(folder)
        self._tables = tables or ("pandas" if find_spec("pandas") else "numpy")
        if self._tables not in ("pandas", "numpy"):
            raise ValueError(f"tables must be 'pandas' or 'numpy', not {tables!r}")
        try:
            with open(self.folder / "history.csv", "rb") as file:
                what = "its history.csv is not from a run"
                is_run = file.readline().startswith(b"step,time,kinetic_energy,")
        except OSError as error:
            what, is_run = f"history.csv: {error.strerror}", False
        if not is_run:
            raise ResultsError(
                f"{self.folder} is no results folder: {what} "
                "(name a folder with results of `record()` or `cdem run`)"
            )

    def __repr__(self) -> str:
        return f"<cdem.Results: {self.folder}>"

    @property
    def history(self) -> Any:
        """Energies, works and losses (J), momenta and impulse (N·s, N·m·s) and numbers of contacts
        over time: the rows of `history.csv`. `Simulation.history` is one such row.
        """
        return self._table("history.csv", whole=("step", "contacts", "refined_blocks", "elements"))

    @property
    def blocks(self) -> Any:
        """Position (m), velocity (m/s), angular velocity (rad/s) and contact force (N) of each
        block over time.
        """
        return self._table("blocks.csv", text=("block",))

    @property
    def contacts(self) -> Any:
        """Time (s) and position (m) of the start and end of each contact point, its forces (N),
        impulses (N·s) and slip (m). A live contact has no `time_off`.
        """
        return self._table("contacts.csv", text=("main", "target", "type"), whole=("level",))

    @property
    def probes(self) -> Any:
        """The motion of the probes: position and displacement (m), velocity (m/s)."""
        return self._table("probes.csv", text=("probe",))

    @property
    def summary(self) -> dict[str, Any]:
        """The contents of `summary.json`; empty if the run has not ended."""
        path = self.folder / "summary.json"
        if not path.is_file():
            return {}
        try:
            summary: dict[str, Any] = json.loads(self._text(path))
        except json.JSONDecodeError as error:
            raise ResultsError(f"{path}:{error.lineno}: {error.msg}; {_TORN}") from None
        return summary

    @property
    def scene(self) -> Scene:
        """The scene of the run, with all defaults filled in."""
        return Scene.read(self.folder / "scene.toml")

    @property
    def frames(self) -> Frames:
        """Frames of the whole model over time."""
        return Frames(self.folder / "frames.pvd")

    @property
    def contact_frames(self) -> Frames:
        """Frames of the contact points over time. They need pyvista."""
        return Frames(self.folder / "contacts.pvd")

    def _text(self, path: Path) -> str:
        try:
            return path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ResultsError(f"cannot read {path}: {error}") from None

    def _table(
        self, name: str, text: Sequence[str] = (), whole: Sequence[str] = ()
    ) -> Any:
        """A table by its columns. An incomplete last row, from a live or killed run, is left out."""
        header, rows = self._rows(self.folder / name)
        cells = list(zip(*rows, strict=True)) or [()] * len(header)
        columns: dict[str, Any] = {}
        for column, values in zip(header, cells, strict=True):
            if column in text:
                columns[column] = np.array(values, dtype=object if self._tables == "pandas" else str)
            else:
                kind = np.int64 if column in whole else np.float64
                columns[column] = self._numbers(name, column, values, kind)
        if self._tables == "pandas":
            import pandas

            return pandas.DataFrame(columns)
        table = np.empty(len(rows), dtype=[(key, value.dtype) for key, value in columns.items()])
        for key, value in columns.items():
            table[key] = value
        return table

    def _rows(self, path: Path) -> tuple[list[str], list[list[str]]]:
        """Names of columns, and the complete rows."""
        lines = self._text(path).splitlines(keepends=True)
        if lines and not lines[-1].endswith("\n"):
            lines.pop()
        if not lines:
            raise ResultsError(f"{path} is empty; {_TORN}")
        header, *rows = csv.reader(lines)
        for line, row in enumerate(rows, 2):
            if len(row) != len(header):
                raise ResultsError(f"{path}:{line}: expected {len(header)} columns, got {len(row)}; {_TORN}")
        return header, rows

    def _numbers(self, name: str, column: str, values: Sequence[str], kind: type) -> Any:
        """A column of numbers; empty cells become NaN."""
        try:
            return np.array([value or "nan" for value in values]).astype(kind)
        except ValueError as error:
            raise ResultsError(f"{self.folder / name}: column {column}: {error}; {_TORN}") from None


class Frames(Sequence[Any]):
    """Frames of a run. Each access reads a file: as a PyVista grid if pyvista is installed, else
    as a `meshio.Mesh`.
    """

    times: list[float]
    """Time of each frame, s."""
    files: list[Path]
    """File of each frame."""

    def __init__(self, path: Path) -> None:
        try:
            entries = ElementTree.parse(path).getroot().iter("DataSet")
            pairs = [(float(e.attrib["timestep"]), path.parent / e.attrib["file"]) for e in entries]
        except (OSError, ElementTree.ParseError, KeyError, ValueError) as error:
            raise ResultsError(f"cannot read {path}: {error}") from None
        self.times = [time for time, _ in pairs]
        self.files = [file for _, file in pairs]

    def __len__(self) -> int:
        return len(self.files)

    @overload
    def __getitem__(self, index: int) -> Any: ...
    @overload
    def __getitem__(self, index: slice) -> list[Any]: ...
    def __getitem__(self, index: int | slice) -> Any:
        if isinstance(index, slice):
            return [_read(file) for file in self.files[index]]
        return _read(self._file(index))

    def __iter__(self) -> Iterator[Any]:
        return map(_read, self.files)

    def meshio(self, index: int) -> Any:
        """A frame as a `meshio.Mesh`."""
        import meshio

        return meshio.read(self._file(index))

    def pyvista(self, index: int) -> Any:
        """A frame as a PyVista grid."""
        import pyvista

        return pyvista.read(self._file(index))

    def _file(self, index: int) -> Path:
        if not -len(self) <= index < len(self):
            raise IndexError(f"there is no frame {index}; the run has written {len(self)}")
        return self.files[index]


def _read(file: Path) -> Any:
    if find_spec("pyvista"):
        import pyvista

        return pyvista.read(file)
    try:
        import meshio
    except ImportError:
        raise ImportError("frames need pyvista or meshio: pip install cdem[pyvista]") from None
    return meshio.read(file)


def read_results(
    folder: str | os.PathLike[str], *, tables: str | None = None
) -> Results:
    """The results of a run, from its results folder.

    tables: "pandas" or "numpy" (structured arrays). Left out: pandas if it is installed.

    Raises `ResultsError` if the folder has no results.
    """
    return Results(folder, tables)
