"""For which joints a torque is good enough: a good sensor for all, a poor one for none, with the reason."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import attrs
import numpy as np
import pytest

from leg_wear_monitor import Mechanism, MonitorConfig
from leg_wear_monitor.commissioning import detection
from leg_wear_monitor.commissioning.detection import LEAST_CYCLES, Walk, joint_detections, with_detections
from leg_wear_monitor.commissioning.result import (
    CommissioningItem,
    CommissioningResult,
    JointDetection,
    judgement,
)
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.estimate.signature import TorqueSensor, simulated_signatures
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references
from leg_wear_monitor.monitor.diagnosis.state import SignedCycle
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import CrankProfile
from leg_wear_monitor.twin.torque_reference import TorqueReference

MakeWalk = Callable[..., Walk]
RESULT = CommissioningResult(
    items=(CommissioningItem(name="crank.sign", value=1),),
    not_told=(),
    findings=(),
    notes=(),
    config=MonitorConfig(),
    turns=60.0,
)


@pytest.fixture(scope="module")
def default_leg(leg: Mechanism) -> Mechanism:
    return fitted(leg, MonitorConfig())


@pytest.fixture(scope="module")
def reference(default_leg: Mechanism) -> TorqueReference:
    return shipped_references(default_leg)[0]


@pytest.fixture(scope="module")
def walked(default_leg: Mechanism, reference: TorqueReference) -> MakeWalk:
    """Make a walk of the simulated new leg, as a sensor shows it."""

    def make(rate_hz: float = 200.0, noise_nm: float = 0.5, cycles: int = 60, rpm: float = 60.0) -> Walk:
        size_nm = torque_size(build_linkage(default_leg), TURN)
        sensor = TorqueSensor(1.0 / rate_hz, 1.0, size_nm)
        # the second half: the first cycles are those of the expected leg
        rows = simulated_signatures(reference, 0, attrs.evolve(sensor, noise_nm=noise_nm))[-cycles:]
        profile = CrankProfile.steady(TURN * rpm / 60.0)
        made = (SignedCycle(i, i + 1, row, profile, 0.0) for i, row in enumerate(rows))
        return Walk(default_leg, MonitorConfig(), np.zeros(cycles), tuple(made), sensor)

    return make


@pytest.fixture(scope="module")
def good(walked: MakeWalk) -> CommissioningResult:
    """Of a good torque, with the reference that is there."""
    return with_detections(RESULT, walked(), None)


def test_a_good_torque_shows_every_joint_by_the_reference_that_is_there(good: CommissioningResult) -> None:
    assert good.reference_used == "the one that comes with the package"
    assert good.reference is None
    found = good.joints
    assert [one.joint for one in found] == ["A", "B", "G", "I", "J"]
    assert all(one.is_good and not one.reason for one in found)
    for one in found:
        assert one.clearances_m == pytest.approx((4.5e-4, 6.0e-4))
        assert one.cycles[1] <= one.cycles[0]
        assert one.named_cycles[1] < 20
    assert judgement(found) == "this torque is good enough for joints A, B, G, I, J"


def test_a_slow_sensor_shows_some_joints_and_says_what_is_wrong(
    walked: MakeWalk, reference: TorqueReference
) -> None:
    found = {one.joint: one for one in joint_detections(walked(rate_hz=50.0), reference)}
    assert found["A"].is_good
    poor = [one for one in found.values() if not one.is_good]
    assert poor
    assert all("50 samples a second are too few, 200 would do" in one.reason for one in poor)


def test_a_noisy_torque_takes_longer(
    good: CommissioningResult, walked: MakeWalk, reference: TorqueReference
) -> None:
    noisy = joint_detections(walked(noise_nm=6.0), reference)
    for one, other in zip(good.joints, noisy, strict=True):
        assert not other.cycles[0] < one.cycles[0]


def test_a_torque_that_is_not_that_of_the_leg_is_good_for_no_joint(
    walked: MakeWalk, reference: TorqueReference
) -> None:
    walk = walked()
    strange = np.concatenate([20.0 * np.sin(np.linspace(0.0, 9.0 * TURN, 80)), np.ones(80)])
    cycles = tuple(one._replace(signature=one.signature + strange) for one in walk.cycles)
    found = joint_detections(attrs.evolve(walk, cycles=cycles), reference)
    assert not any(one.is_good for one in found)
    assert judgement(found).startswith(
        "this torque is not good enough for joints A, B, G, I, J, because it is not"
    )


def test_the_sentence_names_joints_by_their_reason() -> None:
    def one(joint: str, reason: str = "") -> JointDetection:
        numbers = {"clearances_m": (1e-3,), "cycles": (2.0,), "named_cycles": (2.0,)}
        return JointDetection(joint=joint, is_good=not reason, runner_up="", reason=reason, **numbers)

    assert judgement([]) == ""
    assert judgement([one("A"), one("B", "noise"), one("C", "noise"), one("D", "rate")]) == (
        "this torque is good enough for joint A; not for joints B, C, because noise; "
        "nor for joint D, because rate"
    )
    assert judgement([one("A", "noise")]) == "this torque is not good enough for joint A, because noise"


def test_without_a_reference_the_joints_are_not_judged(walked: MakeWalk) -> None:
    result = with_detections(RESULT, walked(rpm=45.0), None)
    assert result.joints == ()
    assert "there is no torque reference of bionic_leg at 45 rpm" in result.reference_used
    assert "in 43 gait cycles (57 s); --reference FILE simulates it now" in result.reference_used


def test_a_reference_that_is_asked_for_is_simulated_and_named(
    walked: MakeWalk, reference: TorqueReference, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, used = SimpleNamespace(profiles=()), []

    def simulated(_mechanism: Mechanism, profiles: list[CrankProfile], _progress: object) -> object:
        asked.profiles = profiles
        return (reference,)

    monkeypatch.setattr(detection, "simulated_under", simulated)
    monkeypatch.setattr(detection, "joint_detections", lambda _walk, made: used.append(made) or ())
    result = with_detections(RESULT, walked(), Path("leg.npz"))
    assert [one.cadence_rpm for one in asked.profiles] == [pytest.approx(60.0)]
    assert result.reference is reference is used[0]
    assert result.config is not None
    assert result.config.diagnosis.reference == "leg.npz"
    assert "reference: leg.npz" in result.to_yaml()


def test_too_few_gait_cycles_are_reported(walked: MakeWalk) -> None:
    few = walked(cycles=LEAST_CYCLES - 1)
    assert "fewer than 8 gait cycles" in with_detections(RESULT, few, None).reference_used
    with pytest.raises(LegWearError, match="--reference: the recording has 7 gait cycles"):
        with_detections(RESULT, few, Path("leg.npz"))
