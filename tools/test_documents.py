"""The checker of documents, on a small tree with known mistakes."""

import subprocess
import tempfile
import unittest
from pathlib import Path

import documents

GOOD = """# Guide

See [the code](src/lib.rs), [above](#guide), `src/lib.rs`, `src/*.rs` and `src/`.
A run writes `history.csv` and `frames/00000.vtu`; its mesh ends in `.msh`.
The method is that of [Li2015].
"""


class Documents(unittest.TestCase):
    def complaints(self, text):
        """What is said about a tree whose only document holds `text`."""
        with tempfile.TemporaryDirectory() as holder:
            root = Path(holder)
            subprocess.run(["git", "init", "--quiet", holder], check=True)
            (root / "src").mkdir()
            (root / "src/lib.rs").write_text("//! Code.\n")
            (root / "references.bib").write_text("@article{Li2015,\n}\n")
            (root / "GUIDE.md").write_text(text)
            return list(documents.complaints(root))

    def test_a_true_document_passes(self):
        self.assertEqual(self.complaints(GOOD), [])

    def test_what_does_not_exist_is_named_with_its_line(self):
        cases = {
            "text\n\nand `src/gone.rs`": "GUIDE.md:3: `src/gone.rs` does not exist",
            "see `gone.rs`": "GUIDE.md:1: `gone.rs` does not exist",
            "see `src/gone/`": "GUIDE.md:1: `src/gone/` does not exist",
            "see [it](gone.md)": "GUIDE.md:1: the link leads to gone.md, which does not exist",
            "# A\n[it](#b)": "GUIDE.md:2: GUIDE.md has no heading #b",
            "after [Nobody1999]": "GUIDE.md:1: [Nobody1999] is not in references.bib",
        }
        for text, expected in cases.items():
            with self.subTest(text):
                self.assertEqual(self.complaints(text), [expected])

    def test_code_blocks_are_not_read_as_prose(self):
        self.assertEqual(self.complaints("```text\n`gone.rs` [it](gone.md)\n```\n"), [])


if __name__ == "__main__":
    unittest.main()
