"""All alarms of a monitor, and the limits that its parameters set for them."""

from collections.abc import Iterable, Mapping

import attrs

from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level, Limit, acknowledged, evaluated, has_changed
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.evaluation.torque_checks import BIAS, DRIFT, LAG, torque_bounds
from leg_wear_monitor.monitor.reports import AlarmList

IMPACT, CLEARANCE, GROWTH = "impact_force", "clearance", "growth"
DEPARTURE = "clearance_departure"
MISMATCH, CADENCE = "torque_mismatch", "cadence"
CRANK_RATE, TORQUE_RATE = "input_rate crank", "input_rate torque"
BAD_SAMPLES, LOST_TIME, STUCK_TORQUE = "input_samples", "input_gaps", "input_torque"
SOURCES = "input_sources"

TWO_SOURCES = Limit(2.0, 2.0)  # of one crank


def limits_of(
    config: MonitorConfig, clearance_joints: tuple[str, ...], torque_size_nm: float = 1.0
) -> dict[str, Limit]:
    """Limit of every alarm by its name; ``torque_size_nm`` RMS of the drive torque as predicted."""
    limits = config.limits
    found: dict[str, Limit] = {}
    for k, joint in enumerate(clearance_joints):
        impact = limits.joint_impact_force_n[k] if limits.joint_impact_force_n else limits.impact_force_n
        clearance = limits.joint_clearance_m[k] if limits.joint_clearance_m else limits.clearance_m
        found[f"{IMPACT} {joint}"] = _limit(config, impact, config.alarms.knock_on_delay_cycles)
        found[f"{CLEARANCE} {joint}"] = _limit(config, clearance)
        found[f"{GROWTH} {joint}"] = _limit(config, limits.growth_m_per_hour)
        if config.encoders.names:
            found[f"{DEPARTURE} {joint}"] = _limit(config, limits.clearance_departure_m)
    found[MISMATCH] = _limit(config, limits.torque_mismatch, config.alarms.knock_on_delay_cycles)
    bounds = torque_bounds(config, torque_size_nm)
    for name, error in ((BIAS, bounds.bias_nm), (DRIFT, bounds.drift_nm), (LAG, bounds.max_lag_s)):
        found[name] = _limit(config, error)
    found[CADENCE] = _limit(config, config.cadence.tolerance_rpm)
    for rate in (CRANK_RATE, TORQUE_RATE):
        found[rate] = _least(config, limits.min_rate_hz)
    found[BAD_SAMPLES] = _limit(config, limits.bad_sample_fraction)
    found[LOST_TIME] = _limit(config, limits.lost_time_fraction)
    found[STUCK_TORQUE] = _limit(config, limits.stuck_torque_fraction)
    found[SOURCES] = TWO_SOURCES
    return found


def _limit(config: MonitorConfig, error: float, on_delay: int | None = None) -> Limit:
    alarms = config.alarms
    return Limit(
        config.limits.warn_fraction * error, error, alarms.deadband, on_delay or alarms.on_delay_cycles
    )


def _least(config: MonitorConfig, error: float) -> Limit:
    alarms = config.alarms
    return Limit(
        error / config.limits.warn_fraction, error, alarms.deadband, alarms.on_delay_cycles, is_least=True
    )


_UNITS = {
    BIAS: "N m", DRIFT: "N m", LAG: "s", IMPACT: "N", CLEARANCE: "m", DEPARTURE: "m",
    GROWTH: "m/h", CADENCE: "rpm", CRANK_RATE: "Hz", TORQUE_RATE: "Hz",
}  # fmt: skip


class AlarmBoard:
    """All alarms as they stand.

    Parameters
    ----------
    config : MonitorConfig
    clearance_joints : tuple of str
    torque_size_nm : float
        RMS of the drive torque as predicted.

    Attributes
    ----------
    alarms : dict of str to Alarm
        By name, always the same ones in the same order.
    """

    def __init__(
        self, config: MonitorConfig, clearance_joints: tuple[str, ...], torque_size_nm: float = 1.0
    ) -> None:
        self._clearance_joints, self._torque_size_nm = clearance_joints, torque_size_nm
        self._limits = limits_of(config, clearance_joints, torque_size_nm)
        self.alarms = {name: _new(name) for name in self._limits}

    def configure(self, config: MonitorConfig) -> None:
        """Evaluate by other limits from now on."""
        self._limits = limits_of(config, self._clearance_joints, self._torque_size_nm)

    @property
    def clearance_limits_m(self) -> tuple[float, ...]:
        """Limit of each clearance joint's clearance."""
        return tuple(self._limits[f"{CLEARANCE} {joint}"].error for joint in self._clearance_joints)

    def evaluate(self, values: Mapping[str, float], stamp_ns: int, cycles: int = 1) -> tuple[AlarmList, ...]:
        """Evaluate values by the names of their alarms; one list of all alarms if an operator sees a change.

        Parameters
        ----------
        values : mapping of str to float
        stamp_ns : int
        cycles : int
            Gait cycles that the values stand for.
        """
        found = [
            evaluated(self.alarms[name], value, self._limits[name], stamp_ns, cycles)
            for name, value in values.items()
        ]
        return self._set(found, stamp_ns)

    def evaluate_early(self, values: Mapping[str, float], stamp_ns: int) -> tuple[AlarmList, ...]:
        """Evaluate values that may still rise until the gait cycle ends: they can only raise their alarms."""
        found = []
        for name, value in values.items():
            before, limit = self.alarms[name], self._limits[name]
            after = evaluated(before, value, limit, stamp_ns)
            if limit.on_delay == 1 and after.present > before.present:
                found.append(after)
        return self._set(found, stamp_ns)

    def acknowledge(self) -> tuple[tuple[Alarm, ...], tuple[Alarm, ...]]:
        """Acknowledge all: those that were cleared and those that stay, as they are now."""
        now = [acknowledged(alarm) for alarm in self.alarms.values() if alarm.level is not Level.OK]
        self.alarms |= {alarm.name: alarm for alarm in now}
        cleared = tuple(alarm for alarm in now if alarm.level is Level.OK)
        return cleared, tuple(alarm for alarm in now if alarm.level is not Level.OK)

    def restore(self, alarms: Iterable[Alarm]) -> None:
        """Take over alarms as they were in another run."""
        for alarm in alarms:
            if alarm.name in self.alarms:
                own = self.alarms[alarm.name]
                self.alarms[alarm.name] = attrs.evolve(alarm, unit=own.unit)

    def level(self, *names: str) -> Level:
        """The highest level that is shown of some alarms."""
        return max(self.alarms[name].level for name in names)

    def _set(self, found: Iterable[Alarm], stamp_ns: int) -> tuple[AlarmList, ...]:
        before = self.alarms
        self.alarms = before | {alarm.name: alarm for alarm in found}
        if any(has_changed(before[name], alarm) for name, alarm in self.alarms.items()):
            return (AlarmList(stamp_ns, tuple(self.alarms.values())),)
        return ()


def _new(name: str) -> Alarm:
    kind, _, subject = name.partition(" ")
    return Alarm(kind=kind, subject=subject, unit=_UNITS.get(kind, _UNITS.get(name, "")))
