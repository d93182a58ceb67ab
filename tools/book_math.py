r"""Typeset the formulas of the book: a preprocessor of mdBook, named in book/book.toml.

    .venv/bin/python tools/book_math.py supports html    # exits with 0: formulas become HTML
    .venv/bin/python tools/book_math.py < book.json      # [context, book] in, book out

- `$\Delta t$` is a formula in a line. It starts and ends on one line, without a space inside the
  dollar signs, and no digit follows it.
- `$$` at the start and at the end of lines encloses a formula of its own, in lines or in one;
  `\tag{3}` numbers it, in each line of `\begin{align}`.
- `\$` is a dollar sign.
- Fenced code, inline code and comments stay as they are.

Formulas become MathML, which browsers show by themselves, without a script or the network.
"""

import json
import os
import re
import sys
from pathlib import Path

from math_core import LatexError, LatexToMathML

ROOT = Path(__file__).resolve().parent.parent

TOKEN = re.compile(
    r"""
    ^[ >]*(?P<fence>`{3,}|~{3,})[^`\n]*\n .*? (?:^[ >]*(?P=fence)|\Z)      # fenced code
    | (?<!`)(?P<ticks>`+)(?!`) (?:(?!\n\s*\n).)+? (?<!`)(?P=ticks)(?!`)    # inline code, in one paragraph
    | <!-- .*? -->
    | \\[^\w\s]                                                            # an escaped character
    | ^(?P<indent>[ ]*)\$\$(?P<display>(?:(?!\n\s*\n)[^$])+)\$\$[ ]*$
    | \$(?=\S)(?P<inline>(?:\\[^\n]|[^\\$`\n])+)(?<!\s)\$(?![\d$])
    | (?P<stray>\$+)
    """,
    re.M | re.S | re.X,
)
STRAY = r"a dollar sign that encloses no formula: write \$ for the sign; tools/book_math.py says how to write formulas"

CONVERTER = LatexToMathML(fancy_error=False)


def mathml(latex, display):
    """The MathML of a formula, on one line and without characters that Markdown reads.

    Raises LatexError where the formula cannot be read.
    """
    if r"\tag" in latex and r"\begin" not in latex:
        latex = rf"\begin{{equation}}{latex}\end{{equation}}"
    markup = CONVERTER.convert_with_local_state(latex, displaystyle=display)
    return re.sub(r"(?<=>)[^<]+", lambda text: escaped(text[0]), markup)


def escaped(text):
    """HTML text with punctuation as character references, which Markdown leaves alone."""
    return re.sub(r"[^\w\s&#;]|_", lambda character: f"&#{ord(character[0])};", text)


def typeset(text):
    """A page with its formulas typeset, and its mistakes as (line, message)."""
    mistakes = []

    def complain(token, message):
        mistakes.append((text.count("\n", 0, token.start()) + 1, message))
        return token[0]

    def replacement(token):
        if token["stray"]:
            return complain(token, STRAY)
        display = token["display"] is not None
        latex = token["display"] if display else token["inline"]
        if latex is None:
            return token[0]
        try:
            markup = mathml(latex.strip(), display)
        except LatexError as error:
            # The message begins with the place in the formula, in bytes.
            return complain(token, f"{token[0].strip()}: {str(error).partition(': ')[2]}")
        return f'\n{token["indent"]}<div class="equation">{markup}</div>\n' if display else markup

    return TOKEN.sub(replacement, text), mistakes


def chapters(items):
    """Every chapter of a list of items of the book, with those inside it."""
    for item in items:
        # Separators and titles of parts are items too.
        if isinstance(item, dict) and "Chapter" in item:
            yield item["Chapter"]
            yield from chapters(item["Chapter"]["sub_items"])


def typeset_book(context, book):
    """Typesets the book in place, and returns its mistakes as lines of `file:line: message`."""
    source = Path(context["root"], context["config"]["book"].get("src", "src"))
    complaints = []
    for chapter in chapters(book["items"]):
        chapter["content"], mistakes = typeset(chapter["content"])
        if mistakes:
            page = os.path.relpath(source / chapter["source_path"], ROOT)
            complaints += [f"{page}:{line}: {message}" for line, message in mistakes]
    return complaints


def main():
    if sys.argv[1:2] == ["supports"]:
        return 0 if sys.argv[2:] == ["html"] else 1
    context, book = json.load(sys.stdin.buffer)
    complaints = typeset_book(context, book)
    if complaints:
        print("\n".join(complaints), file=sys.stderr)
        return 1
    json.dump(book, sys.stdout)
    return 0


if __name__ == "__main__":
    sys.exit(main())
