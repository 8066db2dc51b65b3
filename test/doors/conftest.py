"""The command line through its own door, and the fields that are promised."""

import json
import runpy
import signal
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from typing import Any
from unittest.mock import patch

import attrs
import numpy as np
import pytest
from json_fields import is_of, leaves

import leg_wear_monitor as lw

if not (find_spec("mcap") and find_spec("rosbags")):  # the extra `bags` is not installed
    collect_ignore = [
        f"test_{name}.py" for name in ("diagnosis", "exit_codes", "fleet", "kills", "sample_bags")
    ]

FAULTS = ("error: ", "warning: ", "note: ")

RATE_HZ, PER_SAMPLE = 200, 4  # samples per second of a table; instants of the simulation per sample
NEW_M = 3.0e-4

Columns = dict[str, np.ndarray]


@attrs.frozen
class Done:
    """Exit code, stdout, and the lines on stderr that tell of a fault."""

    code: int
    out: str
    lines: list[str]


@pytest.fixture(scope="session")
def run() -> Callable[..., Done]:
    """Call ``python -m leg_wear_monitor`` in this process, which has loaded the kernels already."""

    def call(*arguments: object) -> Done:
        out, err, code = StringIO(), StringIO(), 0
        handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
        line = ["leg-wear-monitor", *map(str, arguments)]
        try:
            with patch.object(sys, "argv", line), redirect_stdout(out), redirect_stderr(err):
                runpy.run_module("leg_wear_monitor", run_name="__main__", alter_sys=True)
        except SystemExit as end:
            code = int(end.code or 0)
        finally:
            for number, handler in handlers.items():
                signal.signal(number, handler)
        lines = err.getvalue().splitlines()
        return Done(code, out.getvalue(), [line for line in lines if line.startswith(FAULTS)])

    return call


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
