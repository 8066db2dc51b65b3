"""The mechanism with the parameters applied: clearance joints, clearances and wear coefficients."""

from collections.abc import Iterator, Sequence
from typing import Any

import attrs

from leg_wear_monitor.configuration import Doubt, FieldError, doubts
from leg_wear_monitor.errors import ConfigError, did_you_mean
from leg_wear_monitor.mechanism.loader import limit_fault
from leg_wear_monitor.mechanism.person import with_person
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Clearance, Mechanism, SpeedDrive
from leg_wear_monitor.monitor.config.inputs import INTERFACE
from leg_wear_monitor.monitor.config.settings import MonitorConfig, drive_figures
from leg_wear_monitor.twin import sample

_KEYS = {"radial_clearance": "clearances_m", "wear_coefficient": "wear_coefficients_per_pa"}


def fitted(mechanism: Mechanism, config: MonitorConfig, source: str = "parameters") -> Mechanism:
    """Mechanism with the clearance joints, clearances, wear, speed and person of a configuration.

    Parameters
    ----------
    mechanism : Mechanism
    config : MonitorConfig
    source : str
        Origin of the configuration, for messages.

    Raises
    ------
    ConfigError
        For joints that the mechanism does not have, lists of a wrong length, a clearance that does not fit,
        a mechanism with a torque as its drive, a drive that is not known, a person on bodies that are not
        there, or a load on a mechanism without a toe.
    """
    drive_figures(config.drive, source)  # an error in it prevents the start, even if its values are not used
    interface, torque = config.drive.temperature_interface, config.drive_torque.source
    if interface and torque != INTERFACE:
        fault = f"{interface!r} needs drive_torque.source {INTERFACE!r}, which is {torque!r}"
        raise ConfigError(source, "drive.temperature_interface", fault)
    if not isinstance(mechanism.drive, SpeedDrive):
        raise ConfigError(
            source, "mechanism", f"{config.mechanism!r} is driven by a torque. Expected one with drive.speed"
        )
    if config.load.model != sample.NONE and mechanism.toe is None:
        fault = f"{config.load.model!r} needs a point called toe in {mechanism.source}, which has none"
        raise ConfigError(source, "load.model", fault)
    clearance_joints = config.clearance_joints or mechanism.clearance_joints
    _check_joints(clearance_joints, mechanism, source)
    speed = TURN * (config.cadence.commanded_rpm / 60.0)
    settings = {
        name: _settings(mechanism, config, clearance_joints, k, source)
        for k, name in enumerate(clearance_joints)
    }
    leg = attrs.evolve(
        with_person(mechanism, config.load.person_kg),
        clearance_joints=clearance_joints,
        clearances=mechanism.clearances | settings,
        drive=attrs.evolve(mechanism.drive, speed=speed),
    )
    check_limits(config, leg, source)
    return leg


def check_limits(config: MonitorConfig, mechanism: Mechanism, source: str = "parameters") -> None:
    """Check the limits against a mechanism that `fitted` returned.

    Raises
    ------
    ConfigError
        If a list of limits per joint does not have one value for each joint, or if the limit of a clearance
        is above the bushing's radius, which no clearance reaches.
    """
    clearance_joints, limits = mechanism.clearance_joints, config.limits
    given = limits.joint_clearance_m
    if given and len(given) != len(clearance_joints):
        raise _wrong_length(source, "limits.joint_clearance_m", given, clearance_joints, "")
    key, each = limits.of_clearances(len(clearance_joints))
    for joint, limit in zip(clearance_joints, each, strict=True):
        clearance = mechanism.clearances[joint]
        fault = limit_fault(joint, clearance.radial_clearance, clearance.bushing_radius, limit)
        # a limit below the new clearance needs no check, because its alarm rises immediately
        if fault and limit > clearance.radial_clearance:
            raise ConfigError(source, key, fault)


def twin_settings(config: MonitorConfig, source: str = "parameters") -> sample.TwinSettings:
    """Settings of the twin from a configuration.

    Raises
    ------
    ConfigError
        For a measured load without forces.
    """
    cadence = config.cadence
    if config.load.model == sample.MEASURED and config.foot_load.source in (sample.NO_LOAD, sample.CONTACT):
        fault = f"{sample.MEASURED!r} needs forces, and foot_load.source is {config.foot_load.source!r}"
        raise ConfigError(source, "load.model", fault)
    return sample.TwinSettings(
        tracker=sample.TrackerSettings(
            commanded_speed_radps=TURN * (cadence.commanded_rpm / 60.0),
            speed_tolerance=cadence.tolerance_rpm / abs(cadence.commanded_rpm),
        ),
        wear_acceleration=config.wear_acceleration,
        torque_lag_s=drive_figures(config.drive).lateness_s,
        torque_sampling=config.drive_torque.sampling,
        load_source=config.foot_load.source,
        load_frame=config.foot_load.frame,
        load_model=config.load.model,
    )


def _check_joints(clearance_joints: Sequence[str], mechanism: Mechanism, source: str) -> None:
    if not clearance_joints:
        raise ConfigError(
            source,
            "clearance_joints",
            f"none, and {mechanism.source} has none either. Expected some of: {_ready(mechanism)}",
        )
    for name in clearance_joints:
        if name not in mechanism.clearances:
            raise ConfigError(
                source,
                "clearance_joints",
                f"{name!r} has no clearance settings in {mechanism.source}. Expected some of: "
                f"{_ready(mechanism)}{did_you_mean(name, mechanism.clearances)}",
            )
    if len(set(clearance_joints)) < len(clearance_joints):
        raise ConfigError(source, "clearance_joints", f"{list(clearance_joints)} names a joint twice")


def _ready(mechanism: Mechanism) -> str:
    return ", ".join(mechanism.clearances) or "none"


def _settings(
    mechanism: Mechanism, config: MonitorConfig, clearance_joints: Sequence[str], k: int, source: str
) -> Clearance:
    settings = mechanism.clearances[clearance_joints[k]]
    changes: dict[str, Any] = {}
    wear = _own(config.wear_coefficients_per_pa, clearance_joints, k, source, _KEYS["wear_coefficient"])
    if wear is not None:
        changes["wear_coefficient"] = (wear, wear)
    clearance = _own(config.clearances_m, clearance_joints, k, source, _KEYS["radial_clearance"])
    if clearance is not None:
        changes["radial_clearance"] = clearance
    try:
        return attrs.evolve(settings, **changes)
    except FieldError as error:
        raise ConfigError(source, _KEYS[error.key], f"joint {clearance_joints[k]}: {error.fault}") from error


def _own(
    given: Sequence[float], clearance_joints: Sequence[str], k: int, source: str, key: str
) -> float | None:
    """Value for one joint from a list of one value for all or one per joint; None for an empty list."""
    if len(given) not in (0, 1, len(clearance_joints)):
        raise _wrong_length(source, key, given, clearance_joints, "one for all or ")
    return given[k if len(given) > 1 else 0] if given else None


def _wrong_length(
    source: str, key: str, given: Sequence[float], clearance_joints: Sequence[str], other: str
) -> ConfigError:
    return ConfigError(
        source,
        key,
        f"{list(given)} has {len(given)} values. Expected {other}one each for {', '.join(clearance_joints)}",
    )


# Usable parameters that are likely meant in a different unit; see also `mechanism.loader`.


# up to this value, impact forces of healthy legs do not change; at 5000 they reached 331 kN
MOST_ACCELERATION = 1000.0


def parameter_doubts(config: MonitorConfig, leg: Mechanism) -> tuple[Doubt, ...]:
    """All doubtful values of a configuration, for the mechanism that `fitted` returned."""
    return (
        *doubts(config),
        *doubts(config.cadence, "cadence."),
        *doubts(config.crank, "crank."),
        *_limits(config, leg),
        *doubts(config.limits, "limits."),
        *doubts(config.drive, "drive."),
        *_clearances(config, leg),
        *acceleration_doubts(config),
    )


def acceleration_doubts(config: MonitorConfig, most: float = MOST_ACCELERATION) -> tuple[Doubt, ...]:
    """A factor on all wear above ``most``, or below its inverse."""
    factor = config.wear_acceleration
    if 1.0 / most <= factor <= most:
        return ()
    text = f"multiplies all wear by {factor:g}: only for demonstrations, because no real leg wears so fast"
    if factor > MOST_ACCELERATION:
        text += f"; above {MOST_ACCELERATION:g}, the walls get notches and impacts become too strong"
    return (Doubt("wear_acceleration", text),)


def _limits(config: MonitorConfig, leg: Mechanism) -> Iterator[Doubt]:
    key, each = config.limits.of_clearances(len(leg.clearance_joints))
    for joint, limit in zip(leg.clearance_joints, each, strict=True):
        fresh = leg.clearances[joint].radial_clearance
        if limit <= fresh:
            yield Doubt(key, f"{limit:g} m is not above the new clearance of joint {joint}, {fresh:g} m")
            return


def _clearances(config: MonitorConfig, leg: Mechanism) -> Iterator[Doubt]:
    if not config.clearances_m:
        return
    for joint in leg.clearance_joints:
        c = leg.clearances[joint]
        ratio = 100.0 * c.radial_clearance / c.bushing_radius
        if not 1.0e-3 <= ratio <= 25.0:
            fraction = f"{c.radial_clearance:g} m is {ratio:.3g} % of the bushing's radius of joint {joint}"
            yield Doubt("clearances_m", f"{fraction}. Is it in m?")
            return
