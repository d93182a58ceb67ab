"""Check that documents tell the truth about the tree they lie in.

    python3 tools/documents.py

- Every relative link in a Markdown file leads to a file (and heading) that exists.
- Every path written as `code` in a Markdown file exists. A path is a span with
  a slash or a file ending, and nothing else in it; what users and runs make
  (`scene.toml`, `history.csv`, `DIR/frames/`) is not in the tree and not checked.
- Every link to a Rust file whose label is a name, [`Type`], [`Type::member`] or
  [`function`], leads to the file that defines that name. The module's own name
  is right too; a label with a space is prose and not checked.
- Every source cited in Rust or Markdown as [Name2015] is in references.bib.
"""

import difflib
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# Files and folders of users and runs; documents speak of them, the tree has none.
MADE_ELSEWHERE = re.compile(
    r"(.*/)?[\w-]+-results/?|(DIR|target|\.venv|frames|contacts)/.*"
    r"|scene\.toml|(history|blocks|contacts|probes)\.csv|(frames|contacts)\.pvd|\*\.vt[up]"
    r"|summary\.json|report\.html|checkpoint.*"
)
PATH = re.compile(r"[\w.*-]+(/[\w.*-]+)*/?")
ENDING = re.compile(r"\.(rs|toml|md|py|json|cff|bib|msh|geo|png|csv|pvd|vtu|vtp|html)$")
SYMBOL_LINK = re.compile(r"\[`?(\w+(?:::\w+)*)(?:\(\))?`?\]\(([^)\s]+\.rs)\)")
# Comments, strings and characters of Rust, whose text defines nothing; a lifetime is no character.
RUST_TEXT = re.compile(
    r"""//[^\n]*|/\*.*?\*/|\bb?r(?P<hashes>\#*)".*?"(?P=hashes)|"(?:\\.|[^"\\])*"|'(?:\\[^'\n]+|\\'|[^\\'\n])'""",
    re.S,
)
# A definition; no generic `<const D: usize>`, no lifetime `'static`, and `const fn` is a function.
DEFINITION = re.compile(
    r"(?<!<)(?<!, )(?<!')\b(struct|enum|union|trait|type|const|static|fn|mod|macro_rules!)\s+(?!fn\b|unsafe\b|mut\b)(\w+)"
)
BLOCK = re.compile(
    r"^[ ]*(?:pub(?:\([^)]*\))?\s+)?(?:unsafe\s+)?(?P<kind>impl|trait|struct|enum|union)\b"
    r"(?P<head>(?:[^{};\[\]]|\[(?:[^\[\]]|\[[^\[\]]*\])*\])*)\{",
    re.M,
)
CITATION = re.compile(r"\[([A-Z][a-zA-Z]+(?:19|20)\d\d[a-z]?)\]")


def tracked(root, *patterns):
    """Files under version control, or about to be, that match."""
    listing = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", *patterns],
        cwd=root, check=True, capture_output=True, text=True,
    )
    return [root / line for line in sorted(set(listing.stdout.splitlines())) if (root / line).is_file()]


def without_code(text):
    """The text with code blocks blanked, so that line numbers stay."""
    return re.sub(r"^```.*?^```$", lambda block: "\n" * block[0].count("\n"), text, flags=re.M | re.S)


def anchors(text):
    """The anchors of a Markdown text's headings."""
    headings = re.findall(r"^#+\s+(.+?)\s*$", without_code(text), flags=re.M)
    return {re.sub(r"\s", "-", re.sub(r"[^\w\s-]", "", heading.lower())) for heading in headings}


def lines_matching(pattern, text):
    """Line number and match of every match of `pattern`."""
    for match in re.finditer(pattern, text):
        yield text.count("\n", 0, match.start()) + 1, match


def looks_like_path(span):
    """Whether an inline code span names a file or folder of the tree."""
    if not PATH.fullmatch(span) or MADE_ELSEWHERE.fullmatch(span) or ENDING.fullmatch(span):
        return False
    return bool(ENDING.search(span)) or "/" in span


def exists(root, beside, path):
    """Whether a path (it may hold *) exists from the root or beside the document."""
    return any(any(base.glob(path.rstrip("/"))) for base in (root, beside))


def outermost(code):
    """The code without what stands in its brackets: (…), […] and {…}."""
    depth, kept = 0, []
    for character in code:
        depth -= character in ")]}"
        if depth == 0:
            kept.append(character)
        depth += character in "([{"
    return "".join(kept)


def inside_braces(code, start):
    """The code from `start`, just behind a brace, to the brace that closes it."""
    depth = 1
    for end in range(start, len(code)):
        depth += (code[end] == "{") - (code[end] == "}")
        if depth == 0:
            return code[start:end]
    return code[start:]


def type_of_block(kind, head):
    """Name of the type that a block of Rust belongs to; None where it has no name, as in a macro."""
    head = head.replace("->", " ")
    while (shorter := re.sub(r"<[^<>]*>", " ", head)) != head:
        head = shorter
    head = re.split(r"\bwhere\b", head)[0]
    if kind == "impl":
        names = re.findall(r"\w+", re.split(r"\bfor\b", head)[-1])
        return names[-1] if names else None
    name = re.match(r"\s*(\w+)", head)
    return name and name[1]


def symbols(rust):
    """What Rust source defines: all names, and all members as `Type::member`."""
    code = RUST_TEXT.sub(lambda text: re.sub(r"[^\n]", " ", text[0]), rust)
    names, members = {name for _, name in DEFINITION.findall(code)}, set()
    for block in BLOCK.finditer(code):
        body = outermost(inside_braces(code, block.end()))
        owner = type_of_block(block["kind"], block["head"])
        if block["kind"] in ("struct", "union"):
            found = re.findall(r"(\w+)\s*:(?!:)", body)
        elif block["kind"] == "enum":
            found = re.findall(r"(?:^|,)[\s#\[\]]*(\w+)", body)
        else:
            found = [name for kind, name in DEFINITION.findall(body) if kind in ("fn", "const", "type")]
        members.update(f"{owner}::{name}" for name in found if owner)
    return names, members


def alike(label, names, members):
    """The names of a file among which the one that a wrong label means may be."""
    owner, separator, _ = label.rpartition("::")
    of_owner = {name for name in members if name.startswith(owner + separator)}
    return (of_owner or members or names) if owner else names


def label_complaints(where, document, text):
    """Links to Rust files that are labelled with a name the file does not define."""
    for line, match in lines_matching(SYMBOL_LINK, text):
        label, file = match[1], document.parent / match[2]
        if not file.is_file():
            continue
        module = file.resolve().parent.name if file.stem == "mod" else file.stem
        names, members = symbols(file.read_text())
        known = names | members | {module} | {f"{module}::{name}" for name in names}
        if label not in known:
            nearest = difflib.get_close_matches(label, sorted(alike(label, names, members)), n=1, cutoff=0)
            hint = f"; the nearest name in it is {nearest[0]}" if nearest else ""
            yield f"{where}:{line}: {match[2]} does not define {label}{hint}"


def document_complaints(root, document):
    """What is wrong with the links and paths of one Markdown file."""
    text = document.read_text()
    where = document.relative_to(root)
    for line, match in lines_matching(r"\]\(([^)\s]+)\)", without_code(text)):
        target, _, anchor = match[1].partition("#")
        if re.match(r"[a-z]+:", target):
            continue
        file = (document.parent / target) if target else document
        if not file.exists():
            yield f"{where}:{line}: the link leads to {target}, which does not exist"
        elif anchor and anchor not in anchors(file.read_text()):
            yield f"{where}:{line}: {file.name} has no heading #{anchor}"
    yield from label_complaints(where, document, without_code(text))
    for line, match in lines_matching(r"`([^`\n]+)`", without_code(text)):
        if looks_like_path(match[1]) and not exists(root, document.parent, match[1]):
            yield f"{where}:{line}: `{match[1]}` does not exist"


def citation_complaints(root, file, known):
    """Sources cited in a file that the bibliography lacks."""
    for line, match in lines_matching(CITATION, file.read_text()):
        if match[1] not in known:
            yield f"{file.relative_to(root)}:{line}: [{match[1]}] is not in references.bib"


def complaints(root):
    """All that is wrong, as lines of `file:line: what`."""
    bibliography = root / "references.bib"
    known = set(re.findall(r"^@\w+\{(\w+),", bibliography.read_text(), flags=re.M))
    documents = tracked(root, "*.md")
    for document in documents:
        yield from document_complaints(root, document)
    for file in documents + tracked(root, "*.rs"):
        yield from citation_complaints(root, file, known)


def main():
    found = list(complaints(ROOT))
    print("\n".join(found) if found else "paths, links, symbols and sources named in documents exist")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
