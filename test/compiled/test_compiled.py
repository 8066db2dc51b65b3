"""Kernels, vectors of joints, and the cache of compiled code."""

import ast
import math
import os
import platform
import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import command_line
import numba
import numpy as np
import pytest
from numba.core.errors import NumbaError

import leg_wear_monitor
from leg_wear_monitor.cli import kernels
from leg_wear_monitor.compiled import kernel as kernels_of
from leg_wear_monitor.compiled import kernel as whole_program
from leg_wear_monitor.compiled import vector_kinds
from leg_wear_monitor.compiled.cache import code_directory, make_private
from leg_wear_monitor.compiled.kernel import ByAddress, cache_directory, entry, kernel, new_records, record_of
from leg_wear_monitor.compiled.kernel import kernel as compiled_kernel
from leg_wear_monitor.compiled.vectors import (
    WIDTH,
    any_of,
    bits_of,
    entry_of,
    evens,
    every,
    largest,
    number_of,
    odds,
    only,
    padded,
    part_at,
    put_part,
    put_vector,
    root,
    vector_at,
    vector_max,
    vector_sum,
    where,
    with_entry,
    zip_first,
    zip_last,
)
from leg_wear_monitor.errors import ConfigWarning

# Kernels: compilation, cache, records.


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


# Vectors in compiled code, and without a compiler: the same numbers.


@entry
def along(scale, a, b, out):
    """Out = b + scale a - a b in both rows; returns the sum and the maximum of the products in row 1."""
    total, most = every(0.0), every(-math.inf)
    for i in range(0, a.shape[1], WIDTH):
        product = part_at(a, (1, i)) * part_at(b, (1, i))
        total += product
        most = largest(most, product)
    for row in range(2):
        for i in range(0, a.shape[1], WIDTH):
            value = part_at(b, (row, i)) + scale * part_at(a, (row, i))
            value -= part_at(a, (row, i)) * part_at(b, (row, i))
            put_part(out, (row, i), value)
    return vector_sum(total), vector_max(most)


@pytest.mark.parametrize("width", [2, 8, 10, 20])
def test_vectors_are_the_numbers_one_by_one(width):
    random = np.random.default_rng(1)
    a, b, out = random.normal(size=(3, 2, width))
    total, most = along(0.3, a, b, out)
    np.testing.assert_array_equal(out, (b + 0.3 * a) - a * b)
    assert total == pytest.approx(a[1] @ b[1], rel=1.0e-12)
    largest_of_row = (a[1] * b[1]).max()
    assert most == (max(0.0, largest_of_row) if width % WIDTH else largest_of_row)


def test_a_row_that_starts_at_any_number_and_a_store_that_stays_inside():
    """Tables are views into one array: a vector need not start at a multiple of its own length."""
    flat = np.arange(23.0)
    a, whole = flat[1:23].reshape(2, 11), np.zeros((3, 11))
    along(2.0, a, np.ones((2, 11)), whole[:2])
    np.testing.assert_array_equal(whole[:2], 1.0 + 2.0 * a - a)
    assert not whole[2].any()


@entry
def shuffled(x, out):
    a, b = vector_at(x, 0), vector_at(x, WIDTH)
    put_vector(out, (0, 0), evens(a, b))
    put_vector(out, (1, 0), odds(a, b))
    put_vector(x, 0, zip_first(evens(a, b), odds(a, b)))
    put_vector(x, WIDTH, zip_last(evens(a, b), odds(a, b)))
    put_vector(out, (2, 0), with_entry(a, 3, 7.5))
    put_vector(out, (3, 0), only(entry_of(b, 2), 5))
    return any_of(a > 6.5), any_of(a > 7.5)


def test_entries():
    x, out = np.arange(16.0), np.zeros((4, WIDTH))
    assert shuffled(x, out) == (True, False)
    np.testing.assert_array_equal(x, np.arange(16.0))
    np.testing.assert_array_equal(out[0], x[::2])
    np.testing.assert_array_equal(out[1], x[1::2])
    np.testing.assert_array_equal(out[2], [0, 1, 2, 7.5, 4, 5, 6, 7])
    np.testing.assert_array_equal(out[3], [0, 0, 0, 0, 0, 10, 0, 0])


@compiled_kernel
def formula(a, b):
    """Of numbers or of vectors."""
    return where((a > b) & (b >= -0.5), -root(abs(a)), 2.0 - largest(a, 0.25) / (1.0 + b * b))


@entry
def formulas(a, b, out_vector, out_number):
    put_vector(out_vector, 0, formula(vector_at(a, 0), vector_at(b, 0)))
    for i in range(a.shape[0]):
        out_number[i] = formula(a[i], b[i])


def test_one_formula_for_numbers_and_vectors():
    random = np.random.default_rng(2)
    a, b, found, expected = random.normal(size=(4, WIDTH))
    formulas(a, b, found, expected)
    np.testing.assert_array_equal(found, expected)
    plain = np.where((a > b) & (b >= -0.5), -np.sqrt(abs(a)), 2.0 - np.maximum(a, 0.25) / (1.0 + b * b))
    np.testing.assert_array_equal(found, plain)


@entry
def widened(x, out):
    put_vector(out, 0, part_at(x, (1, 1, 2)))


def test_single_precision_rows_of_three_dimensions():
    x, out = np.arange(24.0, dtype=np.float32).reshape(2, 3, 4), np.full(WIDTH, 9.0)
    widened(x, out)
    np.testing.assert_array_equal(out, [18.0, 19.0, 0, 0, 0, 0, 0, 0])


@entry
def there_and_back(number):
    whole = bits_of(number)
    return whole, number_of(whole)


@pytest.mark.parametrize("number", [0.0, 1.0, -2.5, 1.0e-300, math.pi, math.inf])
def test_bits(number):
    assert there_and_back(number) == (int(np.float64(number).view(np.int64)), number)


@pytest.mark.parametrize(("count", "room"), [(0, 0), (1, 8), (8, 8), (9, 16)])
def test_padded(count, room):
    assert padded(count) == room


def test_without_a_compiler():
    x = np.arange(8.0).reshape(2, 4)
    vector_kinds.stored(x, (0, 2), vector_kinds.loaded(x, (1, 0)) + 2.0 * vector_kinds.loaded(x, (1, 2)))
    np.testing.assert_array_equal(x[0], [0.0, 1.0, 16.0, 19.0])
    assert vector_kinds.folded(vector_kinds.loaded(x, (0, 2)), np.add) == 35.0
    assert vector_kinds.chosen(True, 1.0, 2.0) == 1.0
    assert vector_kinds.root_of(4.0) == 2.0


# Compiled code lies where no other local user can put or replace a file: its index files are pickles.


NOBODY = 65534
WHERE = "from leg_wear_monitor.compiled.kernel import cache_directory; print(cache_directory())"

as_root = pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to be two users")


def place_of(**environment):
    """Where a fresh process puts its compiled code, and what it says on stderr."""
    unset = ("NUMBA_", "XDG_", "COV_", "TMPDIR")
    kept = {key: value for key, value in os.environ.items() if not key.startswith(unset)} | environment
    command = [sys.executable, "-W", "default", "-c", WHERE]
    done = subprocess.run(command, env=kept, text=True, capture_output=True, check=True)
    return done.stdout.strip(), done.stderr


def test_a_directory_is_private_whatever_the_umask(tmp_path):
    before = os.umask(0)
    try:
        assert make_private(tmp_path / "a" / "b") is None
    finally:
        os.umask(before)
    assert (tmp_path / "a" / "b").stat().st_mode & 0o7777 == 0o700


@pytest.mark.parametrize("bits", [0o777, 0o775, 0o757, 0o1777])
def test_a_directory_that_others_can_write_to_is_refused(tmp_path, bits):
    (tmp_path / "a").mkdir()
    (tmp_path / "a").chmod(bits)
    (tmp_path / "link").symlink_to("a")
    for path in (tmp_path / "a", tmp_path / "link"):
        assert make_private(path) == f"{path} can be written to by others (chmod go-w {path})"
    assert (tmp_path / "a").stat().st_mode & 0o7777 == bits


def test_a_file_in_the_way_is_reported(tmp_path):
    (tmp_path / "file").write_text("")
    assert "Not a directory" in make_private(tmp_path / "file" / "a")


@as_root
def test_a_directory_or_a_link_of_another_user_is_refused(tmp_path):
    (tmp_path / "theirs").mkdir()
    (tmp_path / "link").symlink_to("/root")
    for path in (tmp_path / "theirs", tmp_path / "link"):
        os.chown(path, NOBODY, NOBODY, follow_symlinks=False)
        assert make_private(path) == f"{path} belongs to a different user (uid {NOBODY})"


@as_root
def test_a_directory_laid_in_advance_by_another_user_is_not_used(tmp_path):
    """The way in: a service without a home, and a name below /tmp that anybody can foretell."""
    laid = tmp_path / f"leg_wear_monitor-{os.geteuid()}"
    laid.mkdir()
    os.chown(laid, NOBODY, NOBODY)
    place, output = place_of(TMPDIR=str(tmp_path), HOME="/dev/null")
    assert place == "None"
    assert not any(laid.iterdir())
    assert f"{laid} belongs to a different user (uid {NOBODY})" in output
    assert "compiled code is not stored" in output


def test_a_directory_that_was_asked_for_and_is_refused_is_reported(tmp_path):
    (tmp_path / "asked" / "leg_wear_monitor").mkdir(parents=True)
    (tmp_path / "asked" / "leg_wear_monitor").chmod(0o777)
    place, output = place_of(NUMBA_CACHE_DIR=str(tmp_path / "asked"), HOME=str(tmp_path / "home"))
    assert Path(place).parent == tmp_path / "home" / ".cache" / "leg_wear_monitor"
    assert output.count("ConfigWarning") == 1
    assert "NUMBA_CACHE_DIR: " in output
    assert "can be written to by others (chmod go-w" in output


def test_the_usual_place_is_taken_without_a_word(place):
    with warnings.catch_warnings():
        warnings.simplefilter("error", ConfigWarning)
        assert code_directory("a leaf of this test") == place / "a leaf of this test"


# --- the verb `cache` ---


def test_it_prints_where_and_how_much(place):
    old = place / "dynamics.full.model-0123456789abcdef"
    old.mkdir(parents=True, mode=0o700)
    (old / "code").write_bytes(bytes(2_300_000))
    lines = command_line.run("cache").out.splitlines()
    assert lines == [f"place: {place}", "total: 2.3 MB in 2 directories"]  # one is the verb's own


def test_clear_removes_all_of_it_and_nothing_beside(place):
    for name in ("dynamics.full.model-0123456789abcdef", "0123456789abcdef"):
        (place / name / "deep").mkdir(parents=True)
        (place / name / "deep" / "code").write_bytes(bytes(1_000_000))
    (place.parent / "beside").write_text("")
    (place / "link").symlink_to(place.parent)
    result = command_line.run("cache", "--clear")
    assert result.code == 0
    assert result.out.splitlines()[1] == "removed: 2.0 MB in 3 directories"
    assert [each.name for each in place.iterdir()] == ["link"]
    assert (place.parent / "beside").exists()


def test_nothing_is_removed_where_no_place_is_safe(monkeypatch):
    monkeypatch.setattr(kernels_of, "cache_directory", lambda: None)
    result = command_line.run("cache", "--clear")
    assert result.code == 2
    assert result.err == "error: no directory is safe for compiled code, so it is not stored\n"


def test_a_fill_prints_the_place_and_the_size(place, monkeypatch):
    monkeypatch.setattr(kernels, "_CALLS", {"nothing": int})
    result = command_line.run("cache", "--fill")
    assert result.code == 0
    assert result.out.startswith(f"place: {place}\ntotal: ")
    assert command_line.run("cache", "--fill", "--clear").code == 2


@pytest.mark.slow
def test_after_a_fill_nothing_is_compiled(place):
    assert command_line.run("cache", "--fill").code == 0
    line = "import leg_wear_monitor.cli.kernels as kernels; [call() for call in kernels._CALLS.values()]"
    before = sorted(file for file in place.rglob("*.nbc"))
    subprocess.run([sys.executable, "-c", line], check=True, cwd=Path(__file__).parents[1])
    assert before and sorted(file for file in place.rglob("*.nbc")) == before
