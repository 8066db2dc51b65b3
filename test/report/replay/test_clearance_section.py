"""What encoders show, on the page of a replay: a table and a sentence, or nothing at all."""

import pytest

from leg_wear_monitor.monitor.encoders.clearance_estimate import ClearanceObservation
from leg_wear_monitor.playback.result.parts import ClearanceChange, ReplayJoint, SeenClearance
from leg_wear_monitor.report.replay.clearance_section import clearance_sections, clearance_sentences

pytestmark = pytest.mark.plain


def joint(seen=None):
    return ReplayJoint(
        clearance_m=ClearanceChange(3.0e-4, 3.0e-4, 3.0e-4),
        growth_m_per_cycle=None,
        growth_error_m_per_cycle=None,
        growth_mps=None,
        forecast=None,
        peak_force_n=None,
        mean_force_n=None,
        seen=seen,
        impacts=0,
    )


def shown(observation, clearance_m=None, departure_m=None, is_other=False):
    return joint(
        SeenClearance(
            observation=observation,
            clearance_m=clearance_m,
            sigma_m=2e-5,
            departure_m=departure_m,
            believed=True,
            is_other=is_other,
        )
    )


def test_without_encoders_there_is_nothing_to_say():
    joints = {"A": joint()}
    assert clearance_sections(joints) == []
    assert clearance_sentences(joints) == []


def test_a_worn_joint_is_named_and_what_is_not_seen_is_said():
    joints = {
        "G": shown(ClearanceObservation.SEEN, 4.5e-4, 1.5e-4, True),
        "A": shown(ClearanceObservation.SEEN, 3.01e-4, 1e-6),
        "J": shown(ClearanceObservation.NOT_OBSERVABLE),
    }
    assert clearance_sentences(joints) == ["Encoders show that G is 150 µm wider than counted."]
    (section,) = clearance_sections(joints)
    (table,) = section.parts
    assert [row[0] for row in table.rows] == ["G", "A", "J"]
    assert [row[2] for row in table.rows] == ["0.4500", "0.3010", "-"]
    assert [row[4] for row in table.rows] == [
        "other than counted",
        "seen by encoders",
        ClearanceObservation.NOT_OBSERVABLE.value,
    ]
