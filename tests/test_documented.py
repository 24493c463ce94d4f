"""Every public function says what it does, and says something of every argument that is not plain from its type."""

import ast
from pathlib import Path

import pytest

import gsfdi

HOME = Path(gsfdi.__file__).parent
FILES = sorted(HOME.rglob("*.py"))


def functions(path: Path) -> list[tuple[str, ast.FunctionDef]]:
    """Public functions, and methods of public classes."""
    found = []
    for node in ast.parse(path.read_text()).body:
        members = node.body if isinstance(node, ast.ClassDef) and not node.name.startswith("_") else [node]
        found += [(one.name, one) for one in members if isinstance(one, ast.FunctionDef) and one.name[0] != "_"]
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(HOME)))
def test_every_argument_is_documented(path: Path) -> None:
    for name, function in functions(path):
        text = ast.get_docstring(function)
        assert text, f"{name} says nothing"
        assert text.split("\n")[0].rstrip().endswith((".", ":", "?")), f"{name}: {text.splitlines()[0]!r}"
        section = text.partition("Parameters\n----------\n")[2]
        if section:
            arguments = [one.arg for one in (*function.args.args, *function.args.kwonlyargs) if one.arg != "self"]
            told = {part.strip(" *") for line in section.splitlines() for part in line.partition(":")[0].split(",")}
            untold = [one for one in arguments if one not in told and f"`{one}`" not in text]
            assert untold == [], f"{name} does not tell of these"
