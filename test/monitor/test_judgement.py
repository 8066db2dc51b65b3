"""What the verdict is told of clearances by the drive torque."""

import math

import pytest

from leg_wear_monitor.monitor.diagnosis.diagnosis import Cause, Change, Diagnosis, DiagnosisState
from leg_wear_monitor.monitor.judgement import seen_by_torque
from leg_wear_monitor.monitor.verdict.situation import SeenClearance


def changed(cause: Cause = Cause.CLEARANCE, subject: str = "G", **options) -> Diagnosis:
    change = Change(
        cause=cause, subject=subject, since_ns=1, value=2.0e-3, sigma=5e-4, counted=3e-4, log_odds=99.0
    )
    known = {"state": DiagnosisState.CHANGED, "clearance_m": (3e-4, math.nan), "sigma_m": (1e-5, math.nan)}
    return Diagnosis(changes=(change,), **{**known, **options})


def test_a_clearance_of_the_fit_is_seen() -> None:
    assert seen_by_torque(0, "A", changed()) == [SeenClearance("torque", 3e-4, 1e-5)]


def test_a_clearance_that_the_fit_of_all_joints_does_not_observe_is_that_of_the_change() -> None:
    assert seen_by_torque(1, "G", changed()) == [SeenClearance("torque", 2.0e-3, 5e-4)]


@pytest.mark.parametrize(
    "diagnosis",
    [
        changed(subject="A"),
        changed(cause=Cause.MASS),
        changed(state=DiagnosisState.AS_COUNTED),
        Diagnosis(),
    ],
)
def test_what_nothing_observes_is_not_seen(diagnosis: Diagnosis) -> None:
    assert seen_by_torque(1, "G", diagnosis) == []
