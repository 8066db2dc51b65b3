"""Where a fit starts."""

import attrs


@attrs.frozen
class Start:
    """A guess of how the crank follows from the joint: ratio * position + offset.

    Attributes
    ----------
    ratio : float
        Turns of the crank per turn of the joint, negative if it turns against it.
    offset_rad : float
        Crank angle at joint position 0.
    torque_sign : int
    explained : float
        Fraction of the torque's variance that the model explains.
    recording : int
        Recording whose torque was used.
    lag_s : float
        Time by which slow changes of the torque are late [s]; it stays unless it is among the terms of the
        fit.
    low_pass_s : float
        What of it is the time constant of a first-order low-pass.
    """

    ratio: float
    offset_rad: float
    torque_sign: int
    explained: float
    recording: int
    lag_s: float = 0.0
    low_pass_s: float = 0.0
