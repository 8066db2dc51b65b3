"""Log of the node: alarm changes and new faults, each logged once."""

import math
from collections.abc import Iterable

from rclpy.impl.rcutils_logger import RcutilsLogger

from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level
from leg_wear_monitor.monitor.reports import AlarmList, Status
from leg_wear_monitor.ros.health.silence import utc

# Statuses that are logged; the others follow from alarms, which are logged already.
STATUSES = ("topics", "load", "recording", "ledger", "clock")


def _write(logger: RcutilsLogger, level: Level, text: str) -> None:
    # separate calls: rclpy rejects one call site that changes its severity
    if level is Level.ERROR:
        logger.error(text)
    elif level is Level.WARN:
        logger.warning(text)
    else:
        logger.info(text)


class AlarmLog:
    """Logs a line for each alarm whose present level changes.

    Parameters
    ----------
    logger : rclpy logger
    """

    def __init__(self, logger: RcutilsLogger) -> None:
        self._logger = logger
        self._present: dict[str, Level] = {}

    def note(self, alarms: AlarmList) -> None:
        """Log the changes in a list of the present state of all alarms."""
        for alarm in alarms.alarms:
            before = self._present.get(alarm.name, Level.OK)
            if alarm.present is not before:
                self._present[alarm.name] = alarm.present
                _write(self._logger, alarm.present, line_of(alarm, before, alarms.stamp_ns))


def line_of(alarm: Alarm, before: Level, stamp_ns: int) -> str:
    """Log line for an alarm's change of level: name, levels, value, limit, time."""
    unit = f" {alarm.unit}" if alarm.unit else ""
    verb = "rises" if alarm.present > before else "falls"
    latched = ", shown until it is acknowledged" if alarm.level > alarm.present else ""
    value = "unknown" if math.isnan(alarm.value) else f"{_plain(alarm.value)}{unit}"
    limit = "" if math.isnan(alarm.limit) else f", limit {_plain(alarm.limit)}{unit}"
    time = f", at {utc(stamp_ns)}" if stamp_ns > 0 else ""
    return (
        f"alarm {alarm.name} {verb} from {before.name} to {alarm.present.name}: {value}{limit}{time}{latched}"
    )


def _plain(value: float) -> str:
    """Four digits, as 11640 and not as 1.164e+04."""
    return f"{float(f'{value:.4g}'):g}"


class StatusLog:
    """Logs a line when a status becomes a fault, changes to another fault, or recovers.

    Parameters
    ----------
    logger : rclpy logger
    """

    def __init__(self, logger: RcutilsLogger) -> None:
        self._logger = logger
        self._before: dict[str, tuple[Level, str]] = {}

    def note(self, statuses: Iterable[Status]) -> None:
        """Log the changes of present statuses; only those in `STATUSES` are logged."""
        for status in statuses:
            if status.name not in STATUSES:
                continue
            now = (status.level, status.message)
            level, _ = before = self._before.get(status.name, (Level.OK, ""))
            if now != before and (status.level is not Level.OK or level is not Level.OK):
                _write(self._logger, status.level, f"{status.name}: {status.message}")
            self._before[status.name] = now
