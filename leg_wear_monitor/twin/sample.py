"""Samples: records of one measurement each, from live topics or from a recording."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.twin.kinds import CRANK, KINDS

Samples = NDArray[Any]
"""Records of `GAIT_SAMPLE`, shape (n,), in order of arrival."""

ENCODERS = 4  # largest number of further encoders, beside the crank's

GAIT_SAMPLE = np.dtype(
    [
        ("stamp_ns", "i8"),
        ("kind", "u1"),
        ("fault", "u1"),
        ("crank_angle_rad", "f8"),
        ("crank_velocity_radps", "f8"),
        ("torque_nm", "f8"),
        ("encoder_rad", "f8", (ENCODERS,)),
        ("foot_force_n", "f8", (2,)),
    ]
)
"""One sample: stamp of the header, kind, fault, and values, NaN where absent.

The angle is that of the mechanism's crank, after sign, offset and gear ratio; it may be wrapped to a turn or
be continuous. A crank sample may also contain a torque (``effort``), and the angles of further encoders in
the order of ``encoders.names``, after their signs: NaN where absent, infinite where the value is no angle. An
invalid torque or encoder angle is not a fault of the sample. The force of the ground on the foot is along the
axes of the ground, the second one up, or with ``foot_load.frame: foot`` of the toe's body; a contact switch
gives (0, 1) or (0, 0).
"""

# Faults of a message, found by the conversion. Such a sample is counted and never used.
NO_FAULT, EMPTY, WRONG_LENGTH, MISSING_JOINT, NOT_FINITE, ZERO_STAMP, UNDECODABLE, WRONG_TYPE = range(8)
# A further fault, found by the tracker.
OUT_OF_RANGE = 8
FAULTS = {
    NO_FAULT: "none",
    EMPTY: "empty",
    WRONG_LENGTH: "wrong_length",
    MISSING_JOINT: "missing_joint",
    NOT_FINITE: "not_finite",
    ZERO_STAMP: "zero_stamp",
    UNDECODABLE: "undecodable",
    WRONG_TYPE: "wrong_type",
    OUT_OF_RANGE: "out_of_range",
}
"""Names of the faults, as used in keys of diagnostics."""


def gait_samples(
    stamp_ns: ArrayLike,
    kind: ArrayLike = CRANK,
    *,
    crank_angle_rad: ArrayLike = np.nan,
    crank_velocity_radps: ArrayLike = np.nan,
    torque_nm: ArrayLike = np.nan,
    encoder_rad: ArrayLike = np.nan,
    foot_force_n: ArrayLike = np.nan,
    fault: ArrayLike = NO_FAULT,
) -> Samples:
    """A block of samples for `WearMonitor.update`, from arrays in order of arrival.

    For a whole recording, `replay` takes arrays and data frames directly.

    Parameters
    ----------
    stamp_ns : (n,) array of int
        Times of measurement [ns].
    kind : (n,) array or int
        0 for a sample of the crank, which may contain a torque, too; 1 for one of the drive torque alone; 2
        for one of the foot load.
    crank_angle_rad, crank_velocity_radps, torque_nm : (n,) array or float
        Angle and speed of the mechanism's crank [rad, rad/s], drive torque on the crank [N m]; NaN where
        absent.
    encoder_rad : (n, m) array or float
        Angles of m further encoders [rad], at most 4, in the order of ``encoders.names``.
    foot_force_n : (n, 2) array or float
        Force of the ground on the foot [N].
    fault : (n,) array or int
        0 for a valid sample; others are counted and not used.

    Returns
    -------
    (n,) structured array

    Raises
    ------
    LegWearError
        For an unknown kind or fault, or for stamps that are not integers.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> samples = lw.gait_samples([0, 5_000_000], crank_angle_rad=[0.1, 0.13], torque_nm=[2.5, 2.4])
    >>> samples["torque_nm"].tolist()
    [2.5, 2.4]
    """
    stamps = np.atleast_1d(np.asarray(stamp_ns))
    if stamps.dtype.kind not in "iu":
        raise LegWearError(f"stamp_ns: {stamps.dtype} is no integer type, expected nanoseconds as int64")
    block = np.empty(len(stamps), GAIT_SAMPLE)
    kinds = {code: each.name for code, each in KINDS.items()}
    for name, value, known in (("kind", kind, kinds), ("fault", fault, FAULTS)):
        codes = np.asarray(value)
        if not np.isin(codes, list(known)).all():
            raise LegWearError(f"{name}: {codes[~np.isin(codes, list(known))].flat[0]} is none of {known}")
        block[name] = codes
    block["stamp_ns"] = stamps
    block["crank_angle_rad"] = crank_angle_rad
    block["crank_velocity_radps"] = crank_velocity_radps
    block["torque_nm"] = torque_nm
    angles = np.asarray(encoder_rad, dtype=float)
    block["encoder_rad"] = np.nan
    block["encoder_rad"][:, : angles.shape[-1] if angles.ndim else None] = angles
    block["foot_force_n"] = foot_force_n
    return block


def brings(samples: Samples, kind: int) -> NDArray[np.bool_]:
    """Mask (n,) of the samples with a kind's value: those of the kind, and others that contain it."""
    is_there = np.isfinite(samples[KINDS[kind].value])
    if is_there.ndim > 1:
        is_there = is_there.all(axis=1)
    return np.asarray((samples["kind"] == kind) | is_there)
