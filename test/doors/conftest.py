"""The command line through its own door, and the fields that are promised."""

import json
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import attrs
import command_line
import numpy as np
import pytest
from json_fields import is_of, leaves

import leg_wear_monitor as lw

if not (find_spec("mcap") and find_spec("rosbags")):  # the extra `bags` is not installed
    collect_ignore = [
        f"test_{name}.py" for name in ("diagnosis", "exit_codes", "fleet", "kills", "sample_bags")
    ]

RATE_HZ, PER_SAMPLE = 200, 4  # samples per second of a table; instants of the simulation per sample
NEW_M = 3.0e-4

Columns = dict[str, np.ndarray]


@pytest.fixture(scope="session")
def run() -> Callable[..., command_line.Done]:
    """Call the command line in this process."""
    return command_line.run


@pytest.fixture(scope="session")
def unknown() -> Callable[[str, Any], set[str]]:
    """What a document has beside the fields that are kept."""
    lines = (Path(__file__).parent / "kept" / "fields.txt").read_text().splitlines()
    fields = [line.split(": ", 2)[:2] for line in lines]

    def find(name: str, document: Any) -> set[str]:
        paths = [path.removesuffix("[]") for kind, path in fields if kind == name]
        return {leaf for leaf in set(leaves(document)) if not any(is_of(path, leaf) for path in paths)}

    return find


@pytest.fixture(scope="session")
def leg() -> lw.Mechanism:
    """The default leg."""
    return lw.load_mechanism("bionic_leg")


@pytest.fixture(scope="session")
def torque_of(leg: lw.Mechanism) -> Callable[..., np.ndarray]:
    """Drive torque [N m] of the leg in full coordinates at 60 rpm; every call with new values simulates."""

    @cache
    def torque(cycles: int, **radial_clearance_m: float) -> np.ndarray:
        clearances = {
            joint: attrs.evolve(each, radial_clearance=radial_clearance_m.get(joint, NEW_M))
            for joint, each in leg.clearances.items()
        }
        wide = attrs.evolve(leg, clearances=clearances)
        trace = lw.simulate(wide, model="full", cycles=cycles, trace=RATE_HZ * PER_SAMPLE).trace
        return trace.drive_torque_nm

    return torque


@pytest.fixture(scope="session")
def table() -> Callable[..., Columns]:
    """Table of a walk at 60 rpm with this torque: means since the sample before, and noise of the sensors."""

    def make(*torque_nm: np.ndarray, noise_nm: float = 0.05) -> Columns:
        torque, noise = np.concatenate(torque_nm), np.random.default_rng(0)
        k = np.arange(1, len(torque) // PER_SAMPLE)
        means = torque[1 : 1 + len(k) * PER_SAMPLE].reshape(-1, PER_SAMPLE).mean(axis=1)
        return {
            "time": 1.0 + k / RATE_HZ,
            "crank_angle": 2.0 * np.pi * k / RATE_HZ + noise.normal(0.0, 2.0e-4, len(k)),
            "drive_torque": means + noise.normal(0.0, noise_nm, len(k)),
        }

    return make


@pytest.fixture(scope="session")
def parameters(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Write a parameter file of the monitor: names with ``__`` for the dots, and their values."""

    def write(**values: Any) -> Path:
        path = tmp_path_factory.mktemp("parameters") / "monitor.yaml"
        named = {name.replace("__", "."): value for name, value in values.items()}
        path.write_text(json.dumps({"/**": {"ros__parameters": named}}))
        return path

    return write
