"""The ground under the synthetic leg: the force that was asked for, another one each step, on the leg."""

from typing import Any

import attrs
import numpy as np
import pytest

from leg_wear_monitor import ConfigError, load_mechanism
from leg_wear_monitor.dynamics.run import DISSIPATION, FRICTION, POWER
from leg_wear_monitor.gait.config import GaitConfig, LoadConfig, PaceConfig
from leg_wear_monitor.gait.leg import POINTS, Ground, SyntheticLeg
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.person import FORE_AFT, nominal_stance
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle, point_motion

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


def test_stance_begins_and_ends_later_as_asked_for() -> None:
    nominal = starts_and_ends(ground(**EVEN).step(SPEED))
    moved = starts_and_ends(ground(heel_strike_shift=0.05, toe_off_shift=-0.03, **EVEN).step(SPEED))
    assert np.subtract(moved, nominal) == pytest.approx([0.05, -0.03], abs=2.0 / POINTS)


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


@pytest.mark.chaotic
def test_energy_is_balanced_while_steps_differ() -> None:
    """Work of drive and ground is stored or lost, to 2e-3 of the losses; 6e-6 on 2026-11-25."""
    leg = SyntheticLeg(GaitConfig(load=LoadConfig(ground_n=600.0)))
    stored = leg._run.stored_energy
    leg.advance(2.0)
    statistics = leg._statistics
    lost = statistics.integral[:, [FRICTION, DISSIPATION]].sum() + statistics.worn_energy[0]
    gained = statistics.drive_integral[POWER] + stored - leg._run.stored_energy
    assert gained == pytest.approx(lost, rel=2.0e-3)


@pytest.mark.parametrize(
    ("mechanism", "load", "line"),
    [
        ("slider_crank", {}, "slider_crank.yaml: bodies: has no point called toe"),
        ("bionic_leg", {"toe_off_shift": 0.3, "heel_strike_shift": -0.25}, "gait: load.timing_scatter: 0.02"),
    ],
)
def test_a_ground_that_cannot_be_is_refused(mechanism: str, load: dict[str, Any], line: str) -> None:
    config = attrs.evolve(GaitConfig(), load=LoadConfig(ground_n=1.0, **load))
    with pytest.raises(ConfigError) as refused:
        Ground(load_mechanism(mechanism), config)
    assert line in str(refused.value)
