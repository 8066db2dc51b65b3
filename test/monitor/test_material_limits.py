"""Loads of the joints in the monitor, against the limits of their materials."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from reported import raised, status_of
from ruamel.yaml import YAML

import leg_wear_monitor as lw
from leg_wear_monitor.mechanism.loader import shipped_mechanisms
from leg_wear_monitor.monitor.forecast.forecast import Answer
from leg_wear_monitor.state import Figure, Level

SECONDS = 8


def leg_with(path: Path, pressure_speed: float | None, material: str = "") -> lw.Mechanism:
    """The default leg whose joint A has a pair of its own with this limit, or a pair of the package."""
    yaml, source = YAML(), {"source": "a test", "conditions": "none"}
    document: dict[str, Any] = {"name": "own", "title": "own", "lubricant": "grease", "regime": "greased"}
    for side in ("bushing", "journal"):
        wear = {"value": 1e-15, "unit": "1/Pa", **source}
        document[side] = {"material": "steel", "wear_coefficient": wear}
    if pressure_speed is not None:
        limit = {"value": pressure_speed, "unit": "Pa m/s", **source}
        document["limits"] = {"pressure_speed": limit}
    yaml.dump(document, path / "own.yaml")
    leg = YAML(typ="safe").load(shipped_mechanisms()["bionic_leg"])
    own = {"material": material or str(path / "own.yaml")}
    leg["clearances"]["joints"] = {"A": own, "B": {}, "G": {}, "I": {}, "J": {}}
    yaml.dump(leg, path / "leg.yaml")
    return lw.load_mechanism(path / "leg.yaml")


def walked(leg: lw.Mechanism) -> lw.WearMonitor:
    """A monitor after some gait cycles at 60 rpm."""
    monitor = lw.WearMonitor(leg)
    stamps_ns = 1_000_000_000 + 5_000_000 * np.arange(200 * SECONDS)
    monitor.update(lw.gait_samples(stamps_ns, crank_angle_rad=2e-9 * np.pi * stamps_ns))
    return monitor


def test_a_joint_beyond_a_limit_has_no_valid_growth_nor_life(tmp_path):
    """Joint A rubs with about 24 kPa m/s when new (config/lives); the limit is 1 kPa m/s."""
    monitor = walked(leg_with(tmp_path, 1.0e3))
    values, verdict = status_of(monitor, "joint A").values, monitor.verdict.verdict
    assert values["mean_pressure_speed_pa_mps"] == pytest.approx(2.4e4, rel=0.25)
    assert values["pressure_speed_limit_pa_mps"] == 1.0e3
    assert "pressure_limit_pa" not in values
    pressure = values["mean_force_n"] / (2.0 * 0.010 * 0.020)
    assert values["mean_pressure_pa"] == pytest.approx(pressure)
    assert {Figure.GROWTH, Figure.FORECAST} <= set(verdict.not_valid)
    (finding,) = [each for each in monitor.verdict.findings if each.code == "MATERIAL_LIMIT"]
    assert finding.joints == ("A",)
    assert "outside the limits of" in finding.why
    assert "p v" in finding.why
    evidence = {each.name: each for each in finding.evidence}
    assert evidence["p v A"].limit == 1.0e3
    assert evidence["p v A"].value == pytest.approx(values["mean_pressure_speed_pa_mps"])
    assert {name for name in raised(monitor, Level.WARN) if "material" in name} == {"material_limit A"}
    assert monitor.renew_forecast().joints[0].forecast.answer is Answer.OUTSIDE_VALIDITY


def test_a_joint_within_its_limits_is_all_right_and_one_without_coefficient_says_so(tmp_path):
    """DU has limits and no coefficient: no wear is counted, and no life is known."""
    monitor = walked(leg_with(tmp_path, None, "du-on-steel-dry"))
    values = status_of(monitor, "joint A").values
    assert values["pressure_speed_limit_pa_mps"] == 1.8e6
    assert values["mean_pressure_speed_pa_mps"] < 1.8e6
    assert not [each for each in monitor.verdict.findings if each.code == "MATERIAL_LIMIT"]
    last = monitor.renew_forecast()
    assert last.joints[0].forecast.answer is Answer.NO_COEFFICIENT
    assert last.joints[0].forecast.prior.holds_for == "du-on-steel-dry (dry)"
    assert last.forecast.answer in (Answer.PARTLY_KNOWN, Answer.NOT_ENOUGH_DATA)
