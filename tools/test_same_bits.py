"""The comparison of two builds, with scripts in place of the command."""

import contextlib
import io
import os
import re
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path
from unittest import mock

import same_bits
import same_files

# A command that writes results of the form that cdem gives them. It notes each call in a file.
COMMAND = '''#!@PYTHON@ -IS
import json, pathlib, signal, struct, sys, time, zlib

NUMBER, SCENE, RESUMES_TO, ENDS = @SETTINGS@
ROWS = 200
stopped = []
signal.signal(signal.SIGINT, lambda *_: stopped.append(True))

def frame(number):
    arrays = [("Float64", struct.pack("<6d", 0, 0, 0, 1, 2, number)), ("Float64", struct.pack("<2d", -0.0, 2))]
    data, entries = b"", []
    for (kind, content), name, count in zip(arrays, ("velocity", "slip"), (3, 1)):
        entries.append(f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{count}" offset="{len(data)}"/>')
        half = len(content) // 2
        pieces = [zlib.compress(content[:half]), zlib.compress(content[half:])]
        data += struct.pack("<5Q", 2, half, half, *map(len, pieces)) + b"".join(pieces)
    head = f'<VTKFile><PointData>{"".join(entries)}</PointData><AppendedData encoding="raw">_'
    return head.encode() + data + b"</AppendedData></VTKFile>"

def go(folder, first, number):
    with open(folder / "history.csv", "a") as table:
        for row in range(first, ROWS + 1):
            table.write(f"{row},{row / ROWS},{number if row == 7 else 1.5}\\n")
            if folder.name.endswith("resumed"):
                table.flush()
                time.sleep(0.001)
            if stopped:
                (folder / "checkpoint").write_text(str(row + 1))
                sys.exit(130)
    for name in ("frames", "contacts"):
        (folder / name).mkdir()
    (folder / "frames/00000.vtu").write_bytes(frame(number))
    (folder / "contacts/00000.vtp").write_bytes(frame(2))
    (folder / "frames.pvd").write_text("<frames/>")
    summary = {"status": "done", "steps": ROWS, "energy_residual": 1e-3, "wall_seconds": time.time()}
    (folder / "summary.json").write_text(json.dumps(summary))

def main(verb, *rest):
    if verb == "--version":
        print("cdem 0.1.0")
        return 0
    with open(pathlib.Path(__file__).with_suffix(".calls"), "a") as calls:
        calls.write(f"{verb} {pathlib.Path(rest[2 if verb == 'run' else 0]).name}\\n")
    if verb == "run":
        folder = pathlib.Path(rest[2])
        folder.mkdir()
        (folder / "scene.toml").write_text(SCENE)
        (folder / "history.csv").write_text("step,time,energy\\n")
        go(folder, 0, NUMBER)
    else:
        folder = pathlib.Path(rest[0])
        go(folder, int((folder / "checkpoint").read_text()), RESUMES_TO)
        (folder / "checkpoint").unlink()
    return ENDS

sys.exit(main(*sys.argv[1:]))
'''


class SameBits(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = Path(holder.name)
        kept = mock.patch.object(same_bits, "KEPT", self.folder / "kept")
        kept.start()
        self.addCleanup(kept.stop)

    def command(self, name, number=1.5, scene="end = 1", resumes_to=1.5, ends=0):
        """A command whose results hold a number, and another one if they are resumed."""
        file = self.folder / name
        settings = repr((number, scene, resumes_to, ends))
        file.write_text(COMMAND.replace("@PYTHON@", sys.executable).replace("@SETTINGS@", settings) + f"# {name}\n")
        file.chmod(0o755)
        return file

    def calls(self, command):
        """All calls of a command so far."""
        return command.with_suffix(".calls").read_text().splitlines()

    def compare(self, old, new, *arguments, scene="joint"):
        """Exit status, and all output."""
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            status = same_bits.main([str(old), str(new), "--scene", scene, *arguments])
        return status, said.getvalue()

    def test_equal_results_pass_and_a_build_runs_once(self):
        old, new, newer = (self.command(name) for name in ("old", "new", "newer"))
        status, said = self.compare(old, new)
        self.assertEqual(status, 0, said)
        self.assertIn("joint, 1 thread (", said)
        self.assertTrue(said.endswith("same_bits: 1 scene, 2 thread counts, 0 resumes: 10 files equal\n"), said)
        self.assertEqual(sorted(self.calls(old)), ["run joint-1", "run joint-3"])
        self.assertEqual(self.compare(old, newer)[0], 0)
        self.assertEqual(len(self.calls(old)), 2)
        self.assertEqual(len(self.calls(newer)), 2)

    def test_the_first_number_that_differs_is_named(self):
        status, said = self.compare(self.command("old"), self.command("new", number=1.25))
        self.assertEqual(status, 1)
        self.assertIn("2 files of 5 differ", said)
        # The header is line 1, step 0 is line 2.
        self.assertIn("history.csv: line 9, column energy: OLD 1.5, NEW 1.25\n", said)
        array = "array PointData/velocity, entry 1, component 2: OLD 1.5, NEW 1.25\n"
        self.assertIn(f"frames/00000.vtu: {array}", said)
        self.assertTrue(said.endswith("4 files of 10 differ\n"), said)

    def test_a_scene_that_differs_is_no_failure(self):
        status, said = self.compare(self.command("old"), self.command("new", scene="end = 1.0"))
        self.assertEqual(status, 0, said)
        self.assertIn("scene.toml differs in 2 runs, which is no failure; line 1: OLD end = 1, NEW end = 1.0", said)

    def test_a_run_that_was_not_complete_or_of_another_scene_is_repeated(self):
        old, new = self.command("old"), self.command("new")
        self.compare(old, new)
        (marker,) = (self.folder / "kept").glob(f"{self.digest(new)}/joint-1/{same_bits.MARKER}")
        marker.unlink()
        self.compare(old, new)
        self.assertEqual(self.calls(new).count("run joint-1"), 2)
        self.assertEqual(self.calls(new).count("run joint-3"), 1)
        with mock.patch.dict(same_bits.OUTPUT, history=100):
            self.compare(old, new)
        self.assertEqual([len(self.calls(command)) for command in (old, new)], [4, 5])

    def digest(self, command):
        """The name of the folder of a command."""
        return same_bits.prepare("", command).folder.name

    def test_a_run_that_fails_is_a_failure_and_runs_again(self):
        old, new = self.command("old"), self.command("new", ends=3)
        status, said = self.compare(old, new)
        self.assertEqual(status, 1)
        self.assertIn("joint, 3 threads: NEW ended with status 3; see ", said)
        self.assertTrue(said.endswith("0 files equal, 2 runs failed\n"), said)
        self.compare(old, new)
        self.assertEqual(len(self.calls(new)), 4)

    def test_a_run_is_interrupted_and_resumed(self):
        old, new = self.command("old"), self.command("new")
        status, said = self.compare(old, new, scene=same_bits.RESUMED)
        self.assertEqual(status, 0, said)
        self.assertRegex(said, r"sliding-feet, resumed: interrupted after 1\d\d rows of history.csv")
        self.assertIn("2 thread counts, 1 resume: 15 files equal", said)
        self.assertEqual(self.calls(new)[-1], "resume sliding-feet-resumed")

    def test_a_resumed_run_that_differs_is_a_failure(self):
        old, new = self.command("old"), self.command("new", resumes_to=1.25)
        status, said = self.compare(old, new, scene=same_bits.RESUMED)
        self.assertEqual(status, 1)
        self.assertIn("3 threads (", said)
        self.assertRegex(said, r"sliding-feet, resumed \(.* s\): 1 file of 5 differs\n    frames/00000.vtu: ")

    def test_a_run_that_ends_before_every_signal_is_told_of(self):
        # As if its rows came faster than they are counted.
        rows = mock.patch.object(same_bits, "rows", lambda results: 0)
        with rows, mock.patch.object(same_bits, "INTERRUPTED_AT", (2, 4)):
            status, said = self.compare(self.command("old"), self.command("new"), scene=same_bits.RESUMED)
        self.assertEqual(status, 1)
        self.assertEqual(said.count("ended before the signal came; the next signal comes earlier"), 2)
        self.assertIn("NEW ended before all signals: choose a longer scene", said)

    def test_a_wrong_call_is_answered_in_one_line(self):
        good, text = self.command("good"), self.folder / "text"
        text.write_text("no program")
        other = self.command("other")
        other.write_text("#!/bin/sh\necho another\n")
        cases = [
            ((self.folder / "gone", good), {}, "gone is no file; name a build"),
            ((good, text), {}, "text is not executable; name a build"),
            ((good, other), {}, "other is not the command cdem; name a build"),
            ((good, good), {"scene": "gone*"}, "no scene is named gone*; choose among bars-2d, "),
        ]
        for commands, options, answer in cases:
            with self.subTest(answer):
                status, said = self.compare(*commands, **options)
                self.assertEqual((status, said.count("\n")), (2, 1), said)
                self.assertIn(answer, said)
        self.assertEqual(self.compare(good, good, "--jobs", "0")[0], 2)

    def test_the_last_builds_are_kept(self):
        kept = self.folder / "kept"
        names = [16 * digit for digit in "abcdef"] + ["notes"]
        for age, name in enumerate(names):
            (kept / name).mkdir(parents=True)
            os.utime(kept / name, (1e9 - age, 1e9 - age))
        same_bits.remove_old({16 * "a", 16 * "f"})
        left = {folder.name for folder in kept.iterdir()}
        self.assertEqual(left, {"notes", *(16 * digit for digit in "abcf")})


class Scenes(unittest.TestCase):
    def test_all_examples_are_there_and_all_scenes_are_in_the_tree(self):
        folders = [scene.folder for scene in same_bits.SCENES]
        examples = [file.parent.relative_to(same_bits.ROOT) for file in same_bits.ROOT.glob("examples/*/scene.toml")]
        self.assertEqual({str(folder) for folder in examples} - set(folders), set())
        self.assertEqual(len({scene.name for scene in same_bits.SCENES}), len(folders))
        self.assertIn(same_bits.RESUMED, [scene.name for scene in same_bits.SCENES])

    def test_a_scene_keeps_all_but_its_changes(self):
        for scene in same_bits.SCENES:
            with self.subTest(scene.name):
                folder = same_bits.ROOT / scene.folder
                was = tomllib.loads((folder / "scene.toml").read_text())
                text, _ = same_bits.scene_text(scene, folder)
                now = tomllib.loads(text)
                self.assertEqual(now.pop("output"), same_bits.OUTPUT)
                was.pop("output", None)
                # Texts, such as "10 ms", belong to scenes whose end is that of the file.
                if scene.end is not None and isinstance(was["time"]["end"], float):
                    self.assertLess(scene.end, was["time"]["end"])
                for path in ["time.end", *scene.changes]:
                    for table in (was, now):
                        same_bits.change(table, path, "changed")
                self.assertEqual(now, was)

    def test_another_mesh_gives_another_digest(self):
        with tempfile.TemporaryDirectory() as holder:
            folder = Path(holder)
            (folder / "scene.toml").write_text('block = [{ mesh = "a.msh" }]')
            digests = set()
            for content in ("one", "two", "two"):
                (folder / "a.msh").write_text(content)
                # An absolute folder takes the place of the tree.
                digests.add(same_bits.scene_text(same_bits.Scene(holder, None, ""), folder)[1])
        self.assertEqual(len(digests), 2)

    def test_each_key_of_the_summary_is_compared_or_left_out(self):
        page = (same_bits.ROOT / "book/src/reference/results.md").read_text()
        rows = re.search(r"## `summary.json`\n(.*?)\n## ", page, flags=re.S)[1].split("\n| `")[1:]
        keys = [key for row in rows for key in re.findall(r"`(\w+)`", "`" + row.partition(" | ")[0])]
        self.assertEqual(sorted(same_files.COMPARED + same_files.NOT_COMPARED), sorted(keys))


class Files(unittest.TestCase):
    def test_differences_are_named_by_place(self):
        cases = [
            ("history.csv", b"a,b\n1,2\n", b"a,b\n1,2\n3,4\n", "OLD has 2 lines, NEW 3"),
            ("blocks.csv", b"a,b\n1,2\n", b"a,c\n1,2\n", "line 1, column b: OLD b, NEW c"),
            ("blocks.csv", b'a,b\n"x, y",2\n', b'a,b\n"x, y",3\n', "line 2, column b: OLD 2, NEW 3"),
            ("contacts.csv", b"a,b\n1,2\n", b"a,b\r\n1,2\n", "byte 3: OLD 10, NEW 13"),
            ("frames.pvd", b"one\ntwo\n", b"one\nthree\n", "line 2: OLD two, NEW three"),
            ("frames/00000.vtu", b"abc", b"abx", "byte 2: OLD 99, NEW 120"),
            ("checkpoints/1.cdem", b"ab", b"abc", "OLD has 2 bytes, NEW 3"),
            ("summary.json", b'{"steps": 1}', b'{"steps": 2, "threads": 3}', "steps: OLD 1, NEW 2"),
            ("summary.json", b'{"time": 0.10}', b'{"time": 0.1}', "time: OLD 0.10, NEW 0.1"),
            ("summary.json", b'{"warnings": []}', b"{}", "warnings: OLD [], NEW nothing"),
            ("summary.json", b'{"warnings": ["lost 1.5e-3 J"]}', b'{"warnings": ["1.5e-3 J are lost"]}', None),
            (
                "summary.json",
                b'{"warnings": ["lost 1.5e-3 J"]}',
                b'{"warnings": ["lost 1.5e-4 J"]}',
                "warnings: OLD ['lost 1.5e-3 J'], NEW ['lost 1.5e-4 J']",
            ),
            ("summary.json", b'{"wall_seconds": 1}', b'{"wall_seconds": 2}', None),
        ]
        for name, old, new, expected in cases:
            with self.subTest(name=name, old=old):
                self.assertEqual(same_files.difference(name, old, new), expected)

    def test_a_file_of_one_run_alone_is_told_of(self):
        with tempfile.TemporaryDirectory() as holder:
            old, new = Path(holder, "old"), Path(holder, "new")
            for folder, names in ((old, ["a.csv", "frames/1.vtu"]), (new, ["a.csv", "probes.csv", "complete"])):
                for name in names:
                    (folder / name).parent.mkdir(parents=True, exist_ok=True)
                    (folder / name).write_text("")
            result = same_files.compare(old, new, leave_out=["complete"])
        self.assertEqual(result.equal, 1)
        self.assertEqual(result.differing, ["probes.csv: OLD has no such file", "frames/1.vtu: NEW has no such file"])


if __name__ == "__main__":
    unittest.main()
