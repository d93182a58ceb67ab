"""Meshes from arrays."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cdem import _engine
from cdem._kinds import ELEMENTS, KINDS, kind_of
from cdem._names import unknown
from cdem.errors import MeshError


class Mesh:
    """A mesh for blocks of a scene: points, cells and named groups of cells.

    Cells are elements, and where groups are wanted for boundary conditions and loads, lines
    (2-D) or faces (3-D) on their boundary; shapes go by our names (`tri3`, `quad4`, `tet4`,
    `wedge6`, `hex8`, `line`, `vertex`) or meshio's, nodes in the order of Gmsh and VTK.
    """

    points: npt.NDArray[np.float64]
    """Places of the points, m before `scale`: an array of n × 3."""
    cells: list[tuple[str, npt.NDArray[np.int64]]]
    """Shapes, and the points of the cells of each: arrays of cells × nodes."""
    groups: dict[str, list[npt.NDArray[np.int64]]]
    """Of each named group the numbers of its cells, for each entry of `cells`."""

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
        groups: names, and of each the numbers of its cells: a dictionary by shape, or an array
            for each entry of `cells`.
        name: what messages call it.

        Raises `MeshError`.
        """
        self.name = name
        self.points = self._points_of(points)
        pairs = list(cells.items() if isinstance(cells, Mapping) else cells)
        if not all(map(_is_pair, pairs)):
            raise MeshError(
                f"{name}: cells are shapes with an array of each, as in {{'tri3': triangles}}"
            )
        self.cells = [self._cells_of(kind, nodes) for kind, nodes in pairs]
        self.groups = {key: self._group_of(key, parts) for key, parts in (groups or {}).items()}
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

    def __repr__(self) -> str:
        cells = ", ".join(f"{len(nodes)} {kind}" for kind, nodes in self.cells)
        return f"<cdem.Mesh: {len(self.points)} points, {cells}>"

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the mesh as a Gmsh file (MSH 2.2), numbers in full."""
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
        Path(path).write_text("\n".join(lines), encoding="utf-8")

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
        array = np.array(points, dtype=np.float64)
        if array.ndim != 2 or array.shape[1] not in (2, 3):
            shape = " × ".join(map(str, array.shape))
            raise MeshError(f"{self.name}: points must be an array of n × 2 or n × 3, not {shape}")
        return np.pad(array, ((0, 0), (0, 3 - array.shape[1])))

    def _cells_of(self, kind: str, nodes: npt.ArrayLike) -> tuple[str, npt.NDArray[np.int64]]:
        shape = kind_of(kind)
        array = np.array(nodes)
        if shape is None:
            raise MeshError(f"{self.name}: {unknown('shape of cells', kind, KINDS)}")
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
        return shape.name, array.astype(np.int64)

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
    ) -> list[npt.NDArray[np.int64]]:
        if isinstance(parts, Mapping):
            named = {_name_of(kind): numbers for kind, numbers in parts.items()}
            kinds = [kind for kind, _ in self.cells]
            if missing := [kind for kind in named if kind not in kinds]:
                raise MeshError(f"{self.name}: group {name!r} has cells of shape {missing[0]}, the mesh none")
            parts = [named.get(kind, ()) for kind in kinds]
        if len(parts) != len(self.cells):
            raise MeshError(
                f"{self.name}: group {name!r} has {len(parts)} arrays for {len(self.cells)} "
                "entries of cells"
            )
        arrays = [np.unique(np.asarray(numbers, dtype=np.int64)) for numbers in parts]
        for (kind, nodes), numbers in zip(self.cells, arrays, strict=True):
            if wrong := [n for n in numbers.tolist() if not 0 <= n < len(nodes)]:
                raise MeshError(
                    f"{self.name}: group {name!r} has cell {wrong[0]} of shape {kind}; there are "
                    f"{len(nodes)}, counted from 0"
                )
        return arrays

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
