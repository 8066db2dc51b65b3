"""Records: named state that compiled and plain code share."""

import numpy as np
import pytest

from leg_wear_monitor.kernel import entry
from leg_wear_monitor.record import copy_record, new_record

pytestmark = pytest.mark.plain

DTYPE = np.dtype([("count", "i8"), ("speed", "f8", (2,))])


@entry
def _step(state, k):
    state.count += 1
    state.speed[k] = 0.5 * state.count


def test_compiled_code_writes_to_the_record_that_python_holds():
    state = new_record(DTYPE)
    _step(state, 0)
    _step(state, 1)
    assert state.count == 2
    assert state.speed.tolist() == [0.5, 1.0]


def test_a_snapshot_is_a_copy_and_can_be_restored():
    state = new_record(DTYPE)
    _step(state, 1)
    snapshot = state.copy()
    _step(state, 0)
    copy_record(snapshot, state)
    assert state.count == 1
    assert state.speed.tolist() == [0.0, 0.5]
    _step(state, 0)
    assert snapshot.count == 1
