"""The size and structure of the package: code lines, modules, records, imports, circles, repeats.

``python benchmarks/structure.py [DIR]`` prints the values of the checkout in DIR, this one by default.
``--check`` compares the sizes with the budgets in ``pyproject.toml`` and names each one that is exceeded.
It also names each inner module that a test in ``test/doors`` uses.
``--lower`` lowers each budget to the present size, rounded up by at most 1 %; it never raises a budget.

Code lines exclude imports, docstrings, comments and blank lines. Test lines are all lines.
"""

import argparse
import ast
import io
import re
import sys
import tokenize
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

PACKAGE = "leg_wear_monitor"
LONG_FUNCTION = 60  # lines of code
SMALLEST = 12  # nodes of a function's body that is looked for elsewhere

_KINDS = "COMMENT", "NL", "NEWLINE", "INDENT", "DEDENT", "ENDMARKER"
_LAYOUT = {getattr(tokenize, kind) for kind in _KINDS}


class Module(NamedTuple):
    """A source file: dotted name without the package's own, numbers of the lines of code and of imports."""

    name: str
    tree: ast.Module
    code: set[int]
    imports: set[int]

    @property
    def package(self) -> str:
        """Folder or file at the top of the package."""
        return self.name.split(".")[0]


def module(path: Path, package: Path) -> Module:
    """A source file, parsed."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    name = ".".join(path.relative_to(package).with_suffix("").parts).removesuffix(".__init__")
    said, imports = set[int](), set[int]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            imports.update(lines_of(node))
        elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            said.update(lines_of(node.body[0]))
    code = set[int]()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _LAYOUT:
            code.update(range(token.start[0], token.end[0] + 1))
    return Module(name, tree, code - said - imports, imports)


def lines_of(node: ast.stmt) -> range:
    """Numbers of a statement's lines."""
    return range(node.lineno, (node.end_lineno or node.lineno) + 1)


def records(of: Module) -> int:
    """Classes whose fields are declared: attrs, dataclasses, named tuples, typed dictionaries."""
    classes = [node for node in ast.walk(of.tree) if isinstance(node, ast.ClassDef)]
    return sum(
        any("attrs." in (text := ast.unparse(each)) or "dataclass" in text for each in one.decorator_list)
        or any(ast.unparse(base) in ("NamedTuple", "TypedDict") for base in one.bases)
        for one in classes
    )


def inner_names(path: Path, tests: Path, packages: set[str], seen: set[Path]) -> Iterator[str]:
    """Inner modules that a test file, or a helper in ``tests`` that it imports, names in imports or texts."""
    seen.add(path)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        found: list[str] = []
        if isinstance(node, ast.Import):
            found = [each.name for each in node.names]
        elif isinstance(node, ast.ImportFrom):
            found = [node.module or "", *(f"{node.module}.{each.name}" for each in node.names)]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found = [node.value]  # as monkeypatch takes it
        for each in found:
            if each.startswith(f"{PACKAGE}.") and each.split(".")[1] in packages:
                yield f"{path.relative_to(tests)}: {each}"
            helper = tests / f"{each}.py"
            if not isinstance(node, ast.Constant) and helper.exists() and helper not in seen:
                yield from inner_names(helper, tests, packages, seen)


def is_public(path: Path, tests: Path, packages: set[str]) -> bool:
    """True if a test file, its helpers and the conftests of its folder use public names only."""
    seen = set[Path]()
    around = [each / "conftest.py" for each in path.parents if tests in each.parents]
    files = [path, *(each for each in around if each.exists())]
    return not any(found for each in files for found in inner_names(each, tests, packages, seen))


def functions(of: Module) -> Iterator[ast.FunctionDef]:
    """Functions and methods of a module."""
    return (node for node in ast.walk(of.tree) if isinstance(node, ast.FunctionDef))


def body(function: ast.FunctionDef) -> list[ast.stmt]:
    """Statements of a function without its docstring."""
    return function.body[1:] if ast.get_docstring(function) else function.body


def length(of: Module, function: ast.FunctionDef) -> int:
    """Lines of code of a function's body."""
    return len(of.code & {line for each in body(function) for line in lines_of(each)})


def imported(of: Module, names: set[str]) -> set[str]:
    """Modules that a module imports anywhere, for types as well."""
    found = set[str]()
    for node in ast.walk(of.tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == PACKAGE:
            home = (node.module or "")[len(PACKAGE) + 1 :]
            for each in node.names:
                inner = f"{home}.{each.name}".strip(".")
                found.add(inner if inner in names else home)
    return found & names - {of.name}


def circles(graph: dict[str, set[str]]) -> list[set[str]]:
    """Sets of modules in which each module reaches all other modules of the set."""
    reached: dict[str, set[str]] = {}
    for start in graph:
        seen, left = set[str](), [start]
        while left:
            new = graph[left.pop()] - seen
            seen |= new
            left += new
        reached[start] = seen
    found = [{other for other in seen if start in reached[other]} for start, seen in reached.items()]
    return [each for k, each in enumerate(found) if each and each not in found[:k]]


def repeats(modules: list[Module]) -> int:
    """Functions whose body occurs more than once."""
    bodies: Counter[str] = Counter()
    for each in modules:
        for function in functions(each):
            statements = body(function)
            if sum(1 for one in statements for _ in ast.walk(one)) >= SMALLEST:
                bodies["\n".join(map(ast.dump, statements))] += 1
    return sum(count for count in bodies.values() if count > 1)


def sizes(root: Path, modules: list[Module]) -> dict[str, int]:
    """Everything that has a budget: code lines per package, and of all; modules; test lines."""
    found: Counter[str] = Counter()
    for each in modules:
        found[each.package] += len(each.code)
    tests = [len(path.read_text(encoding="utf-8").splitlines()) for path in (root / "test").rglob("*.py")]
    return {**found, "all": found.total(), "modules": len(modules), "test_lines": sum(tests)}


def check(found: dict[str, int], settings: Path) -> None:
    """End with one line per size over its budget; a package without an entry has a budget of 0."""
    budgets = tomllib.loads(settings.read_text(encoding="utf-8"))["tool"]["leg_wear_monitor"]["budgets"]
    over = [(name, size, budgets.get(name, 0)) for name, size in found.items() if size > budgets.get(name, 0)]
    if over:
        sys.exit(
            "\n".join(
                f"{settings.name}: {name}: {size} is over the budget of {limit}" for name, size, limit in over
            )
        )


def lower(found: dict[str, int], settings: Path) -> None:
    """Lower each budget to the present size; a package that has gone loses its entry."""

    def entry(match: re.Match[str]) -> str:
        size = found.get(match[1], 0)
        return f"{match[1]} = {min(int(match[2]), size + size // 100)}\n" if size else ""

    before, title, rest = settings.read_text(encoding="utf-8").partition("[tool.leg_wear_monitor.budgets]\n")
    section, end, after = rest.partition("\n[")
    section = re.sub(r"^(\w+) = (\d+)\n", entry, section, flags=re.MULTILINE)
    settings.write_text(before + title + section + end + after, encoding="utf-8")


def main() -> None:
    """Print the values of a checkout, or compare them with the budgets."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("root", nargs="?", type=Path, default=Path(__file__).parents[1], metavar="DIR")
    options.add_argument("--check", action="store_true", help="compare the sizes with the budgets")
    options.add_argument("--lower", action="store_true", help="lower the budgets to the present sizes")
    given = options.parse_args()
    root = given.root
    modules = [module(path, root / PACKAGE) for path in sorted((root / PACKAGE).rglob("*.py"))]
    found = sizes(root, modules)
    if given.lower:
        lower(found, root / "pyproject.toml")
    packages = {each.package for each in modules}
    tests, doors = root / "test", root / "test" / "doors"
    if given.check:
        check(found, root / "pyproject.toml")
        seen = set[Path]()
        inner = [
            name for path in sorted(doors.glob("*.py")) for name in inner_names(path, tests, packages, seen)
        ]
        if inner:
            sys.exit(
                "\n".join(f"{name}: is not public. Expected public names in test/doors." for name in inner)
            )
    if given.check or given.lower:
        return

    names = {each.name for each in modules}
    graph = {each.name: imported(each, names) for each in modules}
    print(f"{'package':16}{'modules':>9}{'code':>8}{'records':>9}{'import lines':>14}")
    for package in [*sorted(packages, key=lambda name: name.strip("_")), ""]:
        inside = [each for each in modules if not package or each.package == package]
        sums = (sum(len(each.code) for each in inside), sum(map(records, inside)))
        imports = sum(len(each.imports) for each in inside)
        print(f"{package or 'all':16}{len(inside):9}{sums[0]:8}{sums[1]:9}{imports:14}")

    files = sorted(tests.rglob("test_*.py"))
    crossed = {(each.package, there.split(".")[0]) for each in modules for there in graph[each.name]}
    long = [length(each, function) for each in modules for function in functions(each)]
    for what, value in (
        ("pairs of packages with imports", sum(here != there for here, there in crossed)),
        ("circles of files", len(circles(graph))),
        ("files in circles", sum(map(len, circles(graph)))),
        ("functions whose body occurs elsewhere", repeats(modules)),
        (f"functions over {LONG_FUNCTION} lines of code", sum(each > LONG_FUNCTION for each in long)),
        ("test lines", found["test_lines"]),
        ("test files", len(files)),
        ("test files that use public names only", sum(is_public(path, tests, packages) for path in files)),
    ):
        print(f"{what:40}{value:8}")


if __name__ == "__main__":
    main()
