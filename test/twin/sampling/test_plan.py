"""The plan: one block a window at a random place, and one more where something changes."""

import numpy as np
import pytest

from leg_wear_monitor.twin.sample import SamplingSettings
from leg_wear_monitor.twin.sampling import Condition, SamplingPlan

SETTINGS = SamplingSettings(fraction=0.1)
SLOW, FAST = Condition(1, 100, 0), Condition(1, 105, 0)

pytestmark = pytest.mark.plain


def followed(conditions: list[Condition], first_ns: int = 0, pulls: tuple[int, ...] = ()) -> np.ndarray:
    """Which gait cycles a plan follows (n,)."""
    plan, follows, found, block = SamplingPlan(SETTINGS), True, [], 0
    for k, condition in enumerate(conditions):
        found.append(follows)
        if k in pulls:
            plan.pull()
        block += follows and not plan.is_settling
        stamp_ns, was = first_ns + k * 10**9, follows
        follows = plan.follows_next(condition, stamp_ns, was)
        if was and not follows:
            plan.note_block(condition, block)
            block = 0
    return np.array(found)


def blocks(found: np.ndarray) -> list[tuple[int, int]]:
    """Begin and length of each block."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], found, [False]]).astype(int)))
    return [(int(begin), int(end - begin)) for begin, end in edges.reshape(-1, 2)]


def test_a_steady_gait_is_followed_by_the_fraction():
    found = followed([SLOW] * 22_000)
    assert found.mean() == pytest.approx(0.1, abs=1e-3)
    assert found[: SETTINGS.followed_cycles].all()
    window = SETTINGS.window_cycles
    assert [found[k : k + window].sum() for k in range(0, 22_000, window)] == [22] * 100


def test_blocks_lie_evenly_and_at_random():
    starts = [begin % 220 for begin, _ in blocks(followed([SLOW] * 110_000))[1:]]
    assert abs(np.mean(starts) - 99.0) < 4.0 * 57.5 / np.sqrt(len(starts))
    assert len(set(starts)) > 100


def test_a_recording_has_the_same_blocks_again_and_another_one_has_others():
    one, again, other = (followed([SLOW] * 2000, first) for first in (5, 5, 6))
    np.testing.assert_array_equal(one, again)
    assert (one != other).any()


def test_a_new_condition_is_followed_where_it_lasts():
    found = followed([SLOW] * 40 + [FAST] + [SLOW] * 60 + [FAST] * 60)
    assert not found[22:103].any()
    assert found[103:125].all()


def test_a_known_condition_is_not_followed_again_at_once():
    often = ([SLOW] * 100 + [FAST] * 100) * 50
    assert followed(often).mean() < 0.12


def test_a_change_pulls_a_block():
    found = followed([SLOW] * 200, pulls=(60,))
    assert found[61:83].all()
    assert not found[22:61].any()
