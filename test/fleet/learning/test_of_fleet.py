"""Learning from the ledgers of a fleet: what a leg gets from the measured clearances of others."""

import json
from pathlib import Path

import attrs
import ledger_contents
import pytest

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.fleet import renew
from leg_wear_monitor.fleet.description import FleetLeg
from leg_wear_monitor.fleet.directory import LegDirectory
from leg_wear_monitor.fleet.renew import learn_fleet
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.forecast.wear_coefficients import read_priors
from leg_wear_monitor.monitor.ledger.ledger import open_ledger

pytestmark = pytest.mark.plain

CONFIG = MonitorConfig()


def leg(name, lot="2026-03"):
    config = attrs.evolve(CONFIG, hardware_id=name)
    return FleetLeg(id=name, lot=lot, config=config, recordings=(), home=Path(), row="minute",
                    node=None, joint_states=None, drive_torque=None)  # fmt: skip


def measured(out, of, clearance_m, withdrawn=False):
    """Ledger of a leg with a measured clearance of joint A after 60 µm of counted wear."""
    path = LegDirectory(out, of.id).ledger
    path.parent.mkdir(parents=True)
    settings = attrs.evolve(of.config, ledger=attrs.evolve(of.config.ledger, path=str(path)))
    ledger = open_ledger(fitted(load_mechanism(settings.mechanism), settings), settings)
    ledger.note(ledger_contents.measured(clearance_m=clearance_m))
    ledger.record()
    ledger.close()
    if withdrawn:
        again = open_ledger(fitted(load_mechanism(settings.mechanism), settings), settings)
        again.withdraw(again.measurements[-1].id, 2, "ann")
        again.record()
        again.close()
    return path.read_bytes()


def test_a_new_leg_learns_from_the_ledgers_of_its_lot(tmp_path):
    legs = [leg("a"), leg("b"), leg("new"), leg("other", "2026-09")]
    before = [measured(tmp_path, one, 4.2e-4) for one in legs[:2]]
    found = learn_fleet(legs, tmp_path)
    priors, findings = found
    assert findings == ()
    own, other = (read_priors(str(priors[name])).joints["A"] for name in ("new", "other"))
    assert own.next == other.next  # of a part that will replace it, the lot is not known
    new, other = own.present, other.present
    assert (new.basis, other.basis) == ("2 parts of lot 2026-03", "2 parts of other lots")
    assert new.sigma < other.sigma
    # twice the nominal coefficients of bushing and journal, as measured
    assert 2e-15 < other.wear_coefficient_per_pa < new.wear_coefficient_per_pa < 4e-15
    assert [LegDirectory(tmp_path, one.id).ledger.read_bytes() for one in legs[:2]] == before
    again = learn_fleet(legs[::-1], tmp_path)
    assert again == found


def test_a_ledger_that_cannot_be_read_is_named_and_the_others_are_used(tmp_path):
    legs = [leg("a"), leg("broken"), leg("new")]
    measured(tmp_path, legs[0], 4.2e-4)
    broken = LegDirectory(tmp_path, "broken").ledger
    broken.parent.mkdir()
    broken.write_bytes(b"not a ledger")
    priors, ((name, text),) = learn_fleet(legs, tmp_path)
    assert name == "broken"
    assert text.startswith("nothing is learned from it: ")
    assert sorted(priors) == ["a", "new"]
    assert read_priors(str(priors["new"])).joints["A"].present.basis == "1 part of lot 2026-03"


def test_a_leg_with_accelerated_wear_teaches_nothing(tmp_path):
    fast = leg("fast")
    fast = attrs.evolve(fast, config=attrs.evolve(fast.config, wear_acceleration=5000.0))
    measured(tmp_path, fast, 4.2e-4)
    finding = "fast", "nothing is learned from it: its wear is accelerated"
    assert learn_fleet([fast, leg("new")], tmp_path) == ({}, (finding,))


def test_where_nobody_ever_measured_no_ledger_is_copied(tmp_path, monkeypatch):
    legs = [leg("a"), leg("b")]
    for one in legs:
        path = LegDirectory(tmp_path, one.id).ledger
        path.parent.mkdir(parents=True)
        settings = attrs.evolve(one.config, ledger=attrs.evolve(one.config.ledger, path=str(path)))
        open_ledger(fitted(load_mechanism(settings.mechanism), settings), settings).close()
    monkeypatch.setattr(renew, "copy_of", lambda path: pytest.fail(f"{path} is copied"))
    assert learn_fleet(legs, tmp_path) == ({}, ())
    assert json.loads((tmp_path / "learning.json").read_text())["pairs"] == {}


def test_when_the_only_measurement_is_withdrawn_the_priors_say_nothing(tmp_path):
    legs = [leg("a"), leg("b")]
    measured(tmp_path, legs[0], 4.2e-4, withdrawn=True)
    assert learn_fleet(legs, tmp_path) == ({}, ())
    assert dict(read_priors(str(LegDirectory(tmp_path, "b").priors)).joints) == {}
