"""Starts of simulations moved by a relative 1e-12: the motion that another machine's last bits give.

Motion with clearances is chaotic. A moved start gives another draw of the same statistics, and a test of
them must hold for every draw. ``MOVED_STARTS=SEED`` moves all starts of a run of the tests, which is what
`make test-machines` does; `move_starts` gives draw after draw in one process, to measure a scatter.
"""

import numpy as np

from leg_wear_monitor.dynamics import full_run
from leg_wear_monitor.dynamics.clearance import stepper
from leg_wear_monitor.dynamics.clearance.model import clearance_state
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
from leg_wear_monitor.dynamics.full_run import full_state

_PART = 1.0e-12
_CLEARANCE_M = 3.0e-4  # journals start centred: moved by the part of a usual clearance
_set_eccentricities = ClearanceStepper.set_eccentricities


def move_starts(seed: int) -> None:
    """Move all starts from now on.

    The same seed moves the same start by the same, so that a run repeats itself; and a mirrored one by the
    mirrored: along gravity, and all coordinates by one factor.
    """
    chance = np.random.default_rng(seed).standard_normal(1 + 100)
    factor, up_m = 1.0 + _PART * chance[0], _PART * _CLEARANCE_M * chance[1:]

    def moved(eccentricity):
        """Eccentricities (2 k,) or (k, 2) [m]."""
        pairs = np.array(eccentricity, dtype=float).reshape(-1, 2)
        pairs[:, 1] += up_m[: len(pairs)]
        return pairs

    def moved_clearance_state(depth, angle, speed):
        state = clearance_state(depth, angle, speed)
        state.e[:] = moved(state.e).ravel()
        return state

    def moved_full_state(q, v, clearance_joints):
        return full_state(factor * q, factor * v, clearance_joints)

    stepper.clearance_state, full_run.full_state = moved_clearance_state, moved_full_state
    ClearanceStepper.set_eccentricities = lambda self, e: _set_eccentricities(self, moved(e))
