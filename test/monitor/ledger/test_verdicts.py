"""Verdicts, identified legs and simulated references in the ledger."""

import math

import attrs
import numpy as np
import pytest

from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references
from leg_wear_monitor.monitor.ledger.entry import IdentifiedLeg, SimulatedReference, VerdictEvent
from leg_wear_monitor.state import Evidence, Figure, State, Verdict
from leg_wear_monitor.twin.reference import LegParameters

pytestmark = pytest.mark.plain

LOAD_N = np.outer(np.arange(128.0), [0.1, 1.0])
VERDICT = Verdict(
    state=State.INSPECT,
    joints=("G",),
    why="the drive torque shows a clearance",
    since_ns=5,
    do="rock joint G",
    evidence=(Evidence("clearance G", 1e-3, math.nan, "m"),),
    not_valid=(Figure.FORECAST,),
    fault_code="CLEARANCE_CHANGED_G",
)


def test_a_verdict_is_a_row_and_is_read_as_written(reopened, rows):
    found = reopened(VerdictEvent(7, VERDICT))
    assert found.last_verdict == VERDICT
    found.close()
    (row,) = rows("SELECT stamp_ns, state, fault_code, joints, evidence, not_valid FROM verdict")
    evidence = '[{"name": "clearance G", "value": 0.001, "limit": null, "unit": "m"}]'
    assert row == (7, "inspect", "CLEARANCE_CHANGED_G", '["G"]', evidence, '["forecast"]')


def test_an_identified_leg_is_read_as_written_and_the_last_is_in_force(reopened):
    legs = []
    for stamp_ns, mass in ((5, 1.1), (7, 0.9)):
        bodies = np.array([mass, 1.02]), np.array([0.998, 1.001])
        leg = LegParameters(*bodies, 2.0 * mass, 0.5 * mass, 0.1 * mass, mass * LOAD_N, 0.2 * mass)
        legs.append(IdentifiedLeg(stamp_ns, ("thigh", "foot"), leg))
    found = reopened(*legs).parameters
    assert found == legs[-1]
    assert found.parameters.load_sigma == leg.load_sigma


def test_a_simulated_reference_is_read_as_written_and_the_last_is_in_force(reopened, leg):
    shipped = shipped_references(leg)[0]
    factors = 1.0 + 0.01 * np.arange(len(leg.bodies))
    other = attrs.evolve(
        shipped,
        profile=attrs.evolve(shipped.profile, sine=np.linspace(0.0, 0.01, len(shipped.profile.sine))),
        parameters=LegParameters(factors, 2.0 - factors, 1.7, 2.0e-3, 0.08, LOAD_N, 0.2),
    )
    made = [SimulatedReference(at, tuple(leg.bodies), one) for at, one in ((5, shipped), (7, other))]
    (found,) = reopened(*made).references  # of the same cadence
    assert (found.stamp_ns, found.bodies) == (7, tuple(leg.bodies))
    assert found.reference.parameters == other.parameters
    assert found.reference.parameters.load_sigma == other.parameters.load_sigma
    assert found.reference.profile.departure(other.profile) == 0.0
    np.testing.assert_array_equal(found.reference.clearance_m, other.clearance_m)
    for one, same in zip(found.reference.torque_nm, other.torque_nm, strict=True):
        np.testing.assert_array_equal(one, same)
