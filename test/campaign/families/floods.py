"""Floods of a live node: garbage, wrong types, values that are none, huge messages, bursts, two publishers.

Each ends with a gait: the node has to be alive, to follow it, and to have said what it lost.
"""

import time
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import numpy as np
from geometry_msgs.msg import WrenchStamped
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from campaign import live
from campaign.case import Case, Outcome
from campaign.live import Stage

SHORT, LONG = 5, 100

_FEW, _MANY = 600, 20_000
_NAMES = 100_000


def warm() -> None:
    """Build the monitor and import ROS."""
    live.warm()


def case(seed: int) -> Case:
    """A flood of one of the kinds."""
    name = list(_KINDS)[seed % len(_KINDS)]
    return Case(description=name, run=partial(_run, name, seed), memory_mb=512.0, seconds=120.0)


def _run(name: str, seed: int, _directory: Path) -> tuple[Outcome, str]:
    flood, sentence = _KINDS[name]
    stage = Stage()
    sent = flood(stage, np.random.default_rng(seed))
    reported, received = stage.reported(), stage.monitor._inbox.received
    unsaid = stage.unsaid()
    # the walk lies an hour later: whatever stamps were believed, it is a time of its own
    stage.send(stage.publisher(JointState, "joint_states", "after"), live.walk(3600.0, 3602.0))
    gait = next(one for one in stage.monitor.monitor.status() if one.name == "gait").message
    lost = [topic.lost for topic in stage.monitor._supervision.inputs]
    counts = f"{sent} sent, {received} received, {lost} lost by DDS; then {gait}; {reported}"
    if unsaid or sentence not in reported or gait != "in step":
        return Outcome.SILENT, f"{unsaid}; expected {sentence!r}; {counts}"
    return Outcome.REPORTED if sentence else Outcome.SOUND, counts


def _crank(stage: Stage, messages: Iterable[object], together: int = 20) -> int:
    return stage.send(stage.publisher(JointState, "joint_states"), messages, together)


def _garbage(stage: Stage, rng: np.random.Generator) -> int:
    """Random bytes, some with the head of a message."""
    publish = stage.publisher(WrenchStamped, "drive_torque"), stage.publisher(JointState, "joint_states")
    heads = (b"", b"\0\1\0\0", b"\0\0\0\0", b"\0\3\0\0")
    return sum(
        stage.send(each, (heads[i % 4] + rng.bytes(int(rng.integers(0, 600))) for i in range(_FEW)))
        for each in publish
    )


def _damaged(stage: Stage, rng: np.random.Generator) -> int:
    """Messages that are cut or have other bytes in them."""

    def damaged() -> Iterable[bytes]:
        for i, whole in enumerate(live.walk(0.0, 4.0)):
            raw = bytearray(whole)
            for _ in range(int(rng.integers(1, 9))):
                raw[int(rng.integers(len(raw)))] = int(rng.integers(256))
            yield bytes(raw[: int(rng.integers(4, len(raw)))] if i % 2 else raw)

    return _crank(stage, damaged())


def _other_type(stage: Stage, rng: np.random.Generator) -> int:
    """Other types on both topics."""
    publish = stage.publisher(Float64, "drive_torque", matches=False)
    again = stage.publisher(WrenchStamped, "joint_states", matches=False)
    # discovery is in the graph
    stage.serve(lambda: "publishes" in stage.reported(), "publishers of another type")
    sent = stage.send(publish, (Float64(data=float(x)) for x in rng.random(_FEW)))
    return sent + stage.send(again, (WrenchStamped() for _ in range(_FEW)))


def _no_numbers(stage: Stage, rng: np.random.Generator) -> int:
    """Values that are none: NaN, infinite, beyond every leg's."""
    odd = (np.nan, np.inf, -np.inf, 1e300, -1e18)
    return _crank(stage, (live.crank(i / 200.0, position=[0.0, float(rng.choice(odd))]) for i in range(_FEW)))


def _huge(stage: Stage, rng: np.random.Generator) -> int:
    """A hundred thousand names a message, without the crank."""
    names = [f"joint_{i:06d}" for i in range(_NAMES)]
    raw = serialize_message(live.crank(1.0, name=names, position=[0.0] * _NAMES, velocity=[]))
    # what the publisher holds is not the monitor's
    publish = stage.publisher(JointState, "joint_states", depth=1)
    return stage.send(publish, (raw for _ in range(150)), together=int(rng.integers(1, 40)))


def _fast(stage: Stage, rng: np.random.Generator) -> int:
    """Ten thousand a second, as fast as they go."""
    return _crank(stage, live.walk(0.0, 2.0, 1.0e4), together=int(rng.integers(10, 100)))


def _burst(stage: Stage, rng: np.random.Generator) -> int:
    """More than the node holds, while it is busy."""
    at_once = int(rng.integers(1_000, _MANY))
    publish = stage.publisher(JointState, "joint_states")
    raw = list(live.walk(0.0, 2.5, 1.0e4))
    inbox, crank = stage.monitor._inbox, stage.monitor._supervision.inputs[0]
    with inbox.lock:
        for message in raw:
            inbox.add(crank.stream.code, message, time.time_ns())
    stage.settle()
    return len(raw) + stage.send(publish, raw[:at_once], together=at_once)


def _two(stage: Stage, rng: np.random.Generator) -> int:
    """Two publishers of one crank that disagree."""
    first = stage.publisher(JointState, "joint_states", "leg")
    second = stage.publisher(JointState, "joint_states", "simulator")
    off = float(rng.uniform(0.3, 5.9))
    turned = live.TURN

    def other(i: int) -> JointState:
        t = i / 200.0 + 0.0011
        return live.crank(t, position=[0.0, (turned * t + off) % turned])

    sent = 0
    for i in range(400):
        first(live.crank(i / 200.0))
        second(other(i))
        sent += 2
        if i % 10 == 0:
            stage.work(20)
    stage.settle()
    return sent


def _zero_stamps(stage: Stage, rng: np.random.Generator) -> int:
    """Stamps of zero."""
    blank = JointState().header
    return _crank(stage, (live.crank(float(t), header=blank) for t in rng.random(_FEW)))


def _nameless(stage: Stage, rng: np.random.Generator) -> int:
    """Names without the crank, some that a terminal must not get."""
    odd = ("knee", "\x1b[2J", "cranc", "", "c" * 200)
    return _crank(stage, (live.crank(i / 200.0, name=["hip", str(rng.choice(odd))]) for i in range(_FEW)))


_KINDS: dict[str, tuple[Callable[[Stage, np.random.Generator], int], str]] = {
    "garbage bytes": (_garbage, "samples cannot be decoded"),
    "huge messages": (_huge, "do not name the crank 'crank': set crank_joint"),
    "a burst": (_burst, "overloaded: samples were dropped"),
    "two publishers": (_two, "two series of crank angles interleave"),
    "another type": (_other_type, "expected sensor_msgs/msg/JointState; no message arrives from it"),
    "damaged messages": (_damaged, "samples "),
    "no numbers": (_no_numbers, "have a value that is NaN or infinite"),
    "ten thousand a second": (_fast, ""),
    "zero stamps": (_zero_stamps, "have a zero stamp: set header.stamp"),
    "names without the crank": (_nameless, "no joint is named 'crank'; there are"),
}
