"""Film of oil or grease between journal and bushing (physics.md section 4).

Closed formulas for a cylindrical bearing of finite width: H. J. Butenschön, Das hydrodynamische,
zylindrische Gleitlager endlicher Breite unter instationärer Belastung, dissertation, Karlsruhe 1976. They
fit his solutions of Reynolds' equation for widths of 1/8 to 1 times the diameter, within 7 % in the force
and 2.4° in its direction. Beyond these widths their polynomials are wrong: at 1.25 squeezing would pull.
"""

import math

from leg_wear_monitor.compiled.kernel import kernel

_NUDGE = 1.0e-4  # step of the finite difference in `film_stiffness`, as a fraction of the gap


@kernel
def rotation_number(x, epsilon):
    """So_D / epsilon [-] of a rotating film, which is finite at 0; x the width over the diameter."""
    a1 = 1.1642 + x * (-1.9456 + x * (7.1161 + x * (-10.1073 + x * 5.0141)))
    a2 = -1.000026 + x * (-0.023634 + x * (-0.4215 + x * (-0.038817 - x * 0.090551)))
    square = 1.0 - epsilon * epsilon
    root = math.sqrt(math.pi**2 * square + 16.0 * epsilon * epsilon)
    return x * x / (2.0 * square * square) * root * a1 * (epsilon - 1.0) / (a2 + epsilon)


@kernel
def attitude_angle(x, epsilon):
    """Angle beta [rad] of a rotating film's force from the line of centres.

    The polynomial was fitted from epsilon = 0.1 on and would pass 90°, the limit for a centred journal, below
    0.06. There the force would push the journal outwards.
    """
    a3 = 1.152624 - 0.104565 * x
    a4 = -2.5905 + 0.798745 * x
    a5 = 8.73393 - 2.3291 * x
    a6 = -13.3414 + 3.424337 * x
    a7 = 6.6294 - 1.591732 * x
    polynomial = a3 + epsilon * (a4 + epsilon * (a5 + epsilon * (a6 + epsilon * a7)))
    beta = math.atan2(math.pi * math.sqrt(1.0 - epsilon * epsilon), 2.0 * epsilon) * polynomial
    return min(beta, 0.5 * math.pi)


@kernel
def squeeze_number(x, epsilon):
    """So_V [-] of a squeezed film; epsilon below 0 where the gap opens; x the width over the diameter."""
    a8 = 0.70038 + x * (3.2415 + x * (-12.2486 + x * (18.895 - x * 9.3561)))
    a9 = -0.999935 + x * (0.0157434 + x * (-0.74224 + x * (0.42278 - x * 0.368928)))
    square = 1.0 - epsilon * epsilon
    root = math.sqrt(square)
    arc = 0.5 * (math.pi - math.acos(epsilon)) * (1.0 + 2.0 * epsilon * epsilon) + 1.5 * epsilon * root
    return 4.0 * x * x / (square * square * root) * arc * a8 * (1.0 - epsilon) / (-a9 - epsilon)


@kernel
def opening_factor(rate, whirl, epsilon, beta):
    """Fraction [-] of the rotation's force that is left where the gap opens.

    Where the gap opens as fast as rotation closes it at the centre of the pressure, there is no pressure left
    to push; the plain sum of both forces would go on pushing and give the journal energy. ``rate`` is that of
    epsilon and ``whirl`` is epsilon |omega_res| [1/s]; between no opening and that rate it falls linearly.
    """
    if rate >= 0.0:
        return 1.0
    closing = whirl * math.sin(beta)
    return max(0.0, 1.0 + 2.0 * rate * math.cos(beta) / closing) if closing > 0.0 else 0.0


@kernel
def _motion(ex, ey, vx, vy, turning, clearance, roughness):
    """Motion of the journal as the film has it; ``turning`` is the sum of both bodies' speeds [rad/s].

    Returns
    -------
    nx, ny, epsilon, rate, whirl
        Line of centres, epsilon up to the roughness, its rate [1/s], and epsilon omega_res [1/s], which is
        finite where the line of centres of a nearly centred journal turns fast.
    """
    e = math.sqrt(ex * ex + ey * ey)
    nx, ny, speed = 1.0, 0.0, math.sqrt(vx * vx + vy * vy)
    if e > 0.0:
        nx, ny = ex / e, ey / e
    elif speed > 0.0:
        nx, ny = vx / speed, vy / speed
    epsilon = min(e, clearance - roughness) / clearance
    whirl = (e * turning - 2.0 * (nx * vy - ny * vx)) / clearance
    return nx, ny, epsilon, (nx * vx + ny * vy) / clearance, whirl


@kernel
def film_force(ex, ey, vx, vy, speed_b, speed_j, clearance, bushing_radius, width, viscosity, roughness):
    """Force of the film on the journal and its moments on both bodies.

    Eccentricity (ex, ey) [m] of the journal and its rate [m/s]; speeds [rad/s] of the bushing's and the
    journal's body; radial clearance, radius of the bushing, axial width [m]; viscosity [Pa s]; roughness [m],
    below the clearance: from an eccentricity of clearance less roughness on, the film has the coefficients
    that it has there. physics.md section 4.

    Returns
    -------
    fx, fy, moment_b, moment_j
        Force [N] at the journal's centre, its opposite acts at the bushing's centre; moments [N m] on the
        bushing's and the journal's body, about these centres. The film has no mass: the moments' sum is that
        of the two forces, reversed.
    """
    nx, ny, epsilon, rate, whirl = _motion(ex, ey, vx, vy, speed_b + speed_j, clearance, roughness)
    x, diameter = width / (2.0 * bushing_radius), 2.0 * (bushing_radius - clearance)
    psi = 2.0 * clearance / diameter
    scale = width * diameter * viscosity / (psi * psi)
    beta = attitude_angle(x, epsilon)
    rotation = scale * rotation_number(x, epsilon) * abs(whirl)
    rotation *= opening_factor(rate, abs(whirl), epsilon, beta)
    f_n = -rotation * math.cos(beta) - scale * squeeze_number(x, math.copysign(epsilon, rate)) * rate
    f_t = math.copysign(rotation * math.sin(beta), whirl)
    fx, fy = f_n * nx - f_t * ny, f_n * ny + f_t * nx
    # shear of a full film: half of the couple of its forces on each body, and Couette's flow
    shear = 0.5 * math.pi * width * diameter**2 * viscosity / psi / math.sqrt(1.0 - epsilon * epsilon)
    drag, half = shear * (speed_j - speed_b), 0.5 * (ex * fy - ey * fx)
    return fx, fy, drag - half, -drag - half


@kernel
def film_damping(ex, ey, vx, vy, speed_b, speed_j, clearance, bushing_radius, width, viscosity, roughness):
    """Minus the derivatives of the film's force by the rate of the eccentricity [N s/m].

    Arguments as in `film_force`.

    Returns
    -------
    xx, xy, yx, yy
        Force's component first, rate's component second.
    """
    nx, ny, epsilon, rate, whirl = _motion(ex, ey, vx, vy, speed_b + speed_j, clearance, roughness)
    x, diameter = width / (2.0 * bushing_radius), 2.0 * (bushing_radius - clearance)
    psi = 2.0 * clearance / diameter
    unit = width * diameter * viscosity / (psi * psi) / clearance
    beta = attitude_angle(x, epsilon)
    nn, nt, tn, tt = unit * squeeze_number(x, math.copysign(epsilon, rate)), 0.0, 0.0, 0.0
    if opening_factor(rate, abs(whirl), epsilon, beta) > 0.0:
        rotation, cosine, sine = 2.0 * unit * rotation_number(x, epsilon), math.cos(beta), math.sin(beta)
        nt, tt = -math.copysign(rotation * cosine, whirl), rotation * sine
        if rate < 0.0:
            nn, tn = nn + rotation * cosine * cosine / sine, nt
    xx = nn * nx * nx - (nt + tn) * nx * ny + tt * ny * ny
    yy = nn * ny * ny + (nt + tn) * nx * ny + tt * nx * nx
    xy = (nn - tt) * nx * ny + nt * nx * nx - tn * ny * ny
    yx = (nn - tt) * nx * ny + tn * nx * nx - nt * ny * ny
    return xx, xy, yx, yy


@kernel
def film_stiffness(ex, ey, vx, vy, speed_b, speed_j, clearance, bushing_radius, width, viscosity, roughness):
    """Minus the derivative of the film's force along the line of centres [N/m]; arguments as in `film_force`.

    That across it is left out: it is as slow as the motion. Where the gap opens, so is this one, which would
    be negative: both components are 0.

    Returns
    -------
    kx, ky
        Components of the force.
    """
    e = math.sqrt(ex * ex + ey * ey)
    if not (ex * vx + ey * vy > 0.0 and e < clearance - roughness):
        return 0.0, 0.0
    part = _NUDGE * (clearance - e)
    ahead = 1.0 + part / e
    fx, fy, _, _ = film_force(
        ex, ey, vx, vy, speed_b, speed_j, clearance, bushing_radius, width, viscosity, roughness
    )
    gx, gy, _, _ = film_force(
        ahead * ex, ahead * ey, vx, vy, speed_b, speed_j,
        clearance, bushing_radius, width, viscosity, roughness,
    )  # fmt: skip
    return (fx - gx) / part, (fy - gy) / part
