"""Cells, as input for plots."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from cdem._kinds import ELEMENTS, KINDS, kind_of
from cdem._names import unknown

if TYPE_CHECKING:
    import meshio
    import pyvista


class Cells:
    """Shapes of cells, and their points."""

    kinds: list[str]
    """The shape of each cell: `tri3`, `quad4`, `tet4`, `wedge6`, `hex8`."""
    connectivity: npt.NDArray[np.int64]
    """The point numbers of all cells, one cell after the other."""
    offsets: npt.NDArray[np.int64]
    """Index of the first point of each cell in `connectivity`, and one more for the end."""

    def __init__(self, kinds: list[str], connectivity: npt.NDArray[Any]) -> None:
        self.kinds = kinds
        self.connectivity = connectivity.astype(np.int64)
        self.offsets = np.cumsum([0, *(KINDS[kind].nodes for kind in kinds)])

    def __len__(self) -> int:
        return len(self.kinds)

    def __repr__(self) -> str:
        counts = ", ".join(f"{self.kinds.count(kind)} {kind}" for kind in ELEMENTS if kind in self.kinds)
        return f"<cdem.Cells: {counts}>"

    def of_kind(self, kind: str) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Numbers of the cells of a shape, and their points: n × nodes.

        kind: `tri3`, `quad4`, `tet4`, `wedge6` or `hex8`, or its name in meshio.

        Raises `ValueError` for another name.
        """
        shape = kind_of(kind)
        if shape is None or shape.name not in ELEMENTS:
            raise ValueError(unknown("shape of cells", kind, ELEMENTS))
        numbers = np.flatnonzero(np.array(self.kinds) == shape.name)
        nodes = np.arange(shape.nodes)
        return numbers, self.connectivity[self.offsets[numbers][:, None] + nodes]


def to_meshio(
    points: npt.NDArray[np.float64],
    cells: Cells,
    point_fields: Mapping[str, Any],
    cell_fields: Mapping[str, Any],
) -> meshio.Mesh:
    """Points, cells and fields as a `meshio.Mesh`."""
    import meshio

    kinds = [kind for kind in ELEMENTS if kind in cells.kinds]
    chosen = {kind: cells.of_kind(kind) for kind in kinds}
    return meshio.Mesh(
        points,
        [(KINDS[kind].meshio, nodes) for kind, (_, nodes) in chosen.items()],
        point_data=dict(point_fields),
        cell_data={
            name: [values[numbers] for numbers, _ in chosen.values()]
            for name, values in cell_fields.items()
        },
    )


def to_pyvista(
    points: npt.NDArray[np.float64],
    cells: Cells,
    point_fields: Mapping[str, Any],
    cell_fields: Mapping[str, Any],
) -> pyvista.UnstructuredGrid:
    """Points, cells and fields as a PyVista grid."""
    import pyvista

    counts = np.diff(cells.offsets)
    padded = np.insert(cells.connectivity, cells.offsets[:-1], counts)
    types = np.array([KINDS[kind].vtk for kind in cells.kinds], dtype=np.uint8)
    grid = pyvista.UnstructuredGrid(padded, types, points)
    for name, values in point_fields.items():
        grid.point_data[name] = values
    for name, values in cell_fields.items():
        grid.cell_data[name] = values
    return grid
