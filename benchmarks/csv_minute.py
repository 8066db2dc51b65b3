"""A minute of a leg as a CSV file, and what the commands of docs/howto/csv.md make of it.

The leg walks in full coordinates at 57 rpm, with masses 4 % off its file; its encoder counts the other way
and has a zero of its own. `python benchmarks/csv_minute.py DIRECTORY` writes leg.csv and start.yaml there and
runs check, commission and replay as the page has them; times are those of the processor.
"""

import argparse
import resource
import subprocess
import sys
from pathlib import Path

import one_core  # noqa: F401, before numpy

# isort: split
import attrs
import numpy as np
from diagnosis import LEGS, NEW, truth

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import TORQUE, new_run_statistics, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.gait.config import PaceConfig
from leg_wear_monitor.gait.leg import Pace

RPM, RATE_HZ, NOISE_RAD, NOISE_NM = 57.0, 199.58, 1.0e-3, 0.5
OFFSET_RAD, BEGIN_MS = 0.7956, 1772352000000
START = """/**:
  ros__parameters:
    input:
      columns:
        stamp: t_ms
        crank_angle: angle_deg
        drive_torque: torque_Nmm
      units:
        stamp: ms
        crank_angle: deg
        drive_torque: N mm
"""


def rows(name: str, seconds: float, opened_m: dict[str, float]) -> np.ndarray:
    """Time [ms], angle [deg] and torque [N mm] as the encoder and the sensor of a leg have them."""
    leg, random = truth(load_mechanism("bionic_leg"), name), np.random.default_rng(3)
    setup, pace = prepare(leg), Pace(PaceConfig(speeds_rpm=(RPM,), ripple=LEGS[name].ripple))
    setup.contacts.clearance[:] = [opened_m.get(joint, NEW[0]) for joint in leg.clearance_joints]
    run, found = FullRun(attrs.evolve(setup, speed=pace.at(0.0).speed), tolerance_m=1e-9), []
    for i in range(round((seconds + 2.0) * RATE_HZ)):
        before, t = run.time, (i + 1) / RATE_HZ
        statistics = new_run_statistics(len(leg.joints))
        run.polynomial[:] = quintic(before, pace.at(before), t - before, pace.at(t))
        run.advance(t, statistics)
        torque = float(statistics.drive_integral[TORQUE]) / (t - before)
        found.append((t, pace.at(t).angle, torque))
    time, angle, torque = np.array(found)[round(2.0 * RATE_HZ) :].T
    angle = np.degrees(OFFSET_RAD - angle - NOISE_RAD * random.standard_normal(len(angle))) % 360.0
    torque = -1000.0 * (torque + NOISE_NM * random.standard_normal(len(torque)))
    return np.column_stack([BEGIN_MS + np.round(1000.0 * (time - 2.0)), angle, torque])


def run(folder: Path, *arguments: str) -> None:
    """Run a command of the page, and print what it prints and the processor time that it takes."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"\n$ leg-wear-monitor {' '.join(arguments)}", flush=True)
    command = [sys.executable, "-m", "leg_wear_monitor", *arguments]
    code = subprocess.run(command, cwd=folder, check=False).returncode
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"exit code {code}; processor {spent:.0f} s", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--leg", choices=list(LEGS), default="a")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--open", nargs=2, metavar=("JOINT", "MM"), help="a second CSV with an opened joint")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    opened = {"leg.csv": {}}
    if options.open:
        opened["opened.csv"] = {options.open[0]: 1e-3 * float(options.open[1])}
    for name, wide in opened.items():
        table, shape = rows(options.leg, options.seconds, wide), ("%d", "%.3f", "%.1f")
        names = "t_ms,angle_deg,torque_Nmm"
        np.savetxt(options.folder / name, table, shape, ",", header=names, comments="")
    (options.folder / "start.yaml").write_text(START)
    run(options.folder, "check", "start.yaml", "leg.csv")
    run(options.folder, "commission", "leg.csv", "--config", "start.yaml", "--out", "monitor.yaml")
    run(options.folder, "replay", "leg.csv", "--config", "monitor.yaml", "--out", "report/")
    if options.open:
        run(options.folder, "replay", "opened.csv", "--config", "monitor.yaml", "--out", "opened/")


if __name__ == "__main__":
    main()
