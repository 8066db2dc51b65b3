"""The structure of the package in figures: files a folder, long functions, index constants, imports, repeats.

``python benchmarks/structure.py [DIR]``: of the checkout in DIR, this one if not given.
"""

import ast
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

LONG = 40  # lines of a function
FULL = 12  # files of a folder
SMALLEST = 12  # nodes of a function's body that is looked for elsewhere


class Module(NamedTuple):
    """A source file and its syntax tree; ``name`` dotted, without the package's own."""

    name: str
    tree: ast.Module


def modules(package: Path) -> list[Module]:
    """All modules of a package."""
    return [
        Module(".".join(path.relative_to(package).with_suffix("").parts), ast.parse(path.read_text()))
        for path in sorted(package.rglob("*.py"))
    ]


def functions(module: Module) -> Iterator[ast.FunctionDef]:
    """Functions and methods of a module."""
    return (node for node in ast.walk(module.tree) if isinstance(node, ast.FunctionDef))


def body(function: ast.FunctionDef) -> list[ast.stmt]:
    """Statements of a function without its docstring."""
    return function.body[1:] if ast.get_docstring(function) else function.body


def lines(function: ast.FunctionDef) -> int:
    """Lines of a function's body without its docstring."""
    statements = body(function)
    return (statements[-1].end_lineno or 0) - statements[0].lineno + 1 if statements else 0


def constants(module: Module) -> Iterator[str]:
    """Names in capitals that a module sets to whole numbers."""
    for node in module.tree.body:
        if not isinstance(node, ast.Assign):
            continue
        value, target = node.value, node.targets[0]
        names = target.elts if isinstance(target, ast.Tuple) else [target]
        number = isinstance(value, ast.Constant) and type(value.value) is int
        counted = isinstance(value, ast.Call) and getattr(value.func, "id", "") == "range"
        listed = isinstance(value, ast.Tuple) and all(
            isinstance(each, ast.Constant) and type(each.value) is int for each in value.elts
        )
        if number or counted or listed:
            yield from (each.id for each in names if isinstance(each, ast.Name) and each.id.isupper())


def index_names(module: Module) -> set[str]:
    """Names that occur in a module's subscripts."""
    subscripts = (node.slice for node in ast.walk(module.tree) if isinstance(node, ast.Subscript))
    return {each.id for inner in subscripts for each in ast.walk(inner) if isinstance(each, ast.Name)}


def crossings(all_modules: list[Module], package: str) -> Counter[tuple[str, str]]:
    """Imports from one room into another."""
    found: Counter[tuple[str, str]] = Counter()
    for module in all_modules:
        for node in ast.walk(module.tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(f"{package}."):
                here, there = module.name.split(".")[0], (node.module or "").split(".")[1]
                if here != there:
                    found[here, there] += 1
    return found


def repeats(all_modules: list[Module]) -> Counter[str]:
    """Bodies of functions that occur more than once."""
    bodies: Counter[str] = Counter()
    for module in all_modules:
        for function in functions(module):
            statements = body(function)
            if sum(1 for each in statements for _ in ast.walk(each)) >= SMALLEST:
                bodies["\n".join(ast.dump(each) for each in statements)] += 1
    return Counter({text: count for text, count in bodies.items() if count > 1})


def main() -> None:
    """Print the figures of a checkout."""
    root = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1])
    package = root / "leg_wear_monitor"
    everything = modules(package)
    folders = Counter(path.parent.relative_to(package).as_posix() for path in package.rglob("[a-z]*.py"))
    fullest = ", ".join(f"{name} {count}" for name, count in folders.most_common(6))
    long = [lines(function) for module in everything for function in functions(module)]
    used = set().union(*(index_names(module) for module in everything))
    index = {f"{module.name}.{name}" for module in everything for name in constants(module) if name in used}
    crossed, repeated = crossings(everything, package.name), repeats(everything)
    sizes = [len(path.read_text().splitlines()) for path in package.rglob("*.py")]
    for what, value in (
        ("modules", len(everything)),
        ("folders", len(folders)),
        (f"folders of more than {FULL} files", sum(count > FULL for count in folders.values())),
        ("fullest folders", fullest),
        ("files over 250 lines", sum(size > 250 for size in sizes)),
        (f"functions over {LONG} lines", sum(each > LONG for each in long)),
        ("index constants", len(index)),
        ("imports across rooms", sum(crossed.values())),
        ("pairs of rooms with imports", len(crossed)),
        ("functions whose body occurs elsewhere", sum(repeated.values())),
    ):
        print(f"{what:40} {value}")


if __name__ == "__main__":
    main()
