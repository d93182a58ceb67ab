"""What can go wrong. Messages are those of the command line, advice is for Python."""


class Error(Exception):
    """What all errors of this package have in common."""


class SceneError(Error, ValueError):
    """The scene is wrong; a line for each problem: where, what was expected, what to try."""


class MeshError(Error, ValueError):
    """A mesh is wrong, or cannot be read."""


class StepError(Error, RuntimeError):
    """The run stopped itself: it has become unphysical. Its state stays, to be looked at."""


class ResultsError(Error, OSError):
    """A folder of results cannot be used, or the disk refuses."""
