"""What a monitor reports now, by name."""

from collections.abc import Callable

from leg_wear_monitor import WearMonitor
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.state import Level


def as_new(one: WearMonitor) -> Callable[[], WearMonitor]:
    """Gives a monitor as new each time; always the same one, since its tables take time."""
    new = one.snapshot()

    def again() -> WearMonitor:
        one.restore(new)
        return one

    return again


def status_of(monitor: WearMonitor, name: str) -> Status:
    """The status of this name."""
    (found,) = [status for status in monitor.status() if status.name == name]
    return found


def raised(monitor: WearMonitor, level: Level = Level.ERROR) -> set[str]:
    """Names of the alarms at this level or a worse one."""
    return {alarm.name for alarm in monitor.alarms.alarms if alarm.level >= level}
