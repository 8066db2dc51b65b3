"""A journal in a bushing: geometry, conformity, friction, arrays of all clearance joints, and film."""

import math
import warnings
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.compiled.vectors import LEAST_DIVISOR, largest, root, where
from leg_wear_monitor.configuration import Doubt, FieldError
from leg_wear_monitor.contact.normal import LAWS, delivered_restitution
from leg_wear_monitor.errors import ConfigError, ConfigWarning
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.position import Linkage, one_cycle
from leg_wear_monitor.mechanism.spec import Clearance, Mechanism, SpeedDrive, TrackDrive

# Geometry of the contact of journal and bushing, and its elastic modulus (physics.md sections 3 to 5).


# Bound of that part of the gradient across the eccentricity which is due to the bend (`worn_contact`),
# compared with the wall's unit normal, whose length is 1.
_SHARPEST = 1.0


@kernel
def journal_contact(ex, ey, clearance):
    """Penetration [m], negative when apart, and unit normal of a journal at eccentricity (ex, ey) [m].

    For numbers or vectors. physics.md section 3.
    """
    e = root(ex * ex + ey * ey)
    inverse, away = 1.0 / largest(e, LEAST_DIVISOR), e > 0.0
    return e - clearance, where(away, ex * inverse, 1.0), where(away, ey * inverse, 0.0)


@kernel
def worn_contact(ex, ey, clearance, slope, bend):
    """Penetration [m] and its gradient on worn surfaces, whose clearance depends on the direction.

    ``slope`` [m/rad] and ``bend`` [m/rad^2] are the first and second derivative of the clearance by the
    direction. The penetration is |e| - c along the worn wall's normal. The normal force acts along the whole
    gradient of the penetration, so that it has a potential (physics.md section 3): the gradient is the wall's
    unit normal plus parts of the order of penetration / clearance, because the normal changes along the wall.
    The part by the bend is bounded: in notches too narrow for the journal it would be many times the normal,
    and there the force has no potential. For numbers or vectors.

    Returns
    -------
    delta, nx, ny, scale, by_slope
        Penetration [m], its gradient (nx, ny) by the eccentricity, and the factors of the clearance's change
        [-] and of its slope's change [rad] in the change of the penetration.
    """
    delta, rx, ry = journal_contact(ex, ey, clearance)
    inside = largest(delta, 0.0)
    inverse = 1.0 / largest(clearance + inside, LEAST_DIVISOR)  # in contact, 1 / |e|
    tilt = slope * inverse
    square = 1.0 / (1.0 + tilt * tilt)
    scale = root(square)
    by_slope = inside * square * scale * tilt * inverse
    by_slope = by_slope * (_SHARPEST / largest(abs(by_slope * bend * inverse), _SHARPEST))
    outwards, back = scale + by_slope * tilt, scale * tilt + by_slope * bend * inverse
    return delta * scale, outwards * rx + back * ry, outwards * ry - back * rx, scale, by_slope


def contact_modulus(youngs_b: float, poisson_b: float, youngs_j: float, poisson_j: float) -> float:
    """4 / (3 (sigma_b + sigma_j)) [Pa], sigma = (1 - nu^2) / E; Lankarani and Nikravesh 1990."""
    sigma = (1.0 - poisson_b * poisson_b) / youngs_b + (1.0 - poisson_j * poisson_j) / youngs_j
    return 4.0 / (3.0 * sigma)


# Conformity: whether a contact is narrow, as Hertz's force K delta^1.5 supposes (physics.md section 4).
#
# The half angle psi of the contact arc is that of the elastic foundation (`normal.winkler`), which is Hertz's
# line contact where it is narrow: F = kappa E* w c (2 psi / sin 2 psi - 1). It grows with force and softness,
# and as the clearance falls: bushings of plastic, and tight ones, are conformal.


NARROW_RAD = math.radians(30.0)
"""Largest half angle of a narrow contact: the load of Hertz's line is 14 % low there."""
WIDEST_RAD = math.radians(60.0)
"""Largest half angle of Winkler's law: its force is 11 % low there."""

_KAPPA_E_STAR = 0.75 * 3.0 * math.pi / 8.0  # kappa E* over the contact modulus
_HALVINGS = 60  # bisections of a right angle, down to rounding errors
_POINTS = 180  # points of a gait cycle


def half_angle_under_load(force_n: float, modulus_pa: float, width_m: float, clearance_m: float) -> float:
    """Half angle psi [rad] of the contact arc under a force.

    Parameters
    ----------
    force_n : float
    modulus_pa : float
        Of `contact_modulus`.
    width_m, clearance_m : float
        Axial contact width, and radial clearance.
    """
    # bisection: the load grows with psi
    load = force_n / (_KAPPA_E_STAR * modulus_pa * width_m * clearance_m)
    low, high = 0.0, 0.5 * math.pi
    for _ in range(_HALVINGS):
        psi = 0.5 * (low + high)
        if 2.0 * psi > (1.0 + load) * math.sin(2.0 * psi):
            high = psi
        else:
            low = psi
    return 0.5 * (low + high)


def contact_doubt(half_angle_rad: float, force_n: float, radius_m: float, is_winkler: bool) -> str | None:
    """Why a joint's normal law is not valid at a force, as one text; None if it is.

    Parameters
    ----------
    half_angle_rad, force_n : float
        Half angle of the contact arc under this force.
    radius_m : float
        Radius of the bushing.
    is_winkler : bool
        Whether the law is Winkler's.
    """
    if half_angle_rad <= (WIDEST_RAD if is_winkler else NARROW_RAD):
        return None
    wide = 2.0e3 * radius_m * math.sin(half_angle_rad)
    arc = (
        f"contact half angle {math.degrees(half_angle_rad):.0f} deg at {float(f'{force_n:.3g}'):g} N "
        f"({wide:.3g} mm wide in a radius of {1.0e3 * radius_m:.4g} mm)"
    )
    if is_winkler:
        return f"{arc}, normal_law winkler holds up to {math.degrees(WIDEST_RAD):.0f} deg"
    return (
        f"{arc}, the law's force K delta^1.5 is for a narrow contact, up to about "
        f"{math.degrees(NARROW_RAD):.0f} deg; normal_law winkler is for a conformal one"
    )


def conformity_doubts(linkage: Linkage) -> Iterator[Doubt]:
    """Clearance joints whose law is not valid at the 99th percentile of the force in the ideal motion."""
    mechanism, drive = linkage.mechanism, linkage.mechanism.drive
    if not mechanism.clearance_joints or not isinstance(drive, SpeedDrive | TrackDrive):
        return
    speed = drive.speed if isinstance(drive, SpeedDrive) else drive.track.speed_radps
    force = np.linalg.norm(one_cycle(linkage, _POINTS, speed).joint_force, axis=2)
    p99 = dict(zip(mechanism.joints, np.quantile(force, 0.99, axis=0).tolist(), strict=True))
    for joint in mechanism.clearance_joints:
        settings = mechanism.clearances[joint]
        fault = contact_doubt(
            half_angle_of(settings, p99[joint]),
            p99[joint],
            settings.bushing_radius,
            settings.normal_law == "winkler",
        )
        if fault:
            yield Doubt(f"clearances ({joint}): normal_law", fault)


def half_angle_of(settings: Clearance, force_n: float) -> float:
    """Half angle [rad] of the contact arc of a joint with these settings under a force."""
    (e_b, e_j), (nu_b, nu_j) = settings.youngs_modulus, settings.poissons_ratio
    modulus = contact_modulus(e_b, nu_b, e_j, nu_j)
    return half_angle_under_load(force_n, modulus, settings.width, settings.radial_clearance)


def is_winkler_form(number: int) -> bool:
    """Whether the number of a form in compiled code is that of Winkler's law."""
    return number == LAWS["winkler"].number


# Coulomb friction with a ramp around zero slip speed (physics.md section 4).


NONE, AMBROSIO, THRELFALL = 0, 1, 2
FRICTION_CODES = {"none": NONE, "ambrosio": AMBROSIO, "threlfall": THRELFALL}


@kernel
def ambrosio_ramp(speed, v0, v1):
    """Fraction c_d [-] of Coulomb's friction: 0 up to v0, 1 from v1, linear between [m/s] (Ambrosio 2003).

    For numbers or vectors.
    """
    return where(speed > v0, where(speed < v1, (speed - v0) / largest(v1 - v0, LEAST_DIVISOR), 1.0), 0.0)


@kernel
def threlfall_ramp(speed, v1):
    """Fraction [-] of Coulomb's friction, 1 - exp(-3 |v| / v1): 95 % at v1 [m/s] (Threlfall 1978)."""
    return 1.0 - math.exp(-3.0 * speed / v1)


@kernel
def friction_force(law, coefficient, v0, v1, f_n, slip):
    """Tangential force [N] on the journal, opposite to the slip speed [m/s]; f_n the normal force [N]."""
    speed = abs(slip)
    if law == AMBROSIO:
        fraction = ambrosio_ramp(speed, v0, v1)
    elif law == THRELFALL:
        fraction = threlfall_ramp(speed, v1)
    else:
        fraction = 0.0
    return against(slip, coefficient * fraction * f_n)


@kernel
def against(slip, force):
    """A force [N] opposite to the slip speed. For numbers or vectors."""
    return where(slip < 0.0, force, -force)


# Clearance joints as arrays for the kernels.


# laws that are valid for nearly elastic impacts only, and the restitution from which they are
NEARLY_ELASTIC, LEAST_RESTITUTION = ("hunt-crossley", "lankarani-nikravesh"), 0.7


class ContactArrays(NamedTuple):
    """Settings of k clearance joints, in SI units.

    ``joint`` (k,): index in the mechanism; ``bushing_radius``, ``clearance``, ``width`` (k,) [m];
    ``modulus`` (k,) [Pa]: of `contact_modulus`; ``normal_form`` (k,): number of the normal law's form;
    ``stiffness`` (k,) [N/m^1.5]: the given one, or 0 if the law's coefficient follows from the modulus and
    the local radii; ``hysteresis`` (k,) [-]: factor chi; ``speed_floor`` (k,) [m/s]: least approach speed;
    ``friction_law`` (k,): code; ``friction`` (k, 3): coefficient [-], ramp v0 and v1 [m/s];
    ``wear_coefficient`` (k, 2) [1/Pa]: of bushing and journal.
    """

    joint: Ints
    bushing_radius: Floats
    clearance: Floats
    width: Floats
    modulus: Floats
    normal_form: Ints
    stiffness: Floats
    hysteresis: Floats
    speed_floor: Floats
    friction_law: Ints
    friction: Floats
    wear_coefficient: Floats


def clearance_settings(
    mechanism: Mechanism,
    joints: Sequence[str],
    clearance_m: float | None = None,
    normal_law: str | None = None,
) -> list[Clearance]:
    """Settings of the clearance joints, with a common clearance [m] and a common normal law if given.

    Returns
    -------
    list of Clearance
        In the order of ``joints``.

    Raises
    ------
    ConfigError
        Names the joint without settings, or the invalid setting.
    """
    changes: dict[str, Any] = {}
    if clearance_m is not None:
        changes["radial_clearance"] = clearance_m
    if normal_law is not None:
        changes["normal_law"] = normal_law
    settings = {}
    for name in joints:
        if name not in mechanism.clearances:
            known = ", ".join(mechanism.clearances) or "none"
            raise ConfigError(
                "clearances",
                "",
                f"{name!r} has no clearance settings in {mechanism.source}, expected some of: {known}",
            )
        try:
            settings[name] = attrs.evolve(mechanism.clearances[name], **changes)
        except FieldError as error:
            option = {"radial_clearance": "clearance-m", "normal_law": "normal-law"}[error.key]
            raise ConfigError(option, "", f"{error.fault} (joint {name})") from error
        _refuse_stiffness(mechanism.source, name, settings[name])
    _warn_of_restitution(mechanism.source, settings)
    return list(settings.values())


def _refuse_stiffness(source: str, name: str, settings: Clearance) -> None:
    """Raise ConfigError if a stiffness [N/m^1.5] is given with a law that has no such coefficient."""
    if settings.stiffness is not None and not LAWS[settings.normal_law].form.takes_stiffness:
        raise ConfigError(
            source,
            f"clearances.joints.{name}.stiffness",
            f"{settings.stiffness:g} N/m^1.5 is for Hertz's force, normal_law {settings.normal_law!r} has "
            "another; leave the key out or choose another law",
        )


def _warn_of_restitution(source: str, settings: dict[str, Clearance]) -> None:
    """Warn of laws for nearly elastic impacts with a small restitution: impacts then return more than set."""
    joints: dict[tuple[str, float], list[str]] = {}  # by law and restitution, for one warning each
    for name, c in settings.items():
        if c.normal_law in NEARLY_ELASTIC and c.restitution < LEAST_RESTITUTION:
            joints.setdefault((c.normal_law, c.restitution), []).append(name)
    for (law, restitution), names in joints.items():
        returned = delivered_restitution(LAWS[law].hysteresis(restitution))
        warnings.warn(
            f"{source}: joint {', '.join(names)}: {law} asked for a restitution of {restitution:g} returns "
            f"{returned:.3g}, it holds from {LEAST_RESTITUTION:g} on; try flores or hu-guo",
            ConfigWarning,
            stacklevel=3,
        )


def compile_films(settings: Sequence[Clearance]) -> Floats:
    """Viscosity [Pa s] and roughness [m] of the joints' films (k, 2); 0 for a dry joint."""
    films = [(c.film.viscosity_pa_s, c.film.roughness_m) if c.film else (0.0, 0.0) for c in settings]
    return np.array(films).reshape(-1, 2)


def compile_contacts(
    mechanism: Mechanism, joints: Sequence[str], settings: Sequence[Clearance]
) -> ContactArrays:
    """Arrays of the clearance joints from their settings, in the given order."""
    order = list(mechanism.joints)
    moduli = [
        contact_modulus(c.youngs_modulus[0], c.poissons_ratio[0], c.youngs_modulus[1], c.poissons_ratio[1])
        for c in settings
    ]
    return ContactArrays(
        joint=np.array([order.index(name) for name in joints], dtype=np.int64),
        bushing_radius=np.array([c.bushing_radius for c in settings]),
        clearance=np.array([c.radial_clearance for c in settings]),
        width=np.array([c.width for c in settings]),
        modulus=np.array(moduli),
        normal_form=np.array([LAWS[c.normal_law].number for c in settings], dtype=np.int64),
        stiffness=np.array([c.stiffness or 0.0 for c in settings]),
        hysteresis=np.array([LAWS[c.normal_law].hysteresis(c.restitution) for c in settings]),
        speed_floor=np.array([c.approach_speed_floor for c in settings]),
        friction_law=np.array([FRICTION_CODES[c.friction.law] for c in settings], dtype=np.int64),
        friction=np.array([[c.friction.coefficient, *c.friction.ramp] for c in settings]).reshape(-1, 3),
        wear_coefficient=np.array([c.wear_coefficient for c in settings]).reshape(-1, 2),
    )


# Film of oil or grease between journal and bushing (physics.md section 4).
#
# Closed formulas for a cylindrical bearing of finite width: H. J. Butenschön, Das hydrodynamische,
# zylindrische Gleitlager endlicher Breite unter instationärer Belastung, dissertation, Karlsruhe 1976. They
# fit his solutions of Reynolds' equation for widths of 1/8 to 1 times the diameter, within 7 % in the force
# and 2.4° in its direction. Beyond these widths their polynomials are wrong: at 1.25 squeezing would pull.


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
