"""Film of oil or grease of a clearance joint in full coordinates (physics.md section 4)."""

import numpy as np

from leg_wear_monitor.contact.film import film_force
from leg_wear_monitor.dynamics.run.run_statistics import DISSIPATION, FORCE, FORCE_SQUARED
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.forces import add_force


@kernel
def add_film(model, k, ex, ey, vx, vy, b, j, sbx, sby, cx, cy, delta, q, v, scratch, out_rate):
    """Add the film's force in clearance joint k to the contact's, (cx, cy) [N]; change the joint's rates.

    Arguments as in `add_contacts`. On worn surfaces the film is that of the local clearance.
    """
    contacts, speed_b, speed_j = model.contacts, v[b, 2], v[j, 2]
    clearance = np.sqrt(ex * ex + ey * ey) - delta
    fx, fy, moment_b, moment_j = film_force(
        ex, ey, vx, vy, speed_b, speed_j, clearance, contacts.bushing_radius[k],
        contacts.width[k], model.films[k, 0], model.films[k, 1],
    )  # fmt: skip
    add_force(b, sbx, sby, -fx, -fy, scratch.force)
    add_force(j, q[b, 0] + sbx + ex - q[j, 0], q[b, 1] + sby + ey - q[j, 1], fx, fy, scratch.force)
    scratch.force[b, 2] += moment_b
    scratch.force[j, 2] += moment_j
    out_rate[FORCE_SQUARED] = (cx + fx) ** 2 + (cy + fy) ** 2
    out_rate[FORCE] = np.sqrt(out_rate[FORCE_SQUARED])
    out_rate[DISSIPATION] -= fx * vx + fy * vy + moment_b * speed_b + moment_j * speed_j
