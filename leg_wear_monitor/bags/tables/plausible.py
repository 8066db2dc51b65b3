"""Columns that are likely in another unit: the wrap of the angle, its speed, the cadence."""

import math
from collections.abc import Iterator

import attrs
import numpy as np

from leg_wear_monitor.bags.tables.layout import CRANK_ANGLE, CRANK_SPEED, Rows
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.config.tables import ANGLES, SPEEDS, STAMPS

_LEAST_ROWS = 50
_LEAST_TURNS = 2.0
_SAME = 1.02  # a wrapped angle reaches its turn within a sample
_NEAR = 1.5  # a hint fits if it gives the speed within this factor
_FAR = 2.0  # beyond this factor of the commanded speed no gait cycle counts (`monitor.evaluation`)
_APART = 1.25  # speed column against the speed of the angle


@attrs.frozen
class _Turning:
    """How the crank's joint turns: angle passed [rad], time passed [s], where both are known."""

    angle_rad: float
    time_s: float

    @property
    def rpm(self) -> float:
        """Mean speed [rpm]."""
        return 60.0 * self.angle_rad / TURN / self.time_s


def unit_doubts(rows: Rows, config: MonitorConfig) -> Iterator[str]:
    """Doubts about units from the first rows of a table."""
    chosen = rows.measured[CRANK_ANGLE] & np.isfinite(rows.values[CRANK_ANGLE])
    angle, stamps = rows.values[CRANK_ANGLE][chosen], rows.stamp_ns[chosen]
    if len(angle) < _LEAST_ROWS:
        return
    turn = _other_turn(angle, config)
    if turn:
        yield turn
        return
    steps_s = np.diff(stamps) * 1.0e-9
    turned = np.diff(angle)
    if _wraps(angle):
        turned = (turned + math.pi) % TURN - math.pi
    ahead = steps_s > 0.0
    turning = _Turning(float(turned[ahead].sum()), float(steps_s[ahead].sum()))
    if abs(turning.angle_rad) < _LEAST_TURNS * TURN:
        return
    if hint := _cadence(turning, config):
        yield hint
    if CRANK_SPEED in rows.values:
        speed = rows.values[CRANK_SPEED][chosen][1:][ahead]
        known = np.isfinite(speed)
        if hint := _speed(speed[known], steps_s[ahead][known], turned[ahead][known], config):
            yield hint


def _wraps(angle: Floats) -> int:
    """How often an angle jumps by more than half of its range: a continuous one never does."""
    return int(np.count_nonzero(np.abs(np.diff(angle)) > 0.5 * np.ptp(angle)))


def _other_turn(angle: Floats, config: MonitorConfig) -> str:
    """Doubt about the unit of an angle that jumps back by a turn of another unit; empty if there is none."""
    unit, (factor, divisor) = config.input.units.crank_angle, config.input.angle_scale
    of_unit = factor / divisor
    if _wraps(angle) < _LEAST_TURNS:
        return ""
    span = float(angle.max() - angle.min())
    step = float(np.median(np.abs(np.diff(angle))))
    turns = {one: TURN * over / by for one, (by, over) in ANGLES.items()} | {unit: TURN / of_unit}
    raw = (span + step) / of_unit
    for other, turn in turns.items():
        if other != unit and max(raw / turn, turn / raw) < _SAME:
            key, value = (
                "input.units.crank_angle",
                f"the angle jumps back by about {raw:.3g} each turn",
            )
            return f"{value}, in {unit!r} a turn is {turns[unit]:.4g}: is it in {other!r} ({key})?"
    return ""


def _cadence(turning: _Turning, config: MonitorConfig) -> str:
    """Doubt about the time or the angle, if another unit gives the commanded cadence."""
    units, found = config.input.units, []
    rpm, commanded = abs(turning.rpm) / config.crank.gear_ratio, abs(config.cadence.commanded_rpm)
    if 1.0 / _FAR <= rpm / commanded <= _FAR:
        return ""
    if units.stamp in STAMPS and not config.input.rate_hz:
        for other, power in STAMPS.items():
            found.append((rpm * 10.0 ** (STAMPS[units.stamp] - power), "input.units.stamp", other))
    factor, divisor = config.input.angle_scale
    for other, (its_factor, its_divisor) in ANGLES.items():
        of_other = rpm * (its_factor / its_divisor) / (factor / divisor)
        found.append((of_other, "input.units.crank_angle", other))
    told = f"the crank turns at {rpm:.3g} rpm, commanded are {commanded:g} rpm"
    best, key, other = min(found, key=lambda each: abs(math.log(each[0] / commanded)))
    fits = 1.0 / _NEAR < best / commanded < _NEAR
    return f"{told}; with {key} {other!r} it would turn at {best:.3g} rpm" if fits else ""


def _speed(speed: Floats, steps_s: Floats, turned: Floats, config: MonitorConfig) -> str:
    """Doubt about the column of the speed, if it is not the speed of the angle."""
    passed_s = float(steps_s.sum())
    told, shown = float((speed * steps_s).sum()), float(turned.sum())
    if not passed_s or abs(shown) < TURN or (told / shown > 1.0 / _APART and told / shown < _APART):
        return ""
    unit = config.input.units.crank_speed
    of_unit = SPEEDS[unit][0] / SPEEDS[unit][1]
    text = (
        f"crank_speed is {told / passed_s / of_unit:.4g} {unit} in the mean, but the angle turns at "
        f"{shown / passed_s / of_unit:.4g} {unit}"
    )
    for other, (factor, divisor) in SPEEDS.items():
        ratio = told / of_unit * (factor / divisor) / shown
        if other != unit and 1.0 / _APART < ratio < _APART:
            return f"{text}: is it in {other!r} (input.units.crank_speed)?"
    return f"{text}: one of the two columns or its unit is wrong"
