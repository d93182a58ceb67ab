"""Names that there are not, told of with those that there are."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

#: Names that a message lists at most.
_MOST = 12


def unknown(what: str, name: object, known: Iterable[str]) -> str:
    """Says that there is no such thing, which one may have been meant, and which there are."""
    names = list(known)
    advice = f"there are {_listed(names)}"
    if near := get_close_matches(str(name), names, n=1):
        advice = f"did you mean {near[0]!r}?" + (f" There are {_listed(names)}" if len(names) > 1 else "")
    elif len(names) == 1:
        advice = f"the only one is {names[0]!r}"
    return f"there is no {what} {name!r}; {advice}"


def _listed(names: list[str]) -> str:
    listed = ", ".join(map(repr, names[:_MOST])) or "none"
    return listed if len(names) <= _MOST else f"{listed} and {len(names) - _MOST} more"
