"""Simulations: stepped, looked at, changed between steps, saved."""

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

#: Wall-clock seconds between two looks for Ctrl-C and at the progress.
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
    """Resultant contact force, N: the mean since the last row of `blocks.csv`, or since the
    start."""
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
    """Contact points, an entry of each array for each of them: the columns of `contacts.csv`."""

    main: list[str]
    """Blocks that give the vertex."""
    target: list[str]
    """Blocks that give the edge or face."""
    type: list[str]
    """Configurations, from `vertex-vertex` to `face-face`."""
    time_on: Vectors
    """First touches, s."""
    time_off: Vectors
    """Separations, s; not a number while a contact lasts."""
    position: Vectors
    """Places of the first touches, m: n × 3."""
    peak_normal_force: Vectors
    """Largest normal forces, N."""
    normal_impulse: Vectors
    """Normal impulses so far, N·s."""
    shear_impulse: Vectors
    """Path lengths of the shear impulses, N·s."""
    slip: Vectors
    """Path lengths of the slips, m."""
    level: npt.NDArray[np.int64]
    """Halvings of the elements there."""
    point: Vectors | None = None
    """Where they are now, m: n × 3. Of live contacts, as what follows."""
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
    """A run of a scene: stepped, looked at, changed between steps.

    Arrays hold the state of one instant, velocities synchronised with positions; they are made
    by the engine and handed over without a copy, and no later step changes them. Vectors have
    three components, as in result files; in 2-D the third is 0. While a simulation steps, other
    threads of Python run, and it steps on threads of its own; the number of them changes no
    result.

    The bits are those that `cdem run` gives. With `record(DIR)` the files are, too.
    """

    # A misspelt name that is set is an error.
    __slots__ = ("_meshes", "_run", "_scene_path")

    def __init__(
        self,
        scene: Scene | Mapping[str, Any] | str | os.PathLike[str],
        *,
        threads: int | None = None,
    ) -> None:
        """A run at its start.

        scene: a scene, a dictionary of its keys, or the path of a scene file.
        threads: how many step; one for each processor if left out.

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
        """The run in a folder of results, as it was at its last checkpoint: one of this package,
        or of `cdem run` that was stopped.

        record: go on writing to that folder, as `cdem resume` does; else it is left as it is.

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
            "a simulation is not copied or pickled: save() it to a folder, and load() it from there"
        )

    def __repr__(self) -> str:
        return f"<cdem.Simulation: t = {self.time:.6g} s of {self._run.end:g} s>"

    # ---- Going on

    def step(self, count: int = 1) -> None:
        """Makes coarse steps, but none beyond the end, of which it warns.

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

        until: time, s, or text with a unit such as `"0.2 ms"`; the first coarse step at or after
            it is the last. The end if left out; of a time after it, it warns.
        callback: called with the simulation after each step, or after so many; if it returns
            `True` or NumPy's, the run stops there.
        every: coarse steps between two calls.
        progress: show how far the run is; if left out, in terminals and notebooks, where it
            takes more than two seconds.

        Ctrl-C stops after the step that is being made: the simulation can be looked at, saved,
        and go on. Raises `StepError`, and `ResultsError` if results cannot be written.
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
        warnings.warn(f"{end}: {what}; raise time.end of the scene to go on", stacklevel=3)

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
        """Coarse steps made."""
        return self._run.step_index

    @property
    def step_size(self) -> float:
        """Length of a coarse step, s."""
        return self._run.step_size

    @property
    def finished(self) -> bool:
        """Whether the end is reached, or what `time.stop_when` asks for."""
        return self._run.finished

    # ---- Looking

    @property
    def scene(self) -> Scene:
        """The scene as run: every default filled in, loads as they have become. Of a simulation
        that was loaded, meshes of arrays are in the checkpoint, not in the scene.
        """
        scene = Scene.parse(self._run.scene, self._scene_path)
        for block in scene.block if self._meshes else ():
            if block.get("mesh") in self._meshes:
                block.mesh = self._meshes[block.mesh]
        return scene

    @property
    def warnings(self) -> list[str]:
        """What is not wrong, but should be looked at."""
        return self._run.warnings()

    @property
    def history(self) -> dict[str, Any]:
        """The row of `history.csv` now; momenta and impulse as vectors."""
        return self._run.history()

    @property
    def energies(self) -> dict[str, float]:
        """Energies, works, losses and the residual of the ledger now, J."""
        row = self._run.history()
        return {name: row[name] for name in _ENERGIES}

    @property
    def momentum(self) -> Vectors:
        """Momentum of all blocks but the fixed, N·s."""
        momentum: Vectors = self._run.history()["momentum"]
        return momentum

    @property
    def angular_momentum(self) -> Vectors:
        """Angular momentum about the origin, N·m·s."""
        momentum: Vectors = self._run.history()["angular_momentum"]
        return momentum

    @property
    def blocks(self) -> dict[str, Block]:
        """All blocks now, by name; parts of a split block as `i.1`, `i.2`, … A name that there
        is not raises a `KeyError` that tells those that there are.
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
        """Contacts that have ended since this was last asked. Of a simulation that records they
        go to `contacts.csv`.

        Raises `ResultsError` while results are recorded.
        """
        return _contacts(self._run.ended_contacts())

    @property
    def positions(self) -> Vectors:
        """Places of all points, m: n × 3. On two scales there are more while blocks collide."""
        positions: Vectors = self._run.positions().reshape(-1, 3)
        return positions

    @property
    def displacements(self) -> Vectors:
        """Displacements of the points, m: n × 3."""
        return self.field("displacement")

    @property
    def velocities(self) -> Vectors:
        """Velocities of the points, m/s: n × 3. May be set: see `set_velocities`."""
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
        """Stress of the cells, Pa: n × 6, as xx yy zz xy yz zx."""
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
        """Fields of points and of cells, for others to draw."""
        of_points = ("displacement", "velocity", "contact_force")
        of_cells = ("stress", "von_mises", "level")
        return {name: self.field(name) for name in of_points}, {
            name: self.field(name) for name in of_cells
        }

    # ---- Changing

    def set_velocities(self, values: npt.ArrayLike, block: str | None = None) -> None:
        """Gives points other velocities at this instant.

        values: m/s: one vector for all, or one for each point, of 2 or 3 components.
        block: whose points; all if left out.

        What is fixed or follows a boundary condition stays as it is. The energy and momentum
        that this brings are counted as external work and impulse. A checkpoint holds what has
        become of it. Raises `ValueError` for an unknown block, an array of another shape, what
        is no finite number, or a third component that is not 0 in 2-D; `StepError` if the run
        has stopped itself.
        """
        names = () if block is None else self.blocks
        if block is not None and block not in names:
            raise ValueError(unknown("block", block, names))
        given = self._velocities_of(values)
        self._run.set_velocities(block, given.ravel(), given.shape[-1])

    def _velocities_of(self, values: npt.ArrayLike) -> Vectors:
        """One vector, or several, of as many components as velocities may have."""
        dimension = self._run.dimension
        given = np.asarray(values)
        if given.ndim not in (1, 2) or given.shape[-1] not in (dimension, 3):
            components = "2 or 3 components" if dimension == 2 else "3 components"
            raise ValueError(
                f"velocities are one vector of {components}, or one for each point, not an array "
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
        """Has a load of the scene push otherwise from now on.

        load: its group, or its number if there are several of that group.
        pressure: what it becomes, as in a scene: a number, a text with a unit, or a table
            [[time, value], …].
        traction: the same of a traction.

        Its work is counted as before. The scene tells of it, so that checkpoints do: up to now
        the load is as it was, and then the new one. Raises `SceneError` for a value that cannot
        be, and `ValueError` for a load that there is not, or one of the other kind.
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
            raise ValueError(f"the load {load!r} is a {other}, and stays one")
        return fitting[0]

    # ---- Keeping

    def record(
        self, folder: str | os.PathLike[str], *, force: bool = False
    ) -> None:
        """Writes results to a folder from now on, as `cdem run` does; tables begin at this
        instant. They end with the run, with `close()`, or when the simulation goes. A process
        that is forked has a copy that writes nothing.

        force: replace the results of an earlier run, never anything else.

        Raises `ResultsError`.
        """
        self._run.record(folder, self._scene_path, force)

    @property
    def folder(self) -> Path | None:
        """The folder of results that are being written."""
        return self._run.folder

    def save(
        self, folder: str | os.PathLike[str] | None = None, *, force: bool = False
    ) -> None:
        """Writes a checkpoint, for `Simulation.load` or `cdem resume` to go on from.

        folder: where to; left out, the folder of the results that are being recorded. A new
            folder holds results that begin at this instant.
        force: replace the results of an earlier run there, never anything else.

        Raises `ResultsError`.
        """
        self._run.save(folder, self._scene_path, force)

    def close(self) -> None:
        """Ends the results that are being recorded, with a checkpoint to go on from; does
        nothing where none are.

        Raises `ResultsError`.
        """
        self._run.close()


def _whole(name: str, number: int, least: int, most: float = math.inf) -> int:
    """An argument that counts something."""
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
    """A time that may be text with a unit."""
    try:
        seconds = _engine.seconds(until) if isinstance(until, str) else float(until)
    except ValueError as error:
        raise ValueError(f"until: {error}") from None
    except TypeError:
        raise TypeError(f"until must be a time in seconds, or text with a unit; got {until!r}") from None
    if not seconds >= 0.0:
        raise ValueError(f"until must be a time in seconds, at least 0; got {until}")
    return seconds


@cache
def _fields() -> list[str]:
    """Names of fields, as scenes have them."""
    schema = json.loads(_engine.schema())
    return [field["const"] for field in schema["$defs"]["Field"]["oneOf"]]


def _contacts(rows: dict[str, Any]) -> Contacts:
    vectors = ("position", "point", "normal", "force")
    return Contacts(
        **{key: rows[key].reshape(-1, 3) if key in vectors else rows[key] for key in rows}
    )
