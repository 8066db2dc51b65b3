"""The sensor of the foot load: what it shows of a leg in full coordinates, and each of its faults by name."""

import math
from collections.abc import Callable

import attrs
import numpy as np
import pytest
from readings_as_samples import samples
from reported import raised, status_of

import leg_wear_monitor as lw
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.gait.config import FootLoadSensorConfig, GaitConfig, LoadConfig
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.gait.sensors import readings
from leg_wear_monitor.mechanism.person import nominal_stance
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.monitor.alarm_specs import DEPARTURE, KINDS
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.verdict.verdict import rules
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin import LOAD, TORQUE
from leg_wear_monitor.twin.sample import Samples

S, START = 1_000_000_000, 10**18
PEAK_N, AT_S = 300.0, 5.2  # a fault begins in stance
MEASURED = {"foot_load.source": "wrench", "load.model": "measured", "diagnosis.enabled": False}

pytestmark = pytest.mark.chaotic


@pytest.fixture(scope="module")
def walk() -> Samples:
    """Twelve gait cycles on the ground, each step otherwise; the sensor has 5 % of noise."""
    config = GaitConfig(
        duration_s=12.0,
        load=LoadConfig(ground_n=PEAK_N),
        foot_load_sensor=FootLoadSensorConfig(source="wrench", noise_n=15.0),
    )
    return samples(list(readings(SyntheticLeg(config), config)), START)


def new_monitor(model: str = "measured", source: str = "wrench") -> lw.WearMonitor:
    """A monitor before the first sample."""
    config = config_from(MEASURED | {"load.model": model, "foot_load.source": source})
    return lw.WearMonitor(lw.load_mechanism("bionic_leg"), config)


def monitored(walk: Samples, model: str = "measured", source: str = "wrench") -> lw.WearMonitor:
    """A monitor after the walk."""
    monitor = new_monitor(model, source)
    for block in np.array_split(walk, 7):
        monitor.update(block)
    return monitor


def of_foot_load(monitor: lw.WearMonitor) -> set[str]:
    """Alarms of the foot load's sensor at ERROR."""
    return {name for name in raised(monitor) if "foot_load" in name}


def test_a_healthy_leg_on_the_ground_is_healthy(walk):
    monitor = monitored(walk)
    assert monitor.verdict.verdict.state.value == "healthy"
    assert not of_foot_load(monitor)
    load, stance = monitor.state.load, nominal_stance(build_linkage(lw.load_mechanism("bionic_leg")))
    assert load.source == "measured"
    # ten steps scatter by 10 % in size and by 2 % of a turn in time
    assert load.peak_n == pytest.approx(PEAK_N, rel=0.02 + 5.3 * 0.1 / 10**0.5)
    assert load.heel_strike_phase == pytest.approx(stance.heel_strike, abs=0.01 + 5.3 * 0.02 / 10**0.5)
    assert load.toe_off_phase == pytest.approx(stance.toe_off, abs=0.01 + 5.3 * 0.02 / 10**0.5)
    assert 0.0 < load.peak_sigma_n < 0.4 * PEAK_N
    status = status_of(monitor, "foot_load")
    assert status.level is Level.OK and status.values["peak_n"] == load.peak_n


def test_every_alarm_has_a_value_in_a_replay_that_has_its_signal(walk):
    """Encoders are not in this walk: `test_encoders.py` raises their alarm."""
    leg = lw.load_mechanism("bionic_leg")
    limited = attrs.evolve(leg.clearances["A"], material="du-on-steel-dry")
    leg = attrs.evolve(leg, clearances=leg.clearances | {"A": limited})
    monitor = lw.WearMonitor(leg, config_from(MEASURED))
    monitor.update(walk)
    with_value = {alarm.kind for alarm in monitor.alarms.alarms if math.isfinite(alarm.value)}
    assert with_value == KINDS.keys() - {DEPARTURE.kind}


def test_without_the_sensor_the_torque_shows_a_stance_and_no_mismatch(walk):
    """Until a load that nobody declared could be a stance, this healthy leg had the alarm of a mismatch."""
    monitor = monitored(walk, "none")
    assert not raised(monitor, Level.WARN)
    torque = status_of(monitor, "torque").values
    # steps scatter by 10 %, and the load is known from some ten of them
    assert torque["load_acting_n"] == pytest.approx(PEAK_N, rel=0.05 + 5.3 * 0.1 / 10**0.5)


def changed(change: Callable[[np.ndarray, np.ndarray], np.ndarray], walk: Samples) -> Samples:
    """The walk with other forces of the sensor: change(time [s], force [N])."""
    out, which = walk.copy(), walk["kind"] == LOAD
    t = 1.0e-9 * (walk["stamp_ns"][which] - START)
    out["foot_force_n"][which] = change(t, walk["foot_force_n"][which])
    return out


def held(t, force):
    return np.where((t > AT_S)[:, None], force[np.searchsorted(t, AT_S)], force)


def other_foot(t, force):
    return np.stack([np.interp(t - 0.5, t, one) for one in force.T], axis=1)


@pytest.mark.parametrize(
    "change, alarm",
    [
        (held, "foot_load_stuck"),
        (lambda t, force: force + np.array([0.0, 50.0]), "foot_load_zero"),
        (lambda t, force: force + 12.0 * t[:, None] * np.array([0.0, 1.0]), "foot_load_zero"),
        (lambda t, force: 10.0 * force, "foot_load_scale"),
        (lambda t, force: 0.001 * force, "foot_load_scale"),
        (other_foot, "foot_load_exchanged"),
        (lambda t, force: -force, "foot_load_sign"),
    ],
    ids=["stuck", "zero", "drift", "ten times", "kN", "other foot", "sign"],
)
def test_each_fault_of_the_sensor_is_named(walk, change, alarm):
    monitor = monitored(changed(change, walk))
    assert of_foot_load(monitor) - {"input_rate foot_load", "input_gaps foot_load"} == {alarm}
    found = {finding.fault_code: finding for finding in monitor.verdict.findings}
    assert rules()[alarm.upper()].fault in found[alarm.upper()].why
    status = status_of(monitor, "foot_load")
    assert status.level is Level.ERROR and rules()[alarm.upper()].fault in status.message


@pytest.mark.parametrize("scale", [1.0, 0.001, 1 / 785, 100.0])
def test_without_a_torque_a_step_of_an_unusual_size_is_another_unit(walk, scale):
    monitor = monitored(changed(lambda t, force: scale * force, walk[walk["kind"] != TORQUE]))
    assert of_foot_load(monitor) == (set() if scale == 1.0 else {"foot_load_scale"})


def test_without_a_torque_a_sensor_that_feels_the_foot_swing_is_of_no_other_unit(walk):
    """In the air: some newtons of inertia at each phase, which are no step."""
    noise = np.random.default_rng(1)
    for lag in (0.0, 0.25, 0.5, 0.75):
        swung = changed(
            lambda t, force, lag=lag: (
                np.cos(TURN * (t - lag))[:, None] * [0.5, 1.0] + 0.3 * noise.standard_normal(force.shape)
            ),
            walk[walk["kind"] != TORQUE],
        )
        assert "foot_load_scale" not in of_foot_load(monitored(swung))


def test_a_fault_is_named_too_where_the_load_is_not_used(walk):
    assert of_foot_load(monitored(changed(lambda t, force: 0.0 * force, walk), "none")) == {"foot_load_stuck"}


def test_a_wrong_load_does_not_wear(walk):
    """A wrong size is no load as soon as it is seen; a stuck sensor keeps the load of the steps before.

    The knee bears 73 N in the air, and 229 N on the ground.
    """
    knee_n = []
    for change in (lambda t, force: 10.0 * force, held):
        cycles = new_monitor().update(changed(change, walk)).cycles
        knee_n.append(np.mean([one.joints[2].mean_force_n for one in cycles[-3:]]))
    assert knee_n[0] == pytest.approx(73.0, rel=0.1)
    assert knee_n[1] == pytest.approx(229.0, rel=0.2)


@pytest.mark.parametrize("begin_s, end_s, alarm", [(6.0, 99.0, "input_rate"), (6.3, 6.7, "input_gaps")])
def test_missing_samples_are_named_and_the_crank_is_monitored(walk, begin_s, end_s, alarm):
    t = 1.0e-9 * (walk["stamp_ns"] - START)
    gone = (
        (walk["kind"] == LOAD) & (t > begin_s) & (t < end_s)
        if alarm == "input_rate"
        else ((walk["kind"] == LOAD) & (t % 1.0 > 0.3) & (t % 1.0 < 0.7))
    )
    monitor = monitored(walk[~gone])
    assert f"{alarm} foot_load" in of_foot_load(monitor)
    assert "FOOT_LOAD_MISSING" in {finding.fault_code for finding in monitor.verdict.findings}
    assert monitor.lost.unmonitored_s < 1.0


def test_noise_without_a_load_does_not_wear_and_is_reported(walk):
    """The knee bears 73 N in the air; under this noise alone it was pressed as by a load."""
    monitor = new_monitor()
    noise = np.random.default_rng(1)
    cycles = monitor.update(changed(lambda t, force: 60.0 * noise.standard_normal(force.shape), walk)).cycles
    assert of_foot_load(monitor) == {"foot_load_stuck"}
    assert np.mean([one.joints[2].mean_force_n for one in cycles[-3:]]) == pytest.approx(73.0, rel=0.1)
    # a load that begins on the ground is one from the fourth step on
    later = changed(
        lambda t, force: np.where((t > 5.0)[:, None], force, 15.0 * noise.standard_normal(force.shape)), walk
    )
    cycles = new_monitor().update(later).cycles
    assert np.mean([one.joints[2].mean_force_n for one in cycles[-2:]]) == pytest.approx(229.0, rel=0.2)


def test_single_spikes_do_not_wear_and_are_reported(walk):
    """One sample of 3 kN in every other swing was taken for a force: it doubled those of hip and knee."""
    forces_n = []
    for size_n in (0.0, 3000.0):
        monitor = new_monitor()
        spiked = changed(
            lambda t, force, size_n=size_n: force + (np.abs(t % 2.0 - 0.8)[:, None] < 0.002) * [0.0, size_n],
            walk,
        )
        reports = monitor.update(spiked)
        forces_n.append([max(one.joints[k].p99_force_n for one in reports.cycles) for k in (1, 2)])
    assert forces_n[1] == pytest.approx(forces_n[0], rel=0.2)
    assert not of_foot_load(monitor) and not raised(monitor)
    assert reports.lost.outliers == 6
    status = status_of(monitor, "foot_load")
    assert status.values["outliers"] == 6.0
    assert "6 samples are outliers, far from the samples before and after; not used" in status.message
    assert status_of(monitor, "input").values["load_outliers"] == 6.0


def test_a_silent_sensor_leaves_the_mean_of_the_steps_before_and_not_the_last_one(walk):
    """Each step has another size; the last one before the silence acted in all gait cycles after it."""
    last_n = []
    for size in (1.0, 2.0):  # of the last step
        larger = changed(lambda t, force, size=size: np.where((t > 7.0)[:, None], size, 1.0) * force, walk)
        is_sent = (larger["kind"] != LOAD) | (larger["stamp_ns"] < START + 8 * S)
        cycles = new_monitor().update(larger[is_sent]).cycles
        last_n.append(cycles[-1].joints[2].mean_force_n)
    # a seventh of the mean is that of the last step
    assert last_n[1] == pytest.approx(last_n[0], rel=0.3)


def test_a_contact_switch_gives_heel_strike_and_toe_off(walk):
    monitor = monitored(
        changed(lambda t, force: np.stack([0.0 * t, force[:, 1] > 60.0], axis=1), walk),
        "none",
        "contact",
    )
    stance = nominal_stance(build_linkage(lw.load_mechanism("bionic_leg")))
    assert not of_foot_load(monitor)
    assert monitor.state.load.peak_n is None
    assert monitor.state.load.heel_strike_phase == pytest.approx(stance.heel_strike, abs=0.05)
    assert monitor.state.load.toe_off_phase == pytest.approx(stance.toe_off, abs=0.05)


def test_blocks_change_nothing(walk):
    walk = walk[: len(walk) // 2]
    one, other = new_monitor(), new_monitor()
    whole = one.update(walk)
    parts = [other.update(block) for block in np.array_split(walk, 17)]
    cycles = [cycle for part in parts for cycle in part.cycles]
    forces = [[each.joints[0].mean_force_n for each in found] for found in (whole.cycles, cycles)]
    assert forces[0] == forces[1]
    assert one.state.load == other.state.load
    assert repr(one.alarms) == repr(other.alarms)


def test_without_a_source_nothing_knows_of_it(leg):
    monitor = lw.WearMonitor(leg)
    assert "foot_load" not in monitor.used
    assert not [one for one in monitor.alarms.alarms if "foot_load" in one.name]
    assert not [one for one in monitor.status() if "foot_load" in (one.name, *one.values)]
    assert monitor.state.load.source == "none"


@pytest.mark.parametrize("source", ["none", "contact"])
def test_a_load_without_forces_cannot_be_measured(leg, source):
    config = config_from({"load.model": "measured", "foot_load.source": source})
    with pytest.raises(ConfigError, match=r"load.model: 'measured' needs forces, and foot_load.source is"):
        lw.WearMonitor(leg, config)
