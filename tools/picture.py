"""Draw a run: snapshots side by side, and the energies over time.

    .venv/bin/python tools/picture.py RESULTS                      # RESULTS.png, beside it
    .venv/bin/python tools/picture.py RESULTS --field stress:xx --at 0.1 0.2 -o hit.png
    .venv/bin/python tools/picture.py RESULTS --energies energies.png

RESULTS is the folder of a 2-D run. Frames are drawn as they are, at the
current positions of the points, all with one colour scale.
"""

import argparse
import csv
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import NamedTuple

import matplotlib
import numpy as np
from matplotlib.collections import PolyCollection
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402  (the backend is chosen first)

# Units of the fields that a frame may hold; others are drawn without.
UNITS = {
    "displacement": "m", "velocity": "m/s", "contact_force": "N",
    "stress": "Pa", "von_mises": "Pa", "principal_stress": "Pa",
}
VOIGT = ["xx", "yy", "zz", "xy", "yz", "zx"]
AXES = ["x", "y", "z"]


class Mistake(Exception):
    """Something the caller can put right; its text says what."""


class Frame(NamedTuple):
    """One instant: time in s, corners of the cells in m, a value per cell."""

    time: float
    polygons: list
    values: np.ndarray


def series(results):
    """Times and files of the frames of a run, in order."""
    index = results / "frames.pvd"
    if not index.is_file():
        raise Mistake(f"{index} does not exist: is {results} the folder of a run?")
    entries = ElementTree.parse(index).iter("DataSet")
    frames = sorted((float(entry.get("timestep")), results / entry.get("file")) for entry in entries)
    if not frames:
        raise Mistake(f"{index} lists no frames")
    return frames


def choose(frames, count, at):
    """The frames nearest to the times `at`, or `count` evenly spread ones."""
    if at:
        return [min(frames, key=lambda frame: abs(frame[0] - time)) for time in at]
    places = np.linspace(0, len(frames) - 1, min(count, len(frames)))
    return [frames[round(place)] for place in places]


def component(array, name, label):
    """One number per item: a component of a vector or tensor, or its length."""
    if array.ndim == 1:
        if label:
            raise Mistake(f"{name} is a scalar: leave out ':{label}'")
        return array
    labels = (VOIGT if array.shape[1] == 6 else AXES)[: array.shape[1]]
    if label in labels:
        return array[:, labels.index(label)]
    if label or array.shape[1] == 6:
        raise Mistake(f"{name} has the components {', '.join(labels)}: choose one, as in {name}:{labels[0]}")
    return np.linalg.norm(array, axis=1)


def read(time, file, field):
    """Read one frame; a field on points is averaged over each cell."""
    if not file.is_file():
        raise Mistake(f"{file} is named in frames.pvd but does not exist")
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(file))
    reader.Update()
    grid = reader.GetOutput()
    points = vtk_to_numpy(grid.GetPoints().GetData())[:, :2]
    cells = [vtk_to_numpy(part) for part in (grid.GetCells().GetConnectivityArray(), grid.GetCells().GetOffsetsArray())]
    corners = [cells[0][begin:end] for begin, end in zip(cells[1][:-1], cells[1][1:])]

    name, _, label = field.partition(":")
    on_cells, on_points = grid.GetCellData(), grid.GetPointData()
    if on_cells.HasArray(name):
        values = component(vtk_to_numpy(on_cells.GetArray(name)), name, label)
    elif on_points.HasArray(name):
        at_points = component(vtk_to_numpy(on_points.GetArray(name)), name, label)
        values = np.array([at_points[cell].mean() for cell in corners])
    else:
        known = [data.GetArrayName(i) for data in (on_cells, on_points) for i in range(data.GetNumberOfArrays())]
        raise Mistake(f"the frames hold no {name!r}; they hold {', '.join(sorted(known))}")
    return Frame(time, [points[cell] for cell in corners], values)


def draw_snapshots(frames, field, file):
    """Draw frames side by side with one colour scale; stress is centred on zero."""
    corners = np.concatenate([polygon for frame in frames for polygon in frame.polygons])
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = 0.03 * max(high - low)
    values = np.concatenate([frame.values for frame in frames])
    least, most = values.min(), values.max()
    signed = least < 0 < most
    if signed:
        most = max(-least, most)
        least = -most

    width, height = high - low + 2 * margin
    panel = 3.2
    size = (panel * len(frames) + 1.0, panel * min(max(height / width, 0.35), 2.0) + 0.6)
    figure, panels = pyplot.subplots(1, len(frames), figsize=size, layout="constrained", squeeze=False)
    for axes, frame in zip(panels[0], frames):
        cells = PolyCollection(frame.polygons, array=frame.values, cmap="RdBu_r" if signed else "viridis")
        cells.set(clim=(least, most), edgecolor="0.25", linewidth=0.5)
        axes.add_collection(cells)
        axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin))
        axes.set(aspect="equal", xticks=[], yticks=[], title=f"{1e3 * frame.time:.4g} ms")
    unit = UNITS.get(field.partition(":")[0])
    title = field.replace("_", " ").replace(":", " ")
    figure.colorbar(cells, ax=panels[0].tolist(), label=f"{title}, {unit}" if unit else title, shrink=0.9)
    figure.savefig(file, dpi=150)
    pyplot.close(figure)


def draw_energies(results, file):
    """Draw kinetic, strain and lost energy of history.csv, and their balance."""
    with open(results / "history.csv", newline="") as table:
        rows = list(csv.DictReader(table))
    if not rows:
        raise Mistake(f"{results / 'history.csv'} has no rows yet")
    column = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    losses = [name for name in column if name.endswith("_loss")]
    lines = {
        "kinetic": column["kinetic_energy"],
        "strain": column["strain_energy"],
        "lost": sum(column[name] for name in losses),
        "residual": column["energy_residual"],
    }
    figure, axes = pyplot.subplots(figsize=(6.4, 3.6), layout="constrained")
    for name, values in lines.items():
        axes.plot(1e3 * column["time"], values, label=name, linewidth=1.2)
    axes.set(xlabel="time, ms", ylabel="energy, J")
    axes.legend(frameon=False)
    figure.savefig(file, dpi=150)
    pyplot.close(figure)


def beside(results):
    """The picture's place by default: not in the folder, which belongs to `cdem run`."""
    results = results.resolve()
    return results.with_name(f"{results.name}.png")


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path, help="folder of a 2-D run")
    parser.add_argument("-o", "--output", type=Path, help="picture to write (RESULTS.png, beside the folder)")
    parser.add_argument("--field", default="velocity", help="field, or field:component (velocity)")
    parser.add_argument("--snapshots", type=int, default=4, help="how many, evenly spread (4)")
    parser.add_argument("--at", type=float, nargs="+", help="these times instead, s")
    parser.add_argument("--energies", type=Path, help="also draw the energies, into this file")
    wanted = parser.parse_args(arguments)
    try:
        chosen = choose(series(wanted.results), wanted.snapshots, wanted.at)
        frames = [read(time, file, wanted.field) for time, file in chosen]
        draw_snapshots(frames, wanted.field, wanted.output or beside(wanted.results))
        if wanted.energies:
            draw_energies(wanted.results, wanted.energies)
    except Mistake as mistake:
        print(f"picture.py: {mistake}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
