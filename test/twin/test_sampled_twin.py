"""A twin that follows blocks of gait cycles only: what it says of the others, and that it repeats itself."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin.digital_twin import DigitalTwin, TwinSnapshot
from leg_wear_monitor.twin.sample import SamplingSettings
from leg_wear_monitor.twin.statistics import CycleStatistics, TwinUpdate

SETTINGS = SamplingSettings(fraction=0.3, block_cycles=8, settle_cycles=1)
SECONDS = 70.0


def angle(t: np.ndarray) -> np.ndarray:
    """A cadence that changes by a tenth every twenty seconds."""
    speed = TURN * (1.0 + 0.1 * (t // 20.0 % 2.0))
    return np.cumsum(speed) * (t[1] - t[0])


@pytest.fixture(scope="module")
def _sampled(leg) -> tuple[DigitalTwin, TwinSnapshot]:
    twin = DigitalTwin(leg, sampling=SETTINGS)
    return twin, twin.snapshot()


@pytest.fixture
def sampled(_sampled) -> DigitalTwin:
    twin, new = _sampled
    twin.restore(new)
    return twin


@pytest.fixture(scope="module")
def walk(gait):
    return gait(SECONDS, angle=angle)


def updated(twin: DigitalTwin, samples: np.ndarray, size: int) -> list[TwinUpdate]:
    return [twin.update(samples[i : i + size]) for i in range(0, len(samples), size)]


def cycles_of(updates: list[TwinUpdate]) -> list[CycleStatistics]:
    return [cycle for update in updates for cycle in update.cycles]


@attrs.frozen(eq=False)
class Replay:
    """What the sampled twin said of the whole walk, and its state after a half of it and at the end."""

    updates: list[TwinUpdate]
    middle: TwinSnapshot
    end: TwinSnapshot

    @property
    def cycles(self) -> list[CycleStatistics]:
        return cycles_of(self.updates)

    @property
    def followed(self) -> np.ndarray:
        return np.array([each.is_followed for each in self.cycles])


@pytest.fixture(scope="module")
def replay(_sampled, walk) -> Replay:
    twin, new = _sampled
    twin.restore(new)
    half = len(walk) // 2
    updates = updated(twin, walk[:half], 1000)
    middle = twin.snapshot()
    updates += updated(twin, walk[half:], 1000)
    return Replay(updates, middle, twin.snapshot())


def worn(twin: DigitalTwin) -> np.ndarray:
    return twin.depth.sum(axis=1).mean(axis=1)


# Largest relative deviation of the wear of joints A, B, G, I, J from that of a whole replay: 5.3 sigma and
# the mean. Sigmas are 0.0017, 0.020, 0.017, 0.025, 0.035, means below 0.003 (29 moved starts, 2026-11-23).
# The error that the twin states is no such bound: it comes from four blocks, so the deviation over it is
# Student's of three degrees of freedom: more than 4 in two of 145, 5.4 the largest.
OFF = np.array([0.013, 0.13, 0.12, 0.16, 0.21])


@pytest.mark.chaotic
def test_the_wear_is_that_of_a_whole_replay(sampled, twin, walk, replay):
    whole, found = cycles_of(updated(twin, walk, 1000)), replay.cycles
    assert [(each.begin_ns, each.stamp_ns) for each in found] == [(e.begin_ns, e.stamp_ns) for e in whole]
    np.testing.assert_allclose([e.moving_s for e in found], [e.moving_s for e in whole], rtol=1e-3)
    sampled.restore(replay.end)
    sampled.end_recording()
    followed = replay.followed
    assert 0.2 < np.mean(followed) < 0.6
    assert sampled.sampling.followed_cycles == sum(followed)
    assert 0.0 <= sampled.sampling.estimated_cycles - (len(found) - sum(followed)) < 1.1  # the last is a part
    off, sigma = worn(sampled) - worn(twin), np.sqrt(sampled.sampling.variance_m2)
    assert (np.abs(off) < OFF * worn(twin)).all()
    assert (sigma < 0.5 * worn(twin)).all()
    assert (sigma > 0.0).all()
    # until the first jump it is the whole replay, bit for bit
    first = followed.argmin()
    for one, same in zip(found[:first], whole[:first], strict=True):
        np.testing.assert_array_equal(one.clearance_mean_m[:], same.clearance_mean_m)
        np.testing.assert_array_equal(one.peak_force_n, same.peak_force_n)


def test_cycles_that_are_not_followed_have_no_forces(replay):
    tracked = [each for each in replay.cycles if not each.is_followed]
    for name in ("peak_force_n", "p99_force_n", "mean_force_n", "growth_mean_m", "archard_j"):
        assert np.isnan([getattr(each, name) for each in tracked]).all()
    assert {each.torque.samples for each in tracked} == {0}
    assert (np.diff([each.clearance_mean_m for each in tracked], axis=0) > -1e-10).all()
    stamps, force, torque, turned = (
        np.concatenate([getattr(update.samples, name) for update in replay.updates])
        for name in ("stamp_ns", "contact_force_n", "predicted_torque_nm", "crank_angle_rad")
    )
    for each in tracked:
        inside = (stamps > each.begin_ns) & (stamps < each.stamp_ns)
        assert np.isnan(force[inside]).all() and np.isnan(torque[inside]).all()
        assert np.isfinite(turned[inside]).all()


@pytest.mark.chaotic
def test_forces_after_a_jump_are_those_of_the_gait(replay):
    """The journals go on where they were left: nothing knocks.

    1.15 with a sigma of 0.09 (29 starts moved by 1e-12, 2026-11-23); the largest of ten was 2.5.
    """
    followed = replay.followed
    peak = np.array([each.peak_force_n for each in replay.cycles])
    again = np.flatnonzero(~followed[:-1] & followed[1:]) + 1
    assert len(again) >= 1
    assert (peak[again] / np.nanmax(peak[: followed.argmin()], axis=0)).mean() < 2.0


def test_blocks_of_samples_do_not_matter(sampled, walk, replay):
    other = cycles_of(updated(sampled, walk, 137))
    depth = sampled.depth
    sampled.restore(replay.end)
    np.testing.assert_array_equal(depth, sampled.depth)
    assert [each.is_followed for each in other] == replay.followed.tolist()


def test_a_restored_twin_goes_on_bit_for_bit(sampled, walk, replay):
    sampled.restore(replay.middle)
    updated(sampled, walk[len(walk) // 2 :], 1000)
    depth, sampling = sampled.depth, sampled.sampling
    sampled.restore(replay.end)
    np.testing.assert_array_equal(sampled.depth, depth)
    for one, same in zip(attrs.astuple(sampled.sampling), attrs.astuple(sampling), strict=True):
        np.testing.assert_array_equal(one, same)


def test_a_lost_crank_is_left_out_and_a_stop_pulls_a_block(sampled, gait):
    """After a gap of two seconds the leg is set in motion again, and followed."""
    samples = gait(40.0)
    kept = np.concatenate([samples[: 200 * 20], samples[200 * 22 :]])
    found = cycles_of(updated(sampled, kept, 1000))
    assert sampled.intake.unmonitored_s == pytest.approx(2.0, abs=0.5)
    after = next(k for k, each in enumerate(found) if each.begin_ns > samples["stamp_ns"][200 * 22])
    assert all(each.is_followed for each in found[after : after + SETTINGS.block_cycles])
    whole = sum(1 for each in found if each.is_followed)
    parts = sampled.sampling.estimated_cycles % 1.0
    assert whole + sampled.sampling.estimated_cycles - parts == len(found)
