"""Meshes of arrays and of meshio."""

import meshio
import numpy as np
import pytest

import cdem

POINTS = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
TRIANGLES = [[0, 1, 2], [0, 2, 3]]


def scene_of(mesh, **block):
    scene = cdem.Scene(dimension=2, time={"end": 1e-3})
    scene.material.add(name="rock", young_modulus=1e9, poisson_ratio=0.25, density=1000.0)
    scene.block.add(name="a", material="rock", mesh=mesh, **block)
    return scene


def square(**more):
    groups = {"right": {"line": [0]}, "whole": {"triangle": [0, 1]}}
    return cdem.Mesh(POINTS, {"triangle": TRIANGLES, "line": [[1, 2]]}, groups, **more)


def test_arrays_make_a_block_with_its_groups():
    scene = scene_of(square(), group="whole")
    scene.load.add(group="right", traction=[1e5, 0.0])
    simulation = cdem.Simulation(scene)
    assert simulation.positions.shape == (4, 3)
    assert simulation.blocks["a"].mass == pytest.approx(1000.0)
    simulation.step()
    # Force times time: 1e5 N on 1 m², and half of the first kick.
    impulse = 1e5 * simulation.step_size
    assert simulation.momentum[0] == pytest.approx(impulse)


def test_two_blocks_of_one_mesh_share_it():
    mesh = square()
    scene = scene_of(mesh)
    scene.block.add(name="b", material="rock", mesh=mesh, translate=[2.0, 0.0])
    assert list(cdem.Simulation(scene).blocks) == ["a", "b"]


def test_a_mesh_of_meshio_is_taken_by_its_cell_sets():
    mesh = meshio.Mesh(
        POINTS,
        [("triangle", TRIANGLES), ("line", [[1, 2]])],
        cell_sets={"right": [[], [0]]},
    )
    scene = scene_of(mesh)
    scene.boundary.add(group="right", velocity={"x": 0.0})
    assert len(cdem.Simulation(scene).positions) == 4


def test_a_gmsh_file_read_by_meshio_makes_the_blocks_of_the_file(prisms):
    from_file = cdem.Simulation(prisms)
    mesh = meshio.read(prisms.directory / prisms.block[0].mesh)
    for block in prisms.block:
        block.mesh = mesh
    from_arrays = cdem.Simulation(prisms)
    for simulation in (from_file, from_arrays):
        simulation.run()
    assert from_file.history["kinetic_energy"] == from_arrays.history["kinetic_energy"]
    assert np.array_equal(from_file.positions, from_arrays.positions)


def test_a_scene_with_arrays_can_be_written_and_run_by_the_command(tmp_path, command):
    scene = scene_of(square(), group="whole")
    scene.load.add(group="right", pressure="-1 MPa")
    scene.write(tmp_path / "scene.toml")
    command("run", tmp_path / "scene.toml")
    simulation = cdem.Simulation(scene)
    simulation.run()
    last = cdem.read_results(tmp_path / "scene-results", tables="numpy").history[-1]
    assert last["kinetic_energy"] == simulation.energies["kinetic_energy"]


def test_a_mesh_of_arrays_comes_back_with_the_scene_and_its_checkpoints(tmp_path):
    simulation = cdem.Simulation(scene_of(square(), group="whole"))
    simulation.record(tmp_path / "results")
    simulation.set_velocities([1.0, 0.0])
    simulation.step(3)
    again = cdem.Simulation(simulation.scene)
    assert np.array_equal(again.positions, cdem.Simulation(scene_of(square())).positions)
    simulation.close()
    loaded = cdem.Simulation.load(tmp_path / "results")
    assert np.array_equal(loaded.positions, simulation.positions)
    with pytest.raises(cdem.SceneError, match=r"mesh of block\[0\] comes from arrays.*write\(path\)"):
        simulation.scene.to_toml()


def test_a_group_may_be_asked_of_one_block():
    scene = scene_of(square())
    scene.block.add(name="b", material="rock", mesh=square(), translate=[2.0, 0.0])
    scene.load.add(group="b.right", traction=[1e5, 0.0])
    simulation = cdem.Simulation(scene)
    simulation.step()
    assert simulation.blocks["a"].velocity[0] == 0.0
    assert simulation.momentum[0] == pytest.approx(1e5 * simulation.step_size)
    scene.load[0].group = "right"
    with pytest.raises(cdem.SceneError, match='several groups: .*block.right'):
        cdem.Simulation(scene)


def test_cells_of_groups_are_numbers_or_a_mask():
    cells = {"tri3": TRIANGLES, "line": [[0, 1], [1, 2]]}
    by_number = cdem.Mesh(POINTS, cells, {"right": {"line": [1]}})
    by_mask = cdem.Mesh(POINTS, cells, {"right": {"line": np.array([False, True])}})
    assert by_mask.groups["right"][1].tolist() == by_number.groups["right"][1].tolist() == [1]


def test_a_mesh_stays_as_it_was_made():
    mesh = square()
    for change in (
        lambda: setattr(mesh, "points", mesh.points[:, :2]),
        lambda: mesh.points.fill(7.0),
        lambda: mesh.cells[0][1].fill(7),
        lambda: mesh.groups.update(more=[]),
    ):
        with pytest.raises((AttributeError, ValueError)):
            change()


def test_written_meshes_have_names_of_the_scene_and_replace_no_others(tmp_path):
    scene = scene_of(square())
    scene.block[0].name = "../evil"
    (tmp_path / "here").mkdir()
    scene.write(tmp_path / "here" / "wall.toml")
    assert sorted(path.name for path in tmp_path.rglob("*.*")) == ["wall-1.msh", "wall.toml"]
    scene.time.end = -1.0
    with pytest.raises(cdem.SceneError, match="time.end"):
        scene.write(tmp_path / "here" / "other.toml")
    with pytest.raises(cdem.MeshError, match="cannot write the mesh .*No such file"):
        scene_of(square()).write(tmp_path / "nowhere" / "wall.toml")
    assert len(list(tmp_path.rglob("*.*"))) == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([0.0, 1.0], {}), "points must be an array of n × 2 or n × 3, not 2"),
        ((POINTS, {"tri": TRIANGLES}), "no shape of cells 'tri'; did you mean 'tri3'"),
        ((POINTS, {"tri6": [[0] * 6]}), "no shape of cells 'tri6'; did you mean 'tri3'"),
        ((POINTS, {"quad": TRIANGLES}), "n × 4, not 2 × 3"),
        ((POINTS, {"triangle": [[0.0, 1.0, 2.0]]}), "whole numbers"),
        ((POINTS, {"triangle": [[0, 1, 4]]}), "have point 4; there are 4 points, counted from 0$"),
        ((POINTS, {"triangle": [[0, 1, -1]]}), "have point -1; there are 4 points, counted from 0$"),
        ((POINTS, {"triangle": [[1, 2, 3], [1, 3, 4]]}), "counted from 1, subtract 1"),
        ((POINTS, {"triangle": np.array([[0, 1, 2**63]], np.uint64)}), "have point 9223372036854775808"),
        ((POINTS, {}), "there are no elements; cells must have one of the shapes tri3"),
        ((POINTS, {"triangle": []}), "there are no elements"),
        ((POINTS, {"line": [[0, 1]]}), "there are no elements"),
        ((POINTS, TRIANGLES), "as in {'tri3': triangles}"),
        ((POINTS, np.array(TRIANGLES)), "as in {'tri3': triangles}"),
        (([[0.0, np.nan]], {}), "the coordinates of point 0 are not finite"),
        ((POINTS, {"triangle": TRIANGLES}, {"g": {"line": [0]}}), "but the mesh has none"),
        ((POINTS, {"triangle": TRIANGLES}, {"g": [[2]]}), "has cell 2 of shape tri3"),
        ((POINTS, {"triangle": TRIANGLES}, {"g": []}), "0 arrays for 1 entries"),
        ((POINTS, {"triangle": TRIANGLES}, {"g": [[0.5]]}), "their numbers, or a boolean for each of 2, not 1 of float64"),
        ((POINTS, {"triangle": TRIANGLES}, {"g": [[True]]}), "a boolean for each of 2, not 1 of bool"),
        ((POINTS, {"triangle": TRIANGLES}, {"g": [[[0, 1]]]}), "not 1 × 2 of int"),
        ((POINTS, [("tri3", TRIANGLES), ("tri3", TRIANGLES)], {"g": {"tri3": [0]}}), "more than once"),
        ((POINTS, {"tri3": TRIANGLES}, {"g": {"tri3": [0], "triangle": [1]}}), "more than once"),
        (([[0.0, 0.0], [1.0]], {}), "points must be an array"),
        ((POINTS, {"tri3": [[0, 1, 2], [0, 1]]}), "cells of shape tri3 must be an array"),
        ((np.array(POINTS, complex), {}), "points must be numbers, not complex128"),
    ],
)
def test_wrong_arrays_are_told_of(arguments, message):
    with pytest.raises(cdem.MeshError, match=message):
        cdem.Mesh(*arguments)


def test_what_is_no_mesh_is_told_of():
    with pytest.raises(cdem.MeshError, match="not of type dict"):
        cdem.Mesh.of({})
    with pytest.raises(cdem.MeshError, match="has no area"):
        flat = cdem.Mesh([[0, 0], [1, 0], [2, 0]], {"triangle": [[0, 1, 2]]})
        cdem.Simulation(scene_of(flat))
