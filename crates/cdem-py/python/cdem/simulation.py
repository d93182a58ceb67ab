"""Simulations: steps, queries, changes between steps, checkpoints."""

from __future__ import annotations

import json
import math
import operator
import os
import warnings
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from cdem import _engine
from cdem._names import unknown
from cdem.cells import Cells, to_meshio, to_pyvista
from cdem.progress import Progress
from cdem.scene import Scene, _plain

if TYPE_CHECKING:
    import meshio
    import pyvista

Vectors = npt.NDArray[np.float64]

#: Wall-clock seconds between two checks for Ctrl-C and updates of the progress.
_LEG = 0.05

_ENERGIES = (
    "kinetic_energy", "strain_energy", "external_work", "gravity_work", "impact_loss",
    "friction_loss", "damping_loss", "fracture_loss", "remesh_loss", "correction_loss",
    "energy_residual",
)  # fmt: skip


@dataclass(frozen=True)
class Block:
    """A block at an instant."""

    name: str
    mass: float
    """Mass, kg."""
    position: Vectors
    """Centre of mass, m."""
    velocity: Vectors
    """Velocity of the centre of mass, m/s."""
    angular_velocity: Vectors
    """Angular velocity, rad/s."""
    force: Vectors
    """Resultant contact force, N: its mean since the last row of `blocks.csv`, or since t = 0."""
    points: slice
    """Its points in the arrays of points."""
    cells: slice
    """Its cells in the arrays of cells."""


class _Blocks(dict[str, Block]):
    """Blocks by their names."""

    def __missing__(self, name: object) -> Block:
        raise KeyError(unknown("block", name, self))


@dataclass(frozen=True, repr=False)
class Contacts:
    """Contact points: the columns of `contacts.csv`, with an entry for each contact point."""

    main: list[str]
    """Names of the main blocks."""
    target: list[str]
    """Names of the target blocks."""
    type: list[str]
    """Contact types, from `vertex-vertex` to `face-face`."""
    time_on: Vectors
    """Times of first touch, s."""
    time_off: Vectors
    """Times of release, s; NaN for a live contact."""
    position: Vectors
    """Positions of the first touches, m: n × 3."""
    peak_normal_force: Vectors
    """Largest normal forces, N."""
    normal_impulse: Vectors
    """Normal impulses so far, N·s."""
    shear_impulse: Vectors
    """Path lengths of the shear impulses, N·s."""
    slip: Vectors
    """Path lengths of the slips, m."""
    level: npt.NDArray[np.int64]
    """Numbers of halvings of the elements there."""
    point: Vectors | None = None
    """Positions now, m: n × 3. This and the following only for live contacts."""
    normal: Vectors | None = None
    """Unit normals, from target to main: n × 3."""
    force: Vectors | None = None
    """Forces on the main blocks, N: n × 3."""
    area: Vectors | None = None
    """Tributary areas, m²."""

    def __len__(self) -> int:
        return len(self.main)

    def __repr__(self) -> str:
        pairs = Counter(f"{main}-{target}" for main, target in zip(self.main, self.target, strict=True))
        most = ", ".join(f"{count} {pair}" for pair, count in pairs.most_common(3))
        return f"<cdem.Contacts: {len(self)}{': ' if most else ''}{most}{', …' * (len(pairs) > 3)}>"


class Simulation:
    """A run of a scene: steps, queries, changes between steps.

    Arrays contain the synchronised state at one instant. The engine creates them and passes them
    on without a copy, and no later step changes them. Vectors have three components, as in result
    files; in 2-D the third is 0. A simulation steps on its own threads, and other Python threads
    run meanwhile. The number of threads does not change results.

    The results have the same bits as those of `cdem run`; so do the files of `record(DIR)`.
    """

    # Assignment to a misspelt name is an error.
    __slots__ = ("_meshes", "_run", "_scene_path")

    def __init__(
        self,
        scene: Scene | Mapping[str, Any] | str | os.PathLike[str],
        *,
        threads: int | None = None,
    ) -> None:
        """A run at t = 0.

        scene: a scene, a dictionary of its keys, or the path of a scene file.
        threads: number of threads. Left out: one for each processor.

        Raises `SceneError`, `MeshError`.
        """
        if isinstance(scene, (str, os.PathLike)):
            scene = Scene.read(scene)
        elif not isinstance(scene, Scene):
            scene = Scene._of(scene)
        source, self._meshes = scene._source()
        meshes = [(path, mesh._engine_mesh(path)) for path, mesh in self._meshes.items()]
        self._run = _engine.Run(source, meshes, _count(threads))
        file = scene._file
        path = file[1] if file is not None else scene.directory / "scene.toml"
        self._scene_path = path.absolute()

    @classmethod
    def load(
        cls,
        folder: str | os.PathLike[str],
        *,
        record: bool = False,
        threads: int | None = None,
    ) -> Simulation:
        """The run in a results folder, at its last checkpoint. Both this package and `cdem run`
        write checkpoints.

        record: if true, results continue in that folder, as with `cdem resume`. Otherwise the
            folder does not change.
        threads: number of threads. Left out: one for each processor.

        Raises `ResultsError`, and `StepError` if the run has stopped itself.
        """
        loaded = cls.__new__(cls)
        loaded._run = _engine.Run.load(folder, record, _count(threads))
        loaded._meshes = {}
        loaded._scene_path = Path(folder).absolute() / "scene.toml"
        return loaded

    def __enter__(self) -> Simulation:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __reduce__(self) -> str | tuple[Any, ...]:
        raise TypeError(
            "a simulation cannot be copied or pickled; save() it to a folder and load() it from there"
        )

    def __repr__(self) -> str:
        return f"<cdem.Simulation: t = {self.time:.6g} s of {self._run.end:g} s>"

    # ---- Steps

    def step(self, count: int = 1) -> None:
        """Makes coarse steps, up to the end of the scene. A warning says if the end cuts them short.

        Raises `StepError`, and `ResultsError` if results cannot be written.
        """
        for _ in range(_whole("count", count, 0)):
            _, made = self._run.advance(math.inf, 1, math.inf)
            if made == 0:
                self._warn_of_end("no step is made")
                return

    def run(
        self,
        until: float | str | None = None,
        *,
        callback: Callable[[Simulation], object] | None = None,
        every: int = 1,
        progress: bool | None = None,
    ) -> None:
        """Steps until a time, or to the end.

        until: time, s, or text with a unit such as `"0.2 ms"`. The run stops at the first coarse
            step at or after it. Left out: the end of the scene. A later time gives a warning.
        callback: function of the simulation, called after every `every` steps. If it returns
            `True` (also NumPy's), the run stops there.
        every: number of coarse steps between two calls.
        progress: if true, a line shows the progress. Left out: true in terminals and notebooks,
            for runs of more than two seconds.

        Ctrl-C stops the run after its current step. The simulation can then be examined, saved
        and continued. Raises `StepError`, and `ResultsError` if results cannot be written.
        """
        every = _whole("every", every, 1)
        if callback is not None and not callable(callback):
            raise TypeError(f"callback must be a function of the simulation, got {callback!r}")
        last = math.inf if until is None else _seconds(until)
        if self._run.end * (1.0 + 1e-9) < last < math.inf:
            self._warn_of_end(f"the run stops there, before {until}")
        with Progress(self._run, min(last, self._run.end), progress) as shown:
            left = every
            while True:
                steps = left if callback is not None else 2**62
                is_there, made = self._run.advance(last, steps, _LEG)
                shown.update()
                left -= made
                if callback is not None and left == 0:
                    left = every
                    answer = callback(self)
                    if isinstance(answer, (bool, np.bool_)) and answer:
                        return
                if is_there:
                    return

    def _warn_of_end(self, what: str) -> None:
        end = f"the scene ends at t = {self._run.end:g} s"
        if self.finished:
            end = f"the run is at its end, t = {self.time:g} s"
        warnings.warn(f"{end}: {what}; for more steps, increase time.end of the scene", stacklevel=3)

    @property
    def time(self) -> float:
        """Time, s."""
        return self._run.time

    @property
    def end(self) -> float:
        """End of the scene, s."""
        return self._run.end

    @property
    def step_index(self) -> int:
        """Number of coarse steps so far."""
        return self._run.step_index

    @property
    def step_size(self) -> float:
        """Length of a coarse step, s."""
        return self._run.step_size

    @property
    def finished(self) -> bool:
        """True at the end of the scene, or at rest as defined by `time.stop_when`."""
        return self._run.finished

    # ---- Queries

    @property
    def scene(self) -> Scene:
        """The scene of the run, with all defaults filled in and all changes of loads. In a loaded
        simulation, meshes from arrays are in the checkpoint, not in the scene.
        """
        scene = Scene.parse(self._run.scene, self._scene_path)
        for block in scene.block if self._meshes else ():
            if block.get("mesh") in self._meshes:
                block.mesh = self._meshes[block.mesh]
        return scene

    @property
    def warnings(self) -> list[str]:
        """Warnings: probable mistakes in the scene, and doubts about the results."""
        return self._run.warnings()

    @property
    def history(self) -> dict[str, Any]:
        """The row of `history.csv` now, with momenta and impulse as vectors."""
        return self._run.history()

    @property
    def energies(self) -> dict[str, float]:
        """Energies, works, losses and the residual of the energy ledger now, J."""
        row = self._run.history()
        return {name: row[name] for name in _ENERGIES}

    @property
    def momentum(self) -> Vectors:
        """Momentum of all blocks that are not fixed, N·s."""
        momentum: Vectors = self._run.history()["momentum"]
        return momentum

    @property
    def angular_momentum(self) -> Vectors:
        """Angular momentum of all blocks that are not fixed, about the origin, N·m·s."""
        momentum: Vectors = self._run.history()["angular_momentum"]
        return momentum

    @property
    def blocks(self) -> dict[str, Block]:
        """All blocks now, by name. The parts of a split block `i` are `i.1`, `i.2`, … An unknown
        name raises a `KeyError` that lists the known names.
        """
        rows = self._run.blocks()
        vectors = {
            name: rows[name].reshape(-1, 3)
            for name in ("position", "velocity", "angular_velocity", "force")
        }
        return _Blocks(
            (
                name,
                Block(
                    name,
                    float(rows["mass"][i]),
                    points=slice(*rows["points"][i]),
                    cells=slice(*rows["cells"][i]),
                    **{key: value[i] for key, value in vectors.items()},
                ),
            )
            for i, name in enumerate(rows["block"])
        )

    @property
    def contacts(self) -> Contacts:
        """The contact points that are closed now."""
        return _contacts(self._run.contacts())

    def ended_contacts(self) -> Contacts:
        """Contacts that have ended since the last call. A simulation that records writes them to
        `contacts.csv` instead.

        Raises `ResultsError` while results are recorded.
        """
        return _contacts(self._run.ended_contacts())

    @property
    def positions(self) -> Vectors:
        """Positions of all points, m: n × 3. The two-scale model adds points during collisions."""
        positions: Vectors = self._run.positions().reshape(-1, 3)
        return positions

    @property
    def displacements(self) -> Vectors:
        """Displacements of the points, m: n × 3."""
        return self.field("displacement")

    @property
    def velocities(self) -> Vectors:
        """Velocities of the points, m/s: n × 3. An assignment is the same as `set_velocities`."""
        return self.field("velocity")

    @velocities.setter
    def velocities(self, values: npt.ArrayLike) -> None:
        self.set_velocities(values)

    @property
    def contact_forces(self) -> Vectors:
        """Contact forces on the points in the last step, N: n × 3."""
        return self.field("contact_force")

    @property
    def stress(self) -> Vectors:
        """Cauchy stresses of the cells, Pa: n × 6, as xx yy zz xy yz zx. Compression is negative."""
        return self.field("stress")

    def field(self, name: str) -> npt.NDArray[Any]:
        """A field of the points (`displacement`, `velocity`, `contact_force`) or of the cells
        (`stress`, `von_mises`, `principal_stress`, `level`): n × components, or n.

        Raises `ValueError` for another name.
        """
        if name not in (fields := _fields()):
            raise ValueError(unknown("field", name, fields))
        values, components = self._run.field(name)
        array: npt.NDArray[Any] = values if components == 1 else values.reshape(-1, components)
        return array

    @property
    def cells(self) -> Cells:
        """Shapes of all cells, and their points."""
        return Cells(*self._run.cells())

    def to_meshio(self) -> meshio.Mesh:
        """The state now as a `meshio.Mesh`, with velocities and stresses. Needs meshio."""
        return to_meshio(self.positions, self.cells, *self._fields())

    def to_pyvista(self) -> pyvista.UnstructuredGrid:
        """The state now for PyVista, with velocities and stresses. Needs pyvista."""
        return to_pyvista(self.positions, self.cells, *self._fields())

    def _fields(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Fields of points and of cells, for plots."""
        of_points = ("displacement", "velocity", "contact_force")
        of_cells = ("stress", "von_mises", "level")
        return {name: self.field(name) for name in of_points}, {
            name: self.field(name) for name in of_cells
        }

    # ---- Changes

    def set_velocities(self, values: npt.ArrayLike, block: str | None = None) -> None:
        """Sets the velocities of points at this instant.

        values: velocities, m/s: one vector for all points, or one for each, of 2 or 3 components.
        block: name of the block. Left out: all points.

        Fixed points and prescribed components do not change. The change of energy and momentum
        counts as external work and impulse. A checkpoint contains the new velocities. Raises
        `ValueError` for an unknown block, an array of another shape, a number that is not finite,
        or a third component other than 0 in 2-D. Raises `StepError` if the run has stopped
        itself.
        """
        names = () if block is None else self.blocks
        if block is not None and block not in names:
            raise ValueError(unknown("block", block, names))
        given = self._velocities_of(values)
        self._run.set_velocities(block, given.ravel(), given.shape[-1])

    def _velocities_of(self, values: npt.ArrayLike) -> Vectors:
        """One vector or several, with a valid number of components."""
        dimension = self._run.dimension
        given = np.asarray(values)
        if given.ndim not in (1, 2) or given.shape[-1] not in (dimension, 3):
            components = "2 or 3 components" if dimension == 2 else "3 components"
            raise ValueError(
                f"velocities must be one vector of {components}, or one for each point, not an array "
                f"of shape {given.shape}"
            )
        if given.dtype.kind not in "iuf" or not np.all(np.isfinite(given)):
            raise ValueError("velocities must be finite numbers")
        if dimension == 2 and np.any(given[..., 2:] != 0.0):
            raise ValueError("in 2-D the third component of a velocity must be 0")
        return given.astype(np.float64)

    def set_load(
        self,
        load: str | int,
        *,
        pressure: Any = None,
        traction: Any = None,
    ) -> None:
        """Changes a load of the scene from now on.

        load: group of the load, or its number if several loads have this group.
        pressure: new pressure, as in a scene: a number, text with a unit, or a table
            [[time, value], …].
        traction: new traction, as in a scene.

        The work of the load counts as before. The scene, and with it each checkpoint, contains
        both: the old load up to now, and the new one afterwards. Raises `SceneError` for an
        invalid value, and `ValueError` for an unknown load or one of the other kind.
        """
        given = [(k, v) for k, v in (("pressure", pressure), ("traction", traction)) if v is not None]
        if len(given) != 1:
            raise ValueError("give either a pressure or a traction")
        kind, value = given[0]
        number = self._load_number(load, kind)
        self._run.set_load(number, kind, json.dumps(_plain(value, kind, {})))

    def _load_number(self, load: str | int, kind: str) -> int:
        loads = self.scene.load
        groups = [table.group for table in loads]
        fitting = [i for i, group in enumerate(groups) if load in (i, group)]
        if not fitting:
            raise ValueError(unknown("load", load, groups))
        if len(fitting) > 1:
            raise ValueError(f"there are {len(fitting)} loads {load!r}; give the number of one of {fitting}")
        if kind not in loads[fitting[0]]:
            other = "traction" if kind == "pressure" else "pressure"
            raise ValueError(f"the load {load!r} is a {other}; its kind cannot change")
        return fitting[0]

    # ---- Results and checkpoints

    def record(
        self, folder: str | os.PathLike[str], *, force: bool = False
    ) -> None:
        """Writes results to a folder from now on, as `cdem run` does. Tables begin at this
        instant. They end with the run, with `close()`, or when the simulation is deleted. The
        copy of a simulation in a forked process writes nothing.

        folder: results folder.
        force: if true, results of an earlier run in the folder are replaced; no other files are.

        Raises `ResultsError`.
        """
        self._run.record(folder, self._scene_path, force)

    @property
    def folder(self) -> Path | None:
        """The results folder, while results are recorded."""
        return self._run.folder

    def save(
        self, folder: str | os.PathLike[str] | None = None, *, force: bool = False
    ) -> None:
        """Writes a checkpoint for `Simulation.load` or `cdem resume`.

        folder: results folder. Left out: that of `record`. Results in a new folder begin at this
            instant.
        force: if true, results of an earlier run in the folder are replaced; no other files are.

        Raises `ResultsError`.
        """
        self._run.save(folder, self._scene_path, force)

    def close(self) -> None:
        """Ends the recording of results, with a checkpoint. Does nothing if none are recorded.

        Raises `ResultsError`.
        """
        self._run.close()


def _whole(name: str, number: int, least: int, most: float = math.inf) -> int:
    """An argument that is a count."""
    try:
        whole = operator.index(number)
    except TypeError:
        raise TypeError(f"{name} must be a whole number, got {number!r}") from None
    if not least <= whole <= most:
        bounds = f"at least {least}" if most == math.inf else f"from {least} to {most}"
        raise ValueError(f"{name} must be {bounds}, got {number}")
    return whole


def _count(threads: int | None) -> int:
    return 0 if threads is None else _whole("threads", threads, 1, 65535)


def _seconds(until: float | str) -> float:
    """A time, s, from a number or text with a unit."""
    try:
        seconds = _engine.seconds(until) if isinstance(until, str) else float(until)
    except ValueError as error:
        raise ValueError(f"until: {error}") from None
    except TypeError:
        raise TypeError(f"until must be a time in seconds, or text with a unit, got {until!r}") from None
    if not seconds >= 0.0:
        raise ValueError(f"until must be a time in seconds, at least 0, got {until}")
    return seconds


@cache
def _fields() -> list[str]:
    """Names of fields, as in scenes."""
    schema = json.loads(_engine.schema())
    return [field["const"] for field in schema["$defs"]["Field"]["oneOf"]]


def _contacts(rows: dict[str, Any]) -> Contacts:
    vectors = ("position", "point", "normal", "force")
    return Contacts(
        **{key: rows[key].reshape(-1, 3) if key in vectors else rows[key] for key in rows}
    )
