"""What is declared of a drive, before anything was measured: prior knowledge of an estimate."""

import math

import attrs


@attrs.frozen(kw_only=True)
class DriveFigures:
    """Declared figures of a drive, at the crank's shaft; NaN where nothing is declared.

    A motor's or a gear's own figures are converted to the crank before: the torque by its turns per turn of
    the crank, friction by speed and stiffness by their square.

    Attributes
    ----------
    lag_s : float
        Time by which the measured torque is late.
    bandwidth_hz : float
        Corner frequency of the first-order low-pass between the torque on the crank and the measured one.
    load_friction : float
        Fraction eta of the friction eta |torque| sign(speed).
    coulomb_nm : float
        Constant friction.
    viscous_nms : float
        Friction by speed [N m s/rad].
    stiffness_nm_per_rad : float
        Stiffness between the measured angle and the crank.
    """

    lag_s: float = math.nan
    bandwidth_hz: float = math.nan
    load_friction: float = math.nan
    coulomb_nm: float = math.nan
    viscous_nms: float = math.nan
    stiffness_nm_per_rad: float = math.nan

    @property
    def declared(self) -> dict[str, float]:
        """The figures that are declared, by name."""
        return {name: value for name, value in attrs.asdict(self).items() if not math.isnan(value)}

    @property
    def lateness_s(self) -> float:
        """Declared time by which slow changes of the torque are late: by the lag and by the low-pass."""
        parts = (self.lag_s, 1.0 / (2.0 * math.pi * self.bandwidth_hz))
        return sum(one for one in parts if not math.isnan(one))


UNDECLARED = DriveFigures()
"""Nothing is known."""
