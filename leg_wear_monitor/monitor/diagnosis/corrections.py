"""Counted clearances that are surely wrong, and what becomes of the evidence when they are corrected."""

from collections.abc import Sequence
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import Change
from leg_wear_monitor.estimate.commissioned_torque import CommissionedTorque
from leg_wear_monitor.estimate.signature import DIRECT
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.diagnosis.evidence import SETTLING_CYCLES
from leg_wear_monitor.monitor.diagnosis.state import TorqueState

# of the counted clearance: smaller openings are named wrongly where masses are 5 % off (diagnosis.md)
CORRECTED_FROM = 1.3


class Correction(NamedTuple):
    """A counted clearance that is surely wrong: joint index, its clearance [m], and the change behind it."""

    joint: int
    clearance_m: float
    change: Change


def correction_of(state: TorqueState, joints: Sequence[str]) -> Correction | None:
    """A settled change of one clearance, seen at the present cadence."""
    if not state.changes or state.fit_cycles < SETTLING_CYCLES or not state.is_compared:
        return None
    change = state.changes[-1]
    if sum(cycle.begin_ns >= change.since_ns for cycle in state.cycles) < SETTLING_CYCLES:
        return None
    is_wide = change.value >= CORRECTED_FROM * change.counted
    if change.subject not in joints or not change.is_sure or not is_wide:
        return None
    return Correction(joints.index(change.subject), change.value, change)


def settle(state: TorqueState, correction: Correction, counted_m: Floats) -> None:
    """Make the gait cycles since a change those of the commissioned leg, with clearances (k,) [m].

    What the correction is off does then not look like a further change; it stays in the standard deviation.
    """
    joint, _, change = correction
    state.cycles = tuple(cycle for cycle in state.cycles if cycle.begin_ns >= change.since_ns)
    signatures, before = state.signatures, state.commissioned
    sigma_m = before.sigma_m.copy() if before else np.zeros(len(counted_m))
    sigma_m[joint] = change.sigma
    state.forget_baselines()
    state.commissioned = CommissionedTorque(
        state.cycles[-1].end_ns,
        counted_m,
        signatures,
        sigma_m,
        before.channel if before else DIRECT,
        state.profile.speed,
    )
    state.settled = (*state.settled, attrs.evolve(change, is_corrected=True))
