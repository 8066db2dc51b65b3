"""State of the encoder observer, and possible faults of an encoder."""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.encoders.angle_regression import Estimate, rms
from leg_wear_monitor.monitor.encoders.commissioning import EncoderErrors
from leg_wear_monitor.monitor.encoders.samples import EncoderSamples
from leg_wear_monitor.twin.reference.crank_profile import CrankProfile
from leg_wear_monitor.twin.reference.joint_angles import PHASES

LEAST_PHASES = PHASES // 4  # with samples: at 60 rpm a rate of 32 Hz

_STRANGE_RAD = 0.1  # deviation within a cycle: many times the effect of clearances and scale errors


@attrs.define
class EncoderState:
    """State besides the regression and the reference; every value is immutable.

    Attributes
    ----------
    samples : EncoderSamples
    errors : EncoderErrors
    due : tuple of (int, int)
        Begin and end [ns] of ended gait cycles that are not evaluated yet.
    present : tuple of bool
        Which encoders the kept cycles have; empty before the first.
    otherwise : tuple of bool
        Encoders of the last cycles, if they differ from `present`.
    otherwise_cycles : int
        Number of these cycles.
    faults : tuple of str
        Fault of each encoder in the last cycle; empty before the first.
    asked : bool
        Whether a reference was requested since the last change of the leg.
    since_reference : int
        Cycles since the last reference was ready.
    profiles : tuple of CrankProfile
        How the crank turned in the last cycles.
    found : Estimate or None
    updated_ns : int
        Stamp of the last forecast update with it, 0 if an update is due.
    other, believed : tuple of bool
        Clearances that then differed significantly from the counted ones, and those that the forecast used.
    """

    samples: EncoderSamples
    errors: EncoderErrors
    due: tuple[tuple[int, int], ...] = ()
    present: tuple[bool, ...] = ()
    otherwise: tuple[bool, ...] = ()
    otherwise_cycles: int = 0
    faults: tuple[str, ...] = ()
    asked: bool = False
    since_reference: int = 0
    profiles: tuple[CrankProfile, ...] = ()
    found: Estimate | None = None
    updated_ns: int = 0
    other: tuple[bool, ...] = ()
    believed: tuple[bool, ...] = ()


def fault_of(raw: Floats, deviation: Floats, joint: str) -> str:
    """Fault of an encoder in a cycle; empty if there is none."""
    finite = deviation[np.isfinite(deviation)]
    if len(finite) < LEAST_PHASES:
        return "gives no angle" if np.isinf(raw).any() else "is not in joint_states with the crank"
    if rms(finite - finite.mean()) > _STRANGE_RAD:
        return f"does not turn as joint {joint} does, look at encoders.joints and encoders.signs"
    return ""


def faults(names: Sequence[str], state: EncoderState) -> list[str]:
    """Faults of the encoders, for operators."""
    return [f"{name} {fault}" for name, fault in zip(names, state.faults, strict=False) if fault]
