"""The gait cycle to play on the page of a replay: before and after a change, and the leg where it belongs."""

import json
import re

import attrs
import numpy as np
import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.mechanism.position import carriers
from leg_wear_monitor.mechanism.reach import reach_of
from leg_wear_monitor.messages.leg_motion import PHASES
from leg_wear_monitor.playback.result import ReplayLeg, summary_of
from leg_wear_monitor.playback.summary import leg_shape
from leg_wear_monitor.report.replay.motion import motion_section
from leg_wear_monitor.state import State

DATA = re.compile(r'<script type="application/json" class="(data|cycles)">(.*?)</script>')


@pytest.fixture(scope="module")
def knocked(knocking):
    return knocking.summary()


def played(summary):
    """What the scripts get."""
    (section,) = motion_section(summary)
    found = DATA.findall(section.parts[0].markup)
    return {name: json.loads(text) for name, text in found}


def test_a_break_out_is_played_before_and_after_it(knocked):
    given = played(knocked)
    before, after = given["data"]["runs"]
    assert (before["label"], after["label"]) == ("before the finding", "after the finding")
    assert set(before["pins"]) == set(after["pins"]) == set(knocked.monitor.clearance_joints)
    assert after["pins"]["G"]["gap"] > 2.0 * before["pins"]["G"]["gap"]  # drawn as the verdict believes
    for pin in (*before["pins"].values(), *after["pins"].values()):
        assert {len(pin[name]) for name in ("e", "f", "hit")} == {PHASES}
    cycles = given["cycles"]
    measured, predicted = (
        np.array([each[name] for each in cycles], float) for name in ("measured_nm", "predicted_nm")
    )
    rms = np.sqrt(np.nanmean((measured - predicted) ** 2, axis=1) / np.nanmean(predicted**2, axis=1))
    assert rms[1] > 1.5 * rms[0]


def test_a_healthy_leg_has_one_gait_cycle_to_play(knocked):
    healthy = attrs.evolve(knocked, verdict=attrs.evolve(knocked.verdict, state=State.HEALTHY))
    (run,) = played(healthy)["data"]["runs"]
    assert run["label"] == "the last one"


def test_what_was_measured_after_the_recording_is_in_none_of_its_gait_cycles(knocked):
    """The last one stood there as "after the finding", its pin stretched to what was measured days later."""
    later = attrs.evolve(knocked.verdict, since_ns=knocked.recording.end_ns + 1)
    (run,) = played(attrs.evolve(knocked, verdict=later))["data"]["runs"]
    assert run["label"] == "the last one"
    assert run["pins"]["G"]["gap"] == played(knocked)["data"]["runs"][0]["pins"]["G"]["gap"]


def test_the_leg_is_where_the_mechanism_is():
    """By a turn and a way of each body alone, at each position of the crank."""
    mechanism = lw.load_mechanism("bionic_leg")
    reach, leg = reach_of(mechanism, None, PHASES), leg_shape(mechanism)
    for name, joint in leg.joints.items():
        turn, x, y = np.array(leg.poses[joint.body]).T if joint.body else np.zeros((3, PHASES))
        place = np.array(joint.place_m)
        path = np.stack([
            np.cos(turn) * place[0] - np.sin(turn) * place[1] + x,
            np.sin(turn) * place[0] + np.cos(turn) * place[1] + y,
        ], axis=1)  # fmt: skip
        assert np.abs(path - reach.path(carriers(mechanism, name)[1], name)).max() < 2.0e-5


def test_without_what_is_played_there_is_no_section(knocked):
    assert motion_section(attrs.evolve(knocked, motion=())) == []
    assert motion_section(attrs.evolve(knocked, leg=ReplayLeg())) == []


def test_it_is_drawn_again_from_the_file_alone(knocked):
    again = summary_of(json.loads(knocked.to_json()), "summary.json")
    assert played(again) == played(knocked)
