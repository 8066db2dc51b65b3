"""The page of a ledger: its verdict, while a monitor writes it; what cannot be read is said."""

import attrs
import numpy as np
import pytest
from html_reader import read, words

from leg_wear_monitor.dashboard import ledger_leg
from leg_wear_monitor.dashboard.ledger_leg import LedgerLeg
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.entry import (
    ClearancePoint,
    Entry,
    ForecastPoint,
    JointWear,
    Measurement,
    VerdictEvent,
    WalkedLoad,
    binding_of,
)
from leg_wear_monitor.monitor.ledger.file import LedgerError
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.state import Evidence, Figure, Level, State, Verdict
from leg_wear_monitor.wear import SECTORS

pytestmark = pytest.mark.plain

CONFIG = MonitorConfig(hardware_id="left")
LEG = fitted(load_mechanism("bionic_leg"), CONFIG)
SECOND = 10**9


def entry(second, worn_m=1.0e-5, alarms=()):
    depth = np.full((2, SECTORS), worn_m / 2.0)
    joints = tuple(JointWear(name, depth, second, float(second)) for name in LEG.clearance_joints)
    totals = {"cycles": float(second), "moving_s": float(second)}
    return Entry(second * SECOND, joints, totals, alarms, spans=((0, second * SECOND, 0),))


def verdict(stamp_s, state="healthy", **changes):
    found = Verdict(
        state=State(state), fault_code="NONE", joints=(), since_ns=stamp_s * SECOND, why="no alarm is raised",
        do="nothing now", evidence=(), not_valid=(),
    )  # fmt: skip
    return VerdictEvent(stamp_s * SECOND, attrs.evolve(found, **changes))


OPENED = {
    "fault_code": "CLEARANCE_G",
    "joints": ("G",),
    "why": "the counted clearance of joint G is 0.7 mm",
    "do": "replace it",
    "evidence": (Evidence("clearance G", 7e-4, 6e-4, "m"),),
    "not_valid": (Figure.FORECAST,),
}


@pytest.fixture
def ledger(tmp_path):
    """One that a monitor has open, and so locked."""
    ledger = Ledger(tmp_path / "wear.db", binding_of(LEG, CONFIG), interval_s=5.0)
    ledger.note(verdict(1))
    for joint in LEG.clearance_joints:
        ledger.note(ForecastPoint(10 * SECOND, 10, joint, 3600.0, 7200.0, 10_800.0))
        for second in (1, 5, 9):
            ledger.note(ClearancePoint(second * SECOND, second, joint, 3e-4 + 1e-6 * second, 3.1e-4))
    assert ledger.keep(entry(10))
    yield ledger
    ledger.close()


def leg_of(ledger, now_s=1e10):
    return LedgerLeg(ledger.path, CONFIG, LEG, lambda: now_s)


def test_the_page_is_the_verdict_of_the_ledger(ledger):
    leg = leg_of(ledger)
    content = leg.content()
    read(content.html)
    assert "HEALTHY" in content.regions["verdict"]
    assert "no alarm is raised" in content.regions["verdict"]
    joints = words(content.regions["joints"])
    assert "counted 0.310 mm" in joints and "limit 0.6 mm" in joints
    assert "2.00 h; 1.00 to 3.00 h" in joints  # a cycle a second
    assert "figure" in content.regions["trends"]
    assert "belief" not in content.regions  # a ledger does not know


def test_the_page_says_under_which_loads_the_leg_walked(ledger):
    assert "As the ledger has it." in words(leg_of(ledger).content().regions["trends"])
    loads = WalkedLoad(0, 7200, 7200.0, 0.0, 0.0), WalkedLoad(300, 43200, 43200.0, 290.0, 8.0)
    assert ledger.keep(attrs.evolve(entry(20), loads=loads))
    said = "As the ledger has it: walked 12 h at 290 N, 2 h at 0 N."
    assert said in words(leg_of(ledger).content().regions["trends"])


def test_what_the_monitor_writes_meanwhile_is_shown_and_its_files_are_left_alone(ledger):
    leg = leg_of(ledger)
    leg.content()
    assert not leg.renew()
    raised = Alarm(kind="clearance", subject="G", unit="m", level=Level.ERROR, present=Level.ERROR,
                   worst=7e-4, limit=6e-4)  # fmt: skip
    ledger.note(verdict(20, "stop", **OPENED))
    assert ledger.keep(entry(20, worn_m=4e-4, alarms=(raised,)))
    assert ledger.keep(entry(21, worn_m=4e-4, alarms=(raised,)), whole=False)
    before = {path.name: path.read_bytes() for path in ledger.path.parent.iterdir()}
    assert leg.renew()
    content = leg.content()
    found = words(content.regions["verdict"])
    assert "STOP" in found and "joint G (knee)" in found and "replace it" in found
    assert "clearance G 0.7 mm (limit 0.6 mm)" in found
    assert "ERROR clearance G (knee)" in words(content.regions["alarms"])
    assert "0.700 mm" in words(content.regions["joints"])
    assert {path.name: path.read_bytes() for path in ledger.path.parent.iterdir()} == before
    assert ledger.keep(entry(22))  # nothing stands in the monitor's way


def test_a_ledger_of_another_leg_and_no_ledger_are_refused(ledger, tmp_path):
    other = attrs.evolve(CONFIG, hardware_id="right")
    with pytest.raises(LedgerError, match=r"is of hardware id left, not right"):
        LedgerLeg(ledger.path, other, LEG, lambda: 0.0)
    foreign = tmp_path / "foreign.db"
    foreign.write_bytes(b"SQLite format 3\0" + bytes(500))
    with pytest.raises(LedgerError, match=r"foreign\.db: is an SQLite file, but not a ledger"):
        LedgerLeg(foreign, CONFIG, LEG, lambda: 0.0)
    with pytest.raises(LedgerError, match=r"none\.db: cannot be read"):
        LedgerLeg(tmp_path / "none.db", CONFIG, LEG, lambda: 0.0)


def test_a_ledger_that_is_damaged_meanwhile_is_said_and_the_page_stays(ledger):
    leg = leg_of(ledger)
    before = leg.content().regions
    whole = ledger.path.read_bytes()
    ledger.close()
    ledger.path.write_bytes(whole[:3000] + bytes(500) + whole[3500:])
    tries = [leg.renew() for _ in range(2 * ledger_leg._TRIES)]
    assert tries.count(True) == 1
    assert leg.content().regions == before
    assert leg.freshness().age_s is None
    assert "is damaged" in leg.freshness().silence
    ledger.path.write_bytes(whole)
    assert leg.renew()
    assert leg.freshness().age_s is not None


def test_the_age_is_that_of_the_file(ledger):
    written_s = ledger.path.stat().st_mtime
    found = leg_of(ledger, written_s + 90.0).freshness()
    assert 88.0 < found.age_s <= 91.0
    assert leg_of(ledger, written_s - 90.0).freshness().age_s == 0.0  # the disk's clock is another


def test_a_measurement_of_the_part_before_is_not_shown_for_the_present_one(ledger):
    old = Measurement(
        stamp_ns=11 * SECOND, joint="G", who="ann", clearance_m=5.5e-4, sigma_m=5e-6, wear_m=1e-5, cycles=10,
        replaced_ns=0, expected_below=0.9, counts=True,
    )  # fmt: skip
    ledger.note(old)
    assert ledger.keep(entry(12))
    assert leg_of(ledger)._view().clearances["G"].measured_m == 5.5e-4
    new = entry(14)
    joints = tuple(attrs.evolve(j, replaced_ns=13 * SECOND) if j.name == "G" else j for j in new.joints)
    assert ledger.keep(attrs.evolve(new, joints=joints))
    assert leg_of(ledger)._view().clearances["G"].measured_m is None
