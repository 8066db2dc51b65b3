"""Records: named state that compiled and plain code share."""

import numpy as np
import pytest

from leg_wear_monitor.compiled.kernel import entry, new_records, record_of, values_of

INNER = np.dtype([("angle", "f8")])
DTYPE = np.dtype([("count", "i8"), ("speed", "f8", (2,)), ("inner", INNER)])


@entry
def _step(states, k):
    state = states[0]
    state.count += 1
    state.speed[k] = 0.5 * state.count
    inner = state.inner
    inner.angle -= 1.0


def test_compiled_code_writes_to_the_record_that_python_holds():
    states = new_records(1, DTYPE)
    state = record_of(states)
    _step(states, 0)
    state.count += 1
    _step(states, 1)
    assert state.count == 3
    assert state.speed.tolist() == [0.5, 1.5]
    assert state.inner.angle == -2.0


def test_a_snapshot_is_a_copy_and_can_be_restored():
    states = new_records(1, DTYPE)
    state = record_of(states)
    _step(states, 1)
    snapshot = states.copy()
    _step(states, 0)
    states[:] = snapshot
    assert state.count == 1
    assert state.speed.tolist() == [0.0, 0.5]
    _step(states, 0)
    assert record_of(snapshot).count == 1


def test_one_of_many_is_not_the_only_one():
    with pytest.raises(ValueError, match="too many"):
        record_of(new_records(2, DTYPE))


def test_values_are_those_of_the_record():
    states = new_records(1, DTYPE)
    _step(states, 1)
    values = values_of(states)
    assert values["count"] == 1
    assert type(values["count"]) is int
    assert list(values["speed"]) == [0.0, 0.5]


@pytest.mark.parametrize("dtype", [[("mean", "f8")], [("outer", [("angle", "f8"), ("fill", "i8")], (2,))]])
def test_a_name_that_numpy_has_taken_is_refused(dtype):
    """Plain Python would read numpy's method, or its number of elements, in place of the field."""
    with pytest.raises(ValueError, match=r"^fields (mean|fill): "):
        new_records(1, np.dtype(dtype))
