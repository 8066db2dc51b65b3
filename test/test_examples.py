"""The examples in the docstrings of public names run as they stand."""

import doctest
from pathlib import Path
from typing import Any

import pytest

import leg_wear_monitor as lw

ROOT = Path(__file__).parents[1]


def examples() -> list[Any]:
    finder = doctest.DocTestFinder(exclude_empty=True)
    found = [test for name in lw.__all__ for test in finder.find(getattr(lw, name), name, globs={})]
    return [test for test in found if test.examples]


@pytest.mark.parametrize("example", examples(), ids=lambda test: test.name)
def test_an_example_runs(example: doctest.DocTest, monkeypatch: pytest.MonkeyPatch) -> None:
    if example.name == "replay":
        pytest.importorskip("mcap")
    monkeypatch.chdir(ROOT)  # files are named from there
    said: list[str] = []
    done = doctest.DocTestRunner().run(example, out=said.append)
    assert done.attempted and not done.failed, "".join(said)


@pytest.mark.plain
def test_there_are_examples_of_what_is_used_most() -> None:
    named = {test.name for test in examples()}
    assert {"WearMonitor", "load_config", "load_mechanism", "plot", "replay", "simulate"} <= named
