"""What people ask of a running monitor: alarms acknowledged, parts replaced."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy")

from click.testing import CliRunner
from diagnostic_msgs.msg import DiagnosticArray
from made_node import made_node
from std_srvs.srv import Trigger

from leg_wear_monitor.cli import common
from leg_wear_monitor.cli.main import cli
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.ros.monitor_node import CONFIRM_S, Confirmation

ME = "/leg_wear_monitor"


@pytest.fixture(scope="module")
def ledger(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("ledger") / "wear.db"


@pytest.fixture(scope="module")
def monitor(shared_stage, walk, ledger: Path):
    """A monitor that has seen all of the walk, with alarms raised in each joint."""
    monitor = shared_stage.monitor(
        wear_acceleration=1.0e5,
        ledger__path=str(ledger),
        limits__clearance_m=3.0e-4,
        alarms__on_delay_cycles=1,
    )
    shared_stage.legs().play(walk, monitor)
    return monitor


def trigger(stage, name: str):
    return stage.call(Trigger, f"{ME}/{name}", Trigger.Request())


def test_alarms_are_acknowledged_and_stay_while_they_are_present(shared_stage, monitor) -> None:
    answer = trigger(shared_stage, "acknowledge_alarms")
    assert answer.success
    assert "clearance A" in answer.message.split("still present")[1]
    heard = shared_stage.listen(f"{ME}/alarms", DiagnosticArray, latched=True)
    shared_stage.wait_for(lambda: bool(heard), "the latched list of alarms")
    line = next(one for one in heard[-1].status if one.name.endswith(": clearance A"))
    assert line.message == "present, acknowledged"


def test_a_part_is_replaced_and_the_ledger_saved(shared_stage, monitor, ledger: Path) -> None:
    wear_monitor = monitor.node.monitor
    worn = wear_monitor.status()
    asked = trigger(shared_stage, "reset_wear/A")
    assert not asked.success
    assert "not reset yet" in asked.message
    assert "call again within 30 s" in asked.message
    assert [repr(one) for one in wear_monitor.status()] == [repr(one) for one in worn]
    forecasts = shared_stage.listen(f"{ME}/forecast", DiagnosticArray)
    answer = trigger(shared_stage, "reset_wear/A")
    assert answer.success
    shared_stage.wait_for(lambda: bool(forecasts), "the forecast of the new part, while the leg rests")
    joints = {one.name: one.values["clearance_m"] for one in wear_monitor.status() if "joint" in one.name}
    before = {one.name: one.values["clearance_m"] for one in worn if "joint" in one.name}
    assert joints["joint A"] == pytest.approx(3.0e-4, rel=1e-12)
    assert before["joint A"] > 3.05e-4
    assert joints["joint B"] == before["joint B"]
    assert trigger(shared_stage, "save_state").success
    assert ledger.exists()
    answer = trigger(shared_stage, "undo_reset/A")
    assert answer.success
    assert "undone" in answer.message
    joints = {one.name: one.values["clearance_m"] for one in wear_monitor.status() if "joint" in one.name}
    assert joints == before
    answer = trigger(shared_stage, "undo_reset/A")
    assert not answer.success
    assert "has no reset to undo" in answer.message


def test_a_reset_by_command_stops_at_its_success(shared_stage, monitor, monkeypatch) -> None:
    """Somebody has called the service once just before: the first call of the command confirms that."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(shared_stage.domain))
    assert not trigger(shared_stage, "reset_wear/B").success
    done = CliRunner().invoke(cli, ["reset", "B", "--node", ME])
    assert (done.exit_code, done.stderr) == (0, "")
    assert done.stdout.startswith("joint B: new surfaces")
    assert CliRunner().invoke(cli, ["acknowledge", "--node", ME]).exit_code == 0
    assert "not reset yet" in trigger(shared_stage, "reset_wear/B").message


@pytest.mark.plain
@pytest.mark.parametrize("verb", [["acknowledge"], ["reset", "B"], ["reset", "B", "--undo"]])
def test_what_a_node_did_not_store_is_a_finding(verb, monkeypatch) -> None:
    reply = "cleared: none; still present: none; it is not stored: no ledger is kept; set ledger.path"
    monkeypatch.setattr(common, "trigger", lambda *_: reply)
    done = CliRunner().invoke(cli, [*verb, "--node", ME])
    assert (done.exit_code, done.stdout) == (1, f"{reply}\n")


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


@pytest.mark.parametrize("has_ledger", [False, True])
def test_what_is_not_stored_is_said_and_cannot_be_undone(has_ledger: bool, tmp_path: Path) -> None:
    ledger, away = tmp_path / "wear.db", tmp_path / "away"
    with made_node(clearance_joints=["G"], ledger__path=str(ledger) if has_ledger else "") as node:
        if has_ledger:
            ledger.rename(away)  # it cannot be written
        assert "; it is not stored: " in node._acknowledge()
        with pytest.raises(LegWearError, match="not reset yet"):
            node._reset_wear("G")
        reply = node._reset_wear("G")
        assert reply.startswith("joint G: new surfaces; alarms cleared: ")
        assert "confirm by walking; it is not stored: " in reply
        assert "undo" not in reply
        with pytest.raises(LegWearError):
            node._undo_reset("G")
        if has_ledger:
            away.rename(ledger)
            assert "not stored" not in node._acknowledge()  # the next entry has what was done meanwhile
            assert "not stored" not in node._undo_reset("G")


def test_another_wear_coefficient_than_that_of_the_ledger_is_logged(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    given = {"clearance_joints": ["G"], "ledger__path": str(tmp_path / "wear.db")}
    with made_node(wear_coefficients_per_pa=[1.0e-15], **given) as node:
        node.monitor._twin.set_depth(np.full((1, 2, 720), 3.0e-5))
    with made_node("--log-level", "warn", wear_coefficients_per_pa=[2.0e-15], **given):
        err = capfd.readouterr().err
        assert "wear coefficient of joint G: 4e-15 1/Pa (bushing and" in err
        assert "usual are" not in err
    with made_node("--log-level", "warn", wear_coefficients_per_pa=[2.0e-7], clearance_joints=["G"]):
        assert "wear_coefficients_per_pa: 2e-07 1/Pa, usual are below" in capfd.readouterr().err


def test_without_a_clock_nothing_is_reset() -> None:
    with made_node(use_sim_time=True, clearance_joints=["G"]) as node:
        for act in (node._reset_wear, node._reset_wear, node._undo_reset):
            with pytest.raises(LegWearError, match="no time for the ledger: use_sim_time"):
                act("G")
