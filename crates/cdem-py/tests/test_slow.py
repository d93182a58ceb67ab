"""What takes minutes: speed beside the command, and memory. Needs a release build."""

import resource
import time

import numpy as np
import pytest

import cdem
from conftest import files

pytestmark = pytest.mark.slow


def impact(radius):
    """A hexagon of some tens of elements hits the floor with a corner."""
    angles = np.pi * np.arange(6) / 3.0 - 0.5 * np.pi
    outline = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    scene = cdem.Scene(dimension=2)
    scene.time.end = 0.01 * radius
    scene.material.add(name="rock", young_modulus="40 GPa", poisson_ratio=0.25, density=2700.0)
    scene.block.add(
        name="block",
        material="rock",
        shape={"polygon": outline, "size": 0.2 * radius},
        translate=[0.0, 1.001 * radius],
        velocity=[0.0, -1.0],
    )
    scene.block.add(
        name="floor",
        material="rock",
        element="quad4",
        shape={"box": {"min": [-radius, -radius], "max": [radius, 0.0], "divisions": [1, 1]}},
        fixed=True,
    )
    return scene


def test_two_hundred_impacts_are_as_fast_as_those_of_the_command(tmp_path, command):
    """Turn about, so that both meet the same machine; files and all."""
    whole = np.zeros(2)
    loops = np.zeros(2)
    for number, radius in enumerate(np.geomspace(0.05, 5.0, 200)):
        path = tmp_path / f"{number}.toml"
        impact(radius).write(path)
        folders = [tmp_path / f"{number}-{way}" for way in ("command", "python")]
        began = time.perf_counter()
        command("run", path, "-o", folders[0], "--threads", 1)
        between = time.perf_counter()
        simulation = cdem.Simulation(path, threads=1)
        simulation.record(folders[1])
        simulation.run()
        whole += [between - began, time.perf_counter() - between]
        loops += [cdem.read_results(folder).summary["wall_seconds"] for folder in folders]
        if number % 20 == 0:
            assert files(folders[0]) == files(folders[1])
    for what, (of_command, of_python) in (("all", whole), ("step loops", loops)):
        speed = of_command / of_python
        print(f"{what}: command {of_command:.2f} s, Python {of_python:.2f} s: {100 * speed:.1f} %")
        assert speed >= 0.95


def test_memory_does_not_grow(prisms):
    """Ten thousand times made, stepped, looked at and dropped."""
    used = []
    for cycle in range(10_000):
        simulation = cdem.Simulation(prisms, threads=2)
        simulation.step()
        simulation.set_velocities([0.0, 1.0])
        _ = simulation.energies, simulation.positions, simulation.contacts, simulation.blocks
        del simulation
        if cycle % 1000 == 999:
            with open("/proc/self/statm") as file:
                used.append(int(file.read().split()[1]) * resource.getpagesize())
    print("MiB after each thousand:", [round(size / 2**20, 1) for size in used])
    # A page a cycle would be 4 MiB a thousand; the allocator's own ripple is below one.
    assert used[-1] - used[1] < 2**20
