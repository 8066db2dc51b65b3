"""Usable parameters that are likely meant in another unit; see also `mechanism.plausible`."""

from collections.abc import Iterator

from leg_wear_monitor.configuration.quantity import Doubt, doubts
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig

MOST_ACCELERATION = 1000.0  # that of the demonstration, config/demo.yaml; 5000 gave healthy legs 331 kN


def parameter_doubts(config: MonitorConfig, leg: Mechanism) -> tuple[Doubt, ...]:
    """All doubtful values of a configuration, for the mechanism that `fitted` returned."""
    return (
        *doubts(config.cadence, "cadence."),
        *doubts(config.crank, "crank."),
        *_limits(config, leg),
        *doubts(config.limits, "limits."),
        *_clearances(config, leg),
        *acceleration_doubts(config),
    )


def acceleration_doubts(config: MonitorConfig, most: float = MOST_ACCELERATION) -> tuple[Doubt, ...]:
    """A factor on all wear above ``most``, or below its inverse."""
    factor = config.wear_acceleration
    if 1.0 / most <= factor <= most:
        return ()
    text = f"multiplies all wear by {factor:g}: a demonstration, whose clearances and lives are no leg's"
    if factor > MOST_ACCELERATION:
        text += f"; above {MOST_ACCELERATION:g}, the walls get notches and impacts become too strong"
    return (Doubt("wear_acceleration", text),)


def _limits(config: MonitorConfig, leg: Mechanism) -> Iterator[Doubt]:
    limits = config.limits
    key = "limits.joint_clearance_m" if limits.joint_clearance_m else "limits.clearance_m"
    each = limits.joint_clearance_m or (limits.clearance_m,) * len(leg.clearance_joints)
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
            yield Doubt("clearances_m", f"{fraction}; mm for m, or m for mm?")
            return
