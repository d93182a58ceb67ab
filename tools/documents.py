"""Check that documents tell the truth about the tree they lie in.

    python3 tools/documents.py

- Every relative link in a Markdown file leads to a file (and heading) that exists.
- Every path written as `code` in a Markdown file exists. A path is a span with
  a slash or a file ending, and nothing else in it; what users and runs make
  (`scene.toml`, `history.csv`, `DIR/frames/`) is not in the tree and not checked.
- Every source cited in Rust or Markdown as [Name2015] is in references.bib.
"""

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
    print("\n".join(found) if found else "paths, links and sources named in documents exist")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
