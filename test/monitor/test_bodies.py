"""Parameters that the drive torque shows: the twin walks with them, and the ledger keeps them."""

import attrs
import numpy as np
import pytest
from reported import status_of

from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.observer import TorqueObserver
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references
from leg_wear_monitor.monitor.wear_monitor import open_monitor
from leg_wear_monitor.twin.reference import LegParameters


@pytest.fixture
def found(leg, monkeypatch) -> LegParameters:
    """Parameters that each observer says it has identified."""
    factors = np.linspace(0.96, 1.04, len(leg.bodies))
    parameters = LegParameters(factors, 1.0 + 0.05 * (factors - 1.0), 1.5, 1.0 / 800.0, 0.07)
    monkeypatch.setattr(TorqueObserver, "parameters", parameters)
    return parameters


def config_of(path, correct: bool = True) -> MonitorConfig:
    config = MonitorConfig()
    ledger = attrs.evolve(config.ledger, path=str(path))
    return attrs.evolve(config, ledger=ledger, diagnosis=attrs.evolve(config.diagnosis, correct=correct))


def test_the_twin_walks_on_with_identified_parameters_and_the_ledger_keeps_them(
    leg, gait, tmp_path, found, monkeypatch
):
    """And the reference that was simulated for them."""
    config, shipped = config_of(tmp_path / "wear.ledger"), shipped_references(leg)[0]
    monkeypatch.setattr(TorqueObserver, "simulated_references", (shipped,))
    monitor = open_monitor(leg, config)
    monitor.update(gait(2.5))
    assert monitor._parts.twin.parameters == found
    assert [body.mass for body in monitor.diagnosis.bodies] == found.mass.tolist()
    status = status_of(monitor, "diagnosis")
    assert "counted with the masses, lengths and friction" in status.message
    assert status.values["thigh_mass_factor"] == found.mass[list(leg.bodies).index("thigh")]
    assert status.values["joint_friction_factor"] == monitor.diagnosis.friction == 1.5
    assert status.values["drive_stiffness_nm_per_rad"] == pytest.approx(800.0)
    monitor.close()
    again = open_monitor(leg, config)
    assert again._parts.twin.parameters == found
    assert again._parts.torque.state.parameters == found
    (kept, *_) = again._parts.torque._references._given
    np.testing.assert_array_equal(kept.torque_nm[3], shipped.torque_nm[3])
    assert kept.parameters == LegParameters.none(leg)
    again.close()


def test_without_corrections_the_twin_keeps_the_parameters_of_its_file(leg, gait, tmp_path, found):
    config = config_of(tmp_path / "wear.ledger", correct=False)
    monitor = open_monitor(leg, config)
    monitor.update(gait(2.5))
    assert monitor._parts.twin.parameters == LegParameters.none(leg)
    assert monitor.diagnosis.bodies == ()
    monitor.close()
