"""Names of a leg in a namespace: its statuses, its hardware, its ledger; the same live and in replay."""

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

import rclpy
from rclpy.parameter import Parameter
from rclpy.utilities import try_shutdown

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.ros.monitor_node import MonitorNode


def hardware(namespace: str, **parameters: Any) -> str:
    """Hardware id of a node that is made and taken down."""
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", "--log-level", "fatal"], context=context)
    parameters |= {"clearance_joints": ["G"]}  # one is made sooner than five
    overrides = [Parameter(name.replace("__", "."), value=value) for name, value in parameters.items()]
    try:
        node = MonitorNode(context=context, namespace=namespace, parameter_overrides=overrides)
        found: str = node.get_parameter("hardware_id").value
        assert node.monitor.config.hardware == found
        node.close()
        node.destroy_node()
    finally:
        try_shutdown(context=context)
    return found


@pytest.fixture(autouse=True)
def no_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(MonitorNode, "_compile", lambda self, decoder: None)


@pytest.mark.parametrize(
    ("namespace", "given", "expected"),
    [("robot/left", None, "robot/left"), ("left", "unit-7", "unit-7")],
)
def test_a_leg_is_called_by_its_namespace_unless_it_has_a_name(
    namespace: str, given: str | None, expected: str
) -> None:
    assert hardware(namespace, **({} if given is None else {"hardware_id": given})) == expected


def test_a_ledger_of_the_root_is_told_what_to_set_in_a_namespace(tmp_path: Path) -> None:
    ledger = str(tmp_path / "wear.db")
    assert hardware("", ledger__path=ledger) == "leg"
    with pytest.raises(LegWearError) as refused:
        hardware("left", ledger__path=ledger)
    assert "is of hardware id leg, not left" in str(refused.value)
    assert "set hardware_id: leg" in str(refused.value)
    assert "\n" not in str(refused.value)
    assert hardware("left", ledger__path=ledger, hardware_id="leg") == "leg"


@pytest.mark.plain
def test_parameters_on_a_node_name_the_leg() -> None:
    config = MonitorConfig()
    assert config.hardware == "leg"
    assert config.on_node("/leg_wear_monitor").hardware == "leg"
    assert config.on_node("/robot/left/leg_wear_monitor").hardware == "robot/left"
    assert MonitorConfig(hardware_id="x").on_node("/left/leg_wear_monitor").hardware == "x"
