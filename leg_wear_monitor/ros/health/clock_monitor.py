"""Check that ROS time advances."""

from leg_wear_monitor.monitor.alarms import fault_codes
from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.ros.health.node_alarms import AHEAD_FROM_S

_STANDS_FROM_S = 1.0
_TURNED_BACK_S = 1.0


def both_clocks(one: Status, other: Status) -> Status:
    """Combine two statuses of the clock into one with the faults of either."""
    faults = [status for status in (one, other) if status.level is not Level.OK]
    message = "; ".join(fault.message for fault in faults) or one.message
    code = max(faults, key=lambda fault: fault.level).fault_code if faults else one.fault_code
    return Status(one.name, max(one.level, other.level), message, one.values | other.values, code)


class ClockMonitor:
    """Compares the node's clock with a monotonic clock."""

    def __init__(self) -> None:
        self._ros_ns = self._changed_ns = 0

    def status(self, ros_ns: int, steady_ns: int, is_simulated: bool, ahead_s: float = 0.0) -> Status:
        """Present status of the clock.

        Parameters
        ----------
        ros_ns, steady_ns : int
            Present time of the node's clock and of a monotonic clock [ns].
        is_simulated : bool
            Whether the node follows ``/clock``.
        ahead_s : float
            Largest lead of an input's stamps over the node's clock [s].
        """
        since_ns, before = ros_ns - self._ros_ns, self._ros_ns
        if since_ns or not self._changed_ns:
            self._ros_ns, self._changed_ns = ros_ns, steady_ns
        stands_s = (steady_ns - self._changed_ns) * 1.0e-9
        values = {"stands_s": stands_s, "is_simulated": float(is_simulated), "stamps_ahead_s": ahead_s}
        if is_simulated and not ros_ns:
            message = "use_sim_time is set and nobody publishes /clock"
            return Status("clock", Level.ERROR, message, values, fault_codes.CLOCK_MISSING)
        if stands_s > _STANDS_FROM_S:
            message = "stands still: /clock has stopped"
            return Status("clock", Level.ERROR, message, values, fault_codes.CLOCK_STOPPED)
        if before and since_ns < -1.0e9 * _TURNED_BACK_S:
            message = "was set back; samples keep their own stamps"
            return Status("clock", Level.WARN, message, values, fault_codes.CLOCK_SET_BACK)
        if ahead_s >= AHEAD_FROM_S:
            message = (
                "the stamps of the samples are ahead of the node's clock: set the clocks of both computers; "
                "samples of a time that was counted ahead are skipped later"
            )
            return Status("clock", Level.WARN, message, values, fault_codes.STAMPS_AHEAD)
        return Status("clock", Level.OK, "goes on", values)
