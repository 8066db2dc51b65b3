"""The monitor's small parts: beats, spans of counted time, health of the input."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.monitor.accounting import NEIGHBOURS_NS, is_within, with_span
from leg_wear_monitor.monitor.evaluation import IDLE_LIMIT, EvaluationPeriods
from leg_wear_monitor.monitor.input_health import TorqueRange, with_torques
from leg_wear_monitor.twin import TORQUE
from leg_wear_monitor.twin.sample import EMPTY, GAIT_SAMPLE, gait_samples

pytestmark = pytest.mark.plain

LENGTH = 1000


def stream(stamps):
    samples = np.zeros(len(stamps), GAIT_SAMPLE)
    samples["stamp_ns"] = stamps
    return samples


def ends(evaluation_periods, blocks):
    """Indices after which beats end."""
    found, at = [], 0
    for block in blocks:
        for piece, is_end in evaluation_periods.pieces(block):
            at += len(piece)
            if is_end:
                found.append(at)
    return found


@given(st.lists(st.integers(-5, 20_000), max_size=400), st.lists(st.integers(0, 400), max_size=8))
def test_beats_are_where_they_are_however_blocks_are_cut(stamps, cuts):
    samples = stream(stamps)
    whole = ends(EvaluationPeriods(LENGTH), [samples])
    blocks = np.split(samples, sorted(min(cut, len(samples)) for cut in cuts))
    assert ends(EvaluationPeriods(LENGTH), blocks) == whole


@given(st.integers(1, 10**15), st.integers(1, LENGTH))
def test_an_even_stream_has_even_beats(begin, step):
    samples = stream(begin + step * np.arange(5 * LENGTH // step + 10))
    found = np.diff([0, *ends(EvaluationPeriods(LENGTH), [samples])])
    assert len(found) >= 2
    assert np.ptp(found[1:]) == 0
    assert abs(found[1] * step - LENGTH) <= 2 * step


@given(st.integers(20, 60), st.sampled_from([10**15, -(10**15), 1]))
def test_one_stray_stamp_ends_no_beat(at, off):
    even = stream(10**16 + 10 * np.arange(400))
    strayed = even.copy()
    strayed["stamp_ns"][at] += off
    assert ends(EvaluationPeriods(LENGTH), [strayed]) == ends(EvaluationPeriods(LENGTH), [even])


@pytest.mark.parametrize("stamps", [[0] * 500, [-1] * 500, [10**9] * 500, [2**63 - 1] * 500])
def test_a_stream_without_time_has_beats_too(stamps):
    assert len(ends(EvaluationPeriods(LENGTH), [stream(stamps)])) >= len(stamps) // IDLE_LIMIT - 1


pairs = st.tuples(st.integers(0, 10**12), st.integers(0, 10**11)).map(lambda pair: (pair[0], sum(pair)))


@given(st.lists(pairs, max_size=12), st.lists(st.integers(-10, 12 * 10**11), min_size=1, max_size=20))
def test_spans_are_apart_in_order_and_hold_all_that_was_put_in(given, stamps):
    spans = ()
    for begin, end in given:
        spans = with_span(spans, begin, end)
    assert all(first[1] + NEIGHBOURS_NS < second[0] for first, second in pairwise(spans))
    assert all(any(begin <= b and e <= end for begin, end in spans) for b, e in given)
    assert sum(e - b for b, e in spans) <= sum(e - b for b, e in given) + NEIGHBOURS_NS * len(given)
    if spans:
        found = is_within(np.array(stamps), np.array(spans))
        assert found.tolist() == [any(b <= stamp <= e for b, e in spans) for stamp in stamps]


def test_stamps_are_found_in_spans_that_overlap():
    """Spans of several runs may."""
    spans = np.array([[0, 100], [10, 20], [50, 60], [200, 300]])
    stamps = np.array([-1, 0, 30, 70, 100, 101, 199, 200, 300, 301])
    assert stamps[is_within(stamps, spans)].tolist() == [0, 30, 70, 100, 200, 300]


def torque_range(values, saturation_nm=0.0, cuts=()):
    samples = gait_samples(np.arange(1, len(values) + 1), TORQUE, torque_nm=values)
    found = TorqueRange()
    for block in np.split(samples, cuts):
        found = with_torques(found, block, saturation_nm)
    return found


@given(
    st.lists(st.sampled_from([-2.0, -1.5, 0.0, 1.0, 2.0, math.nan, math.inf]), max_size=40),
    st.lists(st.integers(0, 40), max_size=5),
)
def test_torques_are_counted_the_same_however_they_are_cut(values, cuts):
    cuts = sorted(min(cut, len(values)) for cut in cuts)
    whole = torque_range(values, 1.5)
    assert torque_range(values, 1.5, cuts) == whole
    finite = [value for value in values if math.isfinite(value)]
    assert whole.number == len(finite)
    if finite:
        assert (whole.least_nm, whole.largest_nm) == (min(finite), max(finite))
        assert whole.at_least == finite.count(min(finite))
        assert whole.at_largest == finite.count(max(finite))
        assert whole.saturated == sum(abs(value) >= 1.5 for value in finite)


def test_how_much_torque_is_stuck():
    assert torque_range([3.0] * 20).stuck_fraction == 1.0
    assert torque_range(np.arange(20.0)).stuck_fraction == 0.0
    assert torque_range(np.clip(np.arange(20.0), 4.5, 100.0)).stuck_fraction == 5 / 20
    assert torque_range(np.arange(20.0), saturation_nm=15.0).stuck_fraction == 5 / 20
    assert math.isnan(torque_range([3.0] * 5).stuck_fraction)
    assert with_torques(TorqueRange(), gait_samples([1], TORQUE, torque_nm=1.0, fault=EMPTY), 0.0).number == 0
