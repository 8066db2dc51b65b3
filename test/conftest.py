"""What all tests share: a search for counterexamples that repeats itself, and mechanisms made ready."""

import os
import sys
from collections.abc import Callable, Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from matplotlib.figure import Figure
from ruamel.yaml import YAML

from leg_wear_monitor import Mechanism, load_mechanism
from leg_wear_monitor.compiled import cache as code_cache
from leg_wear_monitor.compiled import kernel
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.mechanism.position import Linkage, build_linkage

if os.environ.get("MOVED_STARTS"):  # as `make test-machines` sets it
    from moved_starts import move_starts

    move_starts(int(os.environ["MOVED_STARTS"]))

if find_spec("mcap") and find_spec("rosbags"):
    pytest_plugins = ["made_recordings"]
else:  # the extra `bags` is not installed
    collect_ignore_glob = ["recordings/*"]

# the first example may wait for a compilation, so there is no deadline
settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("repeatable")


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache of compiled code, as a new process would find it."""

    def forget() -> None:
        for cached in (code_cache._place, kernel.cache_directory):
            cached.cache_clear()

    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    forget()
    yield tmp_path / "cache" / "leg_wear_monitor"
    monkeypatch.undo()
    forget()


@pytest.hookimpl(trylast=True)  # after `-m` has made its choice
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Take one of several even parts of the chosen tests if ``SLOW_PART`` says so: ``3/8``, from zero."""
    if os.environ.get("SLOW_PART"):
        part, parts = map(int, os.environ["SLOW_PART"].split("/"))
        config.hook.pytest_deselected(items=[item for i, item in enumerate(items) if i % parts != part])
        items[:] = items[part::parts]


@pytest.fixture
def unpainted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are made but not painted: that takes most of a page's time and changes none of its text."""
    monkeypatch.setattr(Figure, "savefig", lambda *_, **__: None)


@pytest.fixture
def traps(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The current directory: its modules have the names of all that a new process imports, and tell of it."""
    home = tmp_path_factory.mktemp("traps")
    marks = home / "told"
    for name in {*sys.stdlib_module_names, "leg_wear_monitor", "joblib", "numba", "numpy", "sitecustomize"}:
        trap = f"open({str(marks)!r}, 'a').write({name!r} + '\\n')\nraise SystemExit(66)\n"
        (home / f"{name}.py").write_text(trap)
    monkeypatch.chdir(home)
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])  # as a console script has it
    yield home
    assert not marks.exists(), f"modules of the current directory were imported: {marks.read_text()}"


@pytest.fixture(scope="session")
def leg() -> Mechanism:
    """The default leg."""
    return load_mechanism("bionic_leg")


@pytest.fixture(scope="session")
def linkage_of() -> Callable[[str], Linkage]:
    """Linkage of a mechanism that comes with the package, by its name."""
    return cache(lambda name: build_linkage(load_mechanism(name)))


@pytest.fixture(scope="session")
def document() -> Callable[[str], Any]:
    """The plain mapping in the file of a mechanism that comes with the package, free to be changed."""

    def read(name: str) -> Any:
        return YAML(typ="safe", pure=True).load(share_directory() / "config" / "mechanisms" / f"{name}.yaml")

    return read


@pytest.fixture(scope="session")
def data() -> Path:
    """Directory of the reference data."""
    return Path(__file__).parent / "data"


@pytest.fixture
def solve_of_any_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    """`numpy.linalg.solve` refuses what numpy 1 takes for a stack of vectors and numpy 2 for one matrix."""
    solve = np.linalg.solve

    def strict(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        assert a.ndim == b.ndim or (a.ndim, b.ndim) == (2, 1), (a.shape, b.shape)
        return solve(a, b)

    monkeypatch.setattr(np.linalg, "solve", strict)
