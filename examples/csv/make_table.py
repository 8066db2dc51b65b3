"""Twelve seconds of a synthetic leg as a table, ``leg.csv``; its knee breaks after five."""

import csv
import sys
from pathlib import Path

import numpy as np

from leg_wear_monitor.gait.config import GaitConfig, KnockConfig
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.gait.sensors import readings

BEGIN_MS = 1_772_352_000_000  # since 1970
SECONDS = 12.0


def cell(value: float, digits: int) -> str:
    """A value as text; empty where nothing was measured."""
    return "" if np.isnan(value) else f"{value:.{digits}f}"


def main(path: Path) -> None:
    config = GaitConfig(seed=4, knock=KnockConfig(joint="G", at_s=5.0, clearance_m=2.0e-3))
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["t_ms", "angle_deg", "torque_Nmm"])
        for one in readings(SyntheticLeg(config), config):
            if one.taken_s > SECONDS:
                break
            angle, torque = np.degrees(one.crank_angle_rad), 1000.0 * one.torque_nm
            table.writerow([f"{BEGIN_MS + 1000.0 * one.taken_s:.3f}", cell(angle, 3), cell(torque, 1)])


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "leg.csv"))
