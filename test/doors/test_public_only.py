"""The tests in this folder see the package as its users do: public names, the command line, files."""

import ast
from collections.abc import Iterator
from pathlib import Path

ROOM = Path(__file__).parent
PACKAGE = "leg_wear_monitor"


def inner(path: Path, seen: set[Path]) -> Iterator[str]:
    """Inner modules that a file and the helpers of the tests that it imports name."""
    seen.add(path)
    for node in ast.walk(ast.parse(path.read_text())):
        names = [each.name for each in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            names = [node.value] if node.value.replace(".", "").isidentifier() else []
        for name in names:
            if name.startswith(f"{PACKAGE}."):
                yield f"{path.name}: {name}"
            helper = ROOM.parent / f"{name}.py"
            if not isinstance(node, ast.Constant) and helper.exists() and helper not in seen:
                yield from inner(helper, seen)


def test_they_import_public_names_only() -> None:
    seen: set[Path] = set()
    assert [found for path in sorted(ROOM.glob("*.py")) for found in inner(path, seen)] == []
    assert len(seen) > len(list(ROOM.glob("*.py")))  # a helper was looked into as well


def test_an_inner_name_is_found(tmp_path: Path) -> None:
    for line in (f"from {PACKAGE}.twin import kinds", f"import {PACKAGE}.twin", f"x = '{PACKAGE}.twin'"):
        (tmp_path / "one.py").write_text(line)
        assert len(list(inner(tmp_path / "one.py", set()))) == 1
