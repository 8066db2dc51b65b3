"""Kernels: compilation, cache, records."""

import ast
import math
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.errors import NumbaError

import leg_wear_monitor
from leg_wear_monitor.compiled import kernel as whole_program
from leg_wear_monitor.compiled.kernel import (
    ByAddress,
    cache_directory,
    entry,
    kernel,
    new_records,
    record_of,
)

# The cache of compiled code: it works wherever the package lies, and is never stale.


LEAF = (
    "from leg_wear_monitor.compiled.kernel import kernel\n@kernel\ndef slope(x):\n    return {factor} * x\n"
)
ROOT = """from leg_wear_monitor.compiled.kernel import entry
{line}
@entry
def line(x):
    return slope(x) + 1.0
"""
DIRECT = "from leg_wear_monitor.leaf import slope"
SCRIPT = """
import importlib, sys
from leg_wear_monitor.compiled.kernel import at_compilation, cache_directory
at_compilation.append(lambda: print("compiling", end=" ", file=sys.stderr))
for root in {roots}:
    line = importlib.import_module(f"leg_wear_monitor.{{root}}").line
    print(line(2.0), len(line.stats.cache_hits))
print(cache_directory())
"""


class Package:
    """A package with our compiled/, a kernel, and entries that call it, each in a module of its own."""

    def __init__(self, directory: Path, **lines: str) -> None:
        self.directory = directory / "leg_wear_monitor"
        self.directory.mkdir()
        (self.directory / "__init__.py").write_text("")
        (self.directory / "compiled").mkdir()
        for name in ("errors", "compiled/__init__", "compiled/cache", "compiled/kernel"):
            shutil.copy(Path(leg_wear_monitor.__file__).parent / f"{name}.py", self.directory / f"{name}.py")
        self.roots = lines or {"root": DIRECT}
        for name, line in self.roots.items():
            (self.directory / f"{name}.py").write_text(ROOT.format(line=line))
        self.write(2.0)

    def write(self, factor: float) -> None:
        (self.directory / "leaf.py").write_text(LEAF.format(factor=factor))

    def run_all(self, **environment: str) -> tuple[dict[str, tuple[str, str]], str]:
        """In a fresh process: by entry the value, 1 if its code came from the cache or 0; that directory."""
        unset = ("NUMBA_", "XDG_", "COV_", "PYTHONPATH")
        kept = {key: value for key, value in os.environ.items() if not key.startswith(unset)}
        kept |= {"PYTHONPATH": str(self.directory.parent), "PYTHONDONTWRITEBYTECODE": "1", **environment}
        command, where = [sys.executable, "-c", SCRIPT.format(roots=[*self.roots])], self.directory.parent
        done = subprocess.run(command, env=kept, cwd=where, text=True, capture_output=True, check=True)
        *lines, home = done.stdout.splitlines()
        found = {name: tuple(line.split()) for name, line in zip(self.roots, lines, strict=True)}
        assert ("compiling" in done.stderr) == any(hits == "0" for _, hits in found.values())
        return found, home

    def run(self, **environment: str) -> list[str]:
        """Of its one entry."""
        found, home = self.run_all(**environment)
        return [*found["root"], home]


@pytest.fixture
def package(tmp_path):
    return Package(tmp_path)


@pytest.fixture
def home(tmp_path):
    return {"HOME": str(tmp_path / "home")}


@pytest.fixture
def nowhere(tmp_path):
    """A home that nobody can write to, root neither: it is a file."""
    (tmp_path / "file").write_text("")
    return str(tmp_path / "file")


def test_a_second_process_does_not_compile_nor_does_a_copy_of_the_same_code(package, home, tmp_path):
    """So a checkout and the package that was installed from it compile once; neither is written to.

    What no code depends on is another comment, another function of the file, another place in it.
    """
    before = sorted(package.directory.rglob("*"))
    package.directory.chmod(0o555)
    try:
        assert package.run(**home)[:2] == ["5.0", "0"]
        value, hits, here = package.run(**home)
    finally:
        package.directory.chmod(0o755)
    assert (value, hits) == ("5.0", "1")
    assert Path(here).is_relative_to(tmp_path / "home" / ".cache" / "leg_wear_monitor")
    assert sorted(package.directory.rglob("*")) == before
    (tmp_path / "copy").mkdir()
    copy = Package(tmp_path / "copy")
    assert copy.run(**home) == ["5.0", "1", here]
    leaf = copy.directory / "leaf.py"
    leaf.write_text(f"# a comment\nOTHER = 1\ndef other():\n    return OTHER\n{leaf.read_text()}")
    assert copy.run(**home)[:2] == ["5.0", "1"]
    copy.write(3.0)
    value, hits, there = copy.run(**home)
    assert (value, hits) == ("7.0", "0")
    assert there != here


@pytest.mark.skipif(platform.machine() != "x86_64", reason="machine code is carried for x86-64 alone")
def test_machine_code_in_the_package_is_used_if_the_processor_can_run_it(package, tmp_path, monkeypatch):
    baseline = {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": ""}
    assert package.run(NUMBA_CACHE_DIR=str(tmp_path / "built"), **baseline)[:2] == ["5.0", "0"]
    shipped = package.directory / "compiled" / "machine_code"
    (tmp_path / "built" / "leg_wear_monitor").rename(shipped)
    value, hits, there = package.run(NUMBA_CACHE_DIR=str(tmp_path / "fresh"))
    assert (value, hits) == ("5.0", "1")
    assert not [*Path(there).parent.rglob("*.nbc")]
    package.write(3.0)
    assert package.run(NUMBA_CACHE_DIR=str(tmp_path / "fresh"))[:2] == ["7.0", "0"]

    monkeypatch.setattr(whole_program, "SHIPPED", shipped)
    (name,) = {each.name for each in shipped.glob("root.line-*")}
    for features, directory in (
        ({}, None),
        (dict.fromkeys(whole_program._BASELINE_FEATURES, True), shipped / name),
    ):
        monkeypatch.setattr("llvmlite.binding.get_host_cpu_features", lambda have=features: have)
        whole_program.shipped_directory.cache_clear()
        assert whole_program.shipped_directory(name) == directory
    whole_program.shipped_directory.cache_clear()


def test_without_a_writable_home_the_temporary_directory_does(package, tmp_path, nowhere):
    (tmp_path / "tmp").mkdir()
    where = package.run(HOME=nowhere, XDG_CACHE_HOME=nowhere, TMPDIR=str(tmp_path / "tmp"))[2]
    assert Path(where).is_relative_to(tmp_path / "tmp")
    assert list(Path(where).parent.rglob("*.nbi"))


@pytest.mark.parametrize("variable", ["NUMBA_CACHE_DIR", "XDG_CACHE_HOME"])
def test_a_directory_that_is_asked_for_is_used(package, tmp_path, nowhere, variable):
    where = package.run(**{"HOME": nowhere, variable: str(tmp_path / "asked")})[2]
    assert Path(where).is_relative_to(tmp_path / "asked")


def test_an_entry_follows_what_it_imports_however_and_nothing_else(tmp_path, home):
    """Numba by itself looks at the file of the caller only, and would go on with the old kernel.

    Compiling takes a minute: only what a change can reach is compiled again.
    """
    package = Package(
        tmp_path,
        direct=DIRECT,
        attribute="from leg_wear_monitor import leaf\nimport leg_wear_monitor.compiled.kernel as k\n"
        "slope = k.kernel(lambda x: leaf.slope(x))",
        constant="from leg_wear_monitor.frozen import slope",
        other="from leg_wear_monitor.island import slope",
    )
    number = "from leg_wear_monitor.numbers import FACTOR\n"
    (package.directory / "frozen.py").write_text(number + LEAF.format(factor="FACTOR"))
    (package.directory / "island.py").write_text(LEAF.format(factor=2.0))
    numbers = package.directory / "numbers.py"
    numbers.write_text("FACTOR = 2.0\n")
    assert package.run_all(**home)[0] == dict.fromkeys(package.roots, ("5.0", "0"))
    package.write(3.0)
    numbers.write_text("FACTOR = 3.0\n")
    changed = dict.fromkeys(package.roots, ("7.0", "0"))
    assert package.run_all(**home)[0] == changed | {"other": ("5.0", "1")}


def line_of(inner, by=2.0):
    """A function that stands for an entry before it is compiled."""

    def line(x):
        return inner(x) * by + FACTOR

    return line


FACTOR: object = 2.0


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (2.0, 2), (2.0, np.nextafter(2.0, 3.0)), (np.array([1.0, 2.0]), np.array([1.0, 3.0])),
        ((1, (2.0,)), (1, (3.0,))), (np.dtype([("a", float)]), np.dtype([("a", float), ("b", int)])),
        (math.sin, math.cos), (np.float32(1.0), np.float64(1.0)), (True, 1),
    ],
)  # fmt: skip
def test_a_constant_of_another_value_or_type_is_other_code(monkeypatch, one, other):
    def directory(value):
        monkeypatch.setitem(globals(), "FACTOR", value)
        return cache_directory(line_of(math.sin))

    assert directory(one) == directory(one) != directory(other)


def test_what_is_around_a_function_and_its_defaults_are_in_its_digest():
    found = [cache_directory(line_of(inner, by)) for inner in (math.sin, math.cos) for by in (1.0, 2.0)]
    assert len({*found}) == 4


def test_a_constant_of_an_unknown_kind_is_refused(monkeypatch):
    """Code that depends on what the digest does not cover could become stale."""
    monkeypatch.setitem(globals(), "FACTOR", {"a": 1.0})
    with pytest.raises(TypeError, match="a change of it would not be seen"):
        cache_directory(line_of(math.sin))


def test_a_kernel_that_allocates_is_refused():
    """It would count references in every step, too."""

    @kernel
    def greedy(n):
        return np.zeros(n).sum()

    with pytest.raises(NumbaError):
        greedy(3)


def _decorators(node):
    """Names of the decorators of a function."""
    return {one.id for one in getattr(node, "decorator_list", ()) if isinstance(one, ast.Name)}


def _python_calls(body):
    """Names that code calls without being compiled itself."""
    for node in ast.iter_child_nodes(body):
        if _decorators(node).isdisjoint({"kernel", "entry"}):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                yield node.func.id
            yield from _python_calls(node)


def test_no_code_of_the_package_calls_a_kernel_from_python():
    """It would be compiled anew in each process that comes there, for seconds."""
    home = Path(leg_wear_monitor.__file__).parents[1]
    paths = {
        ".".join(path.relative_to(home).with_suffix("").parts): path
        for path in (home / "leg_wear_monitor").rglob("*.py")
    }
    trees = {module: ast.parse(path.read_text()) for module, path in paths.items()}
    kernels = {
        (module, node.name)
        for module, tree in trees.items()
        for node in tree.body
        if "kernel" in _decorators(node)
    }
    assert len(kernels) > 100
    for module, tree in trees.items():
        imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        known = {one.asname or one.name: (node.module, one.name) for node in imports for one in node.names}
        known |= {name: (own, name) for own, name in kernels if own == module}
        called = {name for name in _python_calls(tree) if known.get(name) in kernels}
        assert not called, module


def test_numba_has_the_switches_for_a_quick_start():
    """Without them all works, and a start takes three times as long: whole_program.py wants another look."""
    assert whole_program.AVAILABLE


@pytest.mark.parametrize("available", [True, False])
def test_kernels_give_the_same_with_plain_numba(monkeypatch, available):
    monkeypatch.setattr(whole_program, "AVAILABLE", available)

    @kernel
    def power(x, n):
        result = 1.0
        for _ in range(n):
            result *= x
        return result

    @kernel
    def polynomial(x):
        return power(x, 3) + power(x, n=2)

    @numba.njit
    def entry_of_another(x):
        return polynomial(x)

    assert (power(2.0, 3), polynomial(2.0), entry_of_another(2.0)) == (8.0, 12.0, 12.0)


@pytest.mark.parametrize("available", [True, False])
def test_an_entry_that_is_called_by_its_address(monkeypatch, available):
    monkeypatch.setattr(whole_program, "AVAILABLE", available)

    @numba.njit
    def divided(values, by):
        return values[0] / by, len(values)

    target = ByAddress(divided, numba.types.Tuple((numba.types.float64, numba.types.int64)))
    call = target.call

    @numba.njit
    def outer(address, values):
        quotient, count = call(address, (values, 2.0))
        return quotient + count

    values = np.array([3.0, 4.0])
    assert outer(target.address(values, 2.0), values) == 3.5


def test_an_entry_that_returns_what_its_caller_does_not_expect_has_no_address():
    @numba.njit
    def twice(x):
        return 2.0 * x

    with pytest.raises(TypeError, match="twice returns float64, not int64"):
        ByAddress(twice, numba.types.int64).address(1.0)


# Records: named state that compiled and plain code share.


INNER = np.dtype([("angle", "f8")])
DTYPE = np.dtype([("count", "i8"), ("speed", "f8", (2,)), ("inner", INNER)])


@entry
def _step(states, k):
    state = states[0]
    state.count += 1
    state.speed[k] = 0.5 * state.count
    inner = state.inner
    inner.angle -= 1.0


def test_compiled_code_writes_to_the_record_that_python_holds():
    states = new_records(1, DTYPE)
    state = record_of(states)
    _step(states, 0)
    state.count += 1
    _step(states, 1)
    assert state.count == 3
    assert state.speed.tolist() == [0.5, 1.5]
    assert state.inner.angle == -2.0


@pytest.mark.parametrize("dtype", [[("mean", "f8")], [("outer", [("angle", "f8"), ("fill", "i8")], (2,))]])
def test_a_name_that_numpy_has_taken_is_refused(dtype):
    """Plain Python would read numpy's method, or its number of elements, in place of the field."""
    with pytest.raises(ValueError, match=r"^fields (mean|fill): "):
        new_records(1, np.dtype(dtype))
