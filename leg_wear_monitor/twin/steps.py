"""What the tracker tells the leg to do, step by step, in the order of stamps."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.arrays import Floats, Ints

# A step's code: set the leg in motion; move it along a polynomial; let it rest; look at it for a sample;
# leave it; and what is only told. EXTRA is the sample's kind, the reason for leaving it, or a happening.
START, MOVE, REST, LOOK, LEAVE, TELL = range(6)
# columns: begin and end [ns]; turns of the crank before the angle that the polynomial counts from; how much
# of the time bridges a gap [ns]
CODE, BEGIN, END, EXTRA, TURNS, BRIDGE_NS = range(6)

LOST_IN_GAP, LOST_BY_OUTLIERS, LOST_BY_OVERFLOW, LOST_BY_JUMP = range(4)
STOPPED, MOVING, REVERSED = range(4, 7)


class Steps(NamedTuple):
    """Steps: ``what`` (m, 6) as above; ``motion`` (m, 6) a polynomial, or angle and speed, or torque."""

    what: Ints
    motion: Floats


def room_for_steps(m: int) -> Steps:
    """Room for m steps."""
    return Steps(np.zeros((m, 6), dtype=np.int64), np.zeros((m, 6)))


@kernel
def add_step(steps, n, code, begin, end, extra):
    """Write step n; returns n + 1."""
    what = steps.what
    what[n, CODE], what[n, BEGIN], what[n, END], what[n, EXTRA] = code, begin, end, extra
    what[n, TURNS], what[n, BRIDGE_NS] = 0, 0
    for i in range(6):
        steps.motion[n, i] = 0.0
    return n + 1


@kernel
def join_smoothly(before, after, h, out_polynomial):
    """Quintic over a time h [s] from angle, speed and acceleration ``before`` to those ``after``."""
    far = after[0] - (before[0] + h * (before[1] + 0.5 * h * before[2]))
    fast = h * (after[1] - (before[1] + h * before[2]))
    bent = 0.5 * h * h * (after[2] - before[2])
    out_polynomial[0], out_polynomial[1], out_polynomial[2] = before[0], before[1], 0.5 * before[2]
    out_polynomial[3] = (10.0 * far - 4.0 * fast + bent) / h**3
    out_polynomial[4] = (-15.0 * far + 7.0 * fast - 2.0 * bent) / h**4
    out_polynomial[5] = (6.0 * far - 3.0 * fast + bent) / h**5
