"""A long history is thinned, and no extreme value is lost."""

import numpy as np
import pytest

from leg_wear_monitor.playback.history import CYCLE_COLUMNS, SUMMARY_COLUMNS, History
from leg_wear_monitor.playback.summary import POINTS, _history

pytestmark = pytest.mark.plain


def long_history(cycles):
    history, draw = History(("A", "B")), np.random.default_rng(3)
    history._stamps.extend(range(cycles))
    history._cycles.extend(draw.normal(size=cycles * len(CYCLE_COLUMNS)))
    history._joints.extend(draw.normal(size=cycles * 2 * len(SUMMARY_COLUMNS)))
    return history


def test_the_range_of_each_group_is_kept():
    history = long_history(3 * POINTS + 7)
    thin = _history(history)
    assert len(thin.stamp_ns) == len(thin.lowest["torque_mismatch"]) == POINTS
    for name in ("cadence_rpm", "torque_mismatch", "load_n"):
        whole = history.column(name)
        assert thin.highest[name].max() == whole.max() and thin.lowest[name].min() == whole.min()
        assert (thin.lowest[name] <= getattr(thin, name)).all()
        assert (getattr(thin, name) <= thin.highest[name]).all()
        k = 500
        group = whole[thin.stamp_ns[k - 1] + 1 : thin.stamp_ns[k] + 1]
        assert (thin.lowest[name][k], thin.highest[name][k]) == (group.min(), group.max())
    assert thin.peak_force_n["B"].max() == history.joint_column("peak_force_n")[:, 1].max()


@pytest.mark.parametrize("cycles", [0, 1, POINTS])
def test_a_short_history_is_whole(cycles):
    thin = _history(long_history(cycles))
    assert len(thin.stamp_ns) == cycles
    assert thin.lowest == thin.highest == {}
