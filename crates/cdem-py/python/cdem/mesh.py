"""Meshes from arrays."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn, TypeVar

import numpy as np
import numpy.typing as npt

from cdem import _engine
from cdem._kinds import ELEMENTS, KINDS, kind_of
from cdem._names import unknown
from cdem.errors import MeshError

_Array = TypeVar("_Array", bound=npt.NDArray[Any])


class Mesh:
    """A mesh for blocks of a scene: points, cells and named groups of cells.

    Cells are elements, and where groups are wanted for boundary conditions and loads, lines
    (2-D) or faces (3-D) on their boundary; shapes go by our names (`tri3`, `quad4`, `tet4`,
    `wedge6`, `hex8`, `line`, `vertex`) or meshio's, nodes in the order of Gmsh and VTK. A load on
    a group of elements acts on what they have of the boundary. Where several blocks have a group
    of one name, `"a.top"` is what block `a` has of it.

    A mesh stays as it was made: its arrays are read-only.
    """

    points: npt.NDArray[np.float64]
    """Places of the points, m before `scale`: an array of n × 3."""
    cells: tuple[tuple[str, npt.NDArray[np.int64]], ...]
    """Shapes, and the points of the cells of each: arrays of cells × nodes."""
    groups: Mapping[str, tuple[npt.NDArray[np.int64], ...]]
    """Of each named group the numbers of its cells, for each entry of `cells`."""
    name: str
    """What messages call it."""

    def __init__(
        self,
        points: npt.ArrayLike,
        cells: Mapping[str, npt.ArrayLike] | Iterable[tuple[str, npt.ArrayLike]],
        groups: Mapping[str, Mapping[str, npt.ArrayLike] | Sequence[npt.ArrayLike]] | None = None,
        *,
        name: str = "mesh",
    ) -> None:
        """A mesh of arrays, which are taken as they are now.

        points: n × 2 or n × 3.
        cells: shapes, and of each an array of cells × nodes, points counted from 0.
        groups: names, and of each its cells: a dictionary by shape, or an array for each entry of
            `cells`; of the numbers of cells, or of a boolean for each.
        name: what messages call it.

        Raises `MeshError`.
        """
        # What has been checked stays as it is.
        put = partial(object.__setattr__, self)
        put("name", name)
        put("points", self._points_of(points))
        pairs = list(cells.items() if isinstance(cells, Mapping) else cells)
        if not all(map(_is_pair, pairs)):
            raise MeshError(
                f"{name}: cells are shapes with an array of each, as in {{'tri3': triangles}}"
            )
        put("cells", tuple(self._cells_of(kind, nodes) for kind, nodes in pairs))
        named = {key: self._group_of(key, parts) for key, parts in (groups or {}).items()}
        put("groups", MappingProxyType(named))
        self._engine_mesh(name)
        if not any(len(nodes) for kind, nodes in self.cells if kind in ELEMENTS):
            raise MeshError(
                f"{name}: there are no elements; cells need some of shape {', '.join(ELEMENTS)}"
            )

    @classmethod
    def of(cls, mesh: Any) -> Mesh:
        """The mesh itself, or one of a `meshio.Mesh`: its groups are its cell sets, or the
        physical groups of a Gmsh file.

        Raises `MeshError`.
        """
        if isinstance(mesh, cls):
            return mesh
        if not all(hasattr(mesh, part) for part in ("points", "cells", "cell_data", "field_data")):
            kind = type(mesh).__name__
            raise MeshError(f"a mesh is a path, a cdem.Mesh or a meshio.Mesh, not of type {kind}")
        cells = [(block.type, block.data) for block in mesh.cells]
        groups = _sets(mesh) or _physical_groups(mesh)
        return cls(mesh.points, cells, groups, name="meshio.Mesh")

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"a mesh stays as it was made: make another for other {name}")

    def __repr__(self) -> str:
        cells = ", ".join(f"{len(nodes)} {kind}" for kind, nodes in self.cells)
        return f"<cdem.Mesh: {len(self.points)} points, {cells}>"

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the mesh as a Gmsh file (MSH 2.2), numbers in full.

        Raises `MeshError` where it cannot.
        """
        lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames"]
        tags = self._tags()
        lines.append(str(len(tags)))
        lines += [f'{dimension} {tag} "{name}"' for (name, dimension), tag in tags.items()]
        lines += ["$EndPhysicalNames", "$Nodes", str(len(self.points))]
        points = self.points.tolist()
        lines += [f"{i} {x!r} {y!r} {z!r}" for i, (x, y, z) in enumerate(points, 1)]
        lines += ["$EndNodes", "$Elements"]
        elements = list(self._element_lines(tags))
        lines += [str(len(elements)), *elements, "$EndElements", ""]
        try:
            Path(path).write_text("\n".join(lines), encoding="utf-8")
        except OSError as error:
            raise MeshError(f"cannot write the mesh {path}: {error}") from None

    def _tags(self) -> dict[tuple[str, int], int]:
        """Physical groups, by name and dimension, and their numbers."""
        tags: dict[tuple[str, int], int] = {}
        for name, parts in self.groups.items():
            for (kind, _), members in zip(self.cells, parts, strict=True):
                if len(members):
                    tags.setdefault((name, KINDS[kind].dimension), len(tags) + 1)
        return tags

    def _element_lines(self, tags: Mapping[tuple[str, int], int]) -> Iterable[str]:
        """A line for each cell and group that it lies in."""
        number = 0
        for entry, (kind, nodes) in enumerate(self.cells):
            of_cell: list[list[int]] = [[] for _ in nodes]
            for name, parts in self.groups.items():
                for cell in parts[entry].tolist():
                    of_cell[cell].append(tags[name, KINDS[kind].dimension])
            for cell, points in zip(of_cell, (nodes + 1).tolist(), strict=True):
                number += 1
                for tag in cell or [0]:
                    line = [number, KINDS[kind].gmsh, 2, tag, tag, *points]
                    yield " ".join(map(str, line))

    def _points_of(self, points: npt.ArrayLike) -> npt.NDArray[np.float64]:
        array = self._array_of("points", points)
        if array.dtype.kind not in "iuf":
            raise MeshError(f"{self.name}: points must be numbers, not {array.dtype}")
        if array.ndim != 2 or array.shape[1] not in (2, 3):
            shape = " × ".join(map(str, array.shape))
            raise MeshError(f"{self.name}: points must be an array of n × 2 or n × 3, not {shape}")
        padded = np.pad(array.astype(np.float64), ((0, 0), (0, 3 - array.shape[1])))
        return _kept(padded)

    def _array_of(self, what: str, values: npt.ArrayLike) -> npt.NDArray[Any]:
        """An array, of rows that are of one length."""
        try:
            return np.array(values)
        except ValueError as error:
            raise MeshError(f"{self.name}: {what} are no array: {error}") from None

    def _cells_of(self, kind: str, nodes: npt.ArrayLike) -> tuple[str, npt.NDArray[np.int64]]:
        shape = kind_of(kind)
        if shape is None:
            raise MeshError(f"{self.name}: {unknown('shape of cells', kind, KINDS)}")
        array = self._array_of(f"cells of shape {kind}", nodes)
        count = shape.nodes
        if array.size == 0:
            array = np.empty((0, count), dtype=np.int64)
        if array.ndim != 2 or array.shape[1] != count or array.dtype.kind not in "iu":
            size = " × ".join(map(str, array.shape))
            raise MeshError(
                f"{self.name}: cells of shape {shape.name} are an array of whole numbers, "
                f"n × {count}, not {size} of {array.dtype}"
            )
        self._check_points_of(shape.name, array)
        return shape.name, _kept(array.astype(np.int64))

    def _check_points_of(self, kind: str, nodes: npt.NDArray[Any]) -> None:
        """Refuses points that there are not; of any type, before numbers are cut to fit ours."""
        count = len(self.points)
        wrong = nodes[(nodes < 0) | (nodes >= count)]
        if wrong.size == 0:
            return
        counts_from_1 = nodes.min() >= 1 and nodes.max() == count
        hint = " (these seem to count from 1: subtract 1)" if counts_from_1 else ""
        raise MeshError(
            f"{self.name}: cells of shape {kind} have point {wrong[0]}; there are {count}, "
            f"counted from 0{hint}"
        )

    def _group_of(
        self, name: str, parts: Mapping[str, npt.ArrayLike] | Sequence[npt.ArrayLike]
    ) -> tuple[npt.NDArray[np.int64], ...]:
        if isinstance(parts, Mapping):
            parts = self._by_entry(name, parts)
        if len(parts) != len(self.cells):
            raise MeshError(
                f"{self.name}: group {name!r} has {len(parts)} arrays for {len(self.cells)} "
                "entries of cells"
            )
        entries = zip(self.cells, parts, strict=True)
        return tuple(self._members_of(name, kind, len(nodes), part) for (kind, nodes), part in entries)

    def _by_entry(self, name: str, parts: Mapping[str, npt.ArrayLike]) -> list[npt.ArrayLike]:
        """What a group has of each entry of cells, by their shapes, each of which is there once."""
        kinds = [kind for kind, _ in self.cells]
        named: dict[str, npt.ArrayLike] = {}
        for kind, members in parts.items():
            shape = _name_of(kind)
            if shape not in kinds:
                raise MeshError(f"{self.name}: group {name!r} has cells of shape {kind}, the mesh none")
            if kinds.count(shape) > 1 or shape in named:
                raise MeshError(
                    f"{self.name}: cells of shape {shape} are there more than once: give group "
                    f"{name!r} an array for each entry of cells"
                )
            named[shape] = members
        return [named.get(kind, ()) for kind in kinds]

    def _members_of(
        self, name: str, kind: str, count: int, members: npt.ArrayLike
    ) -> npt.NDArray[np.int64]:
        """Numbers of cells of a group, each once, of numbers or of a mask."""
        what = f"group {name!r}: cells of shape {kind}"
        array = self._array_of(what, members)
        if array.size == 0:
            return _kept(np.empty(0, dtype=np.int64))
        if array.dtype.kind == "b" and array.shape == (count,):
            return _kept(np.flatnonzero(array))
        if array.dtype.kind not in "iu" or array.ndim != 1:
            shape = " × ".join(map(str, array.shape))
            raise MeshError(
                f"{self.name}: {what} are their numbers, or a boolean for each of {count}; not "
                f"{shape} of {array.dtype}"
            )
        wrong = array[(array < 0) | (array >= count)]
        if wrong.size:
            raise MeshError(
                f"{self.name}: group {name!r} has cell {wrong[0]} of shape {kind}; there are "
                f"{count}, counted from 0"
            )
        return _kept(np.unique(array).astype(np.int64))

    def _engine_mesh(self, path: str) -> _engine.Mesh:
        """The mesh as the engine takes it, under a path."""
        cells = [(kind, nodes.ravel()) for kind, nodes in self.cells]
        groups = []
        for name, parts in self.groups.items():
            for dimension in range(4):
                chosen = [
                    (entry, numbers.tolist())
                    for entry, numbers in enumerate(parts)
                    if len(numbers) and KINDS[self.cells[entry][0]].dimension == dimension
                ]
                if chosen:
                    groups.append((name, dimension, chosen))
        return _engine.Mesh(path, self.points.ravel(), cells, groups)


def _kept(array: _Array) -> _Array:
    """An array that stays as it is."""
    array.setflags(write=False)
    return array


def _is_pair(entry: object) -> bool:
    """Whether this is a shape with its cells."""
    return isinstance(entry, (tuple, list)) and len(entry) == 2 and isinstance(entry[0], str)


def _name_of(kind: str) -> str:
    """Our name of a shape; one that we have not is left as it is."""
    shape = kind_of(kind)
    return kind if shape is None else shape.name


def _sets(mesh: Any) -> dict[str, list[npt.ArrayLike]]:
    """The cell sets of a meshio mesh, but those that only its reader needs."""
    sets = getattr(mesh, "cell_sets", {})
    none = np.empty(0, dtype=np.int64)
    return {
        name: [none if numbers is None else numbers for numbers in parts]
        for name, parts in sets.items()
        if not name.startswith("gmsh:")
    }


def _physical_groups(mesh: Any) -> dict[str, list[npt.ArrayLike]]:
    """The physical groups that meshio has read from a Gmsh file."""
    physical = mesh.cell_data.get("gmsh:physical")
    if physical is None:
        return {}
    groups: dict[str, list[npt.ArrayLike]] = {}
    for name, (tag, dimension) in mesh.field_data.items():
        kinds = [kind_of(block.type) for block in mesh.cells]
        of_dimension = [kind is not None and kind.dimension == dimension for kind in kinds]
        groups[name] = [
            np.flatnonzero(tags == tag) if fits else np.empty(0, dtype=np.int64)
            for tags, fits in zip(physical, of_dimension, strict=True)
        ]
    return groups
