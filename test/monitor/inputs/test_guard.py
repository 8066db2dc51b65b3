"""Signals that no leg sends: named, and never counted as wear."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reported import ERROR, WARN, raised, status_of

import leg_wear_monitor as lw

MISSING_JOINT = 3  # fault of a sample

# Crank angles that no one leg can send, and why samples cannot be used: named, and never counted as wear.


TURN = 2.0 * np.pi
DEGREES = 180.0 / np.pi


def other_source(gait, duration_s=3.0, begin_s=0.0, rate_hz=200.0, *, off_rad=0.5, late_ns=1_700_000):
    """A second publisher of a crank: its own stamps and another angle."""
    samples = gait(duration_s, rate_hz=rate_hz, begin_s=begin_s)
    samples["stamp_ns"] += late_ns
    samples["crank_angle_rad"] = (samples["crank_angle_rad"] + off_rad) % TURN
    return samples


def interleaved(*series):
    """Samples of several series in the order of their stamps."""
    both = np.concatenate(series)
    return both[np.argsort(both["stamp_ns"], kind="stable")]


def zeros(samples):
    """What joint_state_publisher sends of a joint that nobody has moved."""
    still = samples.copy()
    still["crank_angle_rad"] = 0.0
    return still


SECOND_SOURCES = {
    "another leg": other_source,
    "half a turn off": lambda gait: other_source(gait, off_rad=np.pi),
    "a little off": lambda gait: other_source(gait, off_rad=-0.15),
    "a joint that stands at zero": lambda gait: zeros(other_source(gait)),
    "slow zeros": lambda gait: zeros(other_source(gait, rate_hz=10.0)),
    "fast": lambda gait: other_source(gait, rate_hz=1000.0),
    "the same stamps": lambda gait: other_source(gait, late_ns=0),
}


@pytest.mark.parametrize("name", SECOND_SOURCES)
def test_two_sources_that_disagree_are_named_and_not_counted(monitor, gait, name):
    alone, second = gait(3.0), SECOND_SOURCES[name](gait)
    monitor.update(interleaved(alone, second))
    assert "input_sources" in raised(monitor)
    status = status_of(monitor, "input")
    assert status.level == ERROR
    assert status.message.startswith("two sources of the crank angle disagree")
    assert status_of(monitor, "gait").level == ERROR
    assert monitor.lost.conflicting > 0.5 * len(second)
    totals = status_of(monitor, "gait").values
    assert totals["moving_s"] < 1.0
    assert totals["cycles"] == 0


def test_while_two_sources_send_nothing_wears_and_after_it_goes_on(monitor, gait):
    monitor.update(gait(3.0))
    before = monitor.wear_depth_m.copy()
    moving_s = status_of(monitor, "gait").values["moving_s"]
    monitor.update(interleaved(gait(3.0, begin_s=3.0), other_source(gait, begin_s=3.0)))
    during = status_of(monitor, "gait").values["moving_s"] - moving_s
    # the twin follows by its lag, and may have bridged the first few samples
    assert during < 0.3
    worn = monitor.wear_depth_m - before
    assert worn.sum() < 0.2 * before.sum()
    monitor.update(gait(4.0, begin_s=6.0))
    assert not status_of(monitor, "input").message.startswith("two series")
    assert status_of(monitor, "gait").message == "in step"
    assert monitor.lost.unmonitored_s == pytest.approx(4.0, abs=0.5)
    # shown until somebody has acknowledged it
    assert "input_sources" in raised(monitor)
    monitor.acknowledge(1)
    assert "input_sources" not in raised(monitor, WARN)


def test_two_sources_that_agree_are_followed(monitor, gait):
    monitor.update(interleaved(gait(3.0), other_source(gait, off_rad=TURN * 0.0017)))
    assert "input_sources" not in raised(monitor, WARN)
    assert monitor.lost.conflicting == 0


def healthy(random, rate_hz, rpm, seconds=4.0):
    """A leg that starts, runs unevenly, stops and runs backwards; with jitter, losses, repeats, glitches."""
    n = int(seconds * rate_hz)
    t = (np.arange(n) + 0.02 * random.standard_normal(n)) / rate_hz
    speed = TURN * rpm / 60.0 * np.interp(t, [0.5, 1.0, 2.0, 2.5, 3.0, 3.5], [0.0, 1.0, 1.0, 0.0, 0.0, -1.0])
    speed *= 1.0 + 0.2 * np.sin(2.0 * np.cumsum(speed) / rate_hz)
    angle = np.cumsum(speed) / rate_hz + 1.0e-3 * random.standard_normal(n)
    samples = lw.gait_samples(10**18 + np.round(1.0e9 * t).astype(np.int64), crank_angle_rad=angle)
    glitches = random.choice(n, max(1, n // 200), replace=False)
    samples["crank_angle_rad"][glitches] += random.uniform(-3.0, 3.0, len(glitches))
    kept = samples[random.random(n) > 0.1]
    late = random.choice(len(kept) - 3, len(kept) // 50, replace=False)
    for i in late:
        kept[[i, i + 2]] = kept[[i + 2, i]]
    return np.repeat(kept, 1 + (random.random(len(kept)) < 0.05))


@settings(max_examples=12)
@given(
    seed=st.integers(0, 2**32 - 1),
    rate_hz=st.sampled_from([40.0, 100.0, 200.0, 1000.0, 8000.0]),
    rpm=st.sampled_from([-60.0, 10.0, 60.0, 120.0]),
    wrapped=st.booleans(),
)
def test_one_leg_is_never_taken_for_two_nor_for_degrees(new_monitor, seed, rate_hz, rpm, wrapped):
    samples = healthy(np.random.default_rng(seed), rate_hz, rpm)
    if wrapped:
        samples["crank_angle_rad"] %= TURN
    monitor = new_monitor({"cadence.commanded_rpm": rpm, "diagnosis.enabled": False})
    monitor.update(samples)
    assert (monitor.lost.conflicting, monitor.lost.implausible) == (0, 0)


@pytest.mark.parametrize(("seed", "unit"), [(0, 1.0), (1, DEGREES)])
def test_what_is_withheld_does_not_depend_on_blocks(new_monitor, gait, seed, unit):
    stream = interleaved(gait(4.0), other_source(gait, 1.0, begin_s=1.0))
    stream["crank_angle_rad"][800:] *= unit
    whole, parts = new_monitor(), new_monitor()
    whole.update(stream)
    for part in np.split(stream, np.sort(np.random.default_rng(seed).integers(0, len(stream), 30))):
        parts.update(part)
    assert whole.lost.conflicting + whole.lost.implausible > 100
    assert repr(parts.lost) == repr(whole.lost)
    np.testing.assert_array_equal(parts.wear_depth_m, whole.wear_depth_m)


@pytest.mark.parametrize(
    ("rate_hz", "wrapped"), [(20.0, True), (100.0, False), (200.0, True), (1000.0, False)]
)
def test_degrees_are_named_and_wear_nothing(monitor, gait, rate_hz, wrapped):
    samples = gait(4.0, rate_hz=rate_hz)
    if not wrapped:
        samples["crank_angle_rad"] = np.unwrap(samples["crank_angle_rad"])
    samples["crank_angle_rad"] *= DEGREES
    reports = monitor.update(samples)
    status = status_of(monitor, "input")
    assert status.level == ERROR
    assert status.message.startswith("the crank's angle runs 57")
    assert "degrees" in status.message
    assert not monitor.wear_depth_m.any()
    assert reports.cycles == ()
    assert monitor.lost.implausible > 0.9 * len(samples)
    assert "input_samples" in raised(monitor)
    assert "impact_force A" not in raised(monitor, WARN)


def test_a_driver_that_changes_to_radians_is_followed_from_then_on(monitor, gait):
    wrong = gait(2.0)
    wrong["crank_angle_rad"] *= DEGREES
    monitor.update(wrong)
    reports = monitor.update(gait(4.0, begin_s=2.0))
    assert len(reports.cycles) >= 1
    assert not status_of(monitor, "gait").message.startswith("not monitored")


def test_a_gear_that_is_not_set_is_named(monitor, gait):
    samples = gait(2.0)
    samples["crank_angle_rad"] = 10.0 * np.unwrap(samples["crank_angle_rad"])
    monitor.update(samples)
    message = status_of(monitor, "input").message
    assert "crank.gear_ratio" in message and "degrees" not in message


def test_messages_without_the_crank_are_a_fault_only_if_none_has_it(monitor, gait):
    stream = gait(6.0)
    others = stream[::2].copy()
    others["fault"] = MISSING_JOINT
    both = np.concatenate([stream, others])
    monitor.update(both[np.argsort(both["stamp_ns"], kind="stable")])
    status = status_of(monitor, "input")
    assert status.values["faulty_missing_joint"] == len(others)
    assert status.message == "see: input_rate torque"  # there is none in this gait, and no other fault
    assert "input_samples" not in raised(monitor, WARN)
    unnamed = gait(4.0, begin_s=6.0)
    unnamed["fault"] = MISSING_JOINT
    monitor.update(unnamed)
    assert (
        "samples do not name the crank 'crank' exactly once: set crank_joint"
        in status_of(monitor, "input").message
    )
    assert "input_samples" in raised(monitor)
