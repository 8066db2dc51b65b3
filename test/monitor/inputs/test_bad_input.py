"""Bad input of every kind: no crash, no wear, each sample counted under a name."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reported import ERROR, raised, status_of

import leg_wear_monitor as lw

SECOND = 10**9
CRANK, TORQUE = 0, 1  # kinds of a sample
NO_FAULT, NOT_FINITE, FAULTS = 0, 4, range(1, 9)
START_NS = 1_700_000_000_123_456_789

odd_numbers = st.sampled_from([np.nan, np.inf, -np.inf, 1e300, -1e300, 1e18])
numbers = st.floats() | odd_numbers | st.floats(-10.0, 10.0)
odd_stamps = st.sampled_from([0, -1, -(2**63), 2**63 - 1, 1])
stamps = st.integers(START_NS, START_NS + 10 * SECOND) | odd_stamps
faults = st.sampled_from(FAULTS)
kinds = st.sampled_from([CRANK, TORQUE])

faulty = st.tuples(stamps, kinds, faults, numbers, numbers, numbers)
not_finite = st.tuples(stamps, st.just(CRANK), st.just(NO_FAULT), odd_numbers, numbers, numbers)
stampless = st.tuples(st.sampled_from([0, -1, -(2**63)]), kinds, st.just(NO_FAULT), numbers, numbers, numbers)
anything = st.tuples(stamps, kinds, faults | st.just(NO_FAULT), numbers, numbers, numbers)


def block(samples):
    stamp, kind, fault, angle, velocity, torque = zip(*samples, strict=True)
    values = {"crank_angle_rad": angle, "crank_velocity_radps": velocity, "torque_nm": torque}
    return lw.gait_samples(np.array(stamp, np.int64), kind, fault=fault, **values)


def counted(monitor):
    lost = monitor.lost
    dropped = lost.duplicates + lost.late + lost.stray_stamps + lost.outliers
    return sum(lost.faulty.values()) + dropped + sum(monitor.used.values())


@settings(max_examples=20)
@given(st.lists(faulty | not_finite | stampless, min_size=1, max_size=300))
def test_samples_that_cannot_be_used_are_counted_by_name_and_wear_nothing(new_monitor, samples):
    monitor = new_monitor()
    reports = monitor.update(block(samples))
    assert not monitor.wear_depth_m.any()
    assert reports.cycles == ()
    assert sum(reports.lost.faulty.values()) == len(samples)
    assert len(reports.lost.faulty) == len(FAULTS)
    shown = status_of(monitor, "input").values
    assert sum(value for key, value in shown.items() if key.startswith("faulty_")) == len(samples)


@settings(max_examples=20)
@given(st.lists(anything, min_size=1, max_size=300))
def test_nothing_that_comes_breaks_the_monitor(new_monitor, samples):
    monitor = new_monitor()
    monitor.update(block(samples))
    depth = monitor.wear_depth_m
    assert np.isfinite(depth).all()
    assert (depth >= 0.0).all()
    assert status_of(monitor, "input").values["received"] == len(samples)
    assert counted(monitor) <= len(samples)
    monitor.status()


@pytest.fixture(scope="module")
def good(gait):
    return gait(2.5)


@pytest.fixture(scope="module")
def clean(new_monitor, good):
    """A monitor after a good stream."""
    monitor = new_monitor()
    monitor.update(good)
    return monitor


@settings(max_examples=10)
@given(st.data())
def test_a_good_stream_wears_the_same_with_bad_samples_in_it(new_monitor, good, clean, data):
    extra = data.draw(
        st.lists(st.tuples(st.integers(0, len(good)), faulty | not_finite | stampless), max_size=60)
    )
    repeats = data.draw(st.lists(st.integers(1, len(good)), max_size=20, unique=True))
    inserted = [(at, block([sample])) for at, sample in extra] + [(at, good[at - 1 : at]) for at in repeats]
    inserted.sort(key=lambda pair: pair[0])
    stream = np.insert(
        good, [at for at, _ in inserted], np.concatenate([good[:0], *(sample for _, sample in inserted)])
    )
    monitor = new_monitor()
    reports = monitor.update(stream)
    np.testing.assert_array_equal(monitor.wear_depth_m, clean.wear_depth_m)
    assert monitor.wear_depth_m.any()
    assert sum(reports.lost.faulty.values()) == len(extra)
    assert reports.lost.duplicates == len(repeats)


def spoiled(samples, **values):
    spoilt = samples.copy()
    for name, value in values.items():
        spoilt[name] = value
    return spoilt


TABLE = [
    ("not_finite", lambda s: spoiled(s, crank_angle_rad=np.inf)),
    ("out_of_range", lambda s: spoiled(s, crank_angle_rad=1e300)),
    ("zero_stamp", lambda s: spoiled(s, stamp_ns=0)),
    ("empty", lambda s: spoiled(s, fault=1)),
    ("duplicates", lambda s: spoiled(s, stamp_ns=START_NS)),
    ("stray_stamps", lambda s: spoiled(s, stamp_ns=START_NS + 2 * SECOND * np.arange(len(s))[::-1])),
    ("stray_stamps", lambda s: spoiled(s, stamp_ns=START_NS + 9 * SECOND * (np.arange(len(s)) % 3))),
]


@pytest.mark.parametrize(("name", "spoil"), TABLE, ids=[f"{i} {name}" for i, (name, _) in enumerate(TABLE)])
def test_a_stream_of_nothing_else_is_named_and_alarmed(new_monitor, gait, name, spoil):
    monitor = new_monitor()
    stream = spoil(gait(4.0))
    reports = monitor.update(stream)
    assert not monitor.wear_depth_m.any()
    status = status_of(monitor, "input")
    assert max(status.values.get(name, 0), status.values.get(f"faulty_{name}", 0)) > 0
    assert status.values["received"] == len(stream)
    assert raised(monitor) & {"input_samples", "input_gaps"}, reports.lost
    assert status.level == ERROR


def test_the_stream_with_values_that_are_no_numbers_is_named_with_their_number(new_monitor, gait):
    """Found by the twin in the crank's angle, and by the reader of messages in the torque."""
    crank, torque = gait(4.0), gait(4.0)[::2].copy()
    crank["crank_angle_rad"][::3] = np.inf
    torque["kind"], torque["crank_angle_rad"], torque["torque_nm"] = TORQUE, np.nan, 1.0
    torque["fault"][::4] = NOT_FINITE
    stream = np.concatenate([crank, torque])
    monitor = new_monitor()
    monitor.update(stream[np.argsort(stream["stamp_ns"], kind="stable")])
    pattern = r"(\d+) of \d+ samples have a value .* infinite \((\d+) of the crank, (\d+) of drive_torque\)"
    found = re.search(pattern, status_of(monitor, "input").message)
    every, of_crank, of_torque = map(int, found.groups())
    assert every == of_crank + of_torque
    assert of_crank / of_torque == pytest.approx(8 / 3, rel=0.1)  # a third of the samples, an eighth


@pytest.mark.parametrize("spoil", [lambda s: spoiled(s, crank_angle_rad=1.0), lambda s: s[:1]])
def test_a_crank_that_seems_to_stand_wears_nothing(new_monitor, gait, spoil):
    monitor = new_monitor()
    monitor.update(spoil(gait(3.0)))
    # set in motion, the journals fall from the middle of their bushings: once, a percent of a cycle's wear
    assert monitor.wear_depth_m.max() < 2e-12
