"""From a stop by the drive torque to the repair: latched, acknowledged, measured, replaced, restarted."""

import json
import math

import pytest

from leg_wear_monitor import WearMonitor, open_ledger
from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis, DiagnosisState
from leg_wear_monitor.monitor.parts import Parts
from leg_wear_monitor.state import SCHEMA_VERSION, LegState, State

START_NS = 1_700_000_000_123_456_789
WAITING = Diagnosis(state=DiagnosisState.WAITING, reason="not enough gait cycles")


def shown(clearance_m: float, sigma_m: float) -> Diagnosis:
    """What the drive torque shows for some time: G, and nothing of A."""
    return Diagnosis(
        state=DiagnosisState.CHANGED,
        clearance_m=(math.nan, clearance_m),
        sigma_m=(math.nan, sigma_m),
        least_m=(math.nan, clearance_m - 2.0 * sigma_m),
    )


class Leg:
    """A monitor on the ledger of a test, whose drive torque shows what the test says."""

    def __init__(self, leg, path, gait, monkeypatch):
        values = {"ledger.path": str(path), "clearance_joints": ["A", "G"], "diagnosis.enabled": False}
        self.config, self._leg, self._gait, self._now_s = config_from(values), leg, gait, 0.0
        self.torque = WAITING
        monkeypatch.setattr(Parts, "diagnosis", property(lambda _: self.torque))
        self.begin()

    def begin(self):
        self.monitor = WearMonitor(self._leg, self.config, open_ledger(self._leg, self.config))

    def restart(self):
        self.monitor.close()
        self.begin()

    def walks(self, torque, seconds=2.5):
        """Let it walk on; all verdicts that were reported, in short."""
        self.torque = torque
        reports = self.monitor.update(self._gait(seconds, begin_s=self._now_s))
        self._now_s += seconds
        return [(one.verdict.state.value, one.verdict.fault_code) for one in reports.verdicts]

    @property
    def verdict(self):
        return self.monitor.verdict.verdict

    @property
    def joint(self):
        return next(one for one in self.monitor.status() if one.name == "joint G")

    @property
    def alarms(self):
        """Those of the clearances: that of an impact force may rise by chance."""
        return [one.name for one in self.monitor.alarms.alarms if one.level and one.kind == "clearance"]


@pytest.fixture
def walker(leg, tmp_path, gait, monkeypatch):
    """A leg that walks, with a torque that shows nothing yet."""
    made = Leg(leg, tmp_path / "wear.ledger", gait, monkeypatch)
    made.walks(WAITING)
    yield made
    made.monitor.close()


def test_a_stop_stays_over_unsure_estimates_and_a_restart_until_it_is_acknowledged(walker):
    changes = walker.walks(shown(2.05e-3, 3e-4))
    assert changes[-1] == ("stop", "CLEARANCE_SEEN_G")
    for torque in (WAITING, shown(1.43e-3, 6e-4), WAITING, shown(2.1e-3, 2e-4), WAITING):
        assert walker.walks(torque) == []
    knee = walker.monitor.state.clearances["G"]
    assert (knee.believed_m, knee.believed_sigma_m, knee.believed_by) == (2.1e-3, 2e-4, "torque")
    assert knee.status is State.STOP
    walker.restart()
    assert walker.walks(WAITING)[-1] == ("stop", "CLEARANCE_SEEN_G")
    assert "2.1 mm ± 0.2 mm" in walker.verdict.why
    assert walker.joint.message.startswith("stop: 2.1 mm ± 0.2 mm according to the drive torque")
    cleared, _ = walker.monitor.acknowledge(START_NS)
    assert ([one.name for one in cleared], walker.alarms) == (["clearance G"], [])
    assert walker.verdict.state.value != "stop"


def test_after_a_restart_a_stop_that_is_acknowledged_stays_until_the_torque_shows_the_joint(
    walker, monkeypatch
):
    monkeypatch.setattr(Parts, "unmeasured", frozenset())  # as while the torque is read
    walker.walks(shown(2.05e-3, 3e-4))
    walker.restart()
    walker.walks(WAITING)
    cleared, kept = walker.monitor.acknowledge(START_NS)
    assert (cleared, [one.name for one in kept if one.kind == "clearance"]) == ((), ["clearance G"])
    assert walker.walks(WAITING) + walker.walks(shown(6.5e-4, 1e-4)) == []
    assert walker.verdict.fault_code == "CLEARANCE_SEEN_G"
    walker.walks(shown(3.1e-4, 2e-5))
    assert (walker.alarms, walker.verdict.state is State.STOP) == ([], False)


def test_each_gait_cycle_and_each_verdict_has_a_state_of_the_leg_that_says_the_same(walker):
    walker.torque = shown(2.05e-3, 3e-4)
    reports = walker.monitor.update(walker._gait(2.5, begin_s=walker._now_s))
    assert len(reports.states) >= len(reports.cycles) >= 2
    last = reports.states[-1].state
    assert (last.verdict, last.life_cycles) == (walker.verdict, reports.cycles[-1].cycle)
    knee, hip = last.clearances["G"], last.clearances["A"]
    assert (knee.believed_m, knee.believed_by, knee.status) == (2.05e-3, "torque", State.STOP)
    assert knee.counted_m < knee.limit_m
    assert hip.status is not State.STOP
    record = json.loads(last.to_json())
    assert record.pop("schema_version") == SCHEMA_VERSION
    assert structure(record, LegState, "a state", "") == last


def test_a_restored_monitor_tells_the_same_of_a_latched_stop(walker):
    walker.walks(shown(2.05e-3, 3e-4))
    kept = walker.monitor.snapshot()
    walker.walks(WAITING)
    walker.monitor.acknowledge(START_NS)
    walker.monitor.restore(kept)
    walker.torque = WAITING
    assert walker.verdict.fault_code == "CLEARANCE_SEEN_G"
    assert walker.monitor.state.clearances["G"].believed_m == 2.05e-3


def test_a_measurement_that_contradicts_ends_the_stop_and_says_so(walker):
    walker.walks(shown(2.05e-3, 3e-4))
    found = walker.monitor.measure("knee", 3.1e-4, 1e-5, START_NS, "ann")
    text = "; ".join(found.lines(6e-4, 0.8, ()))
    assert "the drive torque showed 2.05 mm ± 0.3 mm, and this measurement contradicts it" in text
    assert walker.verdict.state.value != "stop"
    assert walker.walks(shown(2.05e-3, 3e-4)) == []  # the same estimate says nothing new
    walker.restart()
    assert ("stop", "CLEARANCE_SEEN_G") not in walker.walks(WAITING) + walker.walks(shown(2.05e-3, 3e-4))
    walker.walks(shown(3.1e-4, 2e-5))
    assert walker.alarms == []
    assert ("stop", "CLEARANCE_SEEN_G") in walker.walks(shown(2.05e-3, 3e-4))  # it breaks afterwards


def test_a_measurement_that_agrees_says_so_and_the_stop_stays(walker):
    walker.walks(shown(2.05e-3, 3e-4))
    found = walker.monitor.measure("G", 2.0e-3, 5e-5, START_NS, "ann")
    lines = found.lines(6e-4, 0.8, ())
    assert "this agrees with what the drive torque shows, 2.05 mm ± 0.3 mm" in lines
    assert not any("contradicts" in line for line in lines)
    assert walker.verdict.state.value == "stop"


def test_a_reset_ends_what_rested_on_the_old_part_and_asks_to_confirm(walker):
    walker.walks(shown(2.05e-3, 3e-4))
    walker.torque = WAITING
    done = walker.monitor.reset_wear("G", START_NS, "ann")
    assert (done.cleared, walker.alarms) == (("clearance G",), [])
    verdict = walker.verdict
    assert (verdict.state.value, verdict.fault_code) == ("watch", "PART_REPLACED_G")
    assert "joint G (knee) was replaced on 2023-11-14" in verdict.why
    assert verdict.do.startswith("confirm by walking")
    walker.walks(WAITING, 8.0)
    assert walker.alarms == []
    walker.walks(WAITING, 15.0)
    assert walker.verdict.fault_code != "PART_REPLACED_G"
