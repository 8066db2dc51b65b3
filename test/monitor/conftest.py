"""Wear to be kept, without a leg that made it."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from leg_wear_monitor.monitor.alarms import Alarm, Level
from leg_wear_monitor.monitor.binding import Binding
from leg_wear_monitor.monitor.ledger import Ledger
from leg_wear_monitor.monitor.ledger_entry import Entry, JointWear

SECOND = 10**9


@pytest.fixture(scope="session")
def binding() -> Binding:
    """What the test ledgers are of."""
    return Binding(hardware_id="leg-7", mechanism="bionic_leg", fingerprint="00ff", joints=("A", "B"))


@pytest.fixture(scope="session")
def entry_at() -> Callable[[int], Entry]:
    """An entry after so many seconds, other at every one."""

    def entry(second: int) -> Entry:
        depth = np.random.default_rng(second).random((2, 2, 720)) * 1.0e-6
        return Entry(
            stamp_ns=second * SECOND,
            joints=tuple(
                JointWear(name, depth[k], second, 0.9 * second, k) for k, name in enumerate(("A", "B"))
            ),
            totals={"cycles": float(second), "moving_s": 0.9 * second},
            alarms=(Alarm(kind="clearance", subject="A", level=Level.WARN, acknowledged=second % 2 == 1),),
            spans=((0, second * SECOND),),
        )

    return entry


@pytest.fixture
def open_ledger(tmp_path: Path, binding: Binding) -> Iterator[Callable[..., Ledger]]:
    """Open the ledger of this test; whatever is open at its end is closed."""
    opened = []

    def open_(binding: Binding = binding, path: Path = tmp_path / "wear.ledger") -> Ledger:
        ledger = Ledger(path, binding, interval_s=5.0)
        opened.append(ledger)
        return ledger

    yield open_
    for ledger in opened:
        ledger.close()
