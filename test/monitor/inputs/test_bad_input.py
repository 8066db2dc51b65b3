"""Bad input of every kind: no crash, no wear, each sample counted under a name."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reported import raised, status_of

from leg_wear_monitor.state import Level
from leg_wear_monitor.twin import CRANK, TORQUE
from leg_wear_monitor.twin.sample import ENCODERS, FAULTS, GAIT_SAMPLE, NO_FAULT, NOT_FINITE

SECOND = 10**9
START_NS = 1_700_000_000_123_456_789

odd_numbers = st.sampled_from([np.nan, np.inf, -np.inf, 1e300, -1e300, 1e18])
numbers = st.floats() | odd_numbers | st.floats(-10.0, 10.0)
odd_stamps = st.sampled_from([0, -1, -(2**63), 2**63 - 1, 1])
stamps = st.integers(START_NS, START_NS + 10 * SECOND) | odd_stamps
faults = st.sampled_from([fault for fault in FAULTS if fault != NO_FAULT])
kinds = st.sampled_from([CRANK, TORQUE])

faulty = st.tuples(stamps, kinds, faults, numbers, numbers, numbers)
not_finite = st.tuples(stamps, st.just(CRANK), st.just(NO_FAULT), odd_numbers, numbers, numbers)
stampless = st.tuples(st.sampled_from([0, -1, -(2**63)]), kinds, st.just(NO_FAULT), numbers, numbers, numbers)
anything = st.tuples(stamps, kinds, faults | st.just(NO_FAULT), numbers, numbers, numbers)


def block(samples):
    rest = (np.nan,) * ENCODERS, (np.nan,) * 2, np.nan
    return np.array([(*sample, *rest) for sample in samples], GAIT_SAMPLE)


def worn(monitor):
    return monitor._twin.depth


def counted(monitor):
    counts = monitor._twin.intake
    dropped = counts.duplicates + counts.late + counts.stray_stamps + counts.outliers
    return sum(counts.faulty.values()) + dropped + sum(counts.used.values())


@settings(max_examples=20)
@given(st.lists(faulty | not_finite | stampless, min_size=1, max_size=300))
def test_samples_that_cannot_be_used_are_counted_by_name_and_wear_nothing(new_monitor, samples):
    monitor = new_monitor()
    reports = monitor.update(block(samples))
    assert not worn(monitor).any()
    assert reports.cycles == ()
    assert sum(reports.lost.faulty.values()) == len(samples)
    assert set(reports.lost.faulty) == set(FAULTS.values()) - {"none"}
    shown = status_of(monitor, "input").values
    assert sum(value for key, value in shown.items() if key.startswith("faulty_")) == len(samples)


@settings(max_examples=20)
@given(st.lists(anything, min_size=1, max_size=300))
def test_nothing_that_comes_breaks_the_monitor(new_monitor, samples):
    monitor = new_monitor()
    monitor.update(block(samples))
    depth = worn(monitor)
    assert np.isfinite(depth).all()
    assert (depth >= 0.0).all()
    assert monitor._twin.intake.received == len(samples)
    assert counted(monitor) <= len(samples)
    monitor.status()


@settings(max_examples=10)
@given(st.data())
def test_a_good_stream_wears_the_same_with_bad_samples_in_it(new_monitor, gait, data):
    good = gait(2.5)
    clean = new_monitor()
    clean.update(good)
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
    np.testing.assert_array_equal(worn(monitor), worn(clean))
    assert worn(monitor).any()
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
    assert not worn(monitor).any()
    status = status_of(monitor, "input")
    assert max(status.values.get(name, 0), status.values.get(f"faulty_{name}", 0)) > 0
    assert status.values["received"] == len(stream)
    assert raised(monitor) & {"input_samples", "input_gaps"}, reports.lost
    assert status.level is Level.ERROR


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
    assert worn(monitor).max() < 2e-12
