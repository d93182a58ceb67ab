"""Scenes: from files, dictionaries and code; what is wrong is told as the command tells it."""

import numpy as np
import pytest

import cdem


def test_a_scene_built_up_is_that_of_its_dictionary(bar):
    again = cdem.Scene(bar.to_dict())
    assert again.to_toml() == bar.to_toml()
    assert 'young_modulus = 1000000000.0' in again.to_toml()


def test_a_scene_written_and_read_is_the_same(prisms, tmp_path):
    prisms.write(tmp_path / "scene.toml")
    again = cdem.Scene.read(tmp_path / "scene.toml")
    assert again.block[0].mesh.endswith("prisms.msh")
    assert cdem.Simulation(again).energies == cdem.Simulation(prisms).energies
    keys, old = again.to_dict(), cdem.Scene.parse(prisms.to_toml()).to_dict()
    for block in (*keys["block"], *old["block"]):
        del block["mesh"]
    assert keys == old


def test_keys_are_attributes_and_items(bar):
    bar.contact.pair.add(between=["rock", "rock"], friction_angle=20.0)
    assert bar.contact["pair"][0].friction_angle == 20.0
    bar.block[0].velocity = np.array([1.0, 0.0])
    assert "velocity = [1.0, 0.0]" in bar.to_toml()
    del bar.block[0].velocity
    assert "velocity" not in bar.block[0]
    with pytest.raises(AttributeError, match="`velocity` is not set"):
        bar.block[0].velocity


@pytest.mark.parametrize(
    ("look", "message"),
    [
        (lambda s: s.titel, "no key 'titel'; did you mean 'title'?"),
        (lambda s: s.time.begin, "time: there is no key 'begin'; there are 'end', 'safety', 'step'"),
        (lambda s: s.block[0].shpe, "block: there is no key 'shpe'; did you mean 'shape'?"),
        (lambda s: s.block[0].shape.box.mni, "box: there is no key 'mni'; did you mean 'min'?"),
        (lambda s: s.block.add(name="a").shpe, "did you mean 'shape'?"),
        (lambda s: s.copy().contact.pair.add().cohesio, "pair: .* did you mean 'cohesion'?"),
        (lambda s: cdem.Table().end, "the key `end` is not set"),
    ],
)
def test_keys_that_there_are_not_are_told_of(bar, look, message):
    with pytest.raises(AttributeError, match=message.replace("?", r"\?")):
        look(bar)


def test_a_table_that_was_only_looked_at_says_nothing(prisms):
    before = prisms.to_toml()
    assert list(prisms.load) == []
    assert prisms.to_toml() == before


def test_copies_are_apart(bar):
    other = bar.copy()
    other.time.end = 1.0
    assert bar.time.end == 2e-3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: setattr(s, "titel", "a"), "titel: unknown key (did you mean `title`?)"),
        (lambda s: s.time.update(end="5 mm"), 'time.end: '),
        (lambda s: s.time.update(end=float("nan")), "time.end: must be a finite number"),
        (lambda s: s.block[0].update(velocity=[1]), "block[0].velocity: expected 2 components"),
        (lambda s: s.block[0].update(material="rok"), "block[0].material: "),
        (lambda s: s.block[0].update(name=object()), "block[0].name: a value of type object"),
        (lambda s: s.load[0].update(group="bar.xmaxx"), "load[0].group: "),
        (lambda s: s.block[0].update(shape={"bx": 1}), "block[0].shape.bx: unknown key (did you mean `box`? The keys here are: box, polygon, size)"),
        # Advice speaks of Python, not of files.
        (lambda s: setattr(s, "block", {"name": "a"}), "block: expected an array, got a table (there may be several: write a list of dictionaries)"),
        (lambda s: setattr(s, "time", [1]), "time: expected a table, got an array (there is one: write a dictionary, not a list)"),
        (lambda s: setattr(s, "density", 1.0), "density: unknown key (it belongs in `material`)"),
        (lambda s: s.block[0].update(shape=1), 'block[0].shape: expected a table, got 1 (for example: shape = {"box": {"min": [0, 0]'),
        (lambda s: delattr(s, "block"), "block: this key is missing (a scene has at least one `block`)"),
    ],
)
def test_what_is_wrong_is_told_by_its_key(bar, change, message):
    change(bar)
    with pytest.raises(cdem.SceneError) as caught:
        cdem.Simulation(bar)
    assert str(caught.value).startswith(message)
    assert isinstance(caught.value, (cdem.Error, ValueError))


def test_a_scene_that_is_no_table_is_told_of():
    with pytest.raises(cdem.SceneError, match="dimension"):
        cdem.Simulation({})
    for wrong in ([1], 1):
        with pytest.raises(cdem.SceneError, match="needs a dictionary of its keys, not a value of type"):
            cdem.Simulation(wrong)
    with pytest.raises(cdem.SceneError, match=r"Scene\.read\(path\) reads a file"):
        cdem.Scene("scene.toml")
    with pytest.raises(cdem.SceneError, match="cannot read the scene nowhere.toml"):
        cdem.Simulation("nowhere.toml")


def test_errors_in_a_file_are_those_of_the_command(tmp_path, command, prisms):
    text = prisms.to_toml().replace("density = 2700.0", "density = -1.0")
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(cdem.SceneError) as caught:
        cdem.Scene.read(path)
    place, message = str(caught.value).split(": ", 1)
    assert place.startswith(f"{path}:")
    line = int(place.split(":")[-2])
    assert text.splitlines()[line - 1] == "density = -1.0"
    told = command("check", path, status=2)
    assert message.split(" (")[0] in told


def test_errors_of_meshes_are_those_of_the_command(tmp_path, command, prisms):
    prisms.write(tmp_path / "scene.toml")
    text = (tmp_path / "scene.toml").read_text()
    (tmp_path / "scene.toml").write_text(text.replace('group = "block_i"', 'group = "block_k"'))
    with pytest.raises(cdem.MeshError) as caught:
        cdem.Simulation(tmp_path / "scene.toml")
    told = " ".join(command("check", tmp_path / "scene.toml", status=2).split())
    message = str(caught.value).split(": ", 1)[1].split(" (")[0]
    assert message.split(";")[0] in told


def test_none_is_no_value(bar):
    bar.block[0].velocity = None
    with pytest.raises(cdem.SceneError, match=r"block\[0\].velocity: must not be None; leave out"):
        bar.check()


def test_a_mesh_that_is_none_is_told_of(bar):
    del bar.block[0].shape
    bar.block[0].mesh = np.zeros((3, 2))
    with pytest.raises(cdem.MeshError, match="a path, a cdem.Mesh or a meshio.Mesh, not of type ndarray"):
        cdem.Simulation(bar)


def test_arrays_of_a_scene_are_its_own(bar):
    velocity = np.array([1.0, 0.0])
    bar.block[0].velocity = velocity
    velocity[0] = 9.0
    other = bar.copy()
    other.block[0].velocity[0] = 2.0
    assert bar.block[0].velocity.tolist() == [1.0, 0.0]


def test_a_scene_that_cannot_be_written_is_told_of(bar, tmp_path):
    with pytest.raises(cdem.SceneError, match="cannot write the scene .*nowhere"):
        bar.write(tmp_path / "nowhere" / "scene.toml")
