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

CODE = """//! Code; `fn in_a_comment` is none.
pub struct Box<const D: usize> {
    /// Metres: not a field.
    pub(crate) sides: [f64; D],
}

pub enum Shape {
    Round { radius: f64 },
    #[default]
    Flat(u8),
}

pub trait Area {
    const UNIT: &'static str = "struct InAString { \\" }";
    fn area(&self) -> f64;
}

impl<const D: usize, F: Fn(&[[f64; D]]) -> f64> Area for Wrapped<D, F> {
    fn area(&self) -> f64 {
        fn inner() {}
        let quote = '{';
        0.0
    }
}

impl Shape {
    pub const fn sides() -> u8 {
        4
    }
}

pub fn measure() {}
"""


class Documents(unittest.TestCase):
    def complaints(self, text, code="//! Code.\n"):
        """What is said about a tree of this `code`, whose only document holds `text`."""
        with tempfile.TemporaryDirectory() as holder:
            root = Path(holder)
            subprocess.run(["git", "init", "--quiet", holder], check=True)
            (root / "src").mkdir()
            (root / "src/lib.rs").write_text(code)
            (root / "src/room").mkdir()
            (root / "src/room/mod.rs").write_text("pub mod inner;\n")
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

    def test_a_label_that_names_what_the_file_defines_passes(self):
        labels = (
            "Box Box::sides Shape::Round Shape::Flat Shape::sides Area Area::area Area::UNIT "
            "Wrapped::area measure measure() inner lib lib::measure `Box` `Wrapped::area`"
        )
        for label in labels.split() + ["a measure of boxes", "src/lib.rs", "the `Gone` of old"]:
            with self.subTest(label):
                self.assertEqual(self.complaints(f"[{label}](src/lib.rs)", CODE), [])
        self.assertEqual(self.complaints("[room](src/room/mod.rs) [inner](src/room/mod.rs)"), [])

    def test_a_label_that_the_file_does_not_define_is_named_with_the_nearest_name(self):
        cases = {
            "Boxes": "Box",
            "`Boxes`": "Box",
            "Box::side": "Box::sides",
            "Box::area": "Box::sides",
            "Shape::Rounded": "Shape::Round",
            "Shape::radius": "Shape::",
            "Shape::area": "Shape::",
            "Wrapped::inner": "Wrapped::area",
            "Old::UNIT": "Area::UNIT",
            "measured": "measure",
            "in_a_comment": "",
            "InAString": "",
            "Metres": "",
            "str": "",
            "D": "",
        }
        for label, nearest in cases.items():
            with self.subTest(label):
                (said,) = self.complaints(f"text\n[{label}](src/lib.rs)", CODE)
                self.assertTrue(
                    said.startswith(f"GUIDE.md:2: src/lib.rs does not define {label.strip('`')}"), said
                )
                self.assertIn(f"; the nearest name in it is {nearest}", said)

    def test_a_label_on_a_file_without_names_has_no_nearest_name(self):
        said = self.complaints("[Gone::by](src/lib.rs)")
        self.assertEqual(said, ["GUIDE.md:1: src/lib.rs does not define Gone::by"])


if __name__ == "__main__":
    unittest.main()
