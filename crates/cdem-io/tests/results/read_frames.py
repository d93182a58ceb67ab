"""Prints as JSON what VTK, and for grids meshio, read from each file named."""

import json
import sys

import meshio
import vtk
from vtk.util.numpy_support import vtk_to_numpy


def arrays(attributes):
    """Name, component names and values of all arrays of an attribute set."""
    found = {}
    for i in range(attributes.GetNumberOfArrays()):
        array = attributes.GetArray(i)
        components = array.GetNumberOfComponents()
        names = [array.GetComponentName(c) for c in range(components)]
        found[array.GetName()] = {
            "components": [name for name in names if name],
            "values": vtk_to_numpy(array).ravel().tolist(),
        }
    return found


def read_with_vtk(path):
    grid = path.endswith(".vtu")
    reader = vtk.vtkXMLUnstructuredGridReader() if grid else vtk.vtkXMLPolyDataReader()
    failures = []
    reader.AddObserver("ErrorEvent", lambda *_: failures.append(path))
    reader.SetFileName(path)
    reader.Update()
    data = reader.GetOutput()
    if failures:
        sys.exit(f"VTK cannot read {failures[0]}")
    cells = data.GetCells() if grid else data.GetVerts()
    points = data.GetPoints()
    return {
        "points": vtk_to_numpy(points.GetData()).ravel().tolist() if points else [],
        "connectivity": vtk_to_numpy(cells.GetConnectivityArray()).tolist(),
        "offsets": vtk_to_numpy(cells.GetOffsetsArray()).tolist(),
        "types": [data.GetCellType(i) for i in range(data.GetNumberOfCells())],
        "time": data.GetFieldData().GetArray("TimeValue").GetValue(0),
        "point_data": arrays(data.GetPointData()),
        "cell_data": arrays(data.GetCellData()),
    }


def read_with_meshio(path):
    mesh = meshio.read(path)
    return {
        "points": mesh.points.ravel().tolist(),
        "kinds": [block.type for block in mesh.cells for _ in block.data],
        "connectivity": [int(p) for block in mesh.cells for p in block.data.ravel()],
        "point_data": {name: a.ravel().tolist() for name, a in mesh.point_data.items()},
        "cell_data": {
            name: [v for a in blocks for v in a.ravel().tolist()]
            for name, blocks in mesh.cell_data.items()
        },
    }


json.dump(
    [
        {
            "vtk": read_with_vtk(path),
            "meshio": read_with_meshio(path) if path.endswith(".vtu") else None,
        }
        for path in sys.argv[1:]
    ],
    sys.stdout,
)
