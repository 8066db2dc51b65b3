"""A robot's signs, gear, offset, source and scale come back from a recording, or are not enough to tell."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from leg_wear_monitor import LegWearError, Mechanism, MonitorConfig, simulate
from leg_wear_monitor.commissioning.commission import commission, propose
from leg_wear_monitor.commissioning.proposal import CommissioningResult
from leg_wear_monitor.estimate.joint_motion import Series
from leg_wear_monitor.estimate.torque_model import TorqueModel
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.inputs import EFFORT, FLOAT64, INTERFACE, WRENCH
from leg_wear_monitor.monitor.config.parameters import config_from, load_config
from leg_wear_monitor.recordings.series import JointName, Signals, TorqueSource

from .conftest import MakeWalk, Record, Robot, Walk, columns_of

CRANK = JointName("/joint_states", "crank")
SENSOR = TorqueSource(WRENCH, "/drive_torque", "z")
NS = {"table.units.stamp": "ns"}
Propose = Callable[..., CommissioningResult]
# What clearances of 0.3 mm in five joints do to phase and torque, at 60 rpm in ten turns
PHASE_RAD = 0.03
SIGMA = 0.04  # fraction of the scale: joints with clearance leave a tenth of the torque unexplained


def random_robot(seed: int) -> Robot:
    rng = np.random.default_rng(seed)
    gear = float(rng.choice([1.0, 1.0, 0.5, 6.25, 9.0, 27.5, 50.0, 100.0]))
    return Robot(
        sign=int(rng.choice([1, -1])),
        gear_ratio=gear,
        offset_rad=float(rng.uniform(-3.0, 3.0)),
        source=str(rng.choice([WRENCH, EFFORT, FLOAT64])),
        axis=str(rng.choice(list("xyz"))),
        torque_sign=int(rng.choice([1, -1])),
        scale=float(rng.choice([1.0, 0.8, 4.448, 1.0e-3])),
        angle_noise_rad=float(rng.choice([1.0e-4, 1.0e-3, 3.0e-3])),
        torque_noise_nm=float(rng.choice([0.05, 0.3, 1.0])),
        is_wrapped=gear == 1.0 and bool(rng.integers(2)),
        seed=seed,
    )


def angle_between(a: float, b: float) -> float:
    return abs((a - b + math.pi) % TURN - math.pi)


def check(robot: Robot, result: CommissioningResult, seconds: float) -> None:
    """All are those of the robot; gear and offset within the error of the model, scale within 2 sigma."""
    assert result.config is not None, result.not_told
    crank, torque = result.config.crank, result.config.drive_torque
    assert result.config.crank_joint == "crank"
    assert (crank.sign, torque.sign) == (robot.sign, robot.torque_sign)
    assert torque.source == robot.source
    assert torque.axis == robot.axis or robot.source != WRENCH
    sigma = result.item("drive_torque.scale").sigma * torque.gear_ratio / robot.scale
    assert sigma < SIGMA
    assert abs(torque.scale * torque.gear_ratio / robot.scale - 1.0) < 2.0 * sigma
    text = " ".join(result.not_told)
    if "crank.gear_ratio" in text:
        turned = TURN * seconds  # at 60 rpm
        assert abs(crank.gear_ratio / robot.gear_ratio - 1.0) * turned < 2.0 * PHASE_RAD
        return
    assert crank.gear_ratio == robot.gear_ratio
    assert angle_between(crank.offset_rad, robot.offset_rad) < PHASE_RAD


ROBOTS = {
    # another joint's current, a temperature and a wrench of noise are beside it
    "current": Robot(
        sign=-1, gear_ratio=9.0, source=INTERFACE, torque_sign=-1, scale=4.448, offset_rad=1.0, seed=0
    ),
    "effort": Robot(gear_ratio=0.5, source=EFFORT, torque_noise_nm=1.0, scale=0.8, offset_rad=-2.0, seed=1),
    "number": Robot(
        sign=-1, gear_ratio=27.5, source=FLOAT64, torque_sign=-1, scale=1.0e-3, angle_noise_rad=3.0e-3, seed=2
    ),
    "wrench": Robot(axis="x", is_wrapped=True, torque_noise_nm=0.3, offset_rad=2.8, seed=3),
}


@pytest.mark.parametrize("name", ROBOTS)
def test_the_parameters_of_a_robot_come_back(name: str, walked: Walk, record: Record, tmp_path: Path) -> None:
    robot = ROBOTS[name]
    result = commission(record(tmp_path / "robot.mcap", robot, walked))
    assert not result.faults and not result.findings
    check(robot, result, walked.time_s[-1])
    assert result.config is not None
    assert (result.config.drive_torque.interface == "motor_current") == (name == "current")


@pytest.mark.slow  # the test before holds it for a robot of each source
@pytest.mark.parametrize("seed", range(10))
def test_ten_robots(seed: int, walked: Walk, record: Record, tmp_path: Path) -> None:
    robot = random_robot(seed)
    result = commission(record(tmp_path / "robot.mcap", robot, walked))
    assert not result.faults and not result.findings
    check(robot, result, walked.time_s[-1])


def signals_of(robot: Robot, walk: Walk) -> Signals:
    position, torque = columns_of(robot, walk)
    joints = {CRANK: Series(walk.time_s, position)}
    return Signals(joints, {SENSOR: Series(walk.time_s, torque)})


@pytest.fixture
def proposed(leg: Mechanism, model: TorqueModel) -> Propose:
    """Propose parameters from signals in memory."""

    def run(signals: Signals, crank_joint: str | None = None, **changes: Any) -> CommissioningResult:
        base = attrs.evolve(MonitorConfig(), **changes)
        return propose(signals, fitted(leg, base), base, crank_joint, model=model)

    return run


@pytest.mark.parametrize(
    ("sign", "torque_sign", "rpm"), [(1, 1, 70.0), (1, -1, -70.0), (-1, 1, -70.0), (-1, -1, 70.0)]
)
def test_an_ideal_leg_gives_back_what_it_was_made_with(
    sign: int,
    torque_sign: int,
    rpm: float,
    ideal_walk: MakeWalk,
    proposed: Propose,
) -> None:
    robot = Robot(sign=sign, torque_sign=torque_sign, gear_ratio=31.0, offset_rad=2.0, torque_noise_nm=1.0e-3)
    result = proposed(signals_of(robot, ideal_walk(rpm, friction_nm=0.5)))
    assert result.config is not None
    assert (result.config.crank.sign, result.config.drive_torque.sign) == (sign, torque_sign)
    assert result.config.crank.gear_ratio == 31.0
    # averages are assumed, which are late by half of 5 ms
    shift = rpm * TURN / 60.0 * 0.0025
    assert angle_between(result.config.crank.offset_rad, 2.0 + shift) < 2.0e-3
    assert result.item("friction").value == pytest.approx(0.5, abs=0.02)
    assert result.config.cadence.commanded_rpm == pytest.approx(rpm, abs=1.0)


def test_another_unit_of_the_torque_changes_the_scale_alone(walked: Walk, proposed: Propose) -> None:
    one, other = (proposed(signals_of(Robot(scale=scale), walked)) for scale in (4.0, 4.0e-3))
    for name in ("crank.offset_rad", "crank.gear_ratio", "drive_torque.sign"):
        assert one.item(name).value == other.item(name).value
    assert one.item("crank.sign").mismatch == pytest.approx(other.item("crank.sign").mismatch, rel=1.0e-6)
    scales = [each.item("drive_torque.scale").value for each in (one, other)]
    assert scales[0] == pytest.approx(1000.0 * float(scales[1]), rel=1.0e-3)


def test_a_lag_that_is_not_declared_is_part_of_the_offset(ideal_walk: MakeWalk, proposed: Propose) -> None:
    result = proposed(signals_of(Robot(torque_noise_nm=0.01), ideal_walk(60.0)))
    (lag,) = result.not_told
    assert "declare drive.lag_s" in lag


def test_a_lag_is_within_the_sigma_of_the_offset(walked: Walk, proposed: Propose) -> None:
    """What cannot be told apart is in the error: the declared lag, 5 ms, times the speed."""
    for lag_s in (0.0, 0.005):
        offset = proposed(signals_of(Robot(lag_s=lag_s, offset_rad=0.3), walked)).item("crank.offset_rad")
        assert offset.sigma is not None
        assert offset.sigma > 0.005 * TURN
        assert angle_between(float(offset.value), 0.3) < 2.0 * offset.sigma


def test_the_limit_of_the_mismatch_is_that_of_the_leg(leg: Mechanism) -> None:
    """A torque of which a part is not the model's would raise the alarm in each gait cycle.

    Of a table in memory, with times in nanoseconds and an encoder that counts the other way.
    """
    ideal, config = simulate(leg, clearances=[], cycles=1, trace=200).trace, config_from(NS)
    angle, random, limits = np.tile(ideal.crank_angle_rad, 16), np.random.default_rng(1), []
    for strange_nm in (0.0, 2.5):
        torque = np.tile(ideal.drive_torque_nm, 16) + strange_nm * np.sin(9.0 * angle)
        table = {
            "time": 10**9 + 5_000_000 * np.arange(len(angle)),
            "crank_angle": 1.0 - angle,
            "drive_torque": torque + 0.1 * random.standard_normal(len(angle)),
        }
        result = commission(table, config)
        assert result.config is not None and result.config.table == config.table
        assert result.item("crank.sign").value == -1
        assert result.item("crank.offset_rad").value == pytest.approx(1.0, abs=0.03)
        (item,) = (each for each in result.items if each.name == "limits.torque_mismatch")
        assert result.config.limits.torque_mismatch == item.value
        limits.append(item.value)
    # a leg without clearance, whose instants are taken as averages, has 0.12; 1.8 of 9.2 N m RMS are added
    assert MonitorConfig().limits.torque_mismatch <= limits[0] < 0.2
    # the filter before the comparison takes some of it
    assert 1.2 * limits[0] < limits[1] < math.hypot(0.14, 1.8 / 9.2) / 0.8


def test_two_legs_in_one_recording_are_not_enough_to_tell(walked: Walk, proposed: Propose) -> None:
    one = signals_of(Robot(), walked)
    left, right = CRANK, JointName("/joint_states", "right_crank")
    joints = {
        left: one.joints[left],
        right: attrs.evolve(one.joints[left], value=one.joints[left].value + 3.14),
    }
    result = proposed(Signals(joints, one.torques))
    assert result.config is None
    assert any("--crank-joint" in text for text in result.not_told)
    assert proposed(Signals(joints, one.torques), "right_crank").config is not None


def test_two_encoders_on_one_shaft_are_not_enough_to_tell(walked: Walk, proposed: Propose) -> None:
    one, motor = signals_of(Robot(), walked), signals_of(Robot(gear_ratio=50.0, seed=1), walked)
    joints = {JointName("/joint_states", "motor"): motor.joints[CRANK], **one.joints}
    result = proposed(Signals(joints, one.torques))
    assert result.config is None
    assert any("--crank-joint" in text for text in result.not_told)


def test_two_sensors_of_one_torque_are_alike(walked: Walk, proposed: Propose) -> None:
    one, other = signals_of(Robot(), walked), signals_of(Robot(torque_noise_nm=0.2, seed=1), walked)
    effort = TorqueSource(WRENCH, "/gear_torque", "x")
    result = proposed(Signals(one.joints, {effort: other.torques[SENSOR], **one.torques}))
    assert result.config is not None


def test_a_torque_that_looks_the_same_mirrored_and_noise_are_not_enough_to_tell(
    ideal_walk: MakeWalk, proposed: Propose
) -> None:
    walk = ideal_walk(60.0)
    symmetric = 9.0 * np.cos(walk.angle_rad) + 4.0 * np.cos(2.0 * walk.angle_rad)
    mirrored = proposed(signals_of(Robot(), attrs.evolve(walk, torque_nm=symmetric)))
    assert mirrored.config is None
    assert any("crank.sign" in text for text in mirrored.not_told)
    noise = np.random.default_rng(1).standard_normal(len(walk.time_s))
    noisy = proposed(signals_of(Robot(), attrs.evolve(walk, torque_nm=noise)))
    assert noisy.config is None
    assert any("whatever the parameters" in text for text in noisy.not_told)
    assert noisy.findings == ()  # neither zeros nor friction of a leg that is not seen


NO_WALK: dict[str, tuple[Callable[[Walk], dict[str, Any]], str]] = {
    "it is short": (
        lambda walk: {name: column[:800] for name, column in attrs.asdict(walk).items()},
        r"crank was recorded for \S+ s only. Expected at least 10 s",
    ),
    "the leg stands": (
        lambda walk: {"angle_rad": 0.0 * walk.angle_rad},
        r"no joint turns continuously like a crank: crank moves by 0\.0",
    ),
    "a joint swings": (lambda walk: {"angle_rad": np.sin(walk.angle_rad)}, "crank swings to and fro"),
    "turns": (lambda walk: {"angle_rad": walk.angle_rad / TURN % 1.0}, "seems to be in turns"),
    "degrees": (lambda walk: {"angle_rad": np.degrees(walk.angle_rad) % 360.0}, "seems to be in degrees"),
    "the torque is zero": (lambda walk: {"torque_nm": 0.0 * walk.torque_nm}, "no torque changes"),
    "the torque is constant": (lambda walk: {"torque_nm": 0.0 * walk.torque_nm + 3.7}, "no torque changes"),
    "the torque is tiny": (lambda walk: {"torque_nm": 1.0e-308 * walk.torque_nm}, "no torque changes"),
}


@pytest.mark.parametrize("case", NO_WALK)
def test_what_is_no_walk_is_refused(case: str, walked: Walk, proposed: Propose) -> None:
    changes, fault = NO_WALK[case]
    other = attrs.evolve(walked, **changes(walked))
    with pytest.raises(LegWearError, match=fault):
        proposed(signals_of(Robot(torque_noise_nm=0.0), other))


def walking_table(pause_s: float = 0.0, scatter_ns: float = 0.0) -> dict[str, np.ndarray]:
    """A walk of 16 gait cycles at 60 rpm, with a pause after the first half, and late by random times."""
    ideal = simulate("bionic_leg", clearances=[], cycles=1, trace=200).trace
    angle, random = np.tile(ideal.crank_angle_rad, 16), np.random.default_rng(1)
    stamp_ns = 10**18 + 5_000_000 * np.arange(len(angle))
    stamp_ns += np.where(np.arange(len(angle)) < len(angle) // 2, 0, round(1.0e9 * pause_s))
    stamp_ns = np.maximum.accumulate(stamp_ns + random.exponential(scatter_ns, len(angle)).astype(np.int64))
    torque = np.tile(ideal.drive_torque_nm, 16) + 0.1 * random.standard_normal(len(angle))
    return {"time": stamp_ns, "crank_angle": angle, "drive_torque": torque}


def test_a_pause_of_a_week_needs_no_memory() -> None:
    result = commission(walking_table(pause_s=7.0 * 86400.0), config_from(NS))
    assert result.config is not None and result.config.crank.gear_ratio == 1.0
    assert result.item("cadence.commanded_rpm").value == pytest.approx(60.0, abs=0.5)


def test_what_a_replay_would_report_of_the_input_is_refused() -> None:
    result = commission(walking_table(scatter_ns=2.0e6), config_from(NS))
    assert result.config is None
    assert any("header.stamp" in text for text in result.not_told)  # the stamps scatter by 2 ms


def test_a_missing_torque_is_refused(walked: Walk, proposed: Propose) -> None:
    with pytest.raises(LegWearError, match="no torque was recorded, or only NaN: expected"):
        proposed(attrs.evolve(signals_of(Robot(), walked), torques={}))


def test_the_result_goes_out_as_json_as_parameters_and_as_a_table(
    walked: Walk, proposed: Propose, tmp_path: Path
) -> None:
    result = proposed(signals_of(Robot(sign=-1, offset_rad=1.0), walked))
    assert json.loads(result.to_json()) == result.to_dict()
    (tmp_path / "monitor.yaml").write_text(result.to_yaml())
    assert load_config(tmp_path / "monitor.yaml") == result.config
    with pytest.raises(LegWearError, match=r"no parameters are proposed: crank\.sign: why"):
        attrs.evolve(result, config=None, not_told=("crank.sign: why",)).to_yaml()
    pytest.importorskip("pandas")
    table = result.to_pandas()
    assert table.loc["crank.sign", "value"] == -1
    assert list(table.index) == [item.name for item in result.items]


def test_a_declared_lag_is_no_part_of_the_offset(
    ideal_walk: MakeWalk, leg: Mechanism, model: TorqueModel
) -> None:
    """13 ms of lag are 0.082 rad at 60 rpm; half a sampling interval is a part of them."""
    robot = Robot(offset_rad=0.3, lag_s=0.013, torque_noise_nm=0.01)
    signals, base = signals_of(robot, ideal_walk(60.0)), load_config()
    base = attrs.evolve(base, drive=attrs.evolve(base.drive, lag_s=0.0105))
    result = propose(signals, fitted(leg, base), base, model=model)
    offset = result.item("crank.offset_rad")
    assert offset.sigma is not None and offset.sigma < 0.05
    assert angle_between(float(offset.value), 0.3) < 5.0e-3
    assert result.not_told == ()


def test_load_friction_is_found_and_moves_nothing(ideal_walk: MakeWalk, proposed: Propose) -> None:
    walk = ideal_walk(40.0, 90.0, friction_nm=0.5)
    rubbing = attrs.evolve(walk, torque_nm=walk.torque_nm + 0.25 * np.abs(walk.torque_nm))
    without, result = (proposed(signals_of(Robot(offset_rad=0.3), one)) for one in (walk, rubbing))
    load_friction, friction = result.item("load friction"), result.item("friction")
    assert load_friction.value == pytest.approx(0.25, abs=0.01)
    assert without.item("load friction").value == pytest.approx(0.0, abs=0.01)
    assert friction.value == pytest.approx(0.5 * 1.25, abs=0.1)
    offset = without.item("crank.offset_rad").value
    assert result.item("crank.offset_rad").value == pytest.approx(offset, abs=5.0e-3)
