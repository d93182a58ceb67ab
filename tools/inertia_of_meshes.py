"""Check the moments of inertia of 200 random meshes of Gmsh, of twelve shapes.

    cargo build --release
    .venv/bin/python tools/inertia_of_meshes.py target/release/cdem

Each mesh has 30 to 2000 nodes. `cdem check` must tell an inertia error of 0 %, but for plates of
one layer: no masses at their faces have their moment about the middle. There it is at most 1 %.
"""

import random
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

import gmsh

MESHES = 200
NODES = (30, 2000)
# Number of shapes, and that of the thin plate among them.
SHAPES, PLATE = 12, 2

SCENE = """title = "One block"
dimension = 3
time = { end = 1e-6 }
material = [{ name = "m", young_modulus = 1e9, poisson_ratio = 0.2, density = 1000.0 }]
block = [{ name = "b", mesh = "block.msh", material = "m" }]
"""

# The row of the block in `cdem check`: elements, nodes, mass, error in per cent, mass matrix.
ROW = re.compile(r"^\s+b\s+m\s+.* kg\s+(\S.*?) %\s+(\w+)", re.MULTILINE)


def shapes(occ, between):
    """Return makers of the twelve shapes; each makes a volume of a size of about 1 m."""

    def both(operation, one, other):
        [(_, volume)], _ = operation([(3, one())], [(3, other())])
        return volume

    def box(*corner_and_size):
        return lambda: occ.addBox(*corner_and_size)

    hole = lambda: occ.addCylinder(0.5, 0.5, -1, 0, 0, 3, between(0.15, 0.35))
    ball = lambda: occ.addSphere(0, 0, 0, 0.5)
    beam = box(0, 0, 0, 1, 0.3, 0.3)
    return [
        box(0, 0, 0, 1, 1, 1),
        box(0, 0, 0, 1, between(0.3, 1), between(0.1, 0.6)),
        box(0, 0, 0, 1, 1, between(0.05, 0.12)),
        ball,
        lambda: occ.addCylinder(0, 0, 0, 0, 0, 1, between(0.1, 0.5)),
        lambda: occ.addCone(0, 0, 0, 0, 0, 1, 0.5, between(0, 0.3)),
        lambda: occ.addWedge(0, 0, 0, 1, between(0.3, 1), 1, ltx=between(0, 0.7)),
        lambda: occ.addTorus(0, 0, 0, 0.5, between(0.1, 0.2)),
        lambda: both(occ.fuse, beam, box(0, 0, 0, 0.3, 1, 0.3)),
        lambda: both(occ.fuse, beam, box(0.4, 0, 0, 0.2, 1, 0.3)),
        lambda: both(occ.cut, box(0, 0, 0, 1, 1, 0.4), hole),
        lambda: both(occ.cut, ball, box(-1, -1, 0, 2, 2, 2)),
    ]


def mesh(number, path):
    """Write the mesh of this number."""
    draw = random.Random(number)
    size = 10 ** draw.uniform(-1.15, -0.25)
    while True:
        gmsh.clear()
        occ = gmsh.model.occ
        volume = shapes(occ, random.Random(number).uniform)[number % SHAPES]()
        occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [volume], name="b")
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.option.setNumber("Mesh.MeshSizeMin", size * draw.uniform(0.3, 1))
        gmsh.model.mesh.generate(3)
        count = len(gmsh.model.mesh.getNodes()[0])
        if NODES[0] <= count <= NODES[1]:
            gmsh.write(str(path))
            return
        size *= 0.8 if count < NODES[0] else 1.2


def main():
    command = Path(sys.argv[1]).resolve()
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    kinds = Counter()
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder, "scene.toml")
        scene.write_text(SCENE)
        for number in range(MESHES):
            mesh(number, scene.with_name("block.msh"))
            told = subprocess.run(
                [command, "check", scene], capture_output=True, text=True, check=True
            ).stdout
            row = ROW.search(told)
            if row is None:
                sys.exit(f"mesh {number}: no row of the block in\n{told}")
            error, kind = row.groups()
            is_plate = number % SHAPES == PLATE
            if error != "0" and not (is_plate and float(error) <= 1.0):
                sys.exit(f"mesh {number}: inertia error {error} %\n{told}")
            kinds[f"{kind}, error 0" if error == "0" else f"{kind}, error up to 1 %"] += 1
    print(dict(kinds))


if __name__ == "__main__":
    main()
