"""A clock that begins anew beside a ledger, and what cannot be told from a recording that is played."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy")

from made_node import made_node
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from leg_wear_monitor.messages.streams import JOINT_STATE
from leg_wear_monitor.monitor.ledger.entry import JointWear
from leg_wear_monitor.ros.monitor_node import BEGUN, UNDECIDED, Epochs, MonitorNode
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin.sample import Samples, gait_samples

SECOND = 10**9
DATE_NS = 1_700_000_000 * SECOND
COUNTED_S = 100


class Counted:
    """A monitor whose ledger has the time from a stamp on, a hundred seconds."""

    def __init__(self, begin_ns: int, is_other_boot: bool = False) -> None:
        self.begin_ns, self.is_other_boot = begin_ns, is_other_boot
        self.begun: list[int] = []

    def begin_run(self, boot_id: str) -> bool:
        return self.is_other_boot

    def counted(self, samples: Samples) -> np.ndarray:
        stamps = samples["stamp_ns"] - self.begin_ns
        return (stamps >= 0) & (stamps <= COUNTED_S * SECOND) & (not self.begun)

    def begin_epoch(self, stamp_ns: int, who: str) -> None:
        self.begun.append(stamp_ns)


def seen(monitor: Counted, from_ns: int, now_ns: int) -> tuple[Epochs, list[tuple[bool, str]]]:
    """What comes of two blocks of samples from a stamp on."""
    said: list[tuple[bool, str]] = []
    epochs = Epochs(monitor, "boot", lambda: now_ns, lambda *line: said.append(line))
    for k in range(2):
        stamps = from_ns + (5 * k + np.arange(5)) * 5_000_000
        epochs.check(gait_samples(stamps, crank_angle_rad=np.zeros(5)))
    return epochs, said


@pytest.mark.plain
@pytest.mark.parametrize("begin_ns", [1, DATE_NS])
def test_samples_of_now_are_never_counted_already(begin_ns: int) -> None:
    """Simulated time that was reset, a computer that starts in 1970, a clock that was set back."""
    monitor = Counted(begin_ns)
    epochs, said = seen(monitor, begin_ns + 5 * SECOND, begin_ns + 6 * SECOND)
    assert len(monitor.begun) == 1
    assert said == [(False, BEGUN)]
    status = epochs.status()
    assert (status.level, status.message) == (Level.OK, BEGUN)
    assert status.values == {"left_out_samples": 0.0, "epochs_begun": 1.0}


@pytest.mark.plain
@pytest.mark.parametrize("begin_ns", [1, DATE_NS])
def test_what_cannot_be_decided_is_an_error_at_once_and_once_in_the_log(begin_ns: int) -> None:
    monitor = Counted(begin_ns)
    epochs, said = seen(monitor, begin_ns + SECOND, DATE_NS + 3600 * SECOND)
    assert not monitor.begun
    assert said == [(True, UNDECIDED)]
    status = epochs.status()
    assert (status.level, status.message) == (Level.ERROR, UNDECIDED)
    assert "ledger.skip_counted: false" in status.message
    assert epochs.status().level is Level.OK


@pytest.mark.plain
def test_stamps_that_are_no_dates_begin_anew_with_the_computer_others_after_what_is_counted() -> None:
    for begin_ns, from_ns, now_ns, begun in (
        (1, 5 * SECOND, DATE_NS, 1),
        (DATE_NS, DATE_NS + SECOND, DATE_NS + 3600 * SECOND, 0),
        (DATE_NS, DATE_NS + (COUNTED_S + 1) * SECOND, DATE_NS, 0),
    ):
        monitor = Counted(begin_ns, is_other_boot=True)
        seen(monitor, from_ns, now_ns)
        assert len(monitor.begun) == begun
    epochs, said = seen(Counted(DATE_NS), DATE_NS + (COUNTED_S + 1) * SECOND, DATE_NS)
    assert (said, epochs.status().level) == ([], Level.OK)


def walked(ledger: Path, monkeypatch: pytest.MonkeyPatch, now_ns: int) -> tuple[Epochs, JointWear]:
    """Two turns of the crank, from one second of simulated time on, in a run of the node."""
    monkeypatch.setattr(MonitorNode, "_ros_now_ns", lambda self: now_ns)
    with made_node(ledger__path=str(ledger), clearance_joints=["G"], clearances_m=[3.0e-4]) as node:
        for k in range(500):
            message = JointState(name=["crank"], position=[2.0 * np.pi * k / 200.0])
            message.header.stamp.sec, rest = divmod(SECOND + 5_000_000 * k, SECOND)
            message.header.stamp.nanosec = rest
            node._inbox.add(JOINT_STATE, serialize_message(message), DATE_NS + 5_000_000 * k)
        while len(node._inbox):
            node._work()
        node.close()
        return node._epochs, node.monitor.wear_of("G")


def test_a_node_counts_simulated_time_that_began_anew_and_nothing_that_is_played(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ledger = tmp_path / "wear.db"
    _, once = walked(ledger, monkeypatch, now_ns=3 * SECOND)
    assert once.depth.sum() > 0.0
    epochs, played = walked(ledger, monkeypatch, now_ns=DATE_NS)
    assert epochs.status().level is Level.ERROR
    assert np.array_equal(played.depth, once.depth)
    epochs, anew = walked(ledger, monkeypatch, now_ns=3 * SECOND)
    assert (epochs.status().level, epochs.status().message) == (Level.OK, BEGUN)
    assert anew.depth.sum() > 1.9 * once.depth.sum()
