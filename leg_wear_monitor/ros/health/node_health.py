"""How the node itself does, for /diagnostics: can it keep up, what got lost on the way, is it recording."""

import math
from collections.abc import Iterable, Iterator

import attrs

from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.ros.health.silence import NOTHING_FROM_S, SILENT_FROM_S, utc
from leg_wear_monitor.ros.inputs.inbox import Inbox
from leg_wear_monitor.ros.inputs.inputs import InputTopic
from leg_wear_monitor.ros.inputs.publishers import misfit, several
from leg_wear_monitor.ros.outputs.black_box import BlackBox

# From here on, the topics that have a message a sample are left out, so that the monitor can catch up.
COARSE_FROM_S = 0.25


@attrs.define
class Load:
    """How the node keeps up.

    Attributes
    ----------
    delay_s, worst_delay_s : float
        For how long the oldest message has waited, now and at worst since it was last told.
    unpublished : int
        Samples whose torque and forces were left out to catch up.
    shed_told : int
        Messages shed until it was last told.
    """

    delay_s: float = 0.0
    worst_delay_s: float = 0.0
    unpublished: int = 0
    shed_told: int = 0

    def note(self, delay_s: float) -> bool:
        """Note a delay; whether it is too long to publish every sample."""
        self.delay_s, self.worst_delay_s = delay_s, max(self.worst_delay_s, delay_s)
        return delay_s > COARSE_FROM_S


def load_status(load: Load, inbox: Inbox) -> Status:
    """How the node keeps up, and begin anew."""
    shed = inbox.shed - load.shed_told
    level, message = Level.OK, "keeps up"
    if shed:
        level, message = Level.ERROR, "overloaded: samples were dropped and their wear is not counted"
    elif load.worst_delay_s > COARSE_FROM_S:
        level, message = Level.WARN, "overloaded: forces and torques of samples are not published"
    values = {
        "received": float(inbox.received),
        "waiting": float(len(inbox)),
        "worst_delay_s": load.worst_delay_s,
        "unpublished_samples": float(load.unpublished),
        "shed_messages": float(inbox.shed),
    }
    load.worst_delay_s, load.shed_told = load.delay_s, inbox.shed
    return Status("load", level, message, values)


def topics_status(topics: Iterable[InputTopic], now_ns: int, started_ns: int) -> Status:
    """The input topics: who publishes them, and what is wrong with that.

    The monitor below has no clock and does not see that nothing comes; here is one.

    Parameters
    ----------
    topics : iterable of InputTopic
    now_ns, started_ns : int
        By a clock that only goes forward.
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
    return Status("topics", level, "; ".join(messages) or "connected", values)


def _faults(topic: InputTopic, silent_s: float, running_s: float) -> Iterator[tuple[Level, str]]:
    """What is wrong with a topic."""
    if other := misfit(topic.publishers, topic.stream.type):
        yield Level.ERROR, other
    elif topic.incompatible:
        yield Level.ERROR, topic.incompatible
    if silent_s > SILENT_FROM_S:
        yield Level.ERROR, f"has fallen silent since {utc(topic.heard_wall_ns)}: nothing is monitored"
    elif not topic.publishers.fitting and not topic.publishers.other:
        yield Level.ERROR if running_s >= NOTHING_FROM_S else Level.WARN, "nobody publishes it"
    elif math.isnan(silent_s) and running_s >= NOTHING_FROM_S:
        yield Level.ERROR, "has a publisher, but no message came yet"
    if topic.lost > topic.lost_told:
        yield Level.WARN, "messages are lost on the way to this node"
    if topic.without_crank:
        yield Level.ERROR, topic.without_crank
    if several_of := several(topic.publishers):
        at = Level.ERROR if topic.sources > 1 else Level.WARN
        yield at, f"{several_of}; expected one"


def recording_status(black_box: BlackBox) -> Status:
    """Whether it is recorded."""
    values = {"recorded_messages": float(black_box.recorded)}
    if black_box.fault:
        return Status("recording", Level.ERROR, f"stopped: {black_box.fault}", values)
    return Status("recording", Level.OK, "on" if black_box.on else "off", values)
