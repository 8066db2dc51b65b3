"""The structure of the package in figures, by room: code, modules, records, imports, circles, repeats.

``python benchmarks/structure.py [DIR]``: of the checkout in DIR, this one if not given.

Code lines are those without imports, docstrings, comments and blank lines; test lines are all lines.
"""

import ast
import io
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

PACKAGE = "leg_wear_monitor"
LONG_FILE, LONG_FUNCTION = 300, 60  # lines of code
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
    def room(self) -> str:
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
    """Sets of modules each of which reaches all others of its set."""
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


def main() -> None:
    """Print the figures of a checkout."""
    root = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1])
    modules = [module(path, root / PACKAGE) for path in sorted((root / PACKAGE).rglob("*.py"))]
    names = {each.name for each in modules}
    graph = {each.name: imported(each, names) for each in modules}
    rooms = sorted({each.room for each in modules}, key=lambda room: room.strip("_"))

    print(f"{'room':16}{'modules':>9}{'code':>8}{'records':>9}{'import lines':>14}")
    for room in [*rooms, ""]:
        inside = [each for each in modules if not room or each.room == room]
        sums = (sum(len(each.code) for each in inside), sum(map(records, inside)))
        imports = sum(len(each.imports) for each in inside)
        print(f"{room or 'all':16}{len(inside):9}{sums[0]:8}{sums[1]:9}{imports:14}")

    crossed = {(each.room, there.split(".")[0]) for each in modules for there in graph[each.name]}
    tests = [len(path.read_text(encoding="utf-8").splitlines()) for path in (root / "test").rglob("*.py")]
    long = [length(each, function) for each in modules for function in functions(each)]
    for what, value in (
        ("pairs of rooms with imports", sum(here != there for here, there in crossed)),
        ("circles of files", len(circles(graph))),
        ("files in circles", sum(map(len, circles(graph)))),
        ("functions whose body occurs elsewhere", repeats(modules)),
        (f"files over {LONG_FILE} lines of code", sum(len(each.code) > LONG_FILE for each in modules)),
        (f"functions over {LONG_FUNCTION} lines of code", sum(each > LONG_FUNCTION for each in long)),
        ("test lines", sum(tests)),
    ):
        print(f"{what:40}{value:8}")


if __name__ == "__main__":
    main()
