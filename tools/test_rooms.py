"""The checker of rooms, on a small crate with known mistakes."""

import tempfile
import unittest
from pathlib import Path

import rooms

TREE = """# Architecture

```text
crates/cdem/src
  math/list      first
  step/mod       second
```

```text
crates/cdem/src
  lib            names
  step/          top
    mod          the loop
  contact/       middle
    mod          facade
    island/      parts
      kick       forces
      drift      motion
    energy       sums
    solver/
      sweep
  math/          ground
    vector, list
```
"""

CODE = {
    "lib.rs": "mod contact;\nmod math;\nmod step;\npub use crate::step::Run;\n",
    "step/mod.rs": "use crate::contact::Contacts;\nuse crate::math::{list::List, vector};\npub struct Run;\n",
    "contact/mod.rs": "pub(crate) mod energy;\npub(crate) mod island;\npub(crate) mod solver;\n"
    "pub(crate) use crate::contact::energy::Energy;\nuse crate::contact::island::kick;\n"
    "#[cfg(test)]\nmod tests;\n#[cfg(test)]\nuse crate::step::Run;\n",
    "contact/tests.rs": "use crate::step::Run;\n",
    "contact/island/mod.rs": "pub(crate) mod drift;\npub(crate) mod kick;\n",
    "contact/island/kick.rs": "//! As in crate::step::Run.\nuse crate::contact::solver::sweep::Sweep;\nuse super::drift::Drift;\n",
    "contact/island/drift.rs": "use super::kick::Kick;\n",
    "contact/energy.rs": "pub(in crate::contact) struct Energy;\n",
    "contact/solver/mod.rs": "pub(crate) mod sweep;\n",
    "contact/solver/sweep.rs": "const QUOTE: char = '\"'; // \"\nconst TEXT: &str = \"crate::step::Run\";\n",
    "math/mod.rs": "pub(crate) mod list;\npub(crate) mod vector;\n",
    "math/list.rs": "use crate::math::vector::Vector;\n",
    "math/vector.rs": "mod tests {}\n#[cfg(test)]\nmod of_tests {\n    use crate::step::Run;\n}\n",
}


class Rooms(unittest.TestCase):
    def complaints(self, code=None, tree=TREE):
        """What is said about the small crate with some files changed."""
        with tempfile.TemporaryDirectory() as holder:
            root = Path(holder)
            (root / "ARCHITECTURE.md").write_text(tree)
            for name, text in {**CODE, **(code or {})}.items():
                file = root / "crates/cdem/src" / name
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text)
            return list(rooms.complaints(root))

    def changed(self, file, added):
        """What is said after a line is put before a file, without the path that all begin with."""
        found = self.complaints({file: added + CODE[file]})
        return [complaint.removeprefix("crates/cdem/src/") for complaint in found]

    def test_a_crate_in_order_passes(self):
        self.assertEqual(self.complaints(), [])

    def test_an_import_that_climbs_is_named_with_its_rooms(self):
        climbs = "imports from {}, which is above it: {}"
        cases = {
            ("math/list.rs", "use crate::{\n    math::vector,\n    step::{self, Run},\n};\n"):
                "math/list.rs:3: math " + climbs.format("step", "Run, step"),
            ("math/list.rs", "fn f() {\n    crate::step::start();\n}\n"):
                "math/list.rs:2: math " + climbs.format("step", "start"),
            ("contact/energy.rs", "use super::super::step::Run as Other;\n"):
                "contact/energy.rs:1: contact/energy " + climbs.format("step", "Run"),
            ("math/list.rs", "use crate::Run;\n"):
                "math/list.rs:1: math " + climbs.format("lib", "Run"),
            # By the facade, though what it hands on stands lower.
            ("contact/solver/sweep.rs", "use crate::contact::Energy;\n"):
                "contact/solver/sweep.rs:1: contact/solver " + climbs.format("contact", "Energy"),
            ("contact/solver/sweep.rs", "use crate::contact::energy::Energy;\n"):
                "contact/solver/sweep.rs:1: contact/solver " + climbs.format("contact/energy", "Energy"),
            ("contact/energy.rs", "use crate::contact::island;\nfn f() { island::kick::go() }\n"):
                "contact/energy.rs:1: contact/energy " + climbs.format("contact/island", "go, island"),
        }
        for (file, added), expected in cases.items():
            with self.subTest(added):
                self.assertIn(expected, self.changed(file, added))

    def test_a_circle_through_two_folders_is_named(self):
        # Parts of a room that has no order inside.
        tree = TREE.replace("vector, list", "vector, list\n    sum/\n      many")
        code = {
            "math/mod.rs": CODE["math/mod.rs"] + "mod sum;\npub use crate::math::sum::many::Many;\n",
            "math/sum/mod.rs": "mod many;\n",
            "math/sum/many.rs": "use crate::math::list::List;\npub struct Many;\n",
        }
        self.assertEqual(self.complaints(code, tree), [])
        code["math/vector.rs"] = "use crate::math::Many;\n"
        source = "crates/cdem/src/math/"
        expected = f"{source}list.rs:1: imports go in a circle through two folders, with "
        self.assertEqual(
            self.complaints(code, tree), [f"{expected}{source}sum/many.rs, {source}vector.rs"]
        )

    def test_tree_and_files_agree(self):
        cases = {
            TREE.replace("  math/ ", "  maths/"): [
                "ARCHITECTURE.md:22: crates/cdem/src/maths/ does not exist",
                "ARCHITECTURE.md:23: crates/cdem/src/maths/vector does not exist",
                "ARCHITECTURE.md:23: crates/cdem/src/maths/list does not exist",
                *(
                    f"crates/cdem/src/math/{file}.rs:1: the tree of ARCHITECTURE.md does not have this file"
                    for file in ("mod", "list", "vector")
                ),
            ],
            TREE.replace("vector, list", "vector"): [
                "crates/cdem/src/math/list.rs:1: the tree of ARCHITECTURE.md does not have this file",
            ],
            TREE.replace("    energy  ", "    energy: "): [
                "ARCHITECTURE.md:19: this line of the tree cannot be read",
                "crates/cdem/src/contact/energy.rs:1: the tree of ARCHITECTURE.md does not have this file",
            ],
            TREE.replace("math/list ", "math/lists"): [
                "ARCHITECTURE.md:5: crates/cdem/src/math/lists does not exist",
            ],
            "# Nothing": ["ARCHITECTURE.md:1: no tree of crates/cdem/src names lib"],
        }
        for tree, expected in cases.items():
            with self.subTest(tree):
                self.assertEqual(self.complaints(tree=tree), expected)


if __name__ == "__main__":
    unittest.main()
