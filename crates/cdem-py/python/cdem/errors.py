"""Errors. The messages are those of the command line, with advice for Python."""


class Error(Exception):
    """The base class of all errors of this package."""


class SceneError(Error, ValueError):
    """The scene has errors. The message has a line for each: place, expectation, advice."""


class MeshError(Error, ValueError):
    """A mesh has an error, or cannot be read."""


class StepError(Error, RuntimeError):
    """The run stopped itself, because its state is unphysical. The state can still be examined."""


class ResultsError(Error, OSError):
    """A results folder cannot be used, or a file cannot be read or written."""
