"""Simulations: stepped, looked at, changed between steps."""

import copy
import multiprocessing
import os
import pickle
import signal
import threading
import time

import numpy as np
import pytest

import cdem
from conftest import ROOT, files


def test_a_run_recorded_is_that_of_the_command_bit_for_bit(prisms, tmp_path, command):
    path = ROOT / "examples" / "two-prisms-2d" / "scene.toml"
    command("run", path, "-o", tmp_path / "command", "--threads", "1")
    simulation = cdem.Simulation(prisms, threads=2)
    simulation.record(tmp_path / "python")
    looked_at = []

    def look(simulation):
        looked_at.append((simulation.blocks["i"].velocity[0], simulation.energies, simulation.contacts))

    simulation.run(callback=look, every=7)
    assert len(looked_at) == 1000 // 7
    assert files(tmp_path / "python") == files(tmp_path / "command")
    assert cdem.read_results(tmp_path / "python").summary["status"] == "done"


def test_an_instant_is_synchronised_and_stays(prisms):
    simulation = cdem.Simulation(prisms)
    simulation.step()
    positions, velocities = simulation.positions, simulation.velocities
    kept = positions.copy()
    assert np.allclose(velocities[simulation.blocks["i"].points], [3.0, 0.0, 0.0])
    simulation.step(5)
    assert np.array_equal(positions, kept)
    # 5 steps at 3 m/s, to round-off of positions of some metres.
    moved = simulation.positions - kept
    points = simulation.blocks["i"].points
    assert np.allclose(moved[points], [15 * simulation.step_size, 0.0, 0.0], atol=1e-14)


def test_until_is_the_first_step_at_or_after_it(prisms):
    simulation = cdem.Simulation(prisms)
    simulation.run(until=0.1)
    assert simulation.step_index == 200
    simulation.run(until=0.1)
    assert simulation.step_index == 200
    simulation.run(until="100.1 ms")
    assert simulation.step_index == 201
    simulation.run()
    assert simulation.finished and simulation.time == simulation.end == 0.5
    with pytest.warns(UserWarning, match="the run is at its end, t = 0.5 s: no step is made"):
        simulation.step()
    assert simulation.step_index == 1000
    simulation.run()


def test_a_time_after_the_end_is_told_of(prisms):
    simulation = cdem.Simulation(prisms)
    with pytest.warns(UserWarning, match=r"the scene ends at t = 0.5 s: .*before 10; .*increase time.end"):
        simulation.run(until=10, callback=lambda s: True)
    assert simulation.step_index == 1


def test_a_callback_stops_the_run(prisms):
    simulation = cdem.Simulation(prisms)
    # Comparisons of arrays give booleans of NumPy.
    simulation.run(callback=lambda s: np.bool_(len(s.contacts) > 0))
    assert 0.333 < simulation.time < 0.335
    contacts = simulation.contacts
    assert (contacts.main, contacts.target, contacts.type) == (["i"], ["j"], ["vertex-edge"])
    assert np.allclose(contacts.normal, [[-1.0, 0.0, 0.0]], atol=1e-3)
    simulation.run()
    ended = simulation.ended_contacts()
    assert len(ended) == 1 and ended.time_off[0] > ended.time_on[0]
    assert len(simulation.ended_contacts()) == 0


def test_an_error_in_a_callback_comes_out_and_the_run_goes_on(prisms):
    simulation = cdem.Simulation(prisms)
    with pytest.raises(ZeroDivisionError):
        simulation.run(callback=lambda s: 1 / 0)
    assert simulation.step_index == 1
    simulation.run(until=0.01)
    assert simulation.step_index == 20


def test_momentum_and_energy_are_kept(prisms):
    simulation = cdem.Simulation(prisms)
    start = simulation.energies["kinetic_energy"]
    momentum = simulation.momentum
    simulation.run()
    # Round-off of some thousand sums.
    assert np.allclose(simulation.momentum, momentum, rtol=1e-12, atol=1e-12 * momentum[0])
    row = simulation.energies
    assert abs(row["energy_residual"]) < 1e-3 * start


def test_fields_have_the_shapes_they_say(prisms):
    prisms.contact.model = "unified-node"
    simulation = cdem.Simulation(prisms)
    simulation.step(3)
    points, cells = len(simulation.positions), len(simulation.cells)
    assert (points, cells) == (6, 2)
    for name in ("displacement", "velocity", "contact_force"):
        assert simulation.field(name).shape == (points, 3)
    assert simulation.field("stress").shape == (cells, 6)
    assert simulation.field("principal_stress").shape == (cells, 3)
    assert simulation.field("von_mises").shape == (cells,)
    assert simulation.field("level").dtype == np.int32
    with pytest.raises(ValueError, match="there is no field 'strain'; there are 'displacement'"):
        simulation.field("strain")
    numbers, nodes = simulation.cells.of_kind("tri3")
    assert numbers.tolist() == [0, 1] and nodes.shape == (2, 3)
    assert np.array_equal(simulation.cells.of_kind("triangle")[1], nodes)
    assert len(simulation.to_meshio().points) == points


def test_velocities_that_are_set_are_counted(bar):
    bar.boundary = cdem.Tables()
    simulation = cdem.Simulation(bar)
    simulation.step(10)
    simulation.velocities = [3.0, 0.0]
    assert np.allclose(simulation.velocities, [3.0, 0.0, 0.0], atol=1e-14)
    assert simulation.momentum[0] == pytest.approx(300.0)
    assert simulation.energies["external_work"] == pytest.approx(450.0)
    simulation.set_velocities([[0.0, 1.0]] * 22, block="bar")
    simulation.run()
    assert simulation.energies["external_work"] == pytest.approx(50.0)
    assert abs(simulation.energies["energy_residual"]) < 1e-9 * 450.0


def test_blocks_that_are_set_moving_meet(prisms):
    """They do so as if they had moved from the start, later by as much."""
    late, early = cdem.Simulation(prisms), cdem.Simulation(prisms)
    late.set_velocities([0.0, 0.0])
    late.run(until=0.05)
    late.set_velocities([3.0, 0.0], block="i")
    late.run(until=0.45)
    early.run(until=0.4)
    for block in "ij":
        a, b = (simulation.blocks[block].velocity for simulation in (late, early))
        # The instant of the touch within a step differs by round-off.
        assert np.allclose(a, b, rtol=1e-6, atol=1e-6)


def test_wrong_velocities_are_told_of(bar):
    simulation = cdem.Simulation(bar)
    for wrong in ([1.0], 1.0, [[1.0] * 4]):
        with pytest.raises(ValueError):
            simulation.set_velocities(wrong)
    with pytest.raises(ValueError, match="each of 22 points, got 3"):
        simulation.velocities = np.zeros((3, 3))
    with pytest.raises(ValueError, match="third component"):
        simulation.set_velocities([0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match="no block 'bra'; did you mean 'bar'"):
        simulation.set_velocities([0.0, 0.0], block="bra")
    with pytest.raises(AttributeError):
        simulation.velocites = np.zeros((3, 3))
    for wrong in ([np.nan, 0.0], [1j, 0.0], [True, False], ["1", "2"]):
        with pytest.raises(ValueError, match="finite numbers"):
            simulation.velocities = wrong
    assert not simulation.velocities.any()
    simulation.run()


def test_velocities_in_space_have_three_components():
    simulation = cdem.Simulation(ROOT / "examples" / "two-prisms-3d" / "scene.toml")
    before = simulation.velocities
    with pytest.raises(ValueError, match="3 components"):
        simulation.velocities = [0.0, 0.0]
    assert np.array_equal(simulation.velocities, before)
    simulation.set_velocities([1.0, 2.0, 3.0], block="i")
    after, chosen = simulation.velocities, simulation.blocks["i"].points
    # The stored velocities are half a step away from the given ones: round-off.
    assert np.allclose(after[chosen], [1.0, 2.0, 3.0], rtol=1e-13)
    rest = np.ones(len(after), dtype=bool)
    rest[chosen] = False
    assert np.array_equal(after[rest], before[rest])


def test_loads_that_are_set_push(bar):
    simulation = cdem.Simulation(bar)
    simulation.step(3)
    changed_at = simulation.time
    simulation.set_load("bar.xmax", traction=["0.1 MPa", 0.0])
    simulation.run()
    row = simulation.energies
    assert row["external_work"] > 0.0
    # The ledger of meshed blocks closes to 0.1 %: README.
    assert abs(row["energy_residual"]) < 1e-3 * row["external_work"]
    table = simulation.scene.load[0].traction
    assert table[-1] == [changed_at, [1e5, 0.0]]


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"load": "bar.xmax", "traction": [1.0]}, cdem.SceneError, "components"),
        ({"load": "bar.xmax", "pressure": 1.0}, ValueError, "is a traction"),
        ({"load": "bar.xmax", "traction": ["1 m", 0.0]}, cdem.SceneError, "traction"),
        ({"load": "bar.xmin", "traction": [1.0, 0.0]}, ValueError, "no load 'bar.xmin'; did you mean 'bar.xmax'"),
        ({"load": "bar.xmax"}, ValueError, "either"),
    ],
)
def test_wrong_loads_are_told_of(bar, arguments, error, message):
    simulation = cdem.Simulation(bar)
    with pytest.raises(error, match=message):
        simulation.set_load(**arguments)
    simulation.run()


def test_one_of_several_loads_of_a_group_goes_by_its_number(bar):
    bar.load.add(group="bar.xmax", traction=[0.0, 0.0])
    simulation = cdem.Simulation(bar)
    with pytest.raises(ValueError, match=r"2 loads 'bar.xmax'; give the number of one of \[0, 1\]"):
        simulation.set_load("bar.xmax", traction=[1.0, 0.0])
    simulation.set_load(1, traction=[1.0, 0.0])
    assert [load.traction for load in simulation.scene.load] == [[0.0, 0.0], [1.0, 0.0]]


def test_a_run_that_becomes_unphysical_stops_itself(bar, tmp_path):
    bar.load[0].traction = [1e13, 0.0]
    simulation = cdem.Simulation(bar)
    simulation.record(tmp_path / "results")
    with pytest.raises(cdem.StepError, match="t = .*bar") as first:
        simulation.run()
    # An unphysical run cannot continue, and has no checkpoint.
    for more in (
        simulation.step,
        simulation.save,
        lambda: simulation.save(tmp_path / "checkpoint"),
        lambda: simulation.record(tmp_path / "more"),
        lambda: simulation.set_velocities([0.0, 0.0]),
        lambda: simulation.set_load("bar.xmax", traction=[0.0, 0.0]),
    ):
        with pytest.raises(cdem.StepError) as second:
            more()
        assert str(first.value) == str(second.value)
    assert [path.name for path in tmp_path.iterdir()] == ["results"]
    assert simulation.positions.shape == (22, 3)
    summary = cdem.read_results(tmp_path / "results").summary
    assert (summary["status"], summary["reason"]) == ("stopped", str(first.value))
    with pytest.raises(cdem.StepError, match="cannot be resumed: .*run it again, with force=True"):
        cdem.Simulation.load(tmp_path / "results")


def test_other_threads_run_while_it_steps(prisms):
    prisms.time.step = 1e-6
    prisms.time.end = 100.0
    simulation = cdem.Simulation(prisms, threads=1)
    count = 0
    stop = threading.Event()

    def tick():
        nonlocal count
        while not stop.is_set():
            count += 1
            time.sleep(1e-3)

    thread = threading.Thread(target=tick, daemon=True)
    thread.start()
    # One call of the engine, half a second long.
    before = count
    is_there, _ = simulation._run.advance(np.inf, 2**62, 0.5)
    after = count
    stop.set()
    thread.join()
    assert not is_there
    # 500 of them on an idle machine.
    assert after - before > 20


def test_two_threads_may_step_and_look(prisms):
    alone = cdem.Simulation(prisms, threads=1)
    rows = [alone.history]
    alone.run(callback=lambda s: rows.append(s.history))
    simulation = cdem.Simulation(prisms, threads=2)
    called = []
    run = {"every": 3, "callback": lambda s: called.append(s.step_index)}
    threads = [threading.Thread(target=simulation.run, kwargs=run, daemon=True) for _ in range(2)]
    for thread in threads:
        thread.start()
    looks = 0
    while any(thread.is_alive() for thread in threads):
        row = simulation.history
        assert row["kinetic_energy"] == rows[row["step"]]["kinetic_energy"]
        looks += 1
    assert looks > 0
    # Each counts the steps that it has made.
    assert len(called) in (332, 333)
    assert np.array_equal(simulation.positions, alone.positions)


def test_ctrl_c_stops_after_a_step(prisms):
    prisms.time.step = 1e-6
    prisms.time.end = 100.0
    simulation = cdem.Simulation(prisms)
    timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        simulation.run()
    assert time.monotonic() - began < 30.0
    stopped_at = simulation.step_index
    assert 0 < stopped_at
    simulation.step()
    assert simulation.step_index == stopped_at + 1


def test_progress_is_shown_when_wanted(prisms, capsys):
    cdem.Simulation(prisms).run(progress=True)
    told = capsys.readouterr().err
    assert told.endswith("\n") and "100 %" in told and "t = 0.5 of 0.5 s" in told
    cdem.Simulation(prisms).run()
    assert capsys.readouterr().err == ""


def test_wrong_arguments_are_told_of(prisms):
    with pytest.raises(ValueError, match="threads"):
        cdem.Simulation(prisms, threads=0)
    with pytest.raises(ValueError, match="every"):
        cdem.Simulation(prisms).run(every=0)
    for until in (np.nan, -1.0, "-1 s"):
        with pytest.raises(ValueError, match="until must be"):
            cdem.Simulation(prisms).run(until=until)
    with pytest.raises(ValueError, match='until: expected a time, but "1 m" is a length'):
        cdem.Simulation(prisms).run(until="1 m")
    with pytest.raises(KeyError, match="no block 'x'; there are 'i', 'j'"):
        cdem.Simulation(prisms).blocks["x"]
    with pytest.raises(ValueError, match="no shape of cells 'line'; there are 'tri3', 'quad4'"):
        cdem.Simulation(prisms).cells.of_kind("line")
    with pytest.raises(ValueError, match="count"):
        cdem.Simulation(prisms).step(-1)
    simulation = cdem.Simulation(prisms)
    for wrong, name in (
        (lambda: simulation.step("a"), "count"),
        (lambda: cdem.Simulation(prisms, threads="2"), "threads"),
        (lambda: simulation.run(until=[1]), "until"),
        (lambda: simulation.run(callback=3), "callback"),
    ):
        with pytest.raises(TypeError, match=name):
            wrong()
    assert simulation.step_index == 0
    with pytest.raises(cdem.SceneError, match="not a value of type NoneType"):
        cdem.Simulation(None)
    for copied in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="save"):
            copied(cdem.Simulation(prisms))


def _end_of(scene):
    simulation = cdem.Simulation(scene, threads=2)
    simulation.run()
    return simulation.positions


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
def test_processes_that_are_forked_have_threads_of_their_own(prisms):
    """Those of the parent are not in the child, which would wait for them for ever."""
    here = cdem.Simulation(prisms, threads=2)
    here.run(until=0.1)
    with multiprocessing.get_context("fork").Pool(2) as pool:
        there = pool.map_async(_end_of, [prisms] * 4).get(timeout=60)
    here.run()
    for positions in there:
        assert np.array_equal(positions, here.positions)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
def test_a_forked_copy_writes_no_results(prisms, tmp_path):
    """Neither when it steps nor when it goes: files and threads are those of its parent."""
    whole = cdem.Simulation(prisms, threads=2)
    whole.record(tmp_path / "whole")
    whole.run()
    simulation = cdem.Simulation(prisms, threads=2)
    simulation.record(tmp_path / "results")
    simulation.run(until=0.1)
    simulation.save()
    before = files(tmp_path / "results")
    child = os.fork()
    if child == 0:
        simulation.run(until=0.4)
        del simulation
        os._exit(0)
    deadline = time.monotonic() + 60.0
    while (ended := os.waitpid(child, os.WNOHANG)) == (0, 0):
        if time.monotonic() > deadline:
            os.kill(child, signal.SIGKILL)
        time.sleep(0.01)
    assert ended == (child, 0)
    assert files(tmp_path / "results") == before
    simulation.run()
    assert files(tmp_path / "results") == files(tmp_path / "whole")


def test_cells_and_contacts_tell_of_themselves_in_short(prisms):
    simulation = cdem.Simulation(prisms)
    assert repr(simulation.cells) == "<cdem.Cells: 2 tri3>"
    assert repr(simulation.contacts) == "<cdem.Contacts: 0>"
    simulation.run(until=0.334)
    assert repr(simulation.contacts) == "<cdem.Contacts: 1: 1 i-j>"
