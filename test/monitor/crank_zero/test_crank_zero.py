"""The zero of the crank is found from the torque, or it is said why not; before, no sample is passed on."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from leg_wear_monitor.monitor.crank_zero import TURNS, CrankZero
from leg_wear_monitor.monitor.evaluation import A_CYCLE, EvaluationPeriods
from leg_wear_monitor.twin import CRANK
from leg_wear_monitor.twin.sample import Samples

TOLERANCE_RAD = 0.02
SECOND = 10**9


def off_rad(search: CrankZero, zero_rad: float) -> float:
    assert search.zero is not None, search.cause
    return abs(math.remainder(search.zero.offset_rad - zero_rad, math.tau))


@pytest.mark.parametrize("seed", range(8))
def test_it_is_found_within_four_turns_and_later_samples_have_it(seed: int, walk, new_search, feed) -> None:
    rng = np.random.default_rng(seed)
    rpm = float(rng.choice([-1.0, 1.0]) * rng.uniform(35.0, 90.0))
    zero, begin = float(rng.uniform(-math.pi, math.pi)), float(rng.uniform(0.0, 1.0))
    seconds = (TURNS[0] + 1.0) * 60.0 / abs(rpm)
    sent = walk(seconds, zero, rpm, begin, is_wrapped=bool(rng.integers(2)), seed=seed)
    search = new_search(float(round(rpm)))
    passed = feed(search, sent)
    assert off_rad(search, zero) < TOLERANCE_RAD
    assert search.zero is not None
    assert search.zero.turns == TURNS[0]
    assert search.zero.sigma_rad >= TOLERANCE_RAD  # clearances shift the phase by as much
    assert search.cause == ""
    later = sent[len(sent) - len(passed) :]
    before_s = 1.0e-9 * (int(later["stamp_ns"][0]) - int(sent["stamp_ns"][0]))
    assert search.unmonitored_s == pytest.approx(before_s, abs=0.01)
    assert before_s < (TURNS[0] + 0.75) * 60.0 / abs(rpm)
    later["crank_angle_rad"] += search.zero.offset_rad
    assert passed.tobytes() == later.tobytes()


@pytest.mark.parametrize(("stop", "cuts"), [(700, (1, 333)), (1300, ()), (1603, (1400, 1602))])
def test_it_does_not_depend_on_blocks(stop: int, cuts: tuple[int, ...], walk, new_search, feed) -> None:
    sent = np.concatenate([walk(4.0, 1.0), walk(1.5, -2.0, begin_s=4.0, seed=1)])
    whole, parts = new_search(), new_search()
    expected = feed(whole, sent)
    periods = EvaluationPeriods(SECOND // A_CYCLE)
    begun = feed(parts, sent[:stop], cuts, periods)
    rest = feed(parts, sent[stop:], (), periods)
    assert np.concatenate([begun, rest]).tobytes() == expected.tobytes()
    assert (parts.zero, parts.cause) == (whole.zero, whole.cause)
    assert parts.unmonitored_s == whole.unmonitored_s


def without_torque(samples: Samples) -> Samples:
    return samples[samples["kind"] == CRANK]


def with_torque(samples: Samples, torque: Callable[[np.ndarray], np.ndarray]) -> Samples:
    samples = samples.copy()
    is_torque = samples["kind"] != CRANK
    samples["torque_nm"][is_torque] = torque(samples["torque_nm"][is_torque])
    return samples


def standing(samples: Samples) -> Samples:
    samples = samples.copy()
    samples["crank_angle_rad"] *= 0.0
    return samples


def symmetric(samples: Samples) -> Samples:
    """A torque that half a turn does not change."""
    samples = samples.copy()
    crank = samples[samples["kind"] == CRANK]["crank_angle_rad"]
    samples["torque_nm"][samples["kind"] != CRANK] = 9.0 * np.cos(2.0 * crank) + 3.0 * np.cos(4.0 * crank)
    return samples


UNTOLD = {
    "no drive torque": (without_torque, 60.0, "had 0 samples in 3 turns"),
    "constant": (lambda one: with_torque(one, np.zeros_like), 60.0, "did not change"),
    "noise": (
        lambda one: with_torque(one, lambda t: np.random.default_rng(2).standard_normal(len(t))),
        60.0,
        "did not fit this leg",
    ),
    "wrong sign": (lambda one: with_torque(one, np.negative), 60.0, "did not fit this leg"),
    "symmetric": (symmetric, 60.0, "did not fit this leg|almost equally well"),
    "few": (lambda one: np.delete(one, np.flatnonzero(one["kind"] != CRANK)[::10].repeat(9) + 2 * np.tile(
        np.arange(1, 10), len(one) // 20)), 60.0, "samples in 3 turns"),
    "standing": (standing, 60.0, "the leg walks at 0 rpm"),
    "another cadence": (lambda one: one, 80.0, "at 60 rpm; the commanded cadence is 80 ± 6 rpm"),
    "backwards": (lambda one: one, -60.0, "the leg walks at 60 rpm; the commanded cadence is -60 ± 6 rpm"),
}  # fmt: skip


@pytest.mark.parametrize("name", UNTOLD)
def test_where_it_cannot_be_told_it_is_said_why_and_found_later(name: str, walk, new_search, feed) -> None:
    change, rpm, why = UNTOLD[name]
    search = new_search(rpm)
    periods = EvaluationPeriods(SECOND // A_CYCLE)
    assert not len(feed(search, change(walk(5.0, 1.0)), (), periods))
    assert search.zero is None
    assert any(each in search.cause for each in why.split("|")), search.cause
    if rpm == 60.0:
        feed(search, walk(25.0, 1.0, begin_s=5.0), (), periods)
        assert off_rad(search, 1.0) < TOLERANCE_RAD


def test_samples_in_vain_are_bounded_and_not_monitored(walk, new_search, feed) -> None:
    search = new_search()
    periods = EvaluationPeriods(SECOND // A_CYCLE)
    feed(search, without_torque(walk(40.0, 1.0)), (), periods)
    assert sum(len(part) for part in search._samples) <= 1.5 * TURNS[-1] * 200
    assert search.unmonitored_s == pytest.approx(40.0, abs=0.1)
    passed = feed(search, walk(40.0, 1.0, begin_s=40.0), (), periods)
    assert off_rad(search, 1.0) < TOLERANCE_RAD
    first_s = 1.0e-9 * (int(passed["stamp_ns"][0]) - 1_700_000_000 * SECOND)
    assert search.unmonitored_s == pytest.approx(first_s, abs=0.01)


@pytest.mark.parametrize("pause_s", [0.0, 3.0])
def test_an_encoder_that_restarts_is_found_again(pause_s: float, walk, new_search, feed) -> None:
    first, second = walk(4.0, 1.0), walk(4.0, -2.2, begin_s=4.0 + pause_s, seed=1)
    truth = np.concatenate([walk(4.0, 0.0), walk(4.0, 0.0, begin_s=4.0 + pause_s, seed=1)])
    search = new_search()
    passed = feed(search, np.concatenate([first, second]))
    assert search.times_found == 2
    assert off_rad(search, -2.2) < TOLERANCE_RAD
    # none of the second boot has the zero of the first
    is_passed = np.isin(truth["stamp_ns"], passed["stamp_ns"])
    cranks = (samples[samples["kind"] == CRANK] for samples in (passed, truth[is_passed]))
    crank, known = (samples["crank_angle_rad"] for samples in cranks)
    off = np.abs(np.remainder(crank - known + math.pi, math.tau) - math.pi)
    assert off.max() < TOLERANCE_RAD


def test_a_gap_in_which_a_counting_encoder_counted_on_changes_nothing(walk, new_search, feed) -> None:
    whole = walk(12.0, 1.0)
    time_s = 1.0e-9 * (whole["stamp_ns"] - whole["stamp_ns"][0])
    search = new_search()
    passed = feed(search, whole[(time_s < 10.0) | (time_s > 10.8)])
    assert search.times_found == 1
    later = whole[whole["stamp_ns"] >= passed["stamp_ns"][0]]
    assert len(passed) == len(later) - np.count_nonzero((time_s >= 10.0) & (time_s <= 10.8))


def test_an_angle_that_goes_nowhere_is_not_waited_for(walk, new_search, feed) -> None:
    sent = walk(12.0, 1.0)
    time_s = 1.0e-9 * (sent["stamp_ns"] - sent["stamp_ns"][0])
    wild = (sent["kind"] == CRANK) & (time_s > 6.0)
    sent["crank_angle_rad"][wild] = np.random.default_rng(0).uniform(-9.0, 9.0, np.count_nonzero(wild))
    search = new_search()
    feed(search, sent)
    assert search.cause
    assert sum(len(part) for part in search._samples) < 1000
