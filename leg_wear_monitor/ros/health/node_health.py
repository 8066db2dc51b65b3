"""Status of the node itself for /diagnostics: load, message loss, recording."""

import math
from collections.abc import Iterable, Iterator

import attrs

from leg_wear_monitor.monitor.alarms import fault_codes
from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.ros.health.silence import NOTHING_FROM_S, SILENT_FROM_S, utc
from leg_wear_monitor.ros.inputs.inbox import Inbox
from leg_wear_monitor.ros.inputs.inputs import InputTopic
from leg_wear_monitor.ros.inputs.publishers import misfit, several
from leg_wear_monitor.ros.outputs.black_box import BlackBox

# Above this delay, topics with one message per sample are not published, so that the monitor can catch up.
COARSE_FROM_S = 0.25


@attrs.define
class Load:
    """Load of the node.

    Attributes
    ----------
    delay_s, worst_delay_s : float
        Waiting time of the oldest message: present, and maximum since the last report [s].
    unpublished : int
        Samples whose torque and forces were not published in order to catch up.
    shed_reported : int
        Messages shed up to the last report.
    """

    delay_s: float = 0.0
    worst_delay_s: float = 0.0
    unpublished: int = 0
    shed_reported: int = 0

    def note(self, delay_s: float) -> bool:
        """Record a delay; return whether it is too long to publish every sample."""
        self.delay_s, self.worst_delay_s = delay_s, max(self.worst_delay_s, delay_s)
        return delay_s > COARSE_FROM_S


def load_status(load: Load, inbox: Inbox) -> Status:
    """Status of the load; starts a new reporting interval."""
    shed = inbox.shed - load.shed_reported
    level, message, code = Level.OK, "keeps up", fault_codes.NO_FAULT
    if shed:
        level, message = Level.ERROR, "overloaded: samples were dropped and their wear is not counted"
        code = fault_codes.SAMPLES_DROPPED
    elif load.worst_delay_s > COARSE_FROM_S:
        level, message = Level.WARN, "overloaded: forces and torques of samples are not published"
        code = fault_codes.SAMPLES_NOT_PUBLISHED
    values = {
        "received": float(inbox.received),
        "waiting": float(len(inbox)),
        "worst_delay_s": load.worst_delay_s,
        "unpublished_samples": float(load.unpublished),
        "shed_messages": float(inbox.shed),
    }
    load.worst_delay_s, load.shed_reported = load.delay_s, inbox.shed
    return Status("load", level, message, values, code)


def topics_status(topics: Iterable[InputTopic], now_ns: int, started_ns: int) -> Status:
    """Status of the input topics: their publishers and faults.

    The monitor core has no clock and cannot detect missing messages, so the node does.

    Parameters
    ----------
    topics : iterable of InputTopic
    now_ns, started_ns : int
        Present time and start time on a monotonic clock [ns].
    """
    messages, values, level = [], {}, Level.OK
    for topic in topics:
        short = topic.name.rsplit("/", 1)[-1]
        silent_s = max(0, now_ns - topic.heard_ns) * 1.0e-9 if topic.heard_ns else math.nan
        values[f"{short}_publishers"] = float(len(topic.publishers.fitting))
        values[f"{short}_silent_s"] = silent_s
        values[f"{short}_lost_messages"] = float(topic.lost)
        for at, fault in _faults(topic, silent_s, (now_ns - started_ns) * 1.0e-9):
            messages.append(f"{topic.name}: {fault}")
            level = max(level, at)
    code = fault_codes.TOPICS if messages else fault_codes.NO_FAULT
    return Status("topics", level, "; ".join(messages) or "connected", values, code)


def _faults(topic: InputTopic, silent_s: float, running_s: float) -> Iterator[tuple[Level, str]]:
    """Faults of a topic with their levels."""
    if other := misfit(topic.publishers, topic.stream.type):
        yield Level.ERROR, other
    elif topic.incompatible:
        yield Level.ERROR, topic.incompatible
    if silent_s > SILENT_FROM_S:
        yield Level.ERROR, f"has been silent since {utc(topic.heard_wall_ns)}: nothing is monitored"
    elif not topic.publishers.fitting and not topic.publishers.other:
        yield Level.ERROR if running_s >= NOTHING_FROM_S else Level.WARN, "nobody publishes it"
    elif math.isnan(silent_s) and running_s >= NOTHING_FROM_S:
        yield Level.ERROR, "has a publisher, but no message has arrived yet"
    if topic.lost > topic.lost_reported:
        yield Level.WARN, "messages are lost on the way to this node"
    if topic.without_crank:
        yield Level.ERROR, topic.without_crank
    if topic.other_axis:
        yield Level.ERROR, topic.other_axis
    if len(topic.publishers.fitting) - topic.shared > 1 and (several_of := several(topic.publishers)):
        at = Level.ERROR if topic.sources > 1 else Level.WARN
        yield at, f"{several_of}; expected one"


def recording_status(black_box: BlackBox) -> Status:
    """Status of the recording."""
    values = {"recorded_messages": float(black_box.recorded)}
    if black_box.fault:
        message = f"stopped: {black_box.fault}"
        return Status("recording", Level.ERROR, message, values, fault_codes.RECORDING_STOPPED)
    return Status("recording", Level.OK, "on" if black_box.on else "off", values)
