"""Results, and checkpoints between Python and the command."""

import signal
import subprocess
import sys
import time

import numpy as np
import pandas
import pytest

import cdem
from conftest import ROOT, files


@pytest.fixture
def results(prisms, tmp_path):
    """A run of the two prisms with ten frames."""
    prisms.output.update(frames=10, history=50, blocks=50)
    simulation = cdem.Simulation(prisms)
    simulation.record(tmp_path / "results")
    simulation.run()
    return tmp_path / "results"


def test_tables_are_those_of_pandas_or_of_numpy(results):
    read = cdem.read_results(results)
    history = read.history
    assert isinstance(history, pandas.DataFrame) and len(history) == 51
    assert history["step"].dtype == np.int64
    assert read.blocks.groupby("block")["mass"].first().tolist() == pytest.approx([74824.5949] * 2)
    assert read.contacts["type"].tolist() == ["vertex-edge"]
    assert len(read.probes) == 0 and "ux" in read.probes
    plain = cdem.read_results(results, tables="numpy")
    assert np.array_equal(plain.history["kinetic_energy"], history["kinetic_energy"])
    assert plain.blocks["block"][0] == "i"
    with pytest.raises(ValueError, match="tables"):
        cdem.read_results(results, tables="polars")


def test_frames_are_read_one_by_one(results):
    frames = cdem.read_results(results).frames
    assert len(frames) == 11 and frames.times[-1] == 0.5
    mesh = frames.meshio(5)
    assert "velocity" in mesh.point_data and mesh.points.shape[1] == 3
    assert len(frames[1:3]) == 2
    assert len(list(frames)) == 11


def test_scene_and_summary_come_along(results, prisms):
    read = cdem.read_results(results)
    assert read.summary["status"] == "done"
    simulation = cdem.Simulation(read.scene)
    assert simulation.end == prisms.time.end


def test_a_folder_of_something_else_is_told_of(tmp_path):
    with pytest.raises(cdem.ResultsError, match="is no results folder"):
        cdem.read_results(tmp_path)
    with pytest.raises(cdem.ResultsError, match="is no results folder"):
        cdem.Simulation.load(tmp_path / "nowhere")


@pytest.mark.parametrize(
    ("name", "kept", "message"),
    [
        ("history.csv", 0, "history.csv is not from a run"),
        ("contacts.csv", 0, "contacts.csv is empty"),
        ("summary.json", 100, r"summary.json:\d+: "),
        ("frames.pvd", 100, "cannot read .*frames.pvd"),
    ],
)
def test_torn_files_are_told_of(results, name, kept, message):
    (results / name).write_bytes((results / name).read_bytes()[:kept])
    with pytest.raises(cdem.ResultsError, match=message):
        read = cdem.read_results(results)
        getattr(read, name.split(".")[0])


def test_tables_that_are_no_tables_are_told_of(results):
    path = results / "history.csv"
    whole = path.read_text(encoding="utf-8")
    lines = whole.splitlines(keepends=True)
    for torn, message in (
        (lines[0] + lines[1][:20] + "\n" + lines[2], r"history.csv:2: expected \d+ columns, got 2"),
        (lines[0] + lines[1].replace("e", "x"), "column .*: could not convert"),
    ):
        path.write_text(torn, encoding="utf-8")
        with pytest.raises(cdem.ResultsError, match=message):
            _ = cdem.read_results(results).history
    path.write_bytes(whole.encode() + b"\xff\n")
    with pytest.raises(cdem.ResultsError, match="utf-8"):
        _ = cdem.read_results(results).history


def test_the_row_that_is_being_written_is_left_out(results):
    path = results / "history.csv"
    whole = cdem.read_results(results).history
    path.write_bytes(path.read_bytes()[:-7])
    assert cdem.read_results(results).history.equals(whole[:-1])


def test_a_program_that_ends_leaves_results_to_go_on_from(tmp_path):
    program = (
        "import cdem, sys; simulation = cdem.Simulation(sys.argv[1], threads=1); "
        "simulation.record(sys.argv[2]); simulation.run(until=0.1)"
    )
    scene = ROOT / "examples" / "two-prisms-2d" / "scene.toml"
    call = [sys.executable, "-c", program, scene, tmp_path / "results"]
    subprocess.run(call, check=True, timeout=60)
    summary = cdem.read_results(tmp_path / "results").summary
    assert (summary["status"], summary["threads"]) == ("interrupted", 1)
    assert cdem.Simulation.load(tmp_path / "results").time == pytest.approx(0.1)


def test_results_of_a_run_at_its_end_are_done(prisms, tmp_path):
    simulation = cdem.Simulation(prisms)
    simulation.run()
    simulation.record(tmp_path / "results")
    simulation.close()
    assert cdem.read_results(tmp_path / "results").summary["status"] == "done"


def test_a_run_whose_results_are_gone_may_be_kept_elsewhere(bar, tmp_path):
    simulation = cdem.Simulation(bar)
    simulation.record(tmp_path / "results")
    simulation.step()
    # Frames are still being written: files may come and go while they are deleted one by one.
    (tmp_path / "results").rename(tmp_path / "away")
    before = simulation.scene.load[0].traction
    with pytest.raises(cdem.ResultsError):
        simulation.set_load("bar.xmax", traction=[1e5, 0.0])
    assert simulation.scene.load[0].traction == before
    with pytest.raises(cdem.ResultsError):
        simulation.run()
    assert simulation.folder is None
    simulation.save(tmp_path / "elsewhere")
    step = simulation.step_index
    assert cdem.Simulation.load(tmp_path / "elsewhere").step_index == step
    simulation.run()
    assert simulation.finished


def test_results_are_replaced_only_when_asked(results, prisms):
    simulation = cdem.Simulation(prisms)
    # Advice speaks of Python, not of the command.
    with pytest.raises(cdem.ResultsError, match="contains an earlier run") as caught:
        simulation.record(results)
    assert "(replace that run with force=True, or name another folder)" in str(caught.value)
    simulation.record(results, force=True)
    with pytest.raises(cdem.ResultsError, match="already"):
        simulation.record(results)
    with pytest.raises(cdem.ResultsError, match="contacts.csv"):
        simulation.ended_contacts()


def test_a_run_saved_by_python_is_resumed_by_the_command(prisms, tmp_path, command):
    whole, part = tmp_path / "whole", tmp_path / "part"
    simulation = cdem.Simulation(prisms)
    simulation.record(whole)
    simulation.run()
    with cdem.Simulation(prisms) as simulation:
        simulation.record(part)
        simulation.run(until=0.3345)
    summary = cdem.read_results(part).summary
    assert (summary["status"], summary["reason"]) == ("interrupted", "interrupted at t = 334.5 ms")
    command("resume", part)
    assert files(part) == files(whole)


def test_a_run_stopped_is_loaded_and_goes_on_alike(prisms, tmp_path):
    whole, part = tmp_path / "whole", tmp_path / "part"
    simulation = cdem.Simulation(prisms)
    simulation.record(whole)
    simulation.run()
    stopped = cdem.Simulation(prisms)
    stopped.record(part)
    stopped.run(until=0.3345)
    del stopped  # as at the end of a program: what was recorded ends well
    before = files(part)
    looked_at = cdem.Simulation.load(part)
    assert looked_at.time == pytest.approx(0.3345)
    looked_at.run()
    assert np.array_equal(looked_at.positions, simulation.positions)
    assert files(part) == before
    again = cdem.Simulation.load(part, record=True, threads=1)
    again.run()
    assert files(part) == files(whole)
    with pytest.raises(cdem.ResultsError, match="is done"):
        cdem.Simulation.load(part)


def test_a_run_of_the_command_that_was_stopped_is_loaded(prisms, tmp_path, command):
    # A frame each 100 steps: the first is of step 0, the third shows that the run steps.
    prisms.time.update(step=1e-6, end=1000.0)
    prisms.output.update(history=10, blocks=10, frames=10_000_000)
    prisms.write(tmp_path / "scene.toml")
    started = command.start("run", tmp_path / "scene.toml", "-o", tmp_path / "results")
    frames = tmp_path / "results" / "frames"
    while not frames.exists() or len(list(frames.iterdir())) < 3:
        assert started.poll() is None, started.communicate()
        time.sleep(0.01)
    started.send_signal(signal.SIGINT)
    assert started.wait(timeout=60) == 130
    loaded = cdem.Simulation.load(tmp_path / "results")
    simulation = cdem.Simulation(prisms)
    simulation.run(until=loaded.time)
    assert simulation.step_index == loaded.step_index > 0
    assert np.array_equal(simulation.positions, loaded.positions)
    assert simulation.energies == loaded.energies


def test_a_run_that_lost_power_is_loaded_and_resumed(prisms, tmp_path, command):
    """Its checkpoint is there, its end is not."""
    prisms.time.end = 0.3345
    simulation = cdem.Simulation(prisms)
    simulation.record(tmp_path / "results")
    simulation.run(until=0.2)
    simulation.save()
    simulation.run(until=0.3)
    loaded = tmp_path / "copy"
    loaded.mkdir()
    for name, content in files(tmp_path / "results").items():
        (loaded / name).parent.mkdir(exist_ok=True)
        (loaded / name).write_bytes(content)
    assert cdem.Simulation.load(loaded).time == pytest.approx(0.2)
    command("resume", loaded)
    simulation.run()
    assert files(loaded) == files(tmp_path / "results")


def test_a_checkpoint_may_be_saved_by_itself(prisms, tmp_path, command):
    simulation = cdem.Simulation(prisms)
    with pytest.raises(cdem.ResultsError, match="name a folder"):
        simulation.save()
    simulation.run(until=0.3345)
    simulation.save(tmp_path / "checkpoint")
    loaded = cdem.Simulation.load(tmp_path / "checkpoint")
    simulation.run()
    loaded.run()
    assert np.array_equal(loaded.positions, simulation.positions)
    assert loaded.energies == simulation.energies
    command("resume", tmp_path / "checkpoint")
    read = cdem.read_results(tmp_path / "checkpoint")
    assert read.history["time"].iloc[0] == pytest.approx(0.3345)
    assert read.history["kinetic_energy"].iloc[-1] == simulation.energies["kinetic_energy"]
    assert len(read.contacts) == 1


def test_what_was_done_between_steps_is_in_a_checkpoint(bar, tmp_path, command):
    simulation = cdem.Simulation(bar)
    simulation.record(tmp_path / "results")
    simulation.step(4)
    simulation.save()
    simulation.set_load("bar.xmax", traction=[1e5, 0.0])
    simulation.step(4)
    simulation.set_velocities([0.0, 1.0])
    simulation.save(tmp_path / "checkpoint")
    simulation.close()
    simulation.run()
    command("resume", tmp_path / "results")
    command("resume", tmp_path / "checkpoint")
    for folder in ("results", "checkpoint"):
        read = cdem.read_results(tmp_path / folder)
        last = read.history.iloc[-1]
        assert last["external_work"] == simulation.energies["external_work"]
        assert read.scene.load[0].traction[-1][1] == [1e5, 0.0]


def test_frames_are_those_of_pyvista_or_else_of_meshio(results, monkeypatch):
    pyvista = pytest.importorskip("pyvista")
    frames = cdem.read_results(results).frames
    assert isinstance(frames[0], pyvista.UnstructuredGrid)
    monkeypatch.setattr("cdem.results.find_spec", lambda name: name != "pyvista")
    assert frames[0].points.shape == (6, 3)
    with pytest.raises(IndexError, match=f"no frame {len(frames)}; the run has written {len(frames)}"):
        frames[len(frames)]


def test_the_state_is_that_of_the_last_frame(results, prisms):
    pytest.importorskip("pyvista")
    simulation = cdem.Simulation(prisms)
    simulation.run()
    frame, now = cdem.read_results(results).frames[-1], simulation.to_pyvista()
    assert np.array_equal(frame.points, now.points)
    assert np.array_equal(frame.cells, now.cells)
    assert np.array_equal(frame.point_data["velocity"], now.point_data["velocity"])
    assert np.array_equal(frame.cell_data["stress"], now.cell_data["stress"])
    assert np.array_equal(simulation.to_meshio().points, now.points)
