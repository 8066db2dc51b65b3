"""Steps: the tracker's instructions to the leg, in the order of stamps (physics.md section 9)."""

import numpy as np

from leg_wear_monitor.compiled.kernel import Records, kernel, new_records

# Codes of steps: set the leg in motion; move it along a polynomial; rest; evaluate it at a sample; stop
# following; report an event only; push the foot at a sample of its load.
START, MOVE, REST, EVALUATE, LEAVE, REPORT, PUSH = range(7)

# Reasons of LEAVE, then events of REPORT.
LOST_IN_GAP, LOST_BY_OUTLIERS, LOST_BY_OVERFLOW, LOST_BY_JUMP = range(4)
STOPPED, MOVING, REVERSED = range(4, 7)

STEP = np.dtype(
    [
        ("code", "i8"),  # one of the codes above
        ("begin_ns", "i8"),  # stamp at which it begins
        ("end_ns", "i8"),  # stamp at which it ends
        ("detail", "i8"),  # EVALUATE: kind of the sample; LEAVE: reason; REPORT: event
        ("turns", "i8"),  # whole crank turns to add to the angle of the motion
        ("bridged_ns", "i8"),  # part of its duration that bridges a gap
        ("torque", "f8"),  # drive torque measured at a sample [N m]
        # START: angle [rad], speed, acceleration; MOVE: coefficients over time [s]; PUSH: force x and y [N]
        ("motion", "f8", (6,)),
    ]
)

SPLINE_NODE = np.dtype(
    [
        ("angle", "f8"),  # crank angle [rad]
        ("speed", "f8"),  # crank speed [rad/s]
        ("acceleration", "f8"),  # crank acceleration [rad/s^2]
    ]
)

Steps = Records
"""Records of `STEP`, shape (m,)."""


def room_for_steps(m: int) -> Steps:
    """Empty records (m,) of steps."""
    return new_records(m, STEP)


@kernel
def add_step(steps, n, code, begin_ns, end_ns, detail):
    """Write step n with zero motion; returns n + 1."""
    step = steps[n]
    step.code, step.begin_ns, step.end_ns, step.detail = code, begin_ns, end_ns, detail
    step.turns, step.bridged_ns, step.torque = 0, 0, 0.0
    for i in range(6):
        step.motion[i] = 0.0
    return n + 1


@kernel
def join_smoothly(before, after, h, out_polynomial):
    """Coefficients (6,) of the quintic over a time h [s] between two spline nodes; physics.md section 9."""
    far = after.angle - (before.angle + h * (before.speed + 0.5 * h * before.acceleration))
    fast = h * (after.speed - (before.speed + h * before.acceleration))
    bent = 0.5 * h * h * (after.acceleration - before.acceleration)
    out_polynomial[0], out_polynomial[1] = before.angle, before.speed
    out_polynomial[2] = 0.5 * before.acceleration
    out_polynomial[3] = (10.0 * far - 4.0 * fast + bent) / h**3
    out_polynomial[4] = (-15.0 * far + 7.0 * fast - 2.0 * bent) / h**4
    out_polynomial[5] = (6.0 * far - 3.0 * fast + bent) / h**5
