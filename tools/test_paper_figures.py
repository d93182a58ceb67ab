"""The paper's figures, from a run of two triangles that is made up."""

import contextlib
import io
import tempfile
import unittest
from pathlib import Path

import numpy as np
from PIL import Image

import paper_figures
from test_picture import write_run

BOOK = Path(__file__).resolve().parent.parent / "book" / "src" / "verification"
INSTANTS = sorted(time for times in paper_figures.SNAPSHOTS.values() for time in times)


class PaperFigures(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = Path(holder.name)

    def write(self, times):
        """A run of blocks of which i goes on at 3 m/s, and j stands at 5 m."""
        write_run(self.folder, times)
        rows = [f"{time},i,{3.0 * time - 2.0}\n{time},j,5.0\n" for time in times]
        (self.folder / "blocks.csv").write_text("time,block,x\n" + "".join(rows))

    def run_main(self):
        """Exit status and what was said on stderr."""
        said = io.StringIO()
        with contextlib.redirect_stderr(said):
            status = paper_figures.main([str(self.folder), str(self.folder)])
        return status, said.getvalue()

    def test_all_four_are_drawn(self):
        self.write(INSTANTS)
        self.assertEqual(self.run_main(), (0, ""))
        for number in (13, 14, 15, 16):
            drawn = Image.open(self.folder / f"two-prisms-{number}.png")
            self.assertIn(f"Figure {number}", drawn.text["Description"])
            self.assertGreater(len(drawn.convert("RGB").getcolors()), 10)

    def test_displacements_count_from_the_start(self):
        self.write([0.0, 0.1, 0.2])
        ways = paper_figures.displacements(self.folder)
        np.testing.assert_allclose(ways["i"], [[0.0, 0.0], [0.1, 0.3], [0.2, 0.6]], atol=1e-12)
        np.testing.assert_allclose(ways["j"][:, 1], 0.0)

    def test_an_instant_without_a_frame_is_named(self):
        self.write([time for time in INSTANTS if time != 0.334])
        status, said = self.run_main()
        self.assertEqual(status, 2)
        self.assertIn("no frame at 0.334 s", said)

    def test_pictures_of_the_book_are_small_and_ours(self):
        page = (BOOK / "two-prisms.md").read_text()
        self.assertIn("tools/paper_figures.py verification/two-scale-prisms/scene-results book/src/verification", page)
        for number in (13, 14, 15, 16):
            file = BOOK / f"two-prisms-{number}.png"
            self.assertIn(f"({file.name})", page)
            self.assertLess(file.stat().st_size, 150_000)
            self.assertIn("paper_figures.py", Image.open(file).text["Description"])


if __name__ == "__main__":
    unittest.main()
