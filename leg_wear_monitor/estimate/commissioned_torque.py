"""The baseline of a leg: its drive torque when it was commissioned."""

import attrs
import numpy as np

from leg_wear_monitor.estimate.signature import DIRECT, Channel
from leg_wear_monitor.mechanism.arrays import Floats


@attrs.frozen(eq=False)
class CommissionedTorque:
    """Signatures of the drive torque of a leg whose k clearances were known.

    Attributes
    ----------
    stamp_ns : int
        End of its last gait cycle.
    clearance_m : (k,) array
        Counted clearances then.
    signatures : (cycles, F) array
        Of each gait cycle, as in `estimate.signature`.
    sigma_m : (k,) array
        Standard deviations of the clearances: above 0 where a correction made them.
    channel : Channel
        Of the drive, by these signatures.
    speed : float
        Mean speed of the crank [rad/s]; 0 where it is not known.
    """

    stamp_ns: int
    clearance_m: Floats
    signatures: Floats
    sigma_m: Floats = attrs.field()
    channel: Channel = DIRECT
    speed: float = 0.0

    @sigma_m.default
    def _as_counted(self) -> Floats:
        return np.zeros(len(self.clearance_m))

    @property
    def is_as_counted(self) -> bool:
        """Whether the clearances were the counted ones, not corrected."""
        return not self.sigma_m.any()

    @property
    def cycles(self) -> int:
        """Number of gait cycles."""
        return len(self.signatures)

    @property
    def mean(self) -> Floats:
        """Mean signature (F,)."""
        return np.asarray(self.signatures.mean(axis=0))
