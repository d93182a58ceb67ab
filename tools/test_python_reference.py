"""The page on the package for Python, of sources as they occur."""

import ast
import unittest

import python_reference

SOURCE = '''
class Thing:
    """A thing."""

    size: float
    """Its size, m."""

    def __init__(self, size: float, *, name: str = "a") -> None:
        """One of a size.

        size: how large,
            in full.
        """

    @property
    def half(self) -> float:
        """Half of it."""

    @classmethod
    def read(cls, path: str) -> "Thing":
        """From a file."""

    def _hidden(self) -> None:
        """Not shown."""
'''


class Page(unittest.TestCase):
    def test_a_class_is_shown_with_its_public_members(self):
        text = "\n".join(python_reference.entry(ast.parse(SOURCE).body[0]))
        for line in ["### `Thing(size, *, name='a')`", "- `size`: how large,\n  in full.",
                     "#### `Thing.size`\n\nIts size, m.", "#### `Thing.half`\n", "#### `Thing.read(path)`"]:
            self.assertIn(line, text)
        self.assertNotIn("hidden", text)

    def test_all_that_is_exported_has_its_place(self):
        self.assertIn("### `read_results(folder, *, tables=None)`", python_reference.page())


if __name__ == "__main__":
    unittest.main()
