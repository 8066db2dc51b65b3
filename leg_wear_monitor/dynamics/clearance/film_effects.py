"""What films do beside their force: tables, drive torque, reactions, integrals (physics.md section 7)."""

import math

from leg_wear_monitor.dynamics.clearance.contact import F_T, NX, NY
from leg_wear_monitor.dynamics.clearance.film import (
    FILM_X,
    FILM_Y,
    MOMENT_B,
    MOMENT_J,
    SPEED_B,
    SPEED_J,
    VISCOSITY,
)
from leg_wear_monitor.dynamics.joint.contact_event import F_N, VX, VY
from leg_wear_monitor.dynamics.run.run_statistics import DISSIPATION, FORCE, FORCE_SQUARED
from leg_wear_monitor.kernel import kernel


@kernel
def load_spins(tables, points, e, v, ahead, now):
    """Rates of the films' bodies, for the eccentricities ``ahead`` [s] later.

    ``points`` (i, w): row of the table and fraction to the next. physics.md section 7.
    """
    spin, (i, w), d = tables.spin, points, e.shape[0]
    for r in range(now.spin.shape[0]):
        now.spin_turn[r] = now.turn_line[r]
        for c in range(d):
            here = (1.0 - w) * spin[i, 0, r, c] + w * spin[i + 1, 0, r, c]
            slope = (1.0 - w) * spin[i, 1, r, c] + w * spin[i + 1, 1, r, c]
            now.spin[r, c] = here
            now.spin_turn[r] += slope * (e[c] + ahead * v[c])
            now.spin_response[r, c] = 0.0
        for c in range(d):
            for a in range(d):
                now.spin_response[r, a] += now.inverse_mass[c, a] * now.spin[r, c]


@kernel
def film_torque(now, sample):
    """Drive torque [N m] that the films' moments need."""
    torque = 0.0
    for r in range(now.spin.shape[0]):
        torque -= now.spin_turn[r] * sample[MOMENT_B + r % 2, r // 2]
    return torque


@kernel
def add_film_reactions(tables, points, now, sample, out_reaction):
    """Add what the films' moments make of drive torque and reactions (r,); ``points`` as in `load_spins`."""
    table, (i, w) = tables.spin_reaction, points
    for m in range(now.spin.shape[0]):
        moment = sample[MOMENT_B + m % 2, m // 2]
        for r in range(out_reaction.shape[0]):
            out_reaction[r] += moment * ((1.0 - w) * table[i, m, r] + w * table[i + 1, m, r])


@kernel
def _power(k, sample):
    """Power [W] that the film of joint k takes from the leg."""
    power = sample[FILM_X, k] * sample[VX, k] + sample[FILM_Y, k] * sample[VY, k]
    return -power - sample[MOMENT_B, k] * sample[SPEED_B, k] - sample[MOMENT_J, k] * sample[SPEED_J, k]


@kernel
def total_force(k, sample):
    """Force [N] of contact and film together in clearance joint k; without a film, that of the contact."""
    f_n, f_t = sample[F_N, k], sample[F_T, k]
    fx = sample[FILM_X, k] - f_n * sample[NX, k] - f_t * sample[NY, k]
    fy = sample[FILM_Y, k] - f_n * sample[NY, k] + f_t * sample[NX, k]
    return math.sqrt(fx * fx + fy * fy)


@kernel
def integrate_films(settings, joint, h, start, end, out_added, out_peak):
    """Add what films change in the integrals of a step of length h [s]; out_added (ADDED, room).

    ``out_peak`` [N]: largest force of each joint of the mechanism.
    """
    for k in range(settings.shape[0]):
        if settings[k, VISCOSITY] > 0.0:
            for end_of_step in range(2):
                sample = end if end_of_step else start
                total, contact = total_force(k, sample), sample[F_N, k] ** 2 + sample[F_T, k] ** 2
                out_added[FORCE, k] += 0.5 * h * (total - math.sqrt(contact))
                out_added[FORCE_SQUARED, k] += 0.5 * h * (total * total - contact)
                out_added[DISSIPATION, k] += 0.5 * h * _power(k, sample)
            out_peak[joint[k]] = max(out_peak[joint[k]], total_force(k, end))
