"""A study's points are computed once, kept whole, and the same however and wherever they are computed."""

import json

import attrs
import numpy as np
import pytest

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.studies import execution
from leg_wear_monitor.studies import leg_tasks as tasks
from leg_wear_monitor.studies.execution import StudyDirectory, run_study
from leg_wear_monitor.studies.results import load_results


def files(directory):
    """Contents of all results of a study, by name."""
    return {path.name: path.read_bytes() for path in sorted((directory / "points").iterdir())}


@pytest.fixture(scope="module")
def uninterrupted(sweep, tmp_path_factory):
    out = tmp_path_factory.mktemp("uninterrupted")
    assert run_study("size", sweep, out) == 3
    return out


def test_finished_points_are_kept_and_others_computed(sweep, uninterrupted, tmp_path, monkeypatch):
    computed = []
    compute = tasks.compute

    def counted(task, mechanism, settings, code):
        computed.append(settings["clearance_m"])
        if len(computed) == 2:
            raise KeyboardInterrupt
        return compute(task, mechanism, settings, code)

    monkeypatch.setattr(execution, "compute", counted)
    with pytest.raises(KeyboardInterrupt):
        run_study("size", sweep, tmp_path)
    assert load_results(tmp_path).missing == ["0.2 mm", "0.3 mm"]
    assert run_study("size", sweep, tmp_path) == 2
    assert computed == [1.0e-4, 2.0e-4, 2.0e-4, 3.0e-4]
    assert run_study("size", sweep, tmp_path) == 0
    assert files(tmp_path) == files(uninterrupted)


def test_another_leg_or_setting_is_another_point(sweep, uninterrupted, tmp_path):
    run_study("size", attrs.evolve(sweep, clearances_m=(1.0e-4,)), tmp_path)
    assert run_study("size", attrs.evolve(sweep, clearances_m=(1.0e-4, 5.0e-4)), tmp_path) == 1
    assert (
        run_study("size", attrs.evolve(sweep, clearances_m=(1.0e-4,), mechanism="jansen_leg"), tmp_path) == 1
    )
    assert len(files(tmp_path)) == 3  # none is lost, the page shows those that were asked for last
    assert [point.label for point in load_results(tmp_path).points] == ["0.1 mm"]


def test_a_result_says_what_it_came_from(uninterrupted):
    entry = json.loads((uninterrupted / "study.json").read_text())["points"][0]
    with np.load(uninterrupted / "points" / f"{entry['key']}.npz") as file:
        about = json.loads(str(file["about"]))
    assert about["settings"] == entry["settings"]
    assert about["settings"]["seed"] == 1
    assert {"leg_wear_monitor", "code", "numpy", "numba"} <= set(about["versions"])
    results = load_results(uninterrupted)
    assert (results.missing, results.faults) == ([], [])
    assert results.mechanism.name == "bionic_leg"
    assert [point.label for point, _ in results.of("response")] == ["0.1 mm", "0.2 mm", "0.3 mm"]


@pytest.mark.plain
def test_a_directory_of_another_study_or_a_damaged_one_is_reported(tiny, tmp_path):
    StudyDirectory(tmp_path).open({"study": "speed", "settings": {}, "points": [], "versions": {}}, "")
    with pytest.raises(ConfigError, match="contains the study speed, expected size"):
        run_study("size", tiny("size", joints=["G"], clearances_m=[1.0e-4]), tmp_path)
    (tmp_path / "points" / "k.npz").write_bytes(b"PK")
    with pytest.raises(ConfigError, match=r"k\.npz: cannot be read"):
        StudyDirectory(tmp_path).read("k", "response", {})
    (tmp_path / "study.json").write_text("{}")
    with pytest.raises(ConfigError, match="is not a study of format"):
        load_results(tmp_path)
    (tmp_path / "study.json").write_text("{")
    with pytest.raises(ConfigError, match="is not JSON"):
        load_results(tmp_path)
    with pytest.raises(ConfigError, match="cannot be read: No such file"):
        load_results(tmp_path / "nowhere")


@pytest.mark.plain
def test_a_motion_that_diverges_is_a_result_with_its_fault(tiny, tmp_path, monkeypatch):
    from leg_wear_monitor.errors import SimulationError

    def diverge(mechanism, settings):
        raise SimulationError("joint G at t = 1 s: pushed through")

    monkeypatch.setitem(tasks.TASKS, "response", diverge)
    settings = tiny("size", joints=["G"], clearances_m=[1.0e-4])
    assert run_study("size", settings, tmp_path) == 1
    assert load_results(tmp_path).faults == [("0.1 mm", "joint G at t = 1 s: pushed through")]
    assert run_study("size", settings, tmp_path) == 0


@pytest.mark.plain
def test_a_worker_with_other_code_is_refused():
    with pytest.raises(RuntimeError, match="another version"):
        tasks.compute("response", None, {}, "other code")


def test_a_point_that_is_asked_for_twice_is_computed_once(tiny, tmp_path):
    """A single place is also all places at once."""
    assert run_study("multi", tiny("multi", sets=[["G"]]), tmp_path) == 1
    assert [point.label for point, _ in load_results(tmp_path).of("response")] == ["G", "G"]
