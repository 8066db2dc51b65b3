"""What a monitor reports now, by name."""

from typing import Any

import leg_wear_monitor as lw

OK, WARN, ERROR = range(3)


def status_of(monitor: lw.WearMonitor, name: str) -> Any:
    """The status of this name."""
    (found,) = [status for status in monitor.status() if status.name == name]
    return found


def raised(monitor: lw.WearMonitor, level: int = ERROR) -> set[str]:
    """Names of the alarms at this level or a worse one."""
    return {alarm.name for alarm in monitor.alarms.alarms if alarm.level >= level}
