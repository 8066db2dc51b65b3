"""Clearance joints as arrays for the kernels."""

import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.configuration import FieldError
from leg_wear_monitor.contact.geometry import contact_modulus
from leg_wear_monitor.contact.laws import FRICTION_CODES, LAWS, delivered_restitution
from leg_wear_monitor.errors import ConfigError, ConfigWarning
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.spec import Clearance, Mechanism

# Laws that are valid for nearly elastic impacts only, and the lowest restitution for which they are valid.
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


_KEYS = {"clearance_m": "radial_clearance", "normal_law": "normal_law", "restitution": "restitution"}
_OF_FRICTION = {"friction": "law", "friction_coefficient": "coefficient"}


def clearance_settings(
    mechanism: Mechanism, joints: Sequence[str], **options: float | str | None
) -> list[Clearance]:
    """Settings of the clearance joints, with common values instead of those in the mechanism file.

    Parameters
    ----------
    mechanism : Mechanism
    joints : sequence of str
    **options
        ``clearance_m``, ``normal_law``, ``restitution``, ``friction``, ``friction_coefficient``: as in
        `simulate`.

    Returns
    -------
    list of Clearance
        In the order of ``joints``.

    Raises
    ------
    ConfigError
        Names the invalid setting.
    """
    given: dict[str, Any] = {name: value for name, value in options.items() if value is not None}
    changes = {key: given[name] for name, key in _KEYS.items() if name in given}
    of_friction = {key: given[name] for name, key in _OF_FRICTION.items() if name in given}
    options_of = {key: name.replace("_", "-") for name, key in (_KEYS | _OF_FRICTION).items()}
    settings = {}
    for name in joints:
        own = mechanism.clearances[name]
        try:
            friction = attrs.evolve(own.friction, **of_friction)
            settings[name] = attrs.evolve(own, friction=friction, **changes)
        except FieldError as error:
            raise ConfigError(options_of[error.key], "", f"{error.fault} (joint {name})") from error
        _refuse_stiffness(mechanism.source, name, settings[name])
    _warn_of_restitution(mechanism.source, settings)
    return list(settings.values())


def _refuse_stiffness(source: str, name: str, settings: Clearance) -> None:
    """Raise ConfigError if a stiffness [N/m^1.5] is given with a law that has no such coefficient."""
    if settings.stiffness is not None and not LAWS[settings.normal_law].form.takes_stiffness:
        raise ConfigError(
            source,
            f"clearances.joints.{name}.stiffness",
            f"{settings.stiffness:g} N/m^1.5 is for Hertz's force. normal_law {settings.normal_law!r} does "
            "not use it: remove the key or choose a different law",
        )


def _warn_of_restitution(source: str, settings: dict[str, Clearance]) -> None:
    """Warn of laws for nearly elastic impacts with a small restitution: impacts then return more than set."""
    joints: dict[tuple[str, float], list[str]] = {}  # joints by law and restitution, for one warning per pair
    for name, c in settings.items():
        if c.normal_law in NEARLY_ELASTIC and c.restitution < LEAST_RESTITUTION:
            joints.setdefault((c.normal_law, c.restitution), []).append(name)
    for (law, restitution), names in joints.items():
        returned = delivered_restitution(LAWS[law].hysteresis(restitution))
        warnings.warn(
            f"{source}: joint {', '.join(names)}: {law} asked for a restitution of {restitution:g} returns "
            f"{returned:.3g}, the law is valid from {LEAST_RESTITUTION:g} on; try flores or hu-guo",
            ConfigWarning,
            stacklevel=3,
        )


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
