"""The ledger on a disk that is full, then read-only, then neither: in a mount namespace of its own."""

import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(
    subprocess.run(
        ["unshare", "-rm", "mount", "-t", "tmpfs", "none", "/mnt"], check=False, capture_output=True
    ).returncode
    != 0,
    reason="no mount namespace may be made here",
)

STORY = """
import subprocess, sys
from pathlib import Path
import numpy as np
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.ledger.entry import AlarmEvent, Binding
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.monitor.ledger.entry import Entry, JointWear

place = Path(sys.argv[1])
mount = lambda options: subprocess.run(["mount", "-t", "tmpfs", "-o", options, "none", place], check=True)
mount("size=300k")
binding = Binding(hardware_id="x", mechanism="x", fingerprint="x", joints=("A",))
ledger = Ledger(place / "wear.ledger", binding, 5.0)
entry = lambda n: Entry(n, (JointWear("A", np.full((2, 720), 1.0 * n)),), {"cycles": 1.0 * n})
assert ledger.keep(entry(1)), ledger.fault

ballast = open(place / "ballast", "wb", buffering=0)
try:
    while ballast.write(bytes(4096)):
        pass
except OSError:
    ballast.close()
ledger.note(AlarmEvent(5, Alarm(kind="clearance", subject="A")))
failed = [n for n in range(2, 100) if not ledger.keep(entry(n))]
assert failed, "the disk was never full"
print("full:", ledger.fault)
(place / "ballast").unlink()

mount("remount,ro")  # possible since a ledger lets go of its file after a failed write
assert not ledger.keep(entry(100))
print("read-only:", ledger.fault)
mount("remount,rw")
assert ledger.keep(entry(101)), ledger.fault
assert [event.stamp_ns for event in ledger.alarm_history] == [5]
ledger.keep(entry(102), closed=True)
ledger.close()

mount("remount,ro")
ledger = Ledger(place / "wear.ledger", binding, 5.0)
print("started read-only:", ledger.fault)
assert ledger.entry.joints[0].depth[0, 0] == 102.0
assert not ledger.keep(entry(103))
mount("remount,rw")
assert ledger.keep(entry(104)), ledger.fault
ledger.close()
assert Ledger(place / "wear.ledger", binding, 5.0).entry.joints[0].depth[0, 0] == 104.0
"""


def test_a_full_and_a_read_only_disk_are_said_and_made_up_for(tmp_path):
    command = ["unshare", "-rm", sys.executable, "-c", STORY, str(tmp_path)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    full, read_only, started = done.stdout.splitlines()
    assert "full" in full
    assert "read" in read_only
    assert "readonly" in started
