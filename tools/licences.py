"""Check that every crate we build with may be used under a licence we accept.

    python3 tools/licences.py

Reads `cargo metadata` (dependencies of all kinds, all platforms). A crate
passes when its SPDX expression can be satisfied with the licences below.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

ACCEPTED = {
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MIT-0",
    "MPL-2.0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
}


def accepted(expression):
    """Whether an SPDX expression can be satisfied with `ACCEPTED`.

    `A/B`, the old spelling of `A OR B`, is understood. Raises ValueError when
    the expression cannot be read.
    """
    text = re.sub(r"\s+WITH\s+", " WITH ", expression.replace("/", " OR "))
    tokens = re.findall(r"\(|\)|\bOR\b|\bAND\b|[\w.+-]+(?: WITH [\w.-]+)?", text)

    def one():
        if not tokens:
            raise ValueError(f"licence expression ends early: {expression!r}")
        token = tokens.pop(0)
        if token == "(":
            value = alternatives()
            if not tokens or tokens.pop(0) != ")":
                raise ValueError(f"no closing parenthesis in licence expression: {expression!r}")
            return value
        if token in (")", "OR", "AND"):
            raise ValueError(f"unexpected {token!r} in licence expression: {expression!r}")
        return token in ACCEPTED

    def conjunction():
        value = one()
        while tokens and tokens[0] == "AND":
            tokens.pop(0)
            value = one() and value
        return value

    def alternatives():
        value = conjunction()
        while tokens and tokens[0] == "OR":
            tokens.pop(0)
            value = conjunction() or value
        return value

    value = alternatives()
    if tokens:
        raise ValueError(f"unexpected {tokens[0]!r} in licence expression: {expression!r}")
    return value


def complaint(package):
    """What is wrong with the licence of one package, or None."""
    name = f"{package['name']} {package['version']}"
    expression = package["license"]
    if not expression:
        return f"{name}: its manifest names no licence"
    try:
        return None if accepted(expression) else f"{name}: {expression} is not accepted"
    except ValueError as error:
        return f"{name}: {error}"


def main():
    root = Path(__file__).resolve().parent.parent
    metadata = subprocess.run(
        ["cargo", "metadata", "--format-version=1", "--locked"],
        cwd=root, check=True, capture_output=True, text=True,
    )
    packages = json.loads(metadata.stdout)["packages"]
    complaints = sorted(filter(None, map(complaint, packages)))
    if complaints:
        print("Replace these crates, or add a licence to tools/licences.py if it has no copyleft:")
        print("\n".join(f"  {line}" for line in complaints))
        return 1
    print(f"{len(packages)} crates, all under accepted licences")
    return 0


if __name__ == "__main__":
    sys.exit(main())
