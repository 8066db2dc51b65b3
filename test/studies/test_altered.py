"""What lies in a study's directory is what was computed, or it is named: each part is bound by a checksum."""

import json
import random
import shutil

import numpy as np
import pytest
from spoilt_json import spoilt

from leg_wear_monitor.errors import ConfigError, ConfigWarning, LegWearError
from leg_wear_monitor.studies import execution
from leg_wear_monitor.studies.execution import canonical, run_study, text_checksum
from leg_wear_monitor.studies.results import load_results

pytestmark = pytest.mark.plain


def result(_task, _mechanism, settings, _code):
    """In place of a computation: something that depends on the settings."""
    return {
        "clearance_m": np.array([settings["clearance_m"]]),
        "clearance_joints": np.array(settings["clearance_joints"]),
    }


@pytest.fixture(scope="module")
def computed(sweep, tmp_path_factory):
    """A study's directory, its results made up."""
    out = tmp_path_factory.mktemp("computed")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(execution, "compute", result)
        assert run_study("size", sweep, out) == 3
    return out


@pytest.fixture
def study(computed, tmp_path, monkeypatch):
    """A copy of it that may be spoilt."""
    monkeypatch.setattr(execution, "compute", result)
    shutil.copytree(computed, tmp_path / "study")
    return tmp_path / "study"


def files(study):
    """Files of the points, in the order of the plan."""
    return [study / "points" / f"{entry['key']}.npz" for entry in manifest(study)["points"]]


def manifest(study):
    return json.loads((study / "study.json").read_text())


def rewritten(file, change):
    """An archive with valid parts after a change of its arrays."""
    with np.load(file) as archive:
        arrays = dict(archive)
    change(arrays)
    np.savez_compressed(file, **arrays)


def swap(first, second):
    one, other = first.read_bytes(), second.read_bytes()
    first.write_bytes(other)
    second.write_bytes(one)


def add_to_about(arrays):
    arrays["about"] = np.array(json.dumps({**json.loads(str(arrays["about"])), "task": "life"}))


def grow(arrays):
    arrays["clearance_m"] *= 1.5


ALTERED = {
    "exchanged": (swap, "is the result of another point"),
    "copied": (lambda first, second: shutil.copy(second, first), "is the result of another point"),
    "a value": (lambda first, _: rewritten(first, grow), "was altered after it was computed"),
    "its settings": (lambda first, _: rewritten(first, add_to_about), "was altered after it was computed"),
    "an array less": (lambda first, _: rewritten(first, lambda a: a.pop("clearance_joints")), "was altered"),
    "nothing about it": (lambda first, _: rewritten(first, lambda a: a.pop("about")), "cannot be read"),
    "no object": (lambda first, _: rewritten(first, lambda a: a.update(about=np.array("[]"))), "cannot be"),
    "cut": (lambda first, _: first.write_bytes(first.read_bytes()[:-40]), "cannot be read"),
    "empty": (lambda first, _: first.write_bytes(b""), "cannot be read"),
}


@pytest.mark.parametrize("how", ALTERED)
def test_a_point_that_is_not_what_was_computed_is_named(study, how):
    alter, fault = ALTERED[how]
    first, second, _ = files(study)
    alter(first, second)
    with pytest.raises(ConfigError, match=fault) as caught:
        load_results(study)
    assert str(first) in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_points_that_are_not_what_was_computed_are_computed_again(study, sweep):
    first, second, third = files(study)
    whole = [path.read_bytes() for path in files(study)]
    swap(first, second)
    rewritten(third, grow)
    with pytest.warns(ConfigWarning) as warned:
        assert run_study("size", sweep, study) == 3
    assert [str(each.message).endswith("; it is computed again") for each in warned] == [True] * 3
    assert [path.read_bytes() for path in files(study)] == whole


def test_a_bomb_is_not_unpacked(study, monkeypatch):
    monkeypatch.setattr(execution, "_MOST_BYTES", 100)
    with pytest.raises(ConfigError, match="unpacks to more than"):
        load_results(study)


def test_another_leg_beside_the_results_is_found(study):
    text = (study / "mechanism.yaml").read_text()
    (study / "mechanism.yaml").write_text(text.replace("mass: 3.5", "mass: 3.6"))
    with pytest.raises(ConfigError, match=r"mechanism\.yaml beside it was altered"):
        load_results(study)


def test_a_study_changed_anywhere_is_one_line_or_what_it_was(study):
    """Also where its checksum was made to fit: then it may be refused or taken, but nothing else."""
    draw, whole, refused = random.Random(11), manifest(study), 0
    text = (study / "mechanism.yaml").read_text()
    for i in range(80):
        changed = spoilt(whole, draw)
        if i % 2:
            changed.pop("checksum", None)
            try:
                changed["checksum"] = text_checksum(canonical(changed), text)
            except ValueError:
                continue
        (study / "study.json").write_text(json.dumps(changed))
        try:
            load_results(study)
        except LegWearError as error:
            refused += 1
            assert len(str(error).splitlines()) == 1
        else:
            assert i % 2 or changed == whole
    assert refused > 50


@pytest.mark.parametrize(
    "text", ["", "[]", "{", "7", "[" * 100_000, '{"format": 2}', '{"format": 2, "checksum": "x"}', "\ud800"]
)
def test_what_is_no_study_is_one_line(study, text):
    (study / "study.json").write_bytes(text.encode(errors="surrogatepass"))
    with pytest.raises(ConfigError) as caught:
        load_results(study)
    assert str(caught.value).startswith(str(study / "study.json"))


@pytest.mark.parametrize("name", ["study.json", "mechanism.yaml"])
def test_a_part_that_is_missing_is_named(study, name):
    (study / name).unlink()
    with pytest.raises(ConfigError, match=f"{name}: cannot be read"):
        load_results(study)
