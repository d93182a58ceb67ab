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

    Cells are elements. Groups for boundary conditions and loads may also need lines (2-D) or
    faces (3-D) on the boundary. Shapes have the names `tri3`, `quad4`, `tet4`, `wedge6`, `hex8`,
    `line`, `vertex`, or those of meshio. Nodes are in the order of Gmsh and VTK. A load on a
    group of elements acts on their boundary facets. If several blocks have a group `top`,
    `"a.top"` is the part of it in block `a`.

    A mesh cannot be changed: its arrays are read-only.
    """

    points: npt.NDArray[np.float64]
    """Positions of the points, m before `scale`: an array of n × 3."""
    cells: tuple[tuple[str, npt.NDArray[np.int64]], ...]
    """Shapes, each with the points of its cells: an array of cells × nodes."""
    groups: Mapping[str, tuple[npt.NDArray[np.int64], ...]]
    """For each named group and each entry of `cells`: the numbers of its cells."""
    name: str
    """Its name in messages."""

    def __init__(
        self,
        points: npt.ArrayLike,
        cells: Mapping[str, npt.ArrayLike] | Iterable[tuple[str, npt.ArrayLike]],
        groups: Mapping[str, Mapping[str, npt.ArrayLike] | Sequence[npt.ArrayLike]] | None = None,
        *,
        name: str = "mesh",
    ) -> None:
        """A mesh from copies of arrays.

        points: n × 2 or n × 3.
        cells: shapes, each with an array of cells × nodes; points are counted from 0.
        groups: names, each with its cells: a dictionary by shape, or one array for each entry of
            `cells`. An array has the numbers of the cells, or a boolean for each cell.
        name: its name in messages.

        Raises `MeshError`.
        """
        # Checked values must not change.
        put = partial(object.__setattr__, self)
        put("name", name)
        put("points", self._points_of(points))
        pairs = list(cells.items() if isinstance(cells, Mapping) else cells)
        if not all(map(_is_pair, pairs)):
            raise MeshError(
                f"{name}: cells must be shapes, each with an array, as in {{'tri3': triangles}}"
            )
        put("cells", tuple(self._cells_of(kind, nodes) for kind, nodes in pairs))
        named = {key: self._group_of(key, parts) for key, parts in (groups or {}).items()}
        put("groups", MappingProxyType(named))
        self._engine_mesh(name)
        if not any(len(nodes) for kind, nodes in self.cells if kind in ELEMENTS):
            raise MeshError(
                f"{name}: there are no elements; cells must have one of the shapes {', '.join(ELEMENTS)}"
            )

    @classmethod
    def of(cls, mesh: Any) -> Mesh:
        """The mesh itself, or a mesh from a `meshio.Mesh`. The groups are its cell sets, or the
        physical groups of a Gmsh file.

        Raises `MeshError`.
        """
        if isinstance(mesh, cls):
            return mesh
        if not all(hasattr(mesh, part) for part in ("points", "cells", "cell_data", "field_data")):
            kind = type(mesh).__name__
            raise MeshError(f"a mesh must be a path, a cdem.Mesh or a meshio.Mesh, not of type {kind}")
        cells = [(block.type, block.data) for block in mesh.cells]
        groups = _sets(mesh) or _physical_groups(mesh)
        return cls(mesh.points, cells, groups, name="meshio.Mesh")

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"a mesh cannot be changed; create another mesh with other {name}")

    def __repr__(self) -> str:
        cells = ", ".join(f"{len(nodes)} {kind}" for kind, nodes in self.cells)
        return f"<cdem.Mesh: {len(self.points)} points, {cells}>"

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the mesh as a Gmsh file (MSH 2.2), with all digits of the numbers.

        Raises `MeshError` if the file cannot be written.
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
        """A line for each cell and each of its groups."""
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
        """An array with rows of one length."""
        try:
            return np.array(values)
        except ValueError as error:
            raise MeshError(f"{self.name}: {what} must be an array: {error}") from None

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
                f"{self.name}: cells of shape {shape.name} must be an array of whole numbers, "
                f"n × {count}, not {size} of {array.dtype}"
            )
        self._check_points_of(shape.name, array)
        return shape.name, _kept(array.astype(np.int64))

    def _check_points_of(self, kind: str, nodes: npt.NDArray[Any]) -> None:
        """Refuses points that do not exist, before the conversion of their numbers."""
        count = len(self.points)
        wrong = nodes[(nodes < 0) | (nodes >= count)]
        if wrong.size == 0:
            return
        counts_from_1 = nodes.min() >= 1 and nodes.max() == count
        hint = " (if yours are counted from 1, subtract 1)" if counts_from_1 else ""
        raise MeshError(
            f"{self.name}: cells of shape {kind} have point {wrong[0]}; there are {count} points, "
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
        """The cells of a group for each entry of cells, from cells by shape. A shape occurs once."""
        kinds = [kind for kind, _ in self.cells]
        named: dict[str, npt.ArrayLike] = {}
        for kind, members in parts.items():
            shape = _name_of(kind)
            if shape not in kinds:
                raise MeshError(f"{self.name}: group {name!r} has cells of shape {kind}, but the mesh has none")
            if kinds.count(shape) > 1 or shape in named:
                raise MeshError(
                    f"{self.name}: cells of shape {shape} occur more than once: give group "
                    f"{name!r} an array for each entry of cells"
                )
            named[shape] = members
        return [named.get(kind, ()) for kind in kinds]

    def _members_of(
        self, name: str, kind: str, count: int, members: npt.ArrayLike
    ) -> npt.NDArray[np.int64]:
        """Numbers of the cells of a group, each once, from numbers or a mask."""
        what = f"group {name!r}: cells of shape {kind}"
        array = self._array_of(what, members)
        if array.size == 0:
            return _kept(np.empty(0, dtype=np.int64))
        if array.dtype.kind == "b" and array.shape == (count,):
            return _kept(np.flatnonzero(array))
        if array.dtype.kind not in "iu" or array.ndim != 1:
            shape = " × ".join(map(str, array.shape))
            raise MeshError(
                f"{self.name}: {what} must be their numbers, or a boolean for each of {count}, not "
                f"{shape} of {array.dtype}"
            )
        wrong = array[(array < 0) | (array >= count)]
        if wrong.size:
            raise MeshError(
                f"{self.name}: group {name!r} has cell {wrong[0]} of shape {kind}; there are "
                f"{count} such cells, counted from 0"
            )
        return _kept(np.unique(array).astype(np.int64))

    def _engine_mesh(self, path: str) -> _engine.Mesh:
        """The mesh for the engine, under a path."""
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
