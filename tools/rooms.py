"""Check that the files of the method import only from their own layer or from layers below.

    python3 tools/rooms.py

The order is written once: in ARCHITECTURE.md. A text block there that begins with a folder
of sources is a tree. Each other line names files, or a folder by a slash at its end, and
describes them. In the tree of the method, which names `lib`, folders are layers, top first,
and so are the parts of contact. Files between two folders form one layer.

- Each name in a tree exists, and a tree names every file below its folder but tests.
- No import climbs to a higher layer.
- No circle of imports goes through files of two folders.

An import is a path in a `use` tree, or one in code that begins with `crate`, `self`,
`super`, a child or an imported module. Tests are not read.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DOCUMENT = "ARCHITECTURE.md"
METHOD = "crates/cdem/src"

# Folders of the method whose lines stand in an order.
ORDERED = ("", "contact/")

TREE = re.compile(r"^```text\n(crates/\S+)\n(.*?)^```", flags=re.M | re.S)
BRANCH = re.compile(r"( *)([\w./-]+(?:, [\w./-]+)*)(?:  .*)?")

# Parts of the source without imported names: comments, visibilities, texts, characters.
NO_CODE = re.compile(
    r"//[^\n]*|/\*.*?\*/|\(in [\w:]+\)|\bb?r(#*)\".*?\"\1|\"(?:\\.|[^\"\\])*\"|'(?:\\[^\n']*'?|[^'\\\n])'",
    flags=re.S,
)
FOR_TESTS = re.compile(r"#\[cfg\(test\)\]\s*(?:#\[[^\]]*\]\s*)*")
USE = re.compile(r"\b(pub(?:\([^)]*\))?\s+)?use\s+([^;]+);")
CHILD = re.compile(r"\bmod\s+(\w+)\s*;")
PATH = re.compile(r"(?<![\w:])\w+(?:::\w+)+")


def blanked(text):
    """As many spaces, and its line ends."""
    return re.sub(r"[^\n]", " ", text)


def end_of_item(code, start):
    """Where the item ends that begins at `start`."""
    depth = 0
    for place in range(start, len(code)):
        depth += (code[place] in "([{") - (code[place] in ")]}")
        if depth == 0 and code[place] in ";}":
            return place + 1
    return len(code)


def production_code(text):
    """Rust code without comments, texts and tests; places stay."""
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
    """The modules of a crate by path, but for tests, and what they import."""

    def __init__(self, source):
        self.modules = {}
        self.read((), source / "lib.rs")
        # The names that a module hands on, and where each comes from.
        self.handed_on = {
            path: {
                name: self.absolute(path, used)
                for used, name, _, is_public in module.uses
                if is_public and self.absolute(path, used) is not None
            }
            for path, module in self.modules.items()
        }
        self.imports = {path: list(self.imports_of(path)) for path in self.modules}

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
        """The module that defines the item of a path."""
        module = self.module_of(path)
        name, rest = path[len(module) : len(module) + 1], path[len(module) + 1 :]
        source = self.handed_on[module].get(*name) if name else None
        return module if source is None else self.origin((*source, *rest))

    def imports_of(self, path):
        """What a module imports: path, line, and whether it is only handed on."""
        module = self.modules[path]
        known, found = {}, []
        for used, name, place, is_public in module.uses:
            used = self.absolute(path, used)
            if used is not None:
                known[name] = used
                handed_on = is_public and not re.search(rf"\b{re.escape(name)}\b", module.rest)
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


def branches(document):
    """The names in all trees of a text: tree, path in its folder, and line."""
    for tree in TREE.finditer(document):
        first = document.count("\n", 0, tree.start(2)) + 1
        folders = []
        for line, text in enumerate(tree[2].splitlines(), first):
            branch = BRANCH.fullmatch(text)
            if branch is None:
                yield tree, None, line
                continue
            del folders[len(branch[1]) // 2 - 1 :]
            above = "".join(folders)
            yield from ((tree, above + name, line) for name in branch[2].split(", "))
            folders.append(branch[2])


def files_of(source, path):
    """The files and folders that a path of a tree may mean."""
    if path.endswith("/"):
        return [source / path]
    return [source / path, source / f"{path}.rs", source / path / "mod.rs"]


class Layers:
    """The layers of the method's files, 0 on top, and their names."""

    def __init__(self, paths):
        self.layer, self.known = {}, set(paths)
        for folder in ORDERED:
            number, was_file = -1, False
            names = (path.removeprefix(folder) for path in paths if path.startswith(folder))
            for name in (name for name in names if name and "/" not in name[:-1]):
                is_file = not name.endswith("/")
                number += not (is_file and was_file)
                was_file = is_file
                self.layer[folder + name] = number

    def of(self, module):
        """Layer of a module, from the crate down, and its name; None where no tree has it."""
        if not module:
            return ((self.layer["lib"],), "lib") if "lib" in self.layer else None
        layers, folder = [], ""
        for name in module:
            path = next((p for p in (f"{folder}{name}/", folder + name) if p in self.known), None)
            if path is None:
                return None
            if folder in ORDERED:
                layers.append(self.layer[path])
                ordered = path
            folder = path
        if folder in ORDERED:
            layers.append(self.layer.get(folder + "mod", 0))
        return tuple(layers), ordered.rstrip("/")


def circle_complaints(crate, where):
    """Circles of imports through files of two folders."""
    imports = {
        path: {crate.origin(used) for used, _, handed_on in crate.imports[path] if not handed_on}
        for path in crate.modules
    }
    reached = {path: reached_from(path, imports) for path in imports}
    files = [module.file for module in crate.modules.values()]
    done = set()
    for path in imports:
        circle = [other for other in reached[path] if path in reached[other]]
        of_circle = sorted(crate.modules[other].file for other in circle)
        folders = {folder_of(file, files) for file in of_circle}
        if len(folders) > 1 and done.isdisjoint(circle):
            names = ", ".join(where(file) for file in of_circle[1:])
            yield f"{where(of_circle[0])}:1: imports go in a circle through two folders, with {names}"
        done.update(circle)


def reached_from(path, imports):
    """The modules that a module imports, itself or through others."""
    reached, ahead = set(), [path]
    while ahead:
        new = imports[ahead.pop()] - reached
        reached |= new
        ahead += new
    return reached


def folder_of(file, files):
    """The folder of a file; one with nothing else in it is its file."""
    is_alone = not any(other.is_relative_to(file.parent) for other in files if other != file)
    return file.parent.parent if is_alone else file.parent


def climbing_complaints(crate, layers, where):
    """Imports from a higher layer."""
    for path, module in crate.modules.items():
        own = layers.of(path)
        if own is None:
            continue
        climbs = {}
        for used, line, _ in crate.imports[path]:
            for other in {crate.module_of(used), crate.origin(used)}:
                layer = layers.of(other)
                if layer and layer[0] < own[0]:
                    climbs.setdefault(layer[1], []).append((line, used[-1] if used else "crate"))
        for room, names in climbs.items():
            line = min(line for line, _ in names)
            taken = ", ".join(sorted({name for _, name in names}))
            yield f"{where(module.file)}:{line}: {own[1]} imports from {room}, which is above it: {taken}"


def complaints(root):
    """All that is wrong, as lines of `file:line: what`."""
    def where(file):
        return file.relative_to(root).as_posix()

    trees = {}
    for tree, path, line in branches((root / DOCUMENT).read_text()):
        if path is None:
            yield f"{DOCUMENT}:{line}: this line of the tree cannot be read"
        elif not any(file.exists() for file in files_of(root / tree[1], path)):
            yield f"{DOCUMENT}:{line}: {tree[1]}/{path} does not exist"
        else:
            trees.setdefault(tree, []).append(path)
    paths = next((paths for tree, paths in trees.items() if tree[1] == METHOD and "lib" in paths), None)
    if paths is None:
        yield f"{DOCUMENT}:1: no tree of {METHOD} names lib"
        return
    crate, layers = Crate(root / METHOD), Layers(paths)
    for path, module in crate.modules.items():
        if layers.of(path) is None:
            yield f"{where(module.file)}:1: the tree of {DOCUMENT} does not have this file"
    climbing = list(climbing_complaints(crate, layers, where))
    # An import that climbs mostly closes a circle, which says less.
    yield from climbing or circle_complaints(crate, where)


def main():
    found = list(complaints(ROOT))
    print("\n".join(found) if found else "files of the method import from their own layer or below")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
