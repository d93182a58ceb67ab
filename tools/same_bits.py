"""Compare all results of two builds of the command, byte for byte.

    tools/same_bits OLD NEW                   # status 0 only if every file is equal
    tools/same_bits OLD NEW --scene 'crowd*'  # only scenes of such names

This is how every change of form is judged. Code that is moved, renamed, divided or made
faster must not change a bit of any result. OLD is the command built before the change, NEW
the command built after it:

    cargo build --release && cp target/release/cdem target/cdem-before    # before the change
    cargo build --release && tools/same_bits target/cdem-before target/release/cdem

Both builds run all examples and twenty scenes of verification/, on one thread and on three.
Long scenes end early. NEW also interrupts one of them and resumes it, and must come to the
files of the whole run of OLD. Each run writes its state at the start, in the middle and at
the end, with all fields in full precision.

Results are kept in target/same-bits, in one folder for each build. The folder is named after
the content of the executable, so OLD runs only once. A run is repeated if it was not complete,
or if its scene or a mesh has changed since.
"""

import argparse
import fcntl
import fnmatch
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import NamedTuple

from same_files import Result, compare

ROOT = Path(__file__).resolve().parent.parent
KEPT = ROOT / "target/same-bits"
# Builds whose results are kept: the two that are compared, and two more.
BUILDS_KEPT = 4
THREADS = (1, 3)
# Time after which a run counts as hanging, s. All take seconds on a machine with nothing else to do.
LIMIT = 600.0


class Scene(NamedTuple):
    """A scene of the tree, with its changes."""

    folder: str
    # Value of `time.end`, s; None: that of the file.
    end: float | None
    # Reason why the scene is in the table.
    covers: str
    # Other keys and their values: "contact.model", or "block.*.mass" for all blocks.
    changes: dict = {}

    @property
    def name(self):
        return "-".join(Path(self.folder).parts[1:])


# With these ends each takes about five seconds at most, and blocks that collide have done so. No
# scene of the tree has springs or the incremental kinematics: here some are given them.
SCENES = [
    Scene("examples/bars-2d", None, "plane waves in meshed blocks, a probe, plane stress"),
    Scene("examples/crowd-2d", None, "two scales, a crowd"),
    Scene("examples/crowd-3d", 0.36, "two scales, a crowd in space: tetrahedra, wedges, hexahedra"),
    Scene("examples/rockfall-3d", 0.01, "a dry-stone wall under its weight, rocks that begin to fall"),
    Scene("examples/slope-2d", None, "two scales, friction, gravity as a table"),
    Scene("examples/two-prisms-2d", None, "two scales, the case of the paper"),
    Scene("examples/two-prisms-3d", None, "two scales, the case of the paper in space"),
    Scene("examples/wall-2d", None, "a wall of meshed blocks, hit by a boulder"),
    Scene("verification/corner-hits", None, "a corner on a corner, blocks of one element"),
    Scene(
        "verification/corner-on-face", None, "two scales, a corner on a face, the other kind of zone",
        {"contact.zone": "wavefront"},
    ),
    Scene("verification/crowd-of-200", 0.4, "two hundred blocks in many islands, rotation"),
    Scene("verification/dropped-block", None, "two scales, a fall, a block that comes to rest on a face"),
    Scene("verification/dry-stone-wall", 1e-4, "faces on faces, one island of 2700 contacts, shared among threads"),
    Scene(
        "verification/edge-on-edge", None, "two scales, an edge across an edge, the incremental kinematics",
        {"block.*.kinematics": "incremental"},
    ),
    Scene("verification/hooked-blocks", None, "blocks that are not convex, hexahedra on tetrahedra"),
    Scene(
        # In short steps and damped: in those of the file these springs throw the blocks apart.
        "verification/joint", None, "springs, a joint that breaks, blocks that meet again",
        {
            "contact.model": "penalty", "contact.normal_stiffness": 5e9,
            "time.safety": 0.1, "material.*.damping": {"stiffness": 1e-5},
        },
    ),
    Scene("verification/joint-3d", None, "tensile strength and cohesion, a traction as a table"),
    Scene("verification/pressed-blocks-3d", 2e-3, "a pressure, nodes held in one direction, damping by mass"),
    Scene(
        "verification/ram", None, "a prescribed turn about an axis",
        {"boundary": [{"block": "ram", "angular_velocity": 2.0, "axis": [0.0, 1.0, 0.0], "point": [-1.0, 0.5, 0.0]}]},
    ),
    Scene("verification/rattling-brick", 0.3, "two scales, a prescribed velocity as a table, lifting off and landing"),
    Scene("verification/rocks-in-a-box", 1.2, "a pile of rocks of all shapes, friction, islands shared among threads"),
    Scene("verification/shot-3d", None, "a block that moves by many times its size in a step"),
    Scene("verification/slide-or-topple", None, "pairs of blocks with friction of their own"),
    Scene("verification/sliding-feet", 0.15, "two scales, fine elements that move with a slide"),
    Scene(
        "verification/slivers", None, "many levels of time in one mesh, which spins",
        {"block.*.angular_velocity": 100.0},
    ),
    Scene(
        "verification/slope-3d", None, "springs with friction in space",
        {"contact.model": "penalty", "contact.normal_stiffness": 1e9},
    ),
    Scene(
        "verification/thin-plates", None, "edges on edges of meshed blocks that bend, the incremental kinematics",
        {"block.*.kinematics": "incremental"},
    ),
    Scene("verification/waves-in-steel", 2e-4, "plane waves of pressure and of shear in 4000 elements"),
]
# The scene that is interrupted and resumed: its elements are refined and slide most of the time.
RESUMED = "sliding-feet"

# The output of each scene: three frames with all fields, and few rows.
OUTPUT = {
    "frames": 2,
    "history": 200,
    "blocks": 50,
    "fields": ["displacement", "velocity", "stress", "von_mises", "principal_stress", "contact_force", "level"],
}
# A run is interrupted when history.csv has one row of so many; the next number is for a run
# that had ended before.
INTERRUPTED_AT = (2, 4, 8, 16, 32)

# File that is written last into the folder of a run; it holds the digest of the scene.
MARKER = "complete"


class Mistake(Exception):
    """Something the caller can put right; its text says how."""


class Failure(Exception):
    """A run with a wrong end; its text says which."""


class Build(NamedTuple):
    """An executable, and the folder of its results."""

    label: str
    command: Path
    folder: Path


def toml(value):
    """A value as TOML, tables in one line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


def change(table, path, value):
    """Set a key of a scene by its path; * means all entries of a list."""
    first, _, rest = path.partition(".")
    if first == "*":
        for entry in table:
            change(entry, rest, value)
    elif rest:
        change(table[first], rest, value)
    else:
        table[first] = value


def scene_text(scene, folder):
    """The text of a scene for a run from a folder, and a digest of it and of its meshes."""
    table = tomllib.loads((ROOT / scene.folder / "scene.toml").read_text())
    ends = {} if scene.end is None else {"time.end": scene.end}
    for path, value in {**ends, **scene.changes, "output": OUTPUT}.items():
        change(table, path, value)
    content = hashlib.sha256()
    for block in table["block"]:
        if "mesh" in block:
            mesh = ROOT / scene.folder / block["mesh"]
            content.update(mesh.read_bytes())
            block["mesh"] = os.path.relpath(mesh, folder)
    text = "".join(f"{key} = {toml(value)}\n" for key, value in table.items())
    content.update(text.encode())
    return text, content.hexdigest()


def say(text):
    """Print at once: several threads wait for runs of minutes."""
    print(text, flush=True)


def counted(number, word):
    """A number of things, as 1 file or 2 files."""
    return f"{number} {word}{'' if number == 1 else 's'}"


def write_scene(build, scene, purpose):
    """Write the scene of a run: its file, the folder of its results, its log, its digest."""
    text, digest = scene_text(scene, build.folder)
    results = build.folder / f"{scene.name}-{purpose}"
    file, log = (results.with_name(f"{results.name}.{ending}") for ending in ("toml", "log"))
    file.write_text(text)
    return file, results, log, digest


def call(build, log, *arguments):
    """Run the command to its end, which must be with status 0."""
    with open(log, "w") as output:
        try:
            done = subprocess.run([build.command, *arguments], stdout=output, stderr=subprocess.STDOUT, timeout=LIMIT)
        except subprocess.TimeoutExpired:
            raise Failure(f"{build.label} did not end within {LIMIT:.0f} s; see {shown(log)}") from None
    if done.returncode != 0:
        raise Failure(f"{build.label} ended with status {done.returncode}; see {shown(log)}")


def shown(path):
    """A path relative to the tree if it lies there."""
    return path.relative_to(ROOT) if path.is_relative_to(ROOT) else path


def whole_run(build, scene, threads):
    """The folder of the results of a scene; the scene is run unless they are there."""
    file, results, log, digest = write_scene(build, scene, threads)
    marker = results / MARKER
    if not marker.is_file() or marker.read_text() != digest:
        shutil.rmtree(results, ignore_errors=True)
        call(build, log, "run", file, "-o", results, "--threads", str(threads))
        marker.write_text(digest)
    return results


def resumed_run(build, scene):
    """The folder of the results of a scene that is interrupted on one thread and resumed on more."""
    file, results, log, _ = write_scene(build, scene, "resumed")
    for part in INTERRUPTED_AT:
        status = interrupt(build, (file, results, log), OUTPUT["history"] // part)
        if status != 0:
            break
        say(f"{scene.name}, resumed: the run ended before the signal came; the next signal comes earlier")
    if status != 130:
        told = "before all signals: choose a longer scene" if status == 0 else f"at the signal with status {status}"
        raise Failure(f"{build.label} ended {told}; see {shown(log)}")
    say(f"{scene.name}, resumed: interrupted after {counted(rows(results), 'row')} of history.csv")
    call(build, log, "resume", results, "--threads", str(THREADS[-1]))
    return results


def interrupt(build, paths, after):
    """Run a scene on one thread and interrupt it when it has written so many rows; its status."""
    file, results, log = paths
    shutil.rmtree(results, ignore_errors=True)
    command = [build.command, "run", file, "-o", results, "--threads", str(THREADS[0])]
    began = time.monotonic()
    with open(log, "w") as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
        try:
            while process.poll() is None and rows(results) < after and time.monotonic() < began + LIMIT:
                time.sleep(0.002)
            process.send_signal(signal.SIGINT)
            return process.wait(LIMIT)
        except subprocess.TimeoutExpired:
            raise Failure(f"{build.label} did not end within {LIMIT:.0f} s of the signal; see {shown(log)}") from None
        finally:
            process.kill()


def rows(results):
    """Rows of history.csv so far, without its header."""
    try:
        return max(0, (results / "history.csv").read_bytes().count(b"\n") - 1)
    except FileNotFoundError:
        return 0


def compare_scene(old, new, scene, threads):
    """Compare a scene on so many threads, and resume it where it is to be: for each the result."""
    found = [judge(f"{scene.name}, {counted(threads, 'thread')}", old, new, scene, threads)]
    # In the same job, for the whole run of OLD must be there.
    if scene.name == RESUMED and threads == THREADS[0]:
        found.append(judge(f"{scene.name}, resumed", old, new, scene, None))
    return found


def judge(label, old, new, scene, threads):
    """Compare two runs and print the result; None of a failure. Without threads NEW is resumed."""
    began = time.monotonic()
    try:
        before = whole_run(old, scene, threads or THREADS[0])
        after = whole_run(new, scene, threads) if threads else resumed_run(new, scene)
    except Failure as failure:
        say(f"{label}: {failure}")
        return None
    result = compare(before, after, leave_out=[MARKER])
    lines = "".join(f"\n    {line}" for line in result.differing)
    say(f"{label} ({time.monotonic() - began:.1f} s): {verdict([result])}{lines}")
    return result


def verdict(results):
    """Results in words: 12 files equal, or 1 file of 12 differs."""
    equal = sum(result.equal for result in results)
    differ = sum(len(result.differing) for result in results)
    if differ == 0:
        return f"{counted(equal, 'file')} equal"
    return f"{counted(differ, 'file')} of {equal + differ} {'differs' if differ == 1 else 'differ'}"


def compare_builds(old, new, scenes, jobs):
    """Compare all scenes and print the closing line; the exit status."""
    if old.folder == new.folder:
        say("OLD and NEW are the same program: only the resumed run can differ")
    found = []
    with ThreadPoolExecutor(jobs) as pool:
        work = [pool.submit(compare_scene, old, new, scene, threads) for scene in scenes for threads in THREADS]
        try:
            for done in as_completed(work):
                found += done.result()
        except BaseException:
            # Runs that have begun come to their end; at Ctrl-C they have had the same signal.
            pool.shutdown(cancel_futures=True)
            raise
    results = [result for result in found if result is not None]
    told = [line for result in results for line in result.told]
    if told:
        say(f"scene.toml differs in {counted(len(told), 'run')}, which is no failure; {told[0]}")
    failed = len(found) - len(results)
    failures = f", {counted(failed, 'run')} failed" if failed else ""
    counts = (len(scenes), "scene"), (len(THREADS), "thread count"), (len(found) - len(work), "resume")
    say(f"same_bits: {', '.join(counted(*count) for count in counts)}: {verdict(results)}{failures}")
    return 1 if failed or any(result.differing for result in results) else 0


def prepare(label, command):
    """A build that can be run, with a folder for its results."""
    if not command.is_file():
        raise Mistake(f"{command} is no file; name a build of the command, as target/release/cdem")
    if not os.access(command, os.X_OK):
        raise Mistake(f"{command} is not executable; name a build of the command, as target/release/cdem")
    command = command.resolve()
    try:
        version = subprocess.run([command, "--version"], capture_output=True).stdout
    except OSError as error:
        raise Mistake(f"{command} does not run ({error.strerror}); build it for this machine") from None
    if not version.startswith(b"cdem "):
        raise Mistake(f"{command} is not the command cdem; name a build of it, as target/release/cdem")
    folder = KEPT.resolve() / hashlib.sha256(command.read_bytes()).hexdigest()[:16]
    folder.mkdir(exist_ok=True)
    os.utime(folder)
    return Build(label, command, folder)


def remove_old(used):
    """Remove the results of all builds but those used and the last others."""
    builds = [folder for folder in KEPT.iterdir() if re.fullmatch("[0-9a-f]{16}", folder.name)]
    builds.sort(key=lambda folder: (folder.name not in used, -folder.stat().st_mtime))
    for folder in builds[BUILDS_KEPT:]:
        shutil.rmtree(folder)


def choose(pattern):
    """The scenes whose names a pattern matches."""
    chosen = [scene for scene in SCENES if fnmatch.fnmatch(scene.name, pattern)]
    if not chosen:
        raise Mistake(f"no scene is named {pattern}; choose among {', '.join(scene.name for scene in SCENES)}")
    return chosen


def main(arguments=None):
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="same_bits", description=__doc__, formatter_class=layout)
    parser.add_argument("old", type=Path, metavar="OLD", help="the command built before the change")
    parser.add_argument("new", type=Path, metavar="NEW", help="the command built after it")
    parser.add_argument("--scene", default="*", metavar="PATTERN", help="only scenes of such names, as 'crowd*' (all)")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="number of runs side by side (2)")
    wanted = parser.parse_args(arguments)
    try:
        if wanted.jobs < 1:
            raise Mistake(f"--jobs {wanted.jobs} is too small; give 1 or more")
        scenes = choose(wanted.scene)
        KEPT.mkdir(parents=True, exist_ok=True)
        with open(KEPT / "lock", "w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise Mistake("another comparison runs in this tree; wait for its end") from None
            old, new = prepare("OLD", wanted.old), prepare("NEW", wanted.new)
            remove_old({old.folder.name, new.folder.name})
            return compare_builds(old, new, scenes, wanted.jobs)
    except Mistake as mistake:
        print(f"same_bits: {mistake}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
