"""Renew the recordings in bags/ with the synthetic leg and the monitor, as two ROS processes."""

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import attrs
from mcap.reader import make_reader

import leg_wear_monitor as lw
from leg_wear_monitor.recordings.mcap_file import McapWriter

ROOT = Path(__file__).parents[1]
DOMAIN = "77"

# Parameters of the leg for each recording; the monitor's parameters are in bags/NAME.yaml.
BAGS: dict[str, dict[str, object]] = {
    "healthy": {},
    "knocking": {"knock.joint": "G", "knock.at_s": 5.0, "knock.clearance_m": 2.0e-3},
    "bad_input": {
        "transport.drop_fraction": 0.05,
        "transport.duplicate_fraction": 0.02,
        "transport.late_fraction": 0.02,
        "transport.fault_fraction": 0.06,
        "transport.gaps_s": [4.0],
        "transport.gap_s": 0.8,
    },
    # the diagnosis knows the ground's force after 93 s; the drive's clock is 0.2 % off, so that samples drift
    "ground": {
        "duration_s": 98.0,
        "load.ground_n": 300.0,
        "knock.joint": "G",
        "knock.at_s": 62.0,
        "knock.clearance_m": 6.0e-4,
        "encoder.rate_hz": 199.6,
        "torque_sensor.source": "effort",
        "torque_sensor.resolution_nm": 0.0625,
    },
}
INPUTS_ONLY = ("ground",)  # the monitor's messages would be four fifths of a longer recording
JOINT_STATES = "/joint_states"
LEG = {"duration_s": 12.0, "seed": 4, "wait_for_subscribers": 1}
PATIENCE_S = 300.0


def start(verb: str, parameters: dict[str, object], *further: str) -> subprocess.Popen[bytes]:
    """A node as a process of its own."""
    # rcl also takes JSON for a value.
    settings = [word for name, value in parameters.items() for word in ("-p", f"{name}:={json.dumps(value)}")]
    environment = {
        **os.environ,
        "ROS_DOMAIN_ID": DOMAIN,
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "AMENT_PREFIX_PATH": sys.prefix,
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(ROOT / "test" / "ros" / "fast_discovery.xml"),
    }
    command = [sys.executable, "-m", "leg_wear_monitor", verb, "--ros-args", *further, *settings]
    return subprocess.Popen(command, env=environment, cwd=ROOT)


def record(name: str, path: Path, parameters: Path) -> None:
    """One recording."""
    path.unlink(missing_ok=True)  # otherwise the monitor would keep the old file under a new name
    monitor = start("monitor", {"record.path": str(path)}, "--params-file", str(parameters))
    try:
        leg = start("gait-publisher", LEG | BAGS[name])
        if leg.wait(PATIENCE_S) != 0:
            raise SystemExit(f"{name}: the leg ended with {leg.returncode}")
        time.sleep(2.0)  # messages in transit arrive
    finally:
        monitor.send_signal(signal.SIGINT)
        monitor.wait(PATIENCE_S)
    if name in INPUTS_ONLY:
        keep_joint_states(path)


def keep_joint_states(path: Path) -> None:
    """Leave all other topics out of a recording."""
    with path.open("rb") as file:
        kept = [each[2] for each in make_reader(file).iter_messages(topics=[JOINT_STATES])]
    with McapWriter(path) as writer:
        channel = writer.channel(JOINT_STATES, "sensor_msgs/msg/JointState")
        for message in kept:
            writer.write(channel, message.log_time, message.data)


def expectation(path: Path, parameters: Path) -> dict[str, Any]:
    """Expected results of a replay: counts, alarms, and of chaotic values the repeatable ones."""
    found = lw.replay(path, parameters).summary()
    raised = {f"{change.alarm.name}: {change.alarm.level.name}" for change in found.alarms.changes}
    return {
        "crank_samples": found.recording.crank_samples,
        "torque_samples": found.recording.torque_samples,
        "findings": [finding.text for finding in found.recording.findings],
        "cycles": found.cycles,
        "lost": attrs.asdict(found.lost),
        "alarms": sorted(raised),
        "verdict": {
            "state": found.verdict.state.value,
            "fault_code": found.verdict.fault_code,
            "not_valid": [figure.value for figure in found.verdict.not_valid],
        },
        "mean_force_n": {name: joint.mean_force_n for name, joint in found.joints.items()},
        "opened_m": {name: joint.opened_m for name, joint in found.joints.items()},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=list(BAGS), help=f"of {', '.join(BAGS)}")
    parser.add_argument("--out", type=Path, default=ROOT / "bags")
    arguments = parser.parse_args()
    for name in arguments.names:
        path, parameters = arguments.out / f"{name}.mcap", ROOT / "bags" / f"{name}.yaml"
        record(name, path, parameters)
        expected = json.dumps(expectation(path, parameters), indent=1)
        path.with_suffix(".json").write_text(expected + "\n")
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB\n{expected}")


if __name__ == "__main__":
    main()
