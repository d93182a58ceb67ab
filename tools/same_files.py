"""Compare the result folders of two runs, file by file, and name the first number that differs.

The files of a run are those of book/src/reference/results.md. `tools/same_bits` uses this.
"""

import array
import csv
import json
import re
import struct
import zlib
from itertools import zip_longest
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

# Keys of summary.json that the scene alone decides.
COMPARED = (
    "status", "reason", "steps", "time", "step", "levels", "element_updates", "contacts_begun",
    "max_penetration", "energy_residual", "warnings",
)
# Keys that may differ although the results are equal. They come from the clock (wall_seconds,
# setup_seconds, updates_per_second), from the machine and its load (peak_memory_bytes), from
# the call (threads), or they name the build (version).
NOT_COMPARED = ("version", "wall_seconds", "setup_seconds", "updates_per_second", "threads", "peak_memory_bytes")

# Types of the numbers in frames, as the module array names them.
TYPES = {"Float64": "d", "Int64": "q", "Int32": "i", "UInt8": "B"}


class Result(NamedTuple):
    """The result of one comparison."""

    # Number of files that are equal.
    equal: int
    # A line for each file that differs.
    differing: list
    # The same for scene.toml: new defaults may stand in it, so a difference there is no failure.
    told: list


def compare(old, new, leave_out=()):
    """Compare the folders of two runs, but for files of some names."""
    equal, differing, told = 0, [], []
    here, there = (files(folder) - set(leave_out) for folder in (old, new))
    for name in sorted(here | there, key=lambda name: (not name.endswith(".csv"), name)):
        if name not in here or name not in there:
            differing.append(f"{name}: {'NEW' if name in here else 'OLD'} has no such file")
            continue
        found = difference(name, (old / name).read_bytes(), (new / name).read_bytes())
        if name == "scene.toml":
            told += [found] if found else []
        elif found:
            differing.append(f"{name}: {found}")
        else:
            equal += 1
    return Result(equal, differing, told)


def files(folder):
    """Names of all files in a folder and its folders."""
    return {file.relative_to(folder).as_posix() for file in folder.rglob("*") if file.is_file()}


def difference(name, old, new):
    """The first difference of two files, in words; None if they are equal."""
    if name == "summary.json":
        return in_summary(old, new)
    if old == new:
        return None
    ways = {".csv": in_table, ".vtu": in_frame, ".vtp": in_frame, ".pvd": in_text, ".toml": in_text}
    return ways.get(Path(name).suffix, in_bytes)(old, new)


def in_summary(old, new):
    """The first key compared that differs in two summaries; None if there is none."""
    # Numbers stay text: they are compared as they are written.
    before, after = (json.loads(content, parse_float=str, parse_constant=str) for content in (old, new))
    for key in COMPARED:
        one, other = (table.get(key, "nothing") for table in (before, after))
        if without_words(one) != without_words(other):
            return f"{key}: OLD {one}, NEW {other}"
    return None


def without_words(value):
    """The numbers of each warning: their words may change from build to build. Other values unchanged."""
    if not isinstance(value, list):
        return value
    return [re.findall(r"\d[\d.]*(?:e[+-]?\d+)?", entry) if isinstance(entry, str) else entry for entry in value]


def in_table(old, new):
    """The first entry of two tables that differs, with its line in the file and its column."""
    before, after = (list(csv.reader(content.decode(errors="replace").splitlines())) for content in (old, new))
    header = before[0] if before else []
    for line, rows in enumerate(zip(before, after), start=1):
        for place, (one, other) in enumerate(zip_longest(*rows, fillvalue="nothing")):
            if one != other:
                column = header[place] if place < len(header) else place + 1
                return f"line {line}, column {column}: OLD {one}, NEW {other}"
    if len(before) != len(after):
        return f"OLD has {len(before)} lines, NEW {len(after)}"
    return in_bytes(old, new)


def in_frame(old, new):
    """The first number of two frames that differs; the first byte if their arrays cannot be read."""
    try:
        before, after = frame_arrays(old), frame_arrays(new)
    except (ValueError, TypeError, KeyError, struct.error, zlib.error, ElementTree.ParseError):
        return in_bytes(old, new)
    if before.keys() != after.keys():
        return f"only one of them has {', '.join(sorted(before.keys() ^ after.keys()))}"
    for name, (components, was) in before.items():
        other_components, now = after[name]
        if (components, was.typecode, len(was)) != (other_components, now.typecode, len(now)):
            return f"array {name}: its type or its size differs"
        # Not the numbers, but their bytes: 0 differs from -0, and a NaN does not from itself.
        one, other = was.tobytes(), now.tobytes()
        if one != other:
            first = first_different(one, other) // was.itemsize
            component = f", component {first % components}" if components > 1 else ""
            return f"array {name}, entry {first // components}{component}: OLD {was[first]!r}, NEW {now[first]!r}"
    return f"all arrays are equal, but {in_bytes(old, new)}"


def frame_arrays(content):
    """The arrays of a frame, by element and name: number of components, and all numbers."""
    opening = content.index(b"<AppendedData")
    data = content.index(b"_", opening) + 1
    found = {}
    for parent in ElementTree.fromstring(content[:opening] + b"</VTKFile>").iter():
        for entry in parent.findall("DataArray"):
            at = data + int(entry.get("offset"))
            # Number of pieces, size of a piece, size of the last, then their compressed sizes.
            (count,) = struct.unpack_from("<Q", content, at)
            sizes = struct.unpack_from(f"<{count}Q", content, at + 24)
            at += 24 + 8 * count
            numbers = array.array(TYPES[entry.get("type")])
            for size in sizes:
                numbers.frombytes(zlib.decompress(content[at : at + size]))
                at += size
            found[f"{parent.tag}/{entry.get('Name')}"] = int(entry.get("NumberOfComponents", 1)), numbers
    return found


def in_text(old, new):
    """The first line of two texts that differs."""
    lines = zip_longest(old.decode().splitlines(), new.decode().splitlines(), fillvalue="nothing")
    for line, (one, other) in enumerate(lines, start=1):
        if one != other:
            return f"line {line}: OLD {one}, NEW {other}"
    return in_bytes(old, new)


def in_bytes(old, new):
    """The first byte that differs."""
    at = first_different(old, new)
    return f"OLD has {len(old)} bytes, NEW {len(new)}" if at is None else f"byte {at}: OLD {old[at]}, NEW {new[at]}"


def first_different(old, new):
    """The place of the first byte that differs; None if one is the beginning of the other."""
    return next((at for at, (one, other) in enumerate(zip(old, new)) if one != other), None)
