"""A clearance measured while the monitor runs: by the command line, in a process of its own, too."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("rclpy")

from click.testing import CliRunner, Result
from diagnostic_msgs.msg import DiagnosticArray
from ledger_contents import rows_of
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.parameter import Parameter

from leg_wear_monitor.cli.main import cli

NODE = "/left/leg_wear_monitor"


def measure(*arguments: str) -> Result:
    return CliRunner().invoke(cli, ["measure", *arguments])


def rows(path: Path) -> list[tuple[object, ...]]:
    return rows_of(path, "SELECT joint, clearance_m, sigma_m, who, counts FROM measurement")


def asked(stage, **values):
    return asked_with(stage, [Parameter(name, value=value) for name, value in values.items()])


def asked_with(stage, parameters):
    request = SetParametersAtomically.Request(parameters=[one.to_parameter_msg() for one in parameters])
    return stage.call(SetParametersAtomically, f"{NODE}/measure", request).result


def test_a_running_monitor_takes_measured_clearances(stage, tmp_path: Path) -> None:
    ledger = tmp_path / "wear.ledger"
    monitor = stage.monitor("left", ledger__path=str(ledger))
    verdicts = stage.listen(f"{NODE}/verdict", DiagnosticArray, latched=True)
    command = [sys.executable, "-m", "leg_wear_monitor", "measure", "A", "0.301", "--sigma", "0.005"]
    alone = subprocess.run([*command, "--node", NODE], capture_output=True, text=True, check=False)
    assert (alone.returncode, alone.stderr) == (0, "")
    assert alone.stdout.startswith(
        "A: 0.301 mm ± 0.005 mm, 0 gait cycles after the part was new; 0.3 mm is counted"
    )

    done = measure("G", "0.9", "--sigma", "0.005", "--node", NODE)
    assert (done.exit_code, done.stderr) == (1, "")
    assert "contradicts the model" in done.stdout
    assert "at its limit: stop the leg when it is safe" in done.stdout
    stage.wait_for(lambda: any("joint_G" in repr(one) for one in verdicts), "the verdict on G")
    (status,) = verdicts[-1].status
    assert "the measured clearance of joint G (knee) is 0.9 mm (limit 0.6 mm)" in status.message

    done = measure("G", "0.9", "--sigma", "0.005", "--accept", "--node", NODE)
    assert done.exit_code == 1
    assert "it counts, as requested" in done.stdout

    done = measure("Z", "0.4", "--sigma", "0.005", "--node", NODE)
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr.splitlines() == [
        f"error: {NODE}/measure: JOINT: 'Z' is not a clearance joint, expected one of A, B, G, I, J"
    ]
    refuses_in_one_line(stage)
    monitor.stop()
    who = "service ~/measure"
    assert rows(ledger) == [
        ("A", pytest.approx(3.01e-4), pytest.approx(5e-6), who, 1),
        ("G", pytest.approx(9e-4), pytest.approx(5e-6), who, 0),
        ("G", pytest.approx(9e-4), pytest.approx(5e-6), who, 1),
    ]


def refuses_in_one_line(stage) -> None:
    """Wrong names, types and values, each with one clear line; nothing is entered."""
    good = {"joint": "A", "clearance_m": 3.0e-4, "sigma_m": 5.0e-6}
    for values, reason in (
        (
            {**good, "clearence_m": 3.0e-4},
            "clearence_m: unknown parameter, expected joint, clearance_m, sigma_m",
        ),
        ({"joint": "A", "clearance_m": 3.0e-4}, "sigma_m: is missing, expected a double"),
        ({**good, "clearance_m": 1}, "clearance_m: is of type integer, expected a double"),
        ({**good, "joint": 3.0}, "joint: is of type double, expected a string"),
        ({**good, "accept": "yes"}, "accept: is of type string, expected a bool"),
        ({**good, "accept": [True]}, "accept: is of type other, expected a bool"),
        ({**good, "clearance_m": 0.3}, "did you mean 0.3 mm?"),
        ({**good, "clearance_m": float("nan")}, "clearance: nan mm is not between"),
        ({**good, "clearance_m": -3.0e-4}, "clearance: -0.3 mm is not between"),
        ({**good, "sigma_m": float("inf")}, "sigma: inf mm is not a standard deviation"),
        ({**good, "sigma_m": 0.0}, "sigma: 0 mm is not a standard deviation"),
        ({}, "joint: is missing, expected a string"),
    ):
        answer = asked(stage, **values)
        assert not answer.successful, values
        assert reason in answer.reason
        assert "\n" not in answer.reason
    twice = [Parameter(name, value=value) for name, value in [*good.items(), ("joint", "B")]]
    assert asked_with(stage, twice).reason == "joint: is given twice"


def test_nobody_answers_within_the_time_that_is_said(domain: int) -> None:
    done = measure("A", "0.301", "--sigma", "0.005", "--node", "/nowhere/monitor", "--wait", "0.5")
    assert (done.exit_code, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    assert "/nowhere/monitor/measure: nobody offers this service within 0.5 s" in line
    done = measure("A", "0.301", "--sigma", "0.005", "--node", "no node")
    assert (done.exit_code, len(done.stderr.splitlines())) == (2, 1)
    assert "'no node' is not the name of a node" in done.stderr


def test_the_forecast_follows_a_measurement_at_once(stage, walk) -> None:
    monitor = stage.monitor("left", wear_acceleration=1.0e5, diagnosis__enabled=False)
    forecasts = stage.listen(f"{NODE}/forecast", DiagnosticArray)
    stage.legs("/left").play(walk, monitor, end_s=4.0)
    stage.wait_for(lambda: bool(forecasts), "a forecast")
    done = measure("A", "0.303", "--sigma", "0.005", "--node", NODE)
    assert done.exit_code == 1  # for this alone
    assert "contradicts" not in done.stdout and "at its limit" not in done.stdout
    assert done.stdout.endswith("it is not stored: no ledger is kept; set ledger.path\n")
    before = len(forecasts)
    answer = asked(stage, joint="A", clearance_m=3.2e-4, sigma_m=5.0e-6)
    assert answer.successful
    assert answer.reason.endswith("it is not stored: no ledger is kept; set ledger.path")
    stage.wait_for(lambda: len(forecasts) > before, "the forecast after the measurement")
    late = stage.listen(f"{NODE}/forecast", DiagnosticArray, latched=True)
    stage.wait_for(lambda: bool(late), "the last forecast, for who comes late")
    assert late == forecasts[-1:]
