"""Messages about unknown names, with the known names."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

#: Largest number of names in a message.
_MOST = 12


def unknown(what: str, name: object, known: Iterable[str]) -> str:
    """A message about an unknown name, with the nearest known name, or all of them."""
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
