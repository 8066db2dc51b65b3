"""Gait cycles that wait for a reference: those alike, whatever comes between."""

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.diagnosis.state import WINDOW_CYCLES, SignedCycle, TorqueState
from leg_wear_monitor.twin.reference import CrankProfile

pytestmark = pytest.mark.plain
STEADY = CrankProfile.steady(TURN)
ODD = attrs.evolve(STEADY, sine=np.array([0.03, *np.zeros(len(STEADY.sine) - 1)]))


def waited(kinds: list[bool]) -> TorqueState:
    """The state after gait cycles, steady ones or odd ones, of which none has a reference."""
    state = TorqueState(np.full(5, 3.0e-4))
    for i, is_odd in enumerate(kinds):
        state.wait_with(SignedCycle(i, i + 1, np.zeros(4), ODD if is_odd else STEADY, 0.0))
    return state


def test_one_odd_cycle_in_five_does_not_begin_the_wait_anew() -> None:
    """Seen before: on a crank that turns as a real motor did, a leg waited for 3900 gait cycles."""
    assert len(waited([False] * 4 + [True] + [False]).waiting) == 5
    assert not STEADY.is_like(ODD)


@given(st.lists(st.booleans(), min_size=1, max_size=2 * WINDOW_CYCLES))
def test_all_of_the_last_cycles_are_kept_once_and_those_that_wait_are_alike(kinds: list[bool]) -> None:
    state = waited(kinds)
    kept = sorted((*state.waiting, *state.odd), key=lambda one: one.begin_ns)
    assert [one.begin_ns for one in kept] == list(range(len(kinds)))[-WINDOW_CYCLES:]
    assert all(one.profile.is_like(state.waiting[-1].profile) for one in state.waiting)
    assert not any(one.profile.is_like(state.waiting[-1].profile) for one in state.odd)
