"""The synthetic leg, and what arrives of its sensors."""

import math
from collections import Counter
from typing import Any

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from readings_as_samples import samples

from leg_wear_monitor import ConfigError, load_mechanism, simulate
from leg_wear_monitor.configuration import FieldError
from leg_wear_monitor.dynamics.run import CrankMotion, quintic
from leg_wear_monitor.gait.config import (
    EncoderConfig,
    GaitConfig,
    KnockConfig,
    LoadConfig,
    PaceConfig,
    TorqueSensorConfig,
    TransportConfig,
)
from leg_wear_monitor.gait.leg import POINTS, Ground, Instant, Pace, SyntheticLeg
from leg_wear_monitor.gait.sensors import Reading, readings
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.person import FORE_AFT, nominal_stance
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle, point_motion
from leg_wear_monitor.twin import CRANK, TORQUE
from leg_wear_monitor.twin.sample import NO_FAULT

# The synthetic leg: its motion, the ground under it, the pace of its simulation.


# The synthetic leg: it moves as the full-coordinate simulation does, and knows its own wear.


STOP = PaceConfig(times_s=(0.0, 0.3), speeds_rpm=(60.0, 0.0), ramp_s=0.3)


@pytest.mark.chaotic
@pytest.mark.parametrize("faster, bound", [(1.0, 1.0e-3), (1.0e4, 0.02)])
def test_one_loose_joint_wears_as_in_the_simulation(faster: float, bound: float) -> None:
    """Through its first impacts, in a twentieth of a cycle: until then a last bit does not part the motions.

    Off by -9.4e-5, sigma 2e-8, and by -0.0076, sigma 6e-6, where ten thousand times the wear has opened the
    joint meanwhile; after two cycles the sigma is 0.03. From 30 starts moved by 1e-12, 2026-11-23.
    """
    leg = SyntheticLeg(GaitConfig(clearance_joints=("A",), wear_acceleration=faster))
    leg.advance(0.05)
    span = {"skip_cycles": 0, "cycles": 0.05}
    figures = simulate(load_mechanism("bionic_leg"), clearances=["A"], model="full", **span)
    assert figures.impacts["A"]
    depth = figures.joints["A"].wear_depth_m_per_cycle
    expected = 0.05 * faster * (depth.bushing_mean + depth.journal_mean)
    assert leg.clearance_m()[0] - 3.0e-4 == pytest.approx(expected, rel=bound)


def test_friction_of_the_drive_adds_to_its_torque() -> None:
    plain, braked = (
        SyntheticLeg(GaitConfig(load=LoadConfig(friction_nm=friction))).advance(0.5).torque_impulse
        for friction in (0.0, 3.0)
    )
    assert braked - plain == pytest.approx(1.5, rel=1e-9)


def test_the_truth_has_an_entry_a_cycle() -> None:
    leg = SyntheticLeg(GaitConfig(wear_acceleration=1.0e4))
    leg.advance(2.5)
    truth = leg.truth()
    assert truth["cycle_end_s"] == pytest.approx([0.0, 1.0, 2.0], abs=0.01)
    for name in leg.clearance_joints:
        column = truth["clearance_m"][name]
        assert len(column) == 4
        assert (np.diff(column) > 0.0).all()


def test_a_leg_that_stands_hardly_wears() -> None:
    """Friction with a ramp lets journals creep where they hang; that is all that is left."""
    leg = SyntheticLeg(GaitConfig(pace=STOP, wear_acceleration=1.0e4))
    start = leg.clearance_m()
    leg.advance(1.0)
    walked = leg.clearance_m() - start
    leg.advance(2.0)
    assert (leg.clearance_m() - start - walked < 0.05 * walked).all()


def test_a_leg_can_start_from_standing() -> None:
    pace = PaceConfig(times_s=(0.0, 0.4), speeds_rpm=(0.0, -60.0), ramp_s=0.3)
    leg = SyntheticLeg(GaitConfig(pace=pace))
    assert leg.advance(1.0).crank.speed == pytest.approx(-2.0 * np.pi)


def test_a_knock_opens_one_joint_at_its_time() -> None:
    leg = SyntheticLeg(GaitConfig(knock=KnockConfig(joint="G", at_s=0.25, clearance_m=1.0e-3)))
    leg.advance(0.24)
    assert leg.clearance_m() == pytest.approx(3.0e-4, rel=1e-3)
    leg.advance(0.26)
    assert leg.clearance_m()[leg.clearance_joints.index("G")] == pytest.approx(1.0e-3, rel=1e-3)


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        (
            {"clearances_m": (1e-4,)},
            "gait: clearances_m: has 1 values. Expected one each for A, B, G, I, J",
        ),
        ({"knock": KnockConfig(joint="C")}, "gait: knock.joint: 'C' is none of A, B, G, I, J"),
        ({"mechanism": "no_leg"}, "no_leg: no mechanism of this name"),
        (
            {"mechanism": "four_bar", "load": LoadConfig(person_kg=80.0)},
            "four_bar.yaml: bodies: has no thigh",
        ),
        (
            {"mechanism": "slider_crank", "load": LoadConfig(ground_n=1.0)},
            "slider_crank.yaml: bodies: has no p",
        ),
    ],
)
def test_what_the_leg_cannot_be_is_refused_in_a_line(changes: dict[str, object], line: str) -> None:
    with pytest.raises(ConfigError) as refused:
        SyntheticLeg(GaitConfig(**changes))
    assert str(refused.value).startswith(line)


# The ground under the synthetic leg: the force that was asked for, another one each step, on the leg.


LEG = load_mechanism("bionic_leg")
SPEED = TURN  # rad/s
EVEN: dict[str, Any] = {"amplitude_scatter": 0.0, "timing_scatter": 0.0}


def ground(rpm: float = 60.0, **load: Any) -> Ground:
    pace = PaceConfig(speeds_rpm=(rpm,))
    return Ground(LEG, GaitConfig(load=LoadConfig(ground_n=300.0, **load), pace=pace))


def starts_and_ends(force: Floats) -> tuple[float, float]:
    """Crank angles [turns] between which a force acts on the foot."""
    in_stance = np.flatnonzero(force[:, 1])
    return in_stance[0] / POINTS, in_stance[-1] / POINTS


def test_without_scatter_it_is_the_template_between_nominal_ends() -> None:
    force, stance = ground(**EVEN).step(SPEED), nominal_stance(build_linkage(LEG))
    assert force == pytest.approx(300.0 * stance.force(FORE_AFT, POINTS), abs=1e-9)
    assert force[:, 1].max() == pytest.approx(300.0, rel=1e-3)
    assert np.abs(force[:, 0]).max() == pytest.approx(300.0 * FORE_AFT, rel=1e-3)


def test_steps_scatter_in_size_and_time() -> None:
    """2000 steps: sample deviations are within 8 % of the true ones, five times their standard error."""
    drawn = ground()
    steps = [drawn.step(SPEED) for _ in range(2000)]
    peaks = np.array([force[:, 1].max() for force in steps])
    begins = np.array([starts_and_ends(force)[0] for force in steps])
    assert peaks.mean() == pytest.approx(300.0, rel=0.012)
    assert peaks.std() == pytest.approx(30.0, rel=0.08)
    assert begins.std() == pytest.approx(0.02, rel=0.08)


def test_equal_seeds_give_equal_steps() -> None:
    one, same = ground(), ground()
    assert np.array_equal(one.step(SPEED), same.step(SPEED))
    assert not np.array_equal(one.step(SPEED), one.step(SPEED))


def test_a_leg_that_walks_backwards_stands_in_the_same_turn_in_reverse() -> None:
    """Its heel strikes where the toe was off."""
    forth, back = ground(**EVEN).step(SPEED), ground(-60.0, **EVEN).step(-SPEED)
    assert starts_and_ends(back) == pytest.approx(starts_and_ends(forth), abs=2.0 / POINTS)
    assert not np.allclose(back, forth)


@pytest.mark.parametrize(
    ("load", "at_s", "vertical_n", "back_n"),
    [
        ({"heel_strike_transient": 1.0}, 0.01, 300.0, 0.0),  # beyond the force without it
        ({"shape": "treadmill", "fore_aft": 0.0}, 0.0, 0.0, 0.0),
    ],
)
def test_other_shapes(load: dict[str, Any], at_s: float, vertical_n: float, back_n: float) -> None:
    stance = nominal_stance(build_linkage(LEG))
    after = ground(**{**EVEN, **load}).step(SPEED)
    before = ground(**EVEN).step(SPEED) if "heel_strike_transient" in load else np.zeros_like(after)
    place = np.arange(POINTS) / POINTS
    there = [np.interp(stance.heel_strike + at_s, place, one) for one in (after - before).T]
    assert np.array(there) @ stance.up == pytest.approx(vertical_n, abs=10.0)
    assert np.array(there) @ stance.back == pytest.approx(back_n, abs=2.0)


def test_the_treadmill_is_not_the_template() -> None:
    """Vertically by 7 % of the peak, fore-aft by 4 % of it, RMS over stance."""
    difference = ground(shape="treadmill", **EVEN).step(SPEED) - ground(**EVEN).step(SPEED)
    along, up = np.sqrt((difference[difference[:, 1] != 0.0] ** 2).mean(axis=0)) / 300.0
    assert up == pytest.approx(0.07, abs=0.01)
    assert along == pytest.approx(0.037, abs=0.005)


@pytest.mark.chaotic
def test_the_drive_does_the_work_of_the_ground() -> None:
    """By virtual work over three steps that all differ: what the leg is told of the force is what acts on it.

    Beside it, clearances let the toe move otherwise and friction grows with the load: 0.129 of the largest
    change, sigma 0.0004 from 6 moved starts, 2026-11-25.
    """
    linkage = build_linkage(LEG)
    assert LEG.toe
    motion = point_motion(one_cycle(linkage, 1024, 1.0), linkage, *LEG.toe)[1]
    impulse, forces = [], []
    for load in (LoadConfig(), LoadConfig(ground_n=300.0)):
        leg, at = SyntheticLeg(GaitConfig(load=load)), []
        for t in np.arange(1, 601) * 0.005:
            instant = leg.advance(float(t))
            at.append(instant.torque_impulse)
            if load.ground_n:
                forces.append(instant.foot_force_n)
        impulse.append(np.array(at))
    phase = np.arange(1, 601) * 0.005 % 1.0
    lever = np.stack([np.interp(phase, np.arange(1024) / 1024, one, period=1.0) for one in motion.T], axis=1)
    expected = -np.cumsum((np.array(forces) * lever).sum(axis=1)) * 0.005
    assert np.ptp(expected) > 1.0
    assert impulse[1] - impulse[0] == pytest.approx(expected, abs=0.15 * np.ptp(expected))


@pytest.mark.parametrize(
    ("mechanism", "load", "line"),
    [
        ("slider_crank", {}, "slider_crank.yaml: bodies: has no point called toe"),
        ("bionic_leg", {"timing_scatter": 0.1}, "gait: load.timing_scatter: 0.1"),
    ],
)
def test_a_ground_that_cannot_be_is_refused(mechanism: str, load: dict[str, Any], line: str) -> None:
    config = attrs.evolve(GaitConfig(), load=LoadConfig(ground_n=1.0, **load))
    with pytest.raises(ConfigError) as refused:
        Ground(load_mechanism(mechanism), config)
    assert line in str(refused.value)


# How the crank turns: what the pace says of angle, speed and acceleration fits together.


SPEEDS = st.lists(st.floats(-120.0, 120.0), min_size=1, max_size=4)
NUMBERS = st.floats(-10.0, 10.0)


def pace_of(speeds: list[float], ripple: float = 0.0, ramp: float = 0.5) -> Pace:
    times = tuple(float(i) for i in range(len(speeds)))
    return Pace(PaceConfig(times_s=times, speeds_rpm=tuple(speeds), ramp_s=ramp, ripple=ripple))


@given(SPEEDS, st.floats(0.0, 0.5), st.floats(0.1, 5.0))
def test_speed_and_acceleration_are_the_derivatives_of_the_angle(
    speeds: list[float], ripple: float, t: float
) -> None:
    pace, h = pace_of(speeds, ripple), 1.0e-5
    before, here, after = (pace.at(t + shift) for shift in (-h, 0.0, h))
    assert (after.angle - before.angle) / (2.0 * h) == pytest.approx(here.speed, abs=1e-4)
    assert (after.speed - before.speed) / (2.0 * h) == pytest.approx(here.acceleration, abs=1e-2)


@given(SPEEDS)
def test_it_reaches_the_last_speed(speeds: list[float]) -> None:
    motion = pace_of(speeds).at(len(speeds) + 0.5)
    assert motion.speed == pytest.approx(speeds[-1] * 2.0 * math.pi / 60.0)
    assert motion.acceleration == 0.0


def test_a_crank_that_stops_stands_still() -> None:
    pace = pace_of([60.0, 0.0], ripple=0.3)
    assert pace.at(1.5).angle == pace.at(9.0).angle
    assert pace.at(9.0).speed == 0.0


@given(st.floats(0.0, 0.9), st.floats(0.0, 10.0))
def test_the_ripple_is_its_share_of_the_speed(ripple: float, t: float) -> None:
    even, real = pace_of([60.0]).at(t), pace_of([60.0], ripple).at(t)
    assert abs(real.speed - even.speed) <= ripple * even.speed + 1e-12
    assert abs(real.angle - even.angle) <= 0.5 * ripple + 1e-12


@given(st.tuples(NUMBERS, NUMBERS, NUMBERS), st.tuples(NUMBERS, NUMBERS, NUMBERS), st.floats(0.05, 2.0))
def test_the_quintic_passes_through_both_states(
    start: tuple[float, float, float], end: tuple[float, float, float], span: float
) -> None:
    coefficients = quintic(3.0, CrankMotion(*start), span, CrankMotion(*end))
    polynomial = np.polynomial.Polynomial(coefficients[1:])
    slope, bend = polynomial.deriv(), polynomial.deriv(2)
    assert coefficients[0] == 3.0
    assert [polynomial(0.0), slope(0.0), bend(0.0)] == pytest.approx(start)
    assert [polynomial(span), slope(span), bend(span)] == pytest.approx(end, abs=1e-9 / span**2)


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"times_s": (0.0, 1.0)}, "speeds_rpm: has 1 speeds for 2 times. Expected one each"),
        ({"times_s": (1.0,)}, "times_s: [1.0] does not increase from 0 s"),
        ({"times_s": (0.0, 0.2), "speeds_rpm": (0.0, 60.0)}, "ramp_s: 0.5 s is longer than"),
        ({"ripple": 1.0}, "ripple: 1.0 is not at most 0.9"),
    ],
)
def test_a_pace_that_cannot_be_is_refused(changes: dict[str, tuple[float, ...]], fault: str) -> None:
    with pytest.raises(FieldError) as refused:
        PaceConfig(**changes)
    assert str(refused.value).startswith(fault)


# What arrives of the leg's sensors: noise, loss and disorder as asked for, and nothing else.


CLEAN = GaitConfig(
    duration_s=2.0,
    encoder=EncoderConfig(noise_rad=0.0, velocity_noise_radps=0.0, counts_per_turn=0.0),
    torque_sensor=TorqueSensorConfig(noise_nm=0.0, resolution_nm=0.0),
    transport=TransportConfig(jitter_s=0.0),
)
FRACTION = st.floats(0.0, 0.5)


class EvenLeg:
    """Turns at 6 rad/s under a torque of 4 N m + 1 N m/s t."""

    def advance(self, t: float) -> Instant:
        return Instant(CrankMotion(6.0 * t, 6.0, 0.0), 4.0 * t + 0.5 * t * t, torque_nm=4.0 + t)


def heard(config: GaitConfig = CLEAN, **transport: Any) -> list[Reading]:
    changed = attrs.evolve(config, transport=attrs.evolve(config.transport, **transport))
    return list(readings(EvenLeg(), changed))  # type: ignore[arg-type]


def key(reading: Reading) -> tuple[int, float, float]:
    """What a reading is, whenever it arrives."""
    return reading.kind, reading.taken_s, reading[4] if reading.kind == CRANK else reading.torque_nm


def test_clean_sensors_tell_the_truth() -> None:
    got = heard()
    crank = [reading for reading in got if reading.kind == CRANK]
    torque = [reading for reading in got if reading.kind == TORQUE]
    assert len(crank) == len(torque) == 399
    assert [r.crank_angle_rad for r in crank] == pytest.approx([6.0 * r.taken_s for r in crank])
    # the mean over 5 ms is the value half way back
    assert [r.torque_nm for r in torque] == pytest.approx([4.0 + r.taken_s - 0.0025 for r in torque])
    assert all(reading.fault == NO_FAULT and reading.arrival_s == reading.taken_s for reading in got)


def test_the_crank_can_bring_the_torque() -> None:
    got = heard(attrs.evolve(CLEAN, torque_sensor=attrs.evolve(CLEAN.torque_sensor, source="effort")))
    assert {reading.kind for reading in got} == {CRANK}
    assert [r.torque_nm for r in got] == pytest.approx([4.0 + r.taken_s - 0.0025 for r in got])


def test_a_sensor_may_sample_instants() -> None:
    got = heard(attrs.evolve(CLEAN, torque_sensor=attrs.evolve(CLEAN.torque_sensor, sampling="instant")))
    torque = [reading for reading in got if reading.kind == TORQUE]
    assert [r.torque_nm for r in torque] == pytest.approx([4.0 + r.taken_s for r in torque])


def test_noise_has_the_deviation_asked_for() -> None:
    torque_sensor = TorqueSensorConfig(noise_nm=0.2)
    noisy = attrs.evolve(CLEAN, encoder=EncoderConfig(noise_rad=0.01), torque_sensor=torque_sensor)
    block, clean = samples(heard(noisy), 0), samples(heard(), 0)
    angle = (block["crank_angle_rad"] - clean["crank_angle_rad"])[clean["kind"] == CRANK]
    torque = (block["torque_nm"] - clean["torque_nm"])[clean["kind"] == TORQUE]
    assert angle.std() == pytest.approx(0.01, rel=0.15)
    assert torque.std() == pytest.approx(0.2, rel=0.15)


def test_equal_seeds_give_equal_readings_and_others_do_not() -> None:
    noisy = GaitConfig(duration_s=0.5, transport=TransportConfig(drop_fraction=0.1, late_fraction=0.1))
    assert repr(heard(noisy)) == repr(heard(noisy))
    assert repr(heard(noisy)) != repr(heard(attrs.evolve(noisy, seed=1)))


@given(FRACTION, FRACTION, FRACTION, st.floats(0.0, 0.05))
@settings(max_examples=20)
def test_they_arrive_in_order_and_none_is_made_up(
    drop: float, twice: float, late: float, late_s: float
) -> None:
    got = heard(drop_fraction=drop, duplicate_fraction=twice, late_fraction=late, late_s=late_s)
    arrival = np.array([reading.arrival_s for reading in got])
    delay = arrival - np.array([reading.taken_s for reading in got])
    assert (np.diff(arrival) >= 0.0).all()
    assert np.minimum(delay, np.abs(delay - late_s)).max() < 1e-12
    count = Counter(key(reading) for reading in got)
    assert set(count) <= {key(reading) for reading in heard()}
    assert max(count.values()) <= 2


def test_shares_are_met() -> None:
    whole = len(heard())
    assert len(heard(drop_fraction=0.2)) == pytest.approx(0.8 * whole, rel=0.1)
    assert len(heard(duplicate_fraction=0.2)) == pytest.approx(1.2 * whole, rel=0.1)
    faulty = [reading.fault for reading in heard(fault_fraction=0.2) if reading.fault != NO_FAULT]
    assert len(faulty) == pytest.approx(0.2 * whole, rel=0.25)
    assert len(set(faulty)) > 5


def test_nothing_is_heard_in_a_gap() -> None:
    taken = np.array([reading.taken_s for reading in heard(gaps_s=(0.5, 1.2), gap_s=0.25)])
    assert not ((taken >= 0.5) & (taken < 0.75)).any()
    assert not ((taken >= 1.2) & (taken < 1.45)).any()
    assert len(taken) == pytest.approx(798 - 200, abs=4)


def test_jitter_never_swaps_two_readings_of_a_sensor() -> None:
    taken = [reading.taken_s for reading in heard(jitter_s=0.01) if reading.kind == CRANK]
    assert (np.diff(taken) > 0.0).all()
    assert np.std(np.diff(taken)) > 1.0e-3
