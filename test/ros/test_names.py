"""Names of a leg in a namespace: its statuses, its hardware, its ledger; the same live and in replay."""

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

from made_node import made_node

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.config.settings import MonitorConfig


def hardware(namespace: str, **parameters: Any) -> str:
    """Hardware id of a node that is made and taken down."""
    # one joint is made sooner than five
    with made_node(namespace=namespace, clearance_joints=["G"], **parameters) as node:
        found: str = node.get_parameter("hardware_id").value
        assert node.monitor.config.hardware == found
    return found


def test_a_leg_is_called_by_its_namespace_unless_it_has_a_name() -> None:
    assert hardware("robot/left") == "robot/left"
    assert hardware("left", hardware_id="unit-7") == "unit-7"


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
    assert config.hardware == config.on_node("/leg_wear_monitor").hardware == "leg"
    assert config.on_node("/robot/left/leg_wear_monitor").hardware == "robot/left"
    assert MonitorConfig(hardware_id="x").on_node("/left/leg_wear_monitor").hardware == "x"
