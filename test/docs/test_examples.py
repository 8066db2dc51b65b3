"""The examples in the docstrings of public names and those of examples/ run as they stand."""

import doctest
import json
import re
import runpy
import sys
from pathlib import Path

import command_line
import pytest
from matplotlib import pyplot

import leg_wear_monitor as lw

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"


def examples():
    finder = doctest.DocTestFinder(exclude_empty=True)
    found = [test for name in lw.__all__ for test in finder.find(getattr(lw, name), name, globs={})]
    return [test for test in found if test.examples]


@pytest.mark.parametrize("example", examples(), ids=lambda test: test.name)
def test_an_example_runs(example, monkeypatch):
    if example.name == "replay":
        pytest.importorskip("mcap")
    monkeypatch.chdir(ROOT)  # files are named from there
    said = []
    done = doctest.DocTestRunner().run(example, out=said.append)
    assert done.attempted and not done.failed, "".join(said)


def test_there_are_examples_of_what_is_used_most():
    named = {test.name for test in examples()}
    assert {"WearMonitor", "load_config", "load_mechanism", "plot", "replay", "simulate"} <= named


def run_script(path, monkeypatch, *arguments):
    """Run a script of examples/ in this process; its names at the end."""
    monkeypatch.setattr(sys, "argv", [str(path), *arguments])
    return runpy.run_path(str(path), run_name="__main__")


def test_the_table_of_examples_csv_has_the_verdict_of_its_leg(tmp_path, monkeypatch):
    table = tmp_path / "leg.csv"
    run_script(EXAMPLES / "csv" / "make_table.py", monkeypatch, str(table))
    verdict = lw.replay(table, EXAMPLES / "csv" / "monitor.yaml").summary().verdict
    assert verdict.state.value == "stop" and verdict.joints == ("G",)


def test_the_fleet_of_examples_fleet_needs_a_person_at_one_leg(tmp_path, monkeypatch, capsys):
    for module in ("mcap", "pandas"):
        pytest.importorskip(module)
    command = ["fleet", "update", EXAMPLES / "fleet" / "fleet.yaml", "--out", tmp_path, "--workers", 1]
    done = command_line.run(*command)
    assert done.code == 0, done.err
    run_script(EXAMPLES / "fleet" / "worn.py", monkeypatch, str(tmp_path))
    worst, other = capsys.readouterr().out.splitlines()
    assert worst.startswith("right-07: stop CLEARANCE_DETECTED_G; G ") and other.startswith(
        "left-07: healthy "
    )


def run_cells(path):
    """Run the cells of code of a notebook, which has no outputs, as a notebook does; its names at the end."""
    names = {}
    for cell in json.loads(path.read_text())["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [] and cell["execution_count"] is None
            exec("".join(cell["source"]), names)
    return names


def test_the_cells_of_examples_notebook_run():
    pytest.importorskip("mcap")
    names = run_cells(EXAMPLES / "notebook" / "verdict.ipynb")
    assert names["summary"].verdict.joints == ("G",) and names["seen"]["G"] > 0.6
    assert names["axes"].get_ylabel().startswith("opened by")


def test_the_linkage_of_examples_own_linkage_walks(monkeypatch, capsys):
    run_script(EXAMPLES / "own_linkage" / "walk.py", monkeypatch)
    ideal, loose = capsys.readouterr().out.splitlines()
    assert ideal.startswith("clearance in none: ") and loose.startswith("clearance in B, C: ")


def test_the_cells_of_examples_paper_draw_every_figure(monkeypatch, tmp_path):
    for module in ("matplotlib", "pandas"):
        pytest.importorskip(module)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("matplotlib.pyplot.show", lambda: pyplot.close("all"))
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda _figure, path: Path(path).touch())
    monkeypatch.setattr(lw, "simulate", shortened(lw.simulate))
    names = run_cells(EXAMPLES / "paper" / "paper.ipynb")
    kinds = ["displacement", "velocity", "acceleration", "torque", "force", "wear", "portrait", "poincare"]
    drawn = {f"{place}_{kind}.pdf" for place in ("hip", "knee", "foot", "all") for kind in kinds}
    assert {path.name for path in (tmp_path / "figures").iterdir()} == drawn
    assert list(names["table"].index) == ["A", "B", "G", "I", "J"]


def shortened(simulate):
    """A simulation of a sixteenth of the gait cycles, without skipped ones, and with few samples."""

    def short(mechanism, *, cycles, trace, skip_cycles, **how):
        assert skip_cycles >= 1.0
        return simulate(
            mechanism, cycles=cycles / 16.0, trace=max(64, min(trace, 128)), skip_cycles=0.0, **how
        )

    return short


def test_every_example_is_in_the_table_and_no_file_of_it_is_lost():
    page = (EXAMPLES / "README.md").read_text()
    directories = sorted(path.name for path in EXAMPLES.iterdir() if path.is_dir())
    assert re.findall(r"^\| `(\w+)/` \|", page, re.MULTILINE) == directories
    named = [*re.findall(r"examples/\S+?\.(?:py|yaml|ipynb)", page)]
    assert named and all((ROOT / name).is_file() for name in named)
