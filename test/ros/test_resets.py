"""A reset is asked for twice, and not without a time to note."""

import pytest

pytest.importorskip("rclpy")

import rclpy
from rclpy.parameter import Parameter
from rclpy.utilities import try_shutdown

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.ros.monitor_node import CONFIRM_S, Confirmation, MonitorNode


@pytest.mark.plain
def test_only_a_second_call_in_time_confirms() -> None:
    clock = [100.0]
    confirmation = Confirmation(lambda: clock[0])
    assert not confirmation.is_confirmed("A")
    assert not confirmation.is_confirmed("B")
    assert confirmation.is_confirmed("A")
    assert not confirmation.is_confirmed("A")
    clock[0] += CONFIRM_S + 0.1
    assert not confirmation.is_confirmed("A")
    clock[0] += CONFIRM_S - 0.1
    assert confirmation.is_confirmed("A")


def test_without_a_clock_nothing_is_reset(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(MonitorNode, "_compile", lambda self, decoder: None)
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", "--log-level", "fatal"], context=context)
    try:
        overrides = [Parameter("use_sim_time", value=True), Parameter("clearance_joints", value=["G"])]
        node = MonitorNode(context=context, parameter_overrides=overrides)
        for act in (node._reset_wear, node._reset_wear, node._undo_reset):
            with pytest.raises(LegWearError, match="no time for the ledger: use_sim_time"):
                act("G")
        node.close()
        node.destroy_node()
    finally:
        try_shutdown(context=context)
