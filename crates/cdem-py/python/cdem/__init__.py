"""Collisions between deformable blocks: explicit finite elements in the blocks, contact without
springs between them.

    import cdem

    simulation = cdem.Simulation("scene.toml")
    simulation.run()
    print(simulation.energies)
"""

from importlib.metadata import version

from cdem.cells import Cells
from cdem.errors import Error, MeshError, ResultsError, SceneError, StepError
from cdem.mesh import Mesh
from cdem.results import Frames, Results, read_results
from cdem.scene import Scene, Table, Tables
from cdem.simulation import Block, Contacts, Simulation

__version__ = version("cdem")

__all__ = [
    "Block",
    "Cells",
    "Contacts",
    "Error",
    "Frames",
    "Mesh",
    "MeshError",
    "Results",
    "ResultsError",
    "Scene",
    "SceneError",
    "Simulation",
    "StepError",
    "Table",
    "Tables",
    "read_results",
]
