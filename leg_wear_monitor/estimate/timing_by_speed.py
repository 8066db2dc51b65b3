"""A lag of a torque and an offset of the crank, which differ by how the turned angle grows with the speed."""

import attrs

from leg_wear_monitor.estimate.cause import Cause, NamedCause


@attrs.frozen
class TimingBySpeed:
    """Regression of the angle by which a torque is turned on the crank's speed: offset - lag * speed.

    Attributes
    ----------
    sums : tuple of float
        Sums of weights, and of weights times the speed, its square, the angle, speed times angle, and the
        angle's square.
    """

    sums: tuple[float, float, float, float, float, float] = (0.0,) * 6

    def with_angle(
        self, angle_rad: float, speed: float, sigma_rad: float = 1.0, forgetting: float = 1.0
    ) -> "TimingBySpeed":
        """Regression with one more gait cycle; those before count less by a factor."""
        x, y, w = speed, angle_rad, sigma_rad**-2.0
        new = (w, w * x, w * x * x, w * y, w * x * y, w * y * y)
        a, b, c, d, e, f = (forgetting * one + other for one, other in zip(self.sums, new, strict=True))
        return TimingBySpeed((a, b, c, d, e, f))

    @property
    def split(self) -> tuple[NamedCause, NamedCause] | None:
        """Lag, and offset of the crank, with what the angles' own errors make of them; None at one speed."""
        w, x, xx, y, xy, _ = self.sums
        size = w * xx - x * x
        if not size > 0.0:
            return None
        lag = NamedCause(Cause.LAG, (x * y - w * xy) / size, (w / size) ** 0.5)
        return lag, NamedCause(Cause.CRANK_OFFSET, (xx * y - x * xy) / size, (xx / size) ** 0.5)

    @property
    def square(self) -> float:
        """Sum of the squares of what is left over, in standard deviations of the angles."""
        found = self.split
        _, _, _, y, xy, yy = self.sums
        return max(yy - found[1].value * y + found[0].value * xy, 0.0) if found else 0.0
