"""Crank motion: a sequence of speeds joined by smooth ramps, with a phase-dependent ripple."""

import math
from bisect import bisect_right
from itertools import pairwise
from typing import NamedTuple

from leg_wear_monitor.dynamics.run.drive import CrankMotion
from leg_wear_monitor.gait.config import PaceConfig
from leg_wear_monitor.mechanism.ideal import TURN


class _Stretch(NamedTuple):
    """Speed transition: start time [s], ripple-free start angle [rad], start and end speed [rad/s]."""

    since: float
    angle: float
    before: float
    after: float


class Pace:
    """Motion of the crank over time, from angle 0.

    The ramps define the ripple-free angle phi. The crank angle is theta = phi + r / h sin(h phi): the ripple
    amplitude is the fraction r of any speed, and the ripple stops with the crank.
    """

    def __init__(self, config: PaceConfig) -> None:
        self._ramp = config.ramp_s
        self._ripple, self._waves = config.ripple, config.ripple_per_turn
        speeds = [rpm * TURN / 60.0 for rpm in config.speeds_rpm]
        self._stretches, self._since = [_Stretch(0.0, 0.0, speeds[0], speeds[0])], [0.0]
        for (_, end), (before, after) in zip(pairwise(config.times_s), pairwise(speeds), strict=True):
            self._stretches.append(_Stretch(end, self._even(end).angle, before, after))
            self._since.append(end)

    def at(self, t: float) -> CrankMotion:
        """Crank motion at a time [s]."""
        angle, speed, acceleration = self._even(t)
        r, h = self._ripple, self._waves
        sine, factor = math.sin(h * angle), 1.0 + r * math.cos(h * angle)
        return CrankMotion(
            angle + r / h * sine, speed * factor, acceleration * factor - speed * speed * r * h * sine
        )

    def _even(self, t: float) -> CrankMotion:
        """Ripple-free motion: a smooth speed step 10 u^3 - 15 u^4 + 6 u^5, then constant speed."""
        last = self._stretches[bisect_right(self._since, t) - 1]
        tau, step = t - last.since, last.after - last.before
        if tau >= self._ramp:
            angle = (
                last.angle + 0.5 * (last.before + last.after) * self._ramp + last.after * (tau - self._ramp)
            )
            return CrankMotion(angle, last.after, 0.0)
        u = tau / self._ramp
        risen = u * u * u * (10.0 + u * (6.0 * u - 15.0))
        area = u**4 * (2.5 + u * (u - 3.0)) * self._ramp
        slope = 30.0 * u * u * (1.0 + u * (u - 2.0)) / self._ramp
        return CrankMotion(
            last.angle + last.before * tau + step * area, last.before + step * risen, step * slope
        )
