"""Laws of the clearance joints in vectors: normal and friction forces of eight joints at once.

The usual laws are formulas for vectors, in which what depends on a joint's state is a choice of two values,
not a jump. Laws of other forms are computed joint by joint.
"""

import numpy as np

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.contact.friction import (
    NONE,
    THRELFALL,
    against,
    ambrosio_ramp,
    friction_force,
)
from leg_wear_monitor.contact.normal.hertz import hertz_force
from leg_wear_monitor.contact.normal.laws import LAWS, normal_force
from leg_wear_monitor.dynamics.joint.joint_contact import coefficient_at
from leg_wear_monitor.kernel import entry, kernel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.vectors import WIDTH, entry_of, padded, vector_at, where, with_entry

# rows of the joints' laws: number of the normal law's form, its hysteresis factor and its coefficient on
# fresh surfaces, clearance [m]; friction coefficient, ramp, and code of the friction law
NORMAL_FORM, HYSTERESIS_FACTOR, FRESH_COEFFICIENT, FRESH_CLEARANCE = range(4)
FRICTION_COEFFICIENT, RAMP_0, RAMP_1, FRICTION_LAW = range(4, 8)
LAW_ROWS = 8

_HERTZ = LAWS["hertz"].number


def contact_laws(contacts: ContactArrays) -> Floats:
    """Parameters of the contact laws of the clearance joints (LAW_ROWS, room), in the rows above."""
    k = len(contacts.joint)
    laws, fresh = np.zeros((LAW_ROWS, padded(k))), np.empty(k)
    _fresh_coefficients(contacts, fresh)
    laws[:FRICTION_COEFFICIENT, :k] = contacts.normal_form, contacts.hysteresis, fresh, contacts.clearance
    laws[FRICTION_COEFFICIENT:FRICTION_LAW, :k] = contacts.friction.T
    laws[FRICTION_LAW, :k] = contacts.friction_law
    laws[FRICTION_COEFFICIENT, :k][contacts.friction_law == NONE] = 0.0
    return laws


def have_usual_laws(contacts: ContactArrays) -> bool:
    """Whether all joints have Hertz's form and a friction without an exponential: vectors of joints."""
    return bool((contacts.normal_form == _HERTZ).all() and (contacts.friction_law != THRELFALL).all())


@entry
def _fresh_coefficients(contacts, out_coefficient):
    """Coefficients (k,) of the normal laws on fresh surfaces, each in the law's own unit."""
    for k in range(out_coefficient.shape[0]):
        radius = contacts.bushing_radius[k]
        out_coefficient[k] = coefficient_at(contacts, k, radius, radius - contacts.clearance[k])


@kernel
def joint_forces(model, k, coefficient, clearance, approach, delta, rate, slip):
    """Forces of eight joints from joint k on; all arguments after k are vectors, the approach 0 if open.

    Returns
    -------
    f_n, stiffness, damping, elastic, f_t
        As in a sample; all 0 for a joint that is open or apart.
    """
    law = model.law
    touching = (delta > 0.0) & (approach > 0.0)
    loss = vector_at(law, (HYSTERESIS_FACTOR, k)) / where(touching, approach, 1.0)
    delta = where(touching, delta, 0.0)
    mu = vector_at(law, (FRICTION_COEFFICIENT, k))
    v0, v1 = vector_at(law, (RAMP_0, k)), vector_at(law, (RAMP_1, k))
    f_n, stiffness, damping, elastic = hertz_force(coefficient, clearance, loss, delta, rate)
    f_t = against(slip, mu * ambrosio_ramp(abs(slip), v0, v1) * f_n)
    if not model.usual:
        for i in range(WIDTH):
            if entry_of(delta, i) > 0.0:
                n, s, d, e = normal_force(
                    law[NORMAL_FORM, k + i], entry_of(coefficient, i), entry_of(clearance, i),
                    entry_of(loss, i), entry_of(delta, i), entry_of(rate, i),
                )  # fmt: skip
                t = friction_force(
                    law[FRICTION_LAW, k + i], law[FRICTION_COEFFICIENT, k + i], entry_of(v0, i),
                    entry_of(v1, i), n, entry_of(slip, i),
                )  # fmt: skip
                f_n, stiffness = with_entry(f_n, i, n), with_entry(stiffness, i, s)
                damping, elastic = with_entry(damping, i, d), with_entry(elastic, i, e)
                f_t = with_entry(f_t, i, t)
    return f_n, stiffness, damping, elastic, f_t
