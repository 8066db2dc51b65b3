"""What a monitor reports now, by name."""

from leg_wear_monitor import WearMonitor
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.state import Level


def status_of(monitor: WearMonitor, name: str) -> Status:
    """The status of this name."""
    (found,) = [status for status in monitor.status() if status.name == name]
    return found


def raised(monitor: WearMonitor, level: Level = Level.ERROR) -> set[str]:
    """Names of the alarms at this level or a worse one."""
    return {alarm.name for alarm in monitor.alarms.alarms if alarm.level >= level}
