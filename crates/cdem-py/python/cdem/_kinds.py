"""Shapes of cells, with their names in other programs."""

from __future__ import annotations

from typing import NamedTuple


class Kind(NamedTuple):
    """A shape of cells."""

    name: str
    meshio: str
    nodes: int
    dimension: int
    vtk: int
    """Number in VTK."""
    gmsh: int
    """Number in Gmsh."""


#: All shapes by their names in cdem, elements first.
KINDS = {
    kind.name: kind
    for kind in (
        Kind("tri3", "triangle", nodes=3, dimension=2, vtk=5, gmsh=2),
        Kind("quad4", "quad", nodes=4, dimension=2, vtk=9, gmsh=3),
        Kind("tet4", "tetra", nodes=4, dimension=3, vtk=10, gmsh=4),
        Kind("wedge6", "wedge", nodes=6, dimension=3, vtk=13, gmsh=6),
        Kind("hex8", "hexahedron", nodes=8, dimension=3, vtk=12, gmsh=5),
        Kind("line", "line", nodes=2, dimension=1, vtk=3, gmsh=1),
        Kind("vertex", "vertex", nodes=1, dimension=0, vtk=1, gmsh=15),
    )
}
_OF_MESHIO = {kind.meshio: kind for kind in KINDS.values()}

#: Shapes of elements.
ELEMENTS = [name for name, kind in KINDS.items() if kind.dimension >= 2]


def kind_of(name: str) -> Kind | None:
    """The shape with this name, in cdem or meshio."""
    return KINDS.get(name) or _OF_MESHIO.get(name)
