"""Recordings of short walks, and fleets of them."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from campaign.warm_twin import keep_twin
from short_walk import torque_of_a_cycle, write_walk

import leg_wear_monitor as lw
from leg_wear_monitor.fleet.description import load_fleet
from leg_wear_monitor.fleet.update import FleetUpdate, update_fleet
from leg_wear_monitor.monitor import parts


@pytest.fixture(scope="session")
def walk(leg: lw.Mechanism) -> Callable[..., Path]:
    """Write a recording of a steady gait that begins some seconds after the others' origin."""
    return partial(write_walk, torque_of_a_cycle(leg))


@pytest.fixture(scope="module")
def one_twin() -> Iterator[None]:
    """All updates in this process take one twin, as new each time: to build one takes half of an update."""
    made = parts.DigitalTwin
    keep_twin()
    yield
    parts.DigitalTwin = made


@pytest.fixture(scope="session")
def describe() -> Callable[..., Path]:
    """Write a fleet.yaml; a leg's recordings are in a directory of its name."""

    def write(home: Path, *legs: str, **more: Any) -> Path:
        entries = [f'  - {{id: {leg}, recordings: "{leg}/*"}}\n' for leg in legs]
        head = "".join(f"{key}: {value}\n" for key, value in more.items())
        path = home / "fleet.yaml"
        path.write_text(f"{head}legs:\n{''.join(entries)}")
        return path

    return write


@pytest.fixture(scope="session")
def update() -> Callable[..., FleetUpdate]:
    """Update a fleet."""
    pytest.importorskip("pyarrow")

    def run(path: Path, out: Path, **options: Any) -> FleetUpdate:
        return update_fleet(load_fleet(path), out, **options)

    return run
