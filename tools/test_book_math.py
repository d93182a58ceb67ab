"""The preprocessor of the book: formulas, code that only looks like them, mistakes, mdBook's protocol."""

import json
import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

import book_math

SCRIPT = Path(book_math.__file__)


def run(*arguments, text=""):
    """The preprocessor as mdBook starts it."""
    return subprocess.run(
        [sys.executable, SCRIPT, *arguments], input=text, capture_output=True, encoding="utf-8",
        # mdBook sends UTF-8 on every machine.
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )


def book_of(page, inner):
    """What mdBook 0.5 sends of a book with a page, and a page below it."""
    def chapter(path, content, sub_items):
        return {"Chapter": {
            "name": path, "content": content, "number": None, "sub_items": sub_items,
            "path": path, "source_path": path, "parent_names": [],
        }}

    items = ["Separator", {"PartTitle": "Theory"}, chapter("page.md", page, [chapter("inner.md", inner, [])])]
    context = {"root": str(book_math.ROOT / "book"), "config": {"book": {"src": "src"}}, "renderer": "html"}
    return json.dumps([context, {"items": items}], ensure_ascii=False)


class Formulas(unittest.TestCase):
    def typeset(self, text):
        """The page, which has no mistakes."""
        page, mistakes = book_math.typeset(text)
        self.assertEqual(mistakes, [])
        return page

    def test_a_formula_in_a_line_stays_in_it(self):
        self.assertEqual(
            self.typeset("Steps of $t_1$, and $x$."),
            "Steps of <math><msub><mi>t</mi><mn>1</mn></msub></math>, and <math><mi>x</mi></math>.",
        )

    def test_a_formula_of_its_own_is_a_block_as_far_in_as_its_list(self):
        for text in ("- so\n  $$\n  x\n  $$\n  then", "- so\n  $$x$$\n  then"):
            with self.subTest(text):
                self.assertEqual(
                    self.typeset(text),
                    '- so\n\n  <div class="equation"><math display="block"><mi>x</mi></math></div>\n\n  then',
                )

    def test_numbers_are_those_of_the_tags(self):
        one = self.typeset("$$\na = b \\tag{3}\n$$")
        two = self.typeset("$$\n\\begin{align}\na &= b \\tag{6} \\\\\nc &= d \\tag{7}\n\\end{align}\n$$")
        self.assertEqual(re.findall(r"\d+(?=&#41;)", one), ["3"])
        self.assertEqual(re.findall(r"\d+(?=&#41;)", two), ["6", "7"])

    def test_markdown_finds_nothing_to_read_in_a_formula(self):
        page = self.typeset(r"$\lvert a \rvert * [b] \text{c-d -- 'e' ...} \_ x^*$")
        self.assertNotRegex(re.sub(r"<[^>]*>|&#?\w+;", "", page), r"[^\w\s]|_")

    def test_code_comments_and_escapes_stay(self):
        for text in (
            "```sh\necho $HOME $x$\n```\n",
            "> ~~~\n> $$\n> x\n> $$\n> ~~~\n",
            "````\n```\n$x$\n````\n",
            "- so\n\n  ```sh\n  echo $x$\n  ```\n",
            "```\n$x$ in a block without an end",
            "`$x$` and ``a ` $x$ ``, over `lines\n$x$`",
            "<!-- $x$\n-->",
            r"\$x\$ costs \$5",
        ):
            with self.subTest(text):
                self.assertEqual(self.typeset(text), text)

    def test_formulas_after_code_are_typeset(self):
        for code in ("```\na\n```\n", "~~~\n```\n~~~\n", "`a` ", "a ` alone\n\n", "<!-- a -->"):
            with self.subTest(code):
                self.assertEqual(self.typeset(code + "$x$"), code + "<math><mi>x</mi></math>")

    def test_backticks_that_do_not_match_are_no_code(self):
        self.assertEqual(self.typeset("``a $x$`"), "``a <math><mi>x</mi></math>`")


class Mistakes(unittest.TestCase):
    def test_what_cannot_be_read_is_told_with_its_line(self):
        cases = {
            "a\n\nb $\\nonsense$": (3, r'$\nonsense$: Unknown command "\nonsense".'),
            "$\\frac{1}$": (1, r"$\frac{1}$: Expected argument but reached end of input."),
            "a\n\n$$\n{x\n$$\n": (3, '$$\n{x\n$$: Expected closing token "}", but reached end of input.'),
        }
        for text, mistake in cases.items():
            with self.subTest(text):
                self.assertEqual(book_math.typeset(text), (text, [mistake]))

    def test_a_dollar_sign_alone_is_a_mistake_not_half_a_formula(self):
        for text in ("from $5 to $6", "$5-$6", "$5 or $x", "$ x $", "so $x\ny$", "in a line $$x$$", "$$\nx\n\ny\n$$"):
            with self.subTest(text):
                page, mistakes = book_math.typeset(text)
                self.assertEqual(page, text)
                self.assertEqual({message for _, message in mistakes}, {book_math.STRAY})

    def test_all_mistakes_of_a_page_are_told(self):
        _, mistakes = book_math.typeset("$\\a$\n$x$\n$\\b$ $")
        self.assertEqual([line for line, _ in mistakes], [1, 3, 3])


class Protocol(unittest.TestCase):
    def test_html_alone_is_supported(self):
        self.assertEqual(run("supports", "html").returncode, 0)
        self.assertEqual(run("supports", "epub").returncode, 1)

    def test_every_chapter_is_typeset_and_nothing_else_changes(self):
        done = run(text=book_of("ü $x$", "$y$"))
        self.assertEqual(done.returncode, 0, done.stderr)
        expected = book_of("ü <math><mi>x</mi></math>", "<math><mi>y</mi></math>")
        self.assertEqual(json.loads(done.stdout), json.loads(expected)[1])

    def test_a_mistake_ends_the_build_with_page_and_line(self):
        done = run(text=book_of("$x$", "so\n$\\nonsense$"))
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertEqual(done.stderr, 'book/src/inner.md:2: $\\nonsense$: Unknown command "\\nonsense".\n')


if __name__ == "__main__":
    unittest.main()
