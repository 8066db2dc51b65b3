"""All alarms of a monitor, and the limits that its parameters set for them."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import attrs

from leg_wear_monitor.monitor.alarms.alarm import (
    Alarm,
    Level,
    Limit,
    acknowledged,
    cleared,
    evaluated,
    has_changed,
)
from leg_wear_monitor.monitor.config.fitting import largest_lag_s
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.evaluation import specs
from leg_wear_monitor.monitor.evaluation.specs import AlarmSpec, LimitSource
from leg_wear_monitor.monitor.evaluation.torque_checks import torque_bounds
from leg_wear_monitor.monitor.reports import AlarmList, JointReport
from leg_wear_monitor.monitor.verdict.belief import is_held_by_estimate
from leg_wear_monitor.twin.settings import NO_LOAD

_NO_SOURCES: Mapping[str, tuple[float, str]] = {}


def joint_specs(config: MonitorConfig) -> tuple[AlarmSpec[JointReport], ...]:
    """Specs of the alarms of each clearance joint."""
    return (*specs.JOINT, *(specs.ENCODERS if config.encoders.names else ()))


def specs_of(
    config: MonitorConfig, clearance_joints: tuple[str, ...]
) -> Iterator[tuple[AlarmSpec[Any], int, Alarm]]:
    """Specs of all alarms in their order, each with the number of its joint and its initial alarm."""
    for k, joint in enumerate(clearance_joints):
        yield from ((spec, k, spec.new(joint)) for spec in joint_specs(config))
    of_leg: tuple[AlarmSpec[Any], ...] = (*specs.TORQUE, *specs.GAIT, *specs.OF_INPUT)
    of_leg += specs.OF_FOOT_LOAD if config.foot_load.source != NO_LOAD else ()
    yield from ((spec, 0, spec.new()) for spec in of_leg)


def limits_of(
    config: MonitorConfig, clearance_joints: tuple[str, ...], torque_size_nm: float = 1.0
) -> dict[str, Limit]:
    """Limit of every alarm by its name; ``torque_size_nm`` is the RMS of the predicted drive torque."""
    bounds = torque_bounds(config, torque_size_nm, largest_lag_s(config))
    return {
        alarm.name: spec.limits(LimitSource(config, bounds, k))
        for spec, k, alarm in specs_of(config, clearance_joints)
    }


class AlarmBoard:
    """Present state of all alarms.

    Parameters
    ----------
    config : MonitorConfig
    clearance_joints : tuple of str
    torque_size_nm : float
        RMS of the predicted drive torque.

    Attributes
    ----------
    alarms : dict of str to Alarm
        By name, always in the same order.
    """

    def __init__(
        self, config: MonitorConfig, clearance_joints: tuple[str, ...], torque_size_nm: float = 1.0
    ) -> None:
        self._clearance_joints, self._torque_size_nm = clearance_joints, torque_size_nm
        self._limits = limits_of(config, clearance_joints, torque_size_nm)
        self.alarms = {alarm.name: alarm for _, _, alarm in specs_of(config, clearance_joints)}

    def configure(self, config: MonitorConfig) -> None:
        """Use other limits from now on."""
        self._limits = limits_of(config, self._clearance_joints, self._torque_size_nm)

    @property
    def clearance_limits_m(self) -> tuple[float, ...]:
        """Limit of each clearance joint's clearance."""
        return tuple(self._limits[specs.CLEARANCE.name(joint)].error for joint in self._clearance_joints)

    @property
    def held_by_estimate(self) -> tuple[str, ...]:
        """Alarms of clearances that are present because of what encoders or the drive torque showed."""
        names = map(specs.CLEARANCE.name, self._clearance_joints)
        return tuple(name for name in names if is_held_by_estimate(self.alarms[name]))

    def evaluate(
        self,
        values: Mapping[str, float],
        stamp_ns: int,
        cycles: int = 1,
        sources: Mapping[str, tuple[float, str]] = _NO_SOURCES,
        impact_factor: float = 1.0,
    ) -> tuple[AlarmList, ...]:
        """Evaluate values by alarm name; returns one list of all alarms if the shown state has changed.

        Parameters
        ----------
        values : mapping of str to float
        stamp_ns : int
        cycles : int
            Number of gait cycles that the values represent.
        sources : mapping of str to (float, str)
            Standard deviation and source of some values, by alarm name.
        impact_factor : float
            On the limits of impact forces.
        """
        found = []
        for name, value in values.items():
            limit = self._limit(name, impact_factor)
            found.append(evaluated(self.alarms[name], value, limit, stamp_ns, cycles, *sources.get(name, ())))
        return self._set(found, stamp_ns)

    def _limit(self, name: str, impact_factor: float) -> Limit:
        """Limit of an alarm, with a factor on those of impact forces."""
        is_impact = impact_factor != 1.0 and self.alarms[name].kind == specs.IMPACT.kind
        return self._limits[name].times(impact_factor) if is_impact else self._limits[name]

    def evaluate_early(
        self, values: Mapping[str, float], stamp_ns: int, impact_factor: float = 1.0
    ) -> tuple[AlarmList, ...]:
        """Evaluate values that may still rise until the gait cycle ends: they can only raise their alarms."""
        found = []
        for name, value in values.items():
            before, limit = self.alarms[name], self._limit(name, impact_factor)
            after = evaluated(before, value, limit, stamp_ns)
            if limit.on_delay == 1 and after.present > before.present:
                found.append(after)
        return self._set(found, stamp_ns)

    def acknowledge(self) -> tuple[tuple[Alarm, ...], tuple[Alarm, ...]]:
        """Acknowledge all alarms; returns the cleared ones and the remaining ones in their new state."""
        now = [acknowledged(alarm) for alarm in self.alarms.values() if alarm.level is not Level.OK]
        self.alarms |= {alarm.name: alarm for alarm in now}
        normal = tuple(alarm for alarm in now if alarm.level is Level.OK)
        return normal, tuple(alarm for alarm in now if alarm.level is not Level.OK)

    def acknowledge_one(self, name: str) -> None:
        """Acknowledge one alarm."""
        self.alarms = self.alarms | {name: acknowledged(self.alarms[name])}

    def clear(self, names: Iterable[str]) -> None:
        """Make alarms as new whose part is not there any more."""
        self.alarms = self.alarms | {name: cleared(self.alarms[name]) for name in names}

    def restore(self, alarms: Iterable[Alarm]) -> None:
        """Restore alarms from another run."""
        for alarm in alarms:
            if alarm.name in self.alarms:
                own = self.alarms[alarm.name]
                self.alarms[alarm.name] = attrs.evolve(alarm, unit=own.unit)

    def level(self, *names: str) -> Level:
        """Highest shown level of some alarms."""
        return max(self.alarms[name].level for name in names)

    def _set(self, found: Iterable[Alarm], stamp_ns: int) -> tuple[AlarmList, ...]:
        before = self.alarms
        self.alarms = before | {alarm.name: alarm for alarm in found}
        if any(has_changed(before[name], alarm) for name, alarm in self.alarms.items()):
            return (AlarmList(stamp_ns, tuple(self.alarms.values())),)
        return ()
