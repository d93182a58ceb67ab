"""Draw a run: snapshots side by side (of long models: above each other), and the
energies over time.

    .venv/bin/python tools/picture.py RESULTS                      # RESULTS.png, beside it
    .venv/bin/python tools/picture.py RESULTS --field stress:xx --at 0.1 0.2 -o hit.png
    .venv/bin/python tools/picture.py RESULTS --energies energies.png
    .venv/bin/python tools/picture.py RESULTS --view -120 20       # of a 3-D run

RESULTS is the folder of a run. Frames are drawn as they are, at the current
positions of the points, all with one colour scale; in 3-D, what of the boundary
faces the eye.
"""

import argparse
import csv
import shlex
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import NamedTuple

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap, Normalize, to_rgba
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402  (the backend is chosen first)

# Units of the fields that a frame may hold; others are drawn without.
UNITS = {
    "displacement": "m", "velocity": "m/s", "contact_force": "N",
    "stress": "Pa", "von_mises": "Pa", "principal_stress": "Pa",
}
# Fields of numbers that are names: neighbours in number are nothing alike.
NAMED = {"block", "material"}
# Inches, of 150 pixels: width of a panel in a single row, and of a page; the
# lowest that a panel should be, and its title.
PANEL_WIDTH, PAGE_WIDTH, PANEL_HEIGHT, TITLE = 3.2, 12.8, 1.7, 0.4
# Direction of view in 3-D, degrees: azimuth about z from x, and elevation above the plane.
VIEW = (-60.0, 30.0)
# Brightness of a face in full light, and in none.
BRIGHT, DARK = 1.0, 0.6
# Of how many pieces the way across a picture in 3-D is: what is farther in front of
# something than a piece is long hides it.
PIECES = 40
VOIGT = ["xx", "yy", "zz", "xy", "yz", "zx"]
AXES = ["x", "y", "z"]


class Mistake(Exception):
    """Something the caller can put right; its text says what."""


class Frame(NamedTuple):
    """One instant: time in s; corners of polygons on the page in m, the hindmost
    first, a value and a brightness of each, and whether its outline shows."""

    time: float
    polygons: list
    values: np.ndarray
    brightness: np.ndarray
    outlined: np.ndarray


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
    if count < 1:
        raise Mistake(f"--snapshots {count}: draw one or more")
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


def read(time, file, field, view=VIEW):
    """Read one frame; a field on points is averaged over each polygon."""
    if not file.is_file():
        raise Mistake(f"{file} is named in frames.pvd but does not exist")
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(file))
    boundary = vtkGeometryFilter()
    boundary.SetInputConnection(reader.GetOutputPort())
    boundary.Update()
    grid, faces = reader.GetOutput(), boundary.GetOutput()
    points = vtk_to_numpy(faces.GetPoints().GetData())
    lists = faces.GetPolys()
    cells = [vtk_to_numpy(part) for part in (lists.GetConnectivityArray(), lists.GetOffsetsArray())]
    corners = [cells[0][begin:end] for begin, end in zip(cells[1][:-1], cells[1][1:])]

    name, _, label = field.partition(":")
    on_cells, on_points = faces.GetCellData(), faces.GetPointData()
    if on_cells.HasArray(name):
        values = component(vtk_to_numpy(on_cells.GetArray(name)), name, label)
    elif on_points.HasArray(name):
        at_points = component(vtk_to_numpy(on_points.GetArray(name)), name, label)
        values = np.array([at_points[cell].mean() for cell in corners])
    else:
        known = [data.GetArrayName(i) for data in (on_cells, on_points) for i in range(data.GetNumberOfArrays())]
        raise Mistake(f"the frames hold no {name!r}; they hold {', '.join(sorted(known))}")
    polygons = [points[cell] for cell in corners]
    if grid.GetNumberOfCells() == 0 or grid.GetCell(0).GetCellDimension() == 2:
        ones = np.ones(len(polygons))
        return Frame(time, [polygon[:, :2] for polygon in polygons], values, ones, ones > 0)
    return Frame(time, *see(polygons, values, view))


def see(polygons, values, view):
    """What an eye far away sees of faces in space: those that face it, on the page, the
    hindmost first. Large ones come in pieces, so that each is before all that it hides."""
    azimuth, elevation = np.radians(view)
    (sine, cosine), (rise, level) = [(np.sin(angle), np.cos(angle)) for angle in (azimuth, elevation)]
    right = np.array([-sine, cosine, 0.0])
    up = np.array([-rise * cosine, -rise * sine, level])
    towards = np.array([level * cosine, level * sine, rise])
    light = towards + 0.5 * up - 0.5 * right
    light /= np.linalg.norm(light)

    normals = np.array([np.cross(polygon, np.roll(polygon, -1, axis=0)).sum(axis=0) for polygon in polygons])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    brightness = DARK + (BRIGHT - DARK) * np.clip(normals @ light, 0.0, 1.0)
    corners = np.concatenate(polygons)
    size = np.linalg.norm(corners.max(axis=0) - corners.min(axis=0)) / PIECES
    parts, owners, outlined = [], [], []
    for i in np.flatnonzero(normals @ towards > 1e-9):
        inside, outline = pieces(polygons[i], size)
        parts += inside + outline
        owners += [i] * (len(inside) + len(outline))
        outlined += [not outline] * len(inside) + [True] * len(outline)
    # Blocks on the ground are before it; a line is before its face.
    depths = np.array([(part @ towards).min() + (0.5 * size if len(part) == 2 else 0.0) for part in parts])
    order = np.argsort(depths, kind="stable")
    page = np.stack([right, up], axis=1)
    owners, outlined = np.array(owners)[order], np.array(outlined)[order]
    return [parts[k] @ page for k in order], values[owners], brightness[owners], outlined


def pieces(polygon, size):
    """A face in quadrilaterals no larger than `size`, and its outline in lines as short;
    one that is small enough is its own only piece, and without lines."""
    after = np.roll(polygon, -1, axis=0)
    count = int(np.ceil(np.linalg.norm(after - polygon, axis=1).max() / size))
    if count <= 1:
        return [polygon], []
    shares = np.linspace(0.0, 1.0, count + 1)
    ends = np.stack([shares[:-1], shares[1:]], axis=1)[..., np.newaxis]
    lines = [(1.0 - t) * a + t * b for a, b in zip(polygon, after) for t in ends]
    a, b, c, d = polygon[[0, 1, 2, -1]]
    s, t = np.meshgrid(shares, shares, indexing="ij")
    s, t = s[..., np.newaxis], t[..., np.newaxis]
    grid = (1.0 - s) * ((1.0 - t) * a + t * d) + s * ((1.0 - t) * b + t * c)
    rings = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2)
    return list(rings.reshape(-1, 4, 3)), lines


def colours(values, named):
    """Colour map and limits: distinct colours for names, centred on zero for signs."""
    least, most = values.min(), values.max()
    if named:
        distinct = [pyplot.get_cmap("tab20")(int(value) % 20) for value in np.arange(least, most + 1)]
        return ListedColormap(distinct), least - 0.5, most + 0.5
    if least < 0 < most:
        most = max(-least, most)
        return "RdBu_r", -most, most
    return "viridis", least, most


def layout(width, height, count):
    """Rows and columns of panels, and the size of one in inches: one row, unless its
    panels would be lower than PANEL_HEIGHT; then as many columns as fit on a page
    with panels of that height, or one where even a page is too narrow."""
    panel = PANEL_WIDTH
    columns = count
    while columns > 1 and panel * height / width < PANEL_HEIGHT:
        columns -= 1
        panel = PAGE_WIDTH / columns
    return -(-count // columns), columns, (panel, panel * min(max(height / width, 0.02), 2.0))


def draw_snapshots(frames, field, file, made_by, window=None, scheme=None):
    """Draw frames with one colour scale; the picture remembers what made it. All of them
    and in fitting colours, but for a window, its lower left and upper right corner, and
    a scheme, as `colours` makes them."""
    corners = np.concatenate([polygon for frame in frames for polygon in frame.polygons])
    low, high = np.array(window) if window else (corners.min(axis=0), corners.max(axis=0))
    margin = 0.0 if window else 0.03 * max(high - low)
    values = np.concatenate([frame.values for frame in frames])
    named = field in NAMED
    colour_map, least, most = scheme or colours(values, named)
    scale = ScalarMappable(Normalize(least, most), colour_map)

    width, height = high - low + 2 * margin
    rows, columns, (across, down) = layout(width, height, len(frames))
    size = (across * columns + 1.0, (down + TITLE) * rows + 0.2)
    figure, panels = pyplot.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False)
    for axes in panels.flat[len(frames):]:
        axes.set_axis_off()
    for axes, frame in zip(panels.flat, frames):
        shown = scale.to_rgba(frame.values)
        shown[:, :3] *= frame.brightness[:, np.newaxis]
        edges = np.where(frame.outlined[:, np.newaxis], to_rgba("0.25"), shown)
        axes.add_collection(PolyCollection(frame.polygons, facecolor=shown, edgecolor=edges, linewidth=0.5))
        axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin))
        axes.set(aspect="equal", xticks=[], yticks=[], title=f"{1e3 * frame.time:.4g} ms")
    unit = UNITS.get(field.partition(":")[0])
    title = field.replace("_", " ").replace(":", " ")
    bar = figure.colorbar(scale, ax=panels.ravel().tolist(), label=f"{title}, {unit}" if unit else title, shrink=0.9)
    if named:
        bar.set_ticks(range(int(values.min()), int(values.max()) + 1, 1 + int(np.ptp(values)) // 20))
        bar.minorticks_off()
    figure.savefig(file, dpi=150, metadata={"Description": made_by})
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
    parser.add_argument("results", type=Path, help="folder of a run")
    parser.add_argument("-o", "--output", type=Path, help="picture to write (RESULTS.png, beside the folder)")
    parser.add_argument("--field", default="velocity", help="field, or field:component (velocity)")
    parser.add_argument("--snapshots", type=int, default=4, help="how many, evenly spread (4)")
    parser.add_argument("--at", type=float, nargs="+", help="these times instead, s")
    parser.add_argument(
        "--view", type=float, nargs=2, default=VIEW, metavar=("AZIMUTH", "ELEVATION"),
        help=f"where the eye is in 3-D, degrees about z from x on, and above the plane ({VIEW[0]:g} {VIEW[1]:g})",
    )
    parser.add_argument("--energies", type=Path, help="also draw the energies, into this file")
    arguments = sys.argv[1:] if arguments is None else arguments
    wanted = parser.parse_args(arguments)
    try:
        chosen = choose(series(wanted.results), wanted.snapshots, wanted.at)
        frames = [read(time, file, wanted.field, wanted.view) for time, file in chosen]
        made_by = f"tools/picture.py {shlex.join(arguments)}"
        draw_snapshots(frames, wanted.field, wanted.output or beside(wanted.results), made_by)
        if wanted.energies:
            draw_energies(wanted.results, wanted.energies)
    except Mistake as mistake:
        print(f"picture.py: {mistake}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
