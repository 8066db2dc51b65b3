"""The joints for which a recorded torque is good enough, by the reference that the monitor would use."""

import math
from collections.abc import Callable
from pathlib import Path

import attrs

from leg_wear_monitor.commissioning.evidence.detection import joint_detections
from leg_wear_monitor.commissioning.evidence.walk import LEAST_CYCLES, Walk
from leg_wear_monitor.commissioning.result.commissioning_result import CommissioningResult
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.config.parameters import config_from, values_of
from leg_wear_monitor.monitor.diagnosis.reference_file import (
    read_references,
    shipped_references,
    simulated_under,
)
from leg_wear_monitor.monitor.diagnosis.references import FIRST_CYCLES
from leg_wear_monitor.twin.reference.torque_reference import CYCLES, PACE, WIDER, TorqueReference

_PERIODS = 4  # evaluation periods in a gait cycle
_SETTLING = 2  # simulated gait cycles of a leg that do not count


def with_detections(
    result: CommissioningResult,
    walk: Walk,
    file: str | Path | None,
    progress: Callable[[float], None] = lambda _fraction: None,
) -> CommissioningResult:
    """The result with what the torque will show of each joint.

    Parameters
    ----------
    result : CommissioningResult
        With proposed parameters.
    walk : Walk
    file : str, pathlib.Path or None
        For a reference that is to be simulated; None: one that is there already is taken.
    progress : callable

    Raises
    ------
    ConfigError
        If the file of the parameter ``diagnosis.reference`` cannot be read.
    LegWearError
        If a reference is asked for and cannot be simulated.
    """
    if len(walk.cycles) < LEAST_CYCLES or result.config is None:
        if file is not None:
            raise LegWearError(
                f"--reference: the recording has {len(walk.cycles)} gait cycles at "
                f"{walk.config.cadence.commanded_rpm:g} rpm with torques, expected at least {LEAST_CYCLES}"
            )
        told = f"joints are not judged: fewer than {LEAST_CYCLES} gait cycles at the commanded cadence"
        return attrs.evolve(result, reference_used=told)
    if file is not None:
        (made,) = simulated_under(walk.mechanism, [walk.profile], progress)
        values = {**values_of(result.config), "diagnosis.reference": str(file)}
        result = attrs.evolve(result, reference=made, config=config_from(values, "commission"))
        told = f"simulated for this recording, {file}"
        return attrs.evolve(result, joints=joint_detections(walk, made), reference_used=told)
    known, told = _known(walk)
    if known is None:
        return attrs.evolve(result, reference_used=_none(walk))
    return attrs.evolve(result, joints=joint_detections(walk, known), reference_used=told)


def _known(walk: Walk) -> tuple[TorqueReference | None, str]:
    """A reference of this leg for the recorded motion of its crank, and where it is from."""
    path = walk.config.diagnosis.reference
    given = read_references(Path(path), walk.mechanism) if path else ()
    for one in (*given, *shipped_references(walk.mechanism)):
        if walk.profile.is_like(one.profile):
            return one, path if any(one is each for each in given) else "the one that comes with the package"
    return None, ""


def _none(walk: Walk) -> str:
    """That there is no reference, and when there will be one."""
    legs = 1 + len(walk.mechanism.clearance_joints) * len(WIDER)
    cycles = FIRST_CYCLES + math.ceil((CYCLES * (legs + 1) + _SETTLING * legs) / PACE / _PERIODS)
    rpm = walk.profile.cadence_rpm
    return (
        f"joints are not judged: there is no torque reference of {walk.mechanism.name} at {rpm:.3g} rpm. The "
        f"monitor simulates one while the leg walks, in {cycles} gait cycles "
        f"({60.0 * cycles / abs(rpm):.0f} s); --reference FILE simulates it now"
    )
