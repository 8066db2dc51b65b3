"""What changes while further encoders are watched, and what may be wrong with one."""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.encoders.angle_regression import Estimate, rms
from leg_wear_monitor.monitor.encoders.commissioning import EncoderErrors
from leg_wear_monitor.monitor.encoders.samples import EncoderSamples
from leg_wear_monitor.twin.reference.joint_angles import PHASES

LEAST_PHASES = PHASES // 4  # with samples: at 60 rpm a rate of 32 Hz

_STRANGE_RAD = 0.1  # of deviation within a cycle: many times what clearances and scale errors make


@attrs.define
class EncoderState:
    """What changes, beside the regression and the reference; every value is immutable.

    Attributes
    ----------
    samples : EncoderSamples
    errors : EncoderErrors
    due : tuple of (int, int)
        Begin and end [ns] of gait cycles that are over and not looked at yet.
    present : tuple of bool
        Which encoders the kept cycles have; empty before the first.
    otherwise : tuple of bool
        Which ones the last cycles had, if that is something else.
    otherwise_cycles : int
        How many of them.
    faults : tuple of str
        What was wrong with each encoder in the last cycle; empty before the first.
    asked : bool
        Whether a reference was asked for since the leg was last another one.
    since_reference : int
        Cycles since the last reference was ready.
    found : Estimate or None
    updated_ns : int
        When it was handed to the forecast, 0 if that is due.
    other, believed : tuple of bool
        Which clearances were then surely other than counted, and which the forecast believed.
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
    found: Estimate | None = None
    updated_ns: int = 0
    other: tuple[bool, ...] = ()
    believed: tuple[bool, ...] = ()


def fault_of(raw: Floats, deviation: Floats, joint: str) -> str:
    """What is wrong with an encoder in a cycle; empty if nothing."""
    seen = deviation[np.isfinite(deviation)]
    if len(seen) < LEAST_PHASES:
        return "gives no angle" if np.isinf(raw).any() else "is not in joint_states with the crank"
    if rms(seen - seen.mean()) > _STRANGE_RAD:
        return f"does not turn as joint {joint} does, look at encoders.joints and encoders.signs"
    return ""


def faults(names: Sequence[str], state: EncoderState) -> list[str]:
    """What is wrong with encoders, for operators."""
    return [f"{name} {fault}" for name, fault in zip(names, state.faults, strict=False) if fault]
