"""Write the book's page on the package for Python from its docstrings.

    python3 tools/python_reference.py            # writes book/src/reference/python.md
    python3 tools/python_reference.py --check    # fails if the page is not up to date

Reads the sources in crates/cdem-py/python/cdem; nothing needs to be built.
"""

import ast
import inspect
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "crates/cdem-py/python/cdem"
PAGE = ROOT / "book/src/reference/python.md"

# Names in the order of the page: all that the package exports.
SECTIONS = {
    "Scenes": ["Scene", "Table", "Tables", "Mesh"],
    "Simulations": ["Simulation", "Block", "Contacts", "Cells"],
    "Results": ["read_results", "Results", "Frames"],
    "Errors": ["Error", "SceneError", "MeshError", "StepError", "ResultsError"],
}

HEAD = """\
# The package for Python

Made from the docstrings of the package by `tools/python_reference.py`.
[The tutorial](../tutorials/python.md) shows their use. [The scene, key by key](scene.md) lists
the keys of scenes, and [Result files](results.md) the columns of tables. Units are SI.
"""


def definitions():
    """Classes and functions of the package, by name."""
    found = {}
    for source in sorted(SOURCES.glob("*.py")):
        for node in ast.parse(source.read_text()).body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and not node.name.startswith("_"):
                found[node.name] = node
    return found


def exported():
    """Names in `__all__`."""
    for node in ast.parse((SOURCES / "__init__.py").read_text()).body:
        if isinstance(node, ast.Assign) and node.targets[0].id == "__all__":
            return set(ast.literal_eval(node.value))
    raise ValueError("the package has no __all__")


def text_of(node):
    """A docstring as Markdown; arguments, `name: meaning`, become a list."""
    lines = []
    for line in (ast.get_docstring(node) or "").splitlines():
        name, colon, _ = line.partition(": ")
        is_argument = colon and name.isidentifier() and name in argument_names(node)
        lines.append(f"- `{name}`: {line.partition(': ')[2]}" if is_argument else line.replace("    ", "  "))
    return "\n".join(lines)


def argument_names(node):
    """Names of the arguments of a function."""
    if not isinstance(node, ast.FunctionDef):
        return ()
    arguments = node.args
    return [a.arg for a in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)]


def signature(name, function, is_method):
    """A call with names and defaults, without types."""
    arguments = ast.unparse(ast.fix_missing_locations(_untyped(function.args)))
    parts = [part for part in arguments.split(", ") if part not in ("/",)]
    if is_method:
        parts = parts[1:]
    return f"{name}({', '.join(parts)})"


def _untyped(arguments):
    """Arguments without their types."""
    copy = ast.parse(f"def f({ast.unparse(arguments)}): ...").body[0].args
    everything = [*copy.posonlyargs, *copy.args, *copy.kwonlyargs, copy.vararg, copy.kwarg]
    for argument in filter(None, everything):
        argument.annotation = None
    return copy


def decorators(function):
    """Names of the decorators of a function."""
    return {ast.unparse(decorator) for decorator in function.decorator_list}


def members(node):
    """Heading and text of the public members of a class."""
    body = node.body
    for member, after in zip(body, [*body[1:], None], strict=True):
        if isinstance(member, ast.AnnAssign) and not member.target.id.startswith("_"):
            yield f"{node.name}.{member.target.id}", _attribute_text(after)
        elif isinstance(member, ast.FunctionDef) and not member.name.startswith("_"):
            marks = decorators(member)
            if "overload" in marks or any(mark.endswith(".setter") for mark in marks):
                continue
            name = f"{node.name}.{member.name}"
            if "property" not in marks:
                name = signature(name, member, is_method="staticmethod" not in marks)
            yield name, text_of(member)


def _attribute_text(after):
    """The string after an attribute."""
    is_text = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
    return inspect.cleandoc(after.value.value) if is_text else ""


def entry(node):
    """The part of the page on a class or function."""
    if isinstance(node, ast.FunctionDef):
        yield f"### `{signature(node.name, node, is_method=False)}`\n\n{text_of(node)}\n"
        return
    made = [m for m in node.body if isinstance(m, ast.FunctionDef) and m.name == "__init__"]
    is_made_by_users = bool(made) and bool(ast.get_docstring(made[0]))
    call = signature(node.name, made[0], is_method=True) if is_made_by_users else node.name
    yield f"### `{call}`\n\n{text_of(node)}\n"
    if is_made_by_users:
        yield f"{text_of(made[0])}\n"
    for name, text in members(node):
        yield f"#### `{name}`\n\n{text}\n" if text else f"#### `{name}`\n"


def page():
    """The whole page."""
    found, parts = definitions(), [HEAD]
    listed = {name for names in SECTIONS.values() for name in names}
    if listed != exported():
        raise ValueError(f"the page and __all__ differ: {sorted(listed ^ exported())}")
    for section, names in SECTIONS.items():
        parts.append(f"## {section}\n")
        for name in names:
            parts.extend(entry(found[name]))
    return "\n".join(parts)


def main():
    text = page()
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(text)
        return 0
    if not PAGE.is_file() or PAGE.read_text() != text:
        print("book/src/reference/python.md is not up to date: run tools/python_reference.py")
        return 1
    print("the page on Python is up to date")
    return 0


if __name__ == "__main__":
    sys.exit(main())
