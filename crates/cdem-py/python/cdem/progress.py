"""The progress of a run, on one line of stderr, or in the output of a notebook cell."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import TYPE_CHECKING

from cdem import _engine

if TYPE_CHECKING:
    from IPython.display import DisplayHandle

#: Seconds before the first line, if none was asked for, and between two lines.
_PATIENCE = 2.0
_INTERVAL = 0.2


class Progress:
    """A line with the time, the speed and the time left of a run."""

    def __init__(self, run: _engine.Run, until: float, wanted: bool | None) -> None:
        self._run = run
        self._until = until
        # Programs with windows may have no stderr.
        can_show = sys.stderr is not None or _is_notebook()
        self._is_wanted = can_show and (_is_watched() if wanted is None else wanted)
        self._is_asked_for = can_show and wanted is True
        self._started = time.monotonic()
        self._shown = self._started + (_PATIENCE if wanted is None else 0.0)
        self._start = (run.step_index, run.time)
        self._shows = _LineOfNotebook() if _is_notebook() else _LineOfTerminal()

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._shows.is_begun or self._is_asked_for:
            self._shows.show(self._line())
            self._shows.end()

    def update(self) -> None:
        """Shows the progress if the last line is old enough."""
        now = time.monotonic()
        if self._is_wanted and now - self._shown >= _INTERVAL:
            self._shown = now
            self._shows.show(self._line())

    def _line(self) -> str:
        step, began = self._start
        seconds = max(time.monotonic() - self._started, 1e-9)
        now = self._run.time
        whole = self._until - began
        share = min((now - began) / whole, 1.0) if whole > 0.0 else 1.0
        bar = ("━" * round(24 * share)).ljust(24, "─")
        speed = (self._run.step_index - step) / seconds
        left = f"{seconds * (1.0 - share) / share:.0f} s left" if share > 0.0 else "time left unknown"
        return f"{bar} {100 * share:3.0f} %  t = {now:.3g} of {self._until:g} s, {speed:,.0f} steps/s, {left}"


class _LineOfTerminal:
    """A line of stderr that each new line replaces."""

    def __init__(self) -> None:
        self._width = 0

    @property
    def is_begun(self) -> bool:
        return self._width > 0

    def show(self, line: str) -> None:
        # Blanks remove the rest of a longer line.
        sys.stderr.write("\r" + line.ljust(self._width))
        sys.stderr.flush()
        self._width = len(line)

    def end(self) -> None:
        sys.stderr.write("\n")


class _LineOfNotebook:
    """An output of a notebook cell that each new line replaces. A stream would keep all lines."""

    def __init__(self) -> None:
        self._handle: DisplayHandle | None = None

    @property
    def is_begun(self) -> bool:
        return self._handle is not None

    def show(self, line: str) -> None:
        from IPython.display import DisplayHandle

        if self._handle is None:
            self._handle = DisplayHandle()
            self._handle.display({"text/plain": line}, raw=True)
        else:
            self._handle.update({"text/plain": line}, raw=True)

    def end(self) -> None:
        """Does nothing: the output stays."""


def _is_watched() -> bool:
    """True in a terminal or a notebook."""
    return (sys.stderr is not None and sys.stderr.isatty()) or _is_notebook()


def _is_notebook() -> bool:
    """True in a notebook kernel, which shows rich output."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")
