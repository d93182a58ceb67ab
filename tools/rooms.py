"""Check that the method's files import only from their own floor or below.

    python3 tools/rooms.py

The order is written once: in the trees of ARCHITECTURE.md. The first line of a tree
is a folder of sources; each further line names a file, or a folder by a slash at its
end, then says what it holds. The tree of the method is ordered, top first: a folder
is a floor, and so is each run of files between two folders.

- What a tree names exists. The tree of the method names every file but tests.
- No import climbs.
- No circle of imports goes through two folders.

Read are `use` trees, and paths in code that begin with `crate`, `self`, `super`, a
child or an imported module; not comments, texts, and what is for tests alone.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DOCUMENT = "ARCHITECTURE.md"
METHOD = "crates/cdem/src"

TREE = re.compile(r"^```text\n(crates/[\w/-]+)\n(.*?)^```", flags=re.M | re.S)
BRANCH = re.compile(r"( *)([\w./-]+(?:, [\w./-]+)*)(?:  +.*)?")

# What is no code, so that names in it are no paths: comments, texts, characters.
NO_CODE = re.compile(
    r"//[^\n]*|/\*.*?\*/|\bb?r(#*)\".*?\"\1|\"(?:\\.|[^\"\\])*\"|'(?:\\[^\n']*'?|[^'\\\n])'",
    flags=re.S,
)
FOR_TESTS = re.compile(r"#\[cfg\(test\)\]\s*(?:#\[[^\]]*\]\s*)*")
USE = re.compile(r"\b(pub(?:\([^)]*\))?\s+)?use\s+([^;]+);")
CHILD = re.compile(r"\bmod\s+(\w+)\s*;")
PATH = re.compile(r"(?<![\w:$])\w+(?:::\w+)+")


def blanked(text):
    """As many spaces, and its line ends."""
    return re.sub(r"[^\n]", " ", text)


def end_of_item(code, start):
    """Where the item ends that begins at `start`."""
    depth = 0
    for place in range(start, len(code)):
        depth += {"{": 1, "}": -1}.get(code[place], 0)
        if depth == 0 and code[place] in ";}":
            return place + 1
    return len(code)


def production_code(text):
    """Rust code without comments, texts and tests; every place stays."""
    code = NO_CODE.sub(lambda found: blanked(found[0]), text)
    while found := FOR_TESTS.search(code):
        end = end_of_item(code, found.end())
        code = code[: found.start()] + blanked(code[found.start() : end]) + code[end:]
    return code


def used_paths(tree, place, above=()):
    """What a `use` tree at a place imports: path, name in the file, place."""
    depth, begin, parts = 0, 0, []
    for at, sign in enumerate(tree + ","):
        depth += {"{": 1, "}": -1}.get(sign, 0)
        if sign == "," and depth == 0:
            parts.append((begin, tree[begin:at]))
            begin = at + 1
    for begin, part in parts:
        head, brace, inner = part.partition("{")
        head, _, alias = head.partition(" as ")
        names = re.findall(r"\w+|\*", head)
        path = (*above, *names)
        if brace:
            inside = place + begin + part.index("{") + 1
            yield from used_paths(inner[: inner.rindex("}")], inside, path)
        elif names:
            path = path[:-1] if len(path) > 1 and path[-1] == "self" else path
            start = place + begin + len(part) - len(part.lstrip())
            yield path, alias.strip() or path[-1], start


class Module:
    """A file of a crate: its code, its children, and its `use` paths."""

    def __init__(self, file):
        self.file = file
        self.code = production_code(file.read_text())
        self.children = CHILD.findall(self.code)
        self.rest = USE.sub(lambda use: blanked(use[0]), self.code)
        self.uses = [
            (path, name, place, bool(use[1]))
            for use in USE.finditer(self.code)
            for path, name, place in used_paths(use[2], use.start(2))
        ]


class Crate:
    """The modules of a crate that are not for tests, by path, and what they import."""

    def __init__(self, source):
        self.modules = {}
        self.read((), source / "lib.rs")
        # Names that a module hands on, and where they come from.
        self.handed_on = {
            path: {
                name: self.absolute(path, used)
                for used, name, _, is_public in module.uses
                if is_public and self.absolute(path, used)
            }
            for path, module in self.modules.items()
        }

    def read(self, path, file):
        """Reads a module and those that it declares."""
        module = self.modules[path] = Module(file)
        folder = file.parent if file.name in ("lib.rs", "mod.rs") else file.with_suffix("")
        for child in module.children:
            nested = folder / child / "mod.rs"
            self.read((*path, child), nested if nested.is_file() else folder / f"{child}.rs")

    def absolute(self, module, path):
        """A path from the root of the crate; None where it leads out of the crate."""
        if path[0] in self.modules[module].children:
            return (*module, *path)
        if path[0] == "crate":
            return path[1:]
        base, rest = module, path
        while rest and rest[0] in ("self", "super"):
            base, rest = (base[:-1] if rest[0] == "super" else base), rest[1:]
        return (*base, *rest) if len(rest) < len(path) else None

    def module_of(self, path):
        """The longest beginning of a path that is a module."""
        while path not in self.modules:
            path = path[:-1]
        return path

    def origin(self, path):
        """The module in which the item of a path is defined."""
        module = self.module_of(path)
        name, rest = path[len(module) : len(module) + 1], path[len(module) + 1 :]
        source = self.handed_on[module].get(*name) if name else None
        return module if source is None else self.origin((*source, *rest))

    def imports(self, path):
        """What a module takes: path, line, and whether it is only handed on."""
        module = self.modules[path]
        known, found = {}, []
        for used, name, place, is_public in module.uses:
            used = self.absolute(path, used)
            if used is not None:
                known[name] = used
                handed_on = is_public and not re.search(rf"\b{name}\b", module.rest)
                found.append((used, place, handed_on))
        for match in PATH.finditer(module.rest):
            names = tuple(match[0].split("::"))
            used = self.absolute(path, names)
            if used is None and known.get(names[0]) in self.modules:
                used = (*known[names[0]], *names[1:])
            if used is not None:
                found.append((used, match.start(), False))
        for used, place, handed_on in found:
            yield used, module.code.count("\n", 0, place) + 1, handed_on
