"""What the diagnosis says at each step: what is known, what is missing, what comes next and when."""

import math
from types import SimpleNamespace
from unittest import mock

import attrs
import numpy as np
import pytest

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.estimate.clearance_fit import ClearanceFit
from leg_wear_monitor.estimate.drive import DIRECT, Channel
from leg_wear_monitor.estimate.ground_load import GroundLoad
from leg_wear_monitor.estimate.signature import CommissionedTorque, TorqueSensor
from leg_wear_monitor.mechanism.person import PHASES
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.inputs import Cadence
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.reasons import doubt, missing, next_step
from leg_wear_monitor.monitor.diagnosis.references import ROUNDS, LegModels, References
from leg_wear_monitor.monitor.diagnosis.state import (
    AtCadence,
    Diagnosis,
    DiagnosisState,
    NotUsed,
    SignedCycle,
    TorqueState,
)
from leg_wear_monitor.monitor.verdict.situation import Situation
from leg_wear_monitor.monitor.verdict.subject_rules import nothing_found
from leg_wear_monitor.twin.reference import CrankProfile, LegParameters

NEW = np.full(5, 3.0e-4)
SENSOR = TorqueSensor(0.005, 1.0, 9.2)
CONFIG = MonitorConfig(cadence=Cadence(tolerance_rpm=20.0))
IDLE, BUSY = (
    SimpleNamespace(
        is_busy=busy, is_late=False, percent=40, cycles_left=20.0, is_for=lambda _, busy=busy: busy
    )
    for busy in (False, True)
)


def cycles(number: int, rpm: float = 60.0) -> tuple[SignedCycle, ...]:
    profile = CrankProfile.steady(TURN * rpm / 60.0)
    return tuple(SignedCycle(i, i + 1, np.zeros(160), profile) for i in range(number))


def of_reference(rpm: float = 60.0) -> SimpleNamespace:
    return SimpleNamespace(profile=CrankProfile.steady(TURN * rpm / 60.0))


def known(rpm: float = 60.0) -> CommissionedTorque:
    return CommissionedTorque(0, NEW, np.zeros((50, 160)), speed=TURN * rpm / 60.0)


def state(**changes: object) -> TorqueState:
    return TorqueState(NEW, **{"sensor": SENSOR, **changes})


UNLIKE, RAMP = 3 * (NotUsed.UNLIKE,), 9 * (NotUsed.UNLIKE,)
STEPS = {
    "no torque": (state(sensor=None), IDLE, ""),
    "another cadence": (state(off_cadence_rpm=30.0, waiting=cycles(2)), IDLE, ""),
    "two gait cycles": (state(waiting=cycles(2)), IDLE, "a reference is chosen in 3 gait cycles (3 s)"),
    # 20 commanded gait cycles are 20 s, in which a crank at 45 rpm turns 15 times
    "a first reference": (
        state(waiting=cycles(9, 45.0)),
        BUSY,
        "clearances are compared in 15 gait cycles (20 s)",
    ),
    "no baseline": (
        state(reference=of_reference(45.0), cycles=cycles(38, 45.0)),
        IDLE,
        "the baseline, with which smaller changes are found, is complete in 12 gait cycles (16 s)",
    ),
    "a baseline": (state(reference=of_reference(), cycles=cycles(50), commissioned=known()), IDLE, ""),
    "identification": (
        state(reference=of_reference(), cycles=cycles(50), commissioned=known(), is_identifying=True),
        BUSY,
        "masses, lengths and friction of this leg are identified in 20 gait cycles (20 s); a reference with "
        "them follows",
    ),
    "another motion": (
        state(reference=of_reference(), cycles=cycles(50), waiting=cycles(15, 75.0), unused=UNLIKE),
        IDLE,
        "a reference for it is begun in 5 gait cycles (4 s)",
    ),
    "another motion, simulated": (
        state(reference=of_reference(), cycles=cycles(50), waiting=cycles(15, 75.0), unused=UNLIKE),
        BUSY,
        "gait cycles at this cadence are compared in 25 gait cycles (20 s)",
    ),
    "a ramp": (
        state(reference=of_reference(), cycles=cycles(50), waiting=cycles(2, 67.0), unused=RAMP),
        IDLE,
        "",
    ),
}


@pytest.mark.parametrize("step", STEPS)
def test_the_next_step_says_what_is_known_then_and_when(step: str) -> None:
    now, references, words = STEPS[step]
    assert next_step(now, references, CONFIG) == words


def test_what_is_known_of_a_cadence_without_a_baseline_of_its_own() -> None:
    other = AtCadence(of_reference(), SENSOR, known(), cycles(50))
    now = state(reference=of_reference(75.0), cycles=cycles(30, 75.0), set_aside=(other,))
    models = SimpleNamespace(is_sure=lambda _: True)
    assert doubt(now, IDLE, models) == "changes at this cadence are not observed yet; at 60 rpm they are"
    assert next_step(now, IDLE, CONFIG).endswith("is complete in 20 gait cycles (16 s)")


def test_what_is_missing_does_not_repeat_the_next_step() -> None:
    other = state(reference=of_reference(), cycles=cycles(20))
    assert missing(other, IDLE, CONFIG) == (
        "the drive torque is not that of the mechanism file (late, filtered, loaded, or of another leg)"
    )
    unlike = state(reference=of_reference(), cycles=cycles(50), waiting=cycles(4, 75.0), unused=UNLIKE)
    assert missing(unlike, IDLE, CONFIG) == ("the crank turns otherwise than in the references (60 rpm)")


def test_a_ramp_is_recognised_and_a_start_raises_no_doubt() -> None:
    models = SimpleNamespace(is_sure=lambda _: True)
    ramp = state(reference=of_reference(), cycles=cycles(19), commissioned=known(), waiting=cycles(2, 67.0))
    ramp.unused = RAMP
    assert doubt(ramp, IDLE, models) == (
        "the cadence changes, now 67 rpm; gait cycles are compared at 60 rpm"
    )
    ramp.unused = (NotUsed.STANDSTILL, NotUsed.UNLIKE, NotUsed.UNLIKE)
    assert doubt(ramp, IDLE, models) == ""


def test_a_torque_that_no_clearances_explain_is_reported_with_what_to_do() -> None:
    """Twice the noise, half the scale or lost samples: nothing was observed, without a reason."""
    models = SimpleNamespace(is_sure=lambda _: True)
    fits = [ClearanceFit(NEW, np.eye(5), square, 0.0) for square in (1.0, 4.0)]
    known_leg = {"reference": of_reference(), "cycles": cycles(50), "commissioned": known()}
    explained, other = (state(**known_leg, fit=fit) for fit in fits)
    assert doubt(explained, IDLE, models) == ""
    assert doubt(other, IDLE, models).startswith(
        "the drive torque is not that of the commissioned leg, and no clearances explain it; they are "
    )
    assert doubt(other, IDLE, models).endswith("the leg is commissioned again")
    other.commissioned = None
    assert doubt(other, IDLE, models) == ""


def test_a_healthy_leg_is_told_how_well_it_is_known_and_what_comes_next() -> None:
    found = Diagnosis(
        state=DiagnosisState.AS_COUNTED,
        next_step="the baseline is complete in 40 gait cycles (40 s)",
        cycles=10,
        clearance_m=(3.0e-4, math.nan),
        sigma_m=(2.0e-5, math.nan),
    )
    (hit,) = nothing_found(Situation(diagnosis=found, mismatch_limit=0.1))
    assert hit.words["observed"].endswith(
        "; 10 gait cycles show clearances to ± 0.02 mm; the baseline is complete in 40 gait cycles (40 s)"
    )


def test_a_force_on_the_foot_that_has_two_sizes_is_not_observable() -> None:
    load = GroundLoad(np.zeros((128, 2)), 40.0, 30.0, 0.1, 0.5, 0.0, 1.0, 9.0, other_n=95.0)
    on_ground = SimpleNamespace(**vars(IDLE), is_load_left_out=lambda _: False)
    models = SimpleNamespace(is_sure=lambda _: False)
    now = state(reference=of_reference(), cycles=cycles(50), commissioned=known(), load=load)
    reason = doubt(now, on_ground, models)
    assert reason.endswith("not observable: 40 N and 95 N explain its drive torque as well")
    now.load = attrs.evolve(load, other_n=math.nan)
    assert "not observable" not in doubt(now, on_ground, models)


def test_a_leg_on_the_ground_is_identified_before_what_is_left_counts_as_the_shape_of_the_force() -> None:
    models = LegModels(load_mechanism("bionic_leg"))

    def is_of_file(misfit: float, loaded: bool, rounds: int) -> bool:
        carried = SimpleNamespace(load=np.zeros((128 if loaded else 0, 2)))
        now = state(reference=SimpleNamespace(parameters=carried), rounds=rounds)
        with mock.patch.object(models, "misfit", lambda _: misfit):
            return models.is_of_file(now)

    assert not is_of_file(1.2, loaded=True, rounds=0) and not is_of_file(1.2, loaded=True, rounds=ROUNDS - 1)
    assert is_of_file(1.2, loaded=True, rounds=ROUNDS) and not is_of_file(1.2, loaded=False, rounds=ROUNDS)
    assert is_of_file(0.5, loaded=True, rounds=0) and not is_of_file(3.0, loaded=True, rounds=ROUNDS)


def test_no_joint_is_corrected_where_the_drive_hides_it_or_the_leg_is_not_known_well() -> None:
    """Behind a mean over 40 ms, I at 0.45 mm was corrected as J; a mean over 20 ms is 22 Hz."""
    models = LegModels(load_mechanism("bionic_leg"))

    def found(misfit: float, channel: Channel, cycle_s: float = 1.0) -> tuple[bool, str]:
        sensor = attrs.evolve(SENSOR, channel=channel, cycle_s=cycle_s)
        reference = SimpleNamespace(parameters=SimpleNamespace(load=np.zeros((0, 2))))
        now = state(reference=reference, sensor=sensor, commissioned=known(), cycles=cycles(50))
        with mock.patch.object(models, "misfit", lambda _: misfit):
            return models.is_sure(now), doubt(now, IDLE, models)

    hidden = "the drive passes 11 Hz of the torque: names of joints are not sure, none is corrected"
    assert found(0.4, Channel(mean_s=0.04)) == (False, hidden)
    assert found(0.4, Channel(mean_s=0.02)) == (True, "") == found(0.4, Channel(mean_s=0.04), cycle_s=2.0)
    is_sure, reason = found(0.7, DIRECT)
    assert not is_sure and reason.startswith("the model does not fit this leg")


def test_a_leg_is_identified_until_scatter_is_left_and_one_of_an_earlier_run_where_it_is_unlike() -> None:
    mechanism = load_mechanism("bionic_leg")
    models = LegModels(mechanism)
    references, own = References(mechanism, models), LegParameters.none(mechanism)

    def is_to_identify(misfit: float, rounds: int, known: LegParameters | None) -> bool:
        now = state(reference=SimpleNamespace(parameters=own), rounds=rounds, parameters=known)
        with mock.patch.object(models, "misfit", lambda _: misfit):
            return references.is_to_identify(now)

    assert is_to_identify(0.7, 0, None) and not is_to_identify(0.5, 0, None)
    assert is_to_identify(0.5, ROUNDS - 1, own) and not is_to_identify(0.4, ROUNDS - 1, own)
    assert not is_to_identify(0.7, ROUNDS, own)
    earlier = attrs.evolve(own, friction=1.2)
    assert not is_to_identify(0.7, 0, earlier) and is_to_identify(0.9, 0, earlier)
    loaded = attrs.evolve(own, load=np.ones((PHASES, 2)))  # its load was found, its bodies were not looked at
    assert is_to_identify(0.5, 0, loaded) and not is_to_identify(0.4, 0, loaded)
