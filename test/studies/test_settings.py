"""Descriptions of studies: what comes with the package is whole, what cannot be is refused in one line."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.cli.verbs.study import NAMES
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.studies.execution import load_settings, parse_settings
from leg_wear_monitor.studies.kinds import STUDIES
from leg_wear_monitor.studies.leg_tasks import TASKS
from leg_wear_monitor.studies.life_tasks import check_points, ensemble

pytestmark = pytest.mark.plain


def test_the_names_that_help_shows_are_the_library_s():
    assert sorted(STUDIES) == list(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_every_study_that_comes_with_the_package_has_points_that_can_be(name):
    settings = load_settings(name)
    points, leg = settings.points(), load_mechanism(settings.mechanism)
    check_points(leg, [point.settings for point in points])
    keys = {point.key(leg) for point in points}
    assert len({point.label for point in points}) >= 3
    assert len(keys) >= len({point.label for point in points})
    assert {point.task for point in points} <= set(TASKS)
    assert all(point.cost > 0.0 for point in points)


@pytest.mark.parametrize(
    ("study", "keys", "fault"),
    [
        ("size", {"clearances_m": [0.1]}, "size.yaml: joints: is missing, expected: joints with clearance"),
        ("size", {"joints": ["G"], "clearances_m": []}, "[] does not rise from value to value"),
        ("size", {"joints": ["G"], "clearances_m": [0.02, 0.01]}, "does not rise from value to value"),
        ("size", {"joints": ["G", "G"], "clearances_m": [0.1]}, "['G', 'G'] is not a list of at"),
        ("size", {"joints": ["G"], "clearance_m": [0.1]}, "unknown key, did you mean clearances_m?"),
        ("location", {"sets": [["A"], []]}, "sets: [] is not a list of at least one joint"),
        ("location", {"sets": [["A"]], "speed_rpm": -60}, "speed_rpm: -60.0 is not at least 0.1 rpm"),
        ("location", {"sets": [["A"]], "ensemble": {"runs": 1}}, "ensemble.runs: 1 is not at least 2"),
        ("location", {"sets": [["A"]], "ensemble": {"runs": 2.5}}, "runs: 2.5 is not a whole number"),
        (
            "location",
            {"sets": [["A"]], "ensemble": {"cycles": 2, "traced_cycles": 3}},
            "ensemble.traced_cycles: 3 is more than the 2 cycles counted",
        ),
        (
            "chaos",
            {"joints": ["A"], "exponent": {"renewals": 48}},
            "exponent.renewals: 48 does not divide 512",
        ),
        ("load", {"joints": ["A"], "loads_n": [300, 100]}, "loads_n: [300.0, 100.0] does not rise"),
        ("laws", {"joints": ["A"], "normal_laws": ["hooke"]}, "normal_laws: 'hooke' is not one of hertz,"),
    ],
)
def test_what_cannot_be_is_reported_with_its_key(study, keys, fault):
    with pytest.raises(ConfigError) as error:
        parse_settings(study, keys, f"{study}.yaml")
    assert fault in str(error.value)
    assert str(error.value).startswith(f"{study}.yaml: ")
    assert "\n" not in str(error.value)


def test_joints_that_the_leg_does_not_have_are_reported_before_anything_runs(tiny):
    settings = tiny("size", joints=["Q"], clearances_m=[1.0e-4])
    with pytest.raises(ConfigError, match="'Q' has no clearance settings in bionic_leg"):
        check_points(load_mechanism(), [point.settings for point in settings.points()])


def test_a_key_depends_on_all_that_the_result_depends_on_and_nothing_else(tiny):
    leg, other = load_mechanism("bionic_leg"), load_mechanism("jansen_leg")
    (point,) = tiny("location", sets=[["G"]]).points()
    key = point.key(leg)
    assert attrs.evolve(point, label="another", cost=7.0).key(leg) == key
    assert point.key(attrs.evolve(leg, source="elsewhere.yaml")) == key
    assert point.key(other) != key
    assert attrs.evolve(point, task="section").key(leg) != key
    for name in point.settings:
        assert attrs.evolve(point, settings={**point.settings, name: 99}).key(leg) != key


def test_a_load_is_on_the_leg_of_its_response_its_life_and_its_exponent(tiny):
    points = tiny("load", joints=["G"], loads_n=[0.0, 300.0]).points()
    assert [point.task for point in points] == ["response", "life", "exponent"] * 2
    leg = load_mechanism()
    air, ground = (ensemble(leg, point.settings | {"runs": 1})[0].mechanism for point in points[::3])
    assert not np.any(air.loads["ground"].force)
    assert max(y for _, y in ground.loads["ground"].force) == pytest.approx(300.0, rel=1e-3)
