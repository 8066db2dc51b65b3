"""Play of a joint from its angle over time, and from the load that reverses."""

import math

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.play.count import bits_of, found_count
from leg_wear_monitor.play.findings import EXCESS, findings, notes
from leg_wear_monitor.play.fit import Fit, fit_play
from leg_wear_monitor.play.plateaus import Plateaus, Sides, plateaus, sides
from leg_wear_monitor.play.result import Play

LEAST_PLATEAUS = 4  # on each side
_APART = 6.0  # standard deviations: noise then takes no sample of one cluster into the other
_LEAST_HELD = 0.4  # of the time: a joint that is elsewhere for longer rests at a third place
_PASSES = 3  # without a load: the sides change with the drift that is removed


def measure_play(
    time_s: Floats,
    angle_rad: Floats,
    load: Floats | None = None,
    *,
    count_rad: float | None = None,
    joint: str = "angle",
    load_name: str = "load",
) -> Play:
    """Measure the play of a joint that was rocked: pushed to and fro, each push held for a moment.

    Parameters
    ----------
    time_s, angle_rad : (n,) arrays
        Times in ascending order, and the angle of the joint.
    load : (n,) array, optional
        A signal with the direction of the push, in any unit: effort, torque, force or target. Without one,
        the angle must come to rest in two clusters.
    count_rad : float, optional
        Count of the encoder; default: found from the values.
    joint, load_name : str
        Names for the result and for messages.

    Returns
    -------
    Play

    Raises
    ------
    LegWearError
        If the recording does not show the play; the message names the cause.
    """
    time_s, angle, load = _checked(time_s, angle_rad, load, joint, load_name)
    angle = np.unwrap(angle)
    count = _count(angle, count_rad, joint)
    if load is None:
        found, fit = _from_clusters(time_s, angle, count, joint)
    else:
        found, fit = _with_side(time_s, angle, _sides(load, load_name), count, joint)
    return _result(found, fit, count, joint, "" if load is None else load_name)


def _checked(
    time_s: Floats, angle: Floats, load: Floats | None, joint: str, load_name: str
) -> tuple[Floats, Floats, Floats | None]:
    """Arrays of the finite samples, whose lengths and times fit."""
    columns = {"time": time_s, joint: angle} | ({} if load is None else {load_name: load})
    arrays = {name: np.asarray(column, float) for name, column in columns.items()}
    lengths = ", ".join(f"{name} {len(column)}" for name, column in arrays.items())
    if len({len(column) for column in arrays.values()}) > 1:
        raise LegWearError(f"arrays of different lengths: {lengths}")
    finite = np.all([np.isfinite(column) for column in arrays.values()], axis=0)
    chosen = [column[finite] for column in arrays.values()]
    if not len(chosen[0]):
        raise ConfigError(joint, "", "has no value, expected the angle of a joint that is rocked")
    if (np.diff(chosen[0]) < 0.0).any():
        raise LegWearError(f"times of {joint} are not in ascending order")
    return chosen[0], chosen[1], chosen[2] if load is not None else None


def _count(angle: Floats, given: float | None, joint: str) -> float:
    if given is not None:
        return given
    if not np.ptp(angle):
        raise ConfigError(joint, "", f"is constant at {angle[0]:.6g} rad: it moves by less than one count")
    found = found_count(angle)
    if found is None:
        values = len(np.unique(angle))
        fault = f"has {values} different values, which do not show the encoder's count: give it"
        raise ConfigError(joint, "", fault)
    return found


def _sides(signal: Floats, name: str) -> Sides:
    try:
        return sides(signal)
    except LegWearError as error:
        raise ConfigError(name, "", str(error)) from error


def _with_side(time_s: Floats, angle: Floats, side: Sides, count: float, joint: str) -> tuple[Plateaus, Fit]:
    """Plateaus and fit for known sides."""
    found = plateaus(time_s, angle, side, count)
    each = [int(np.count_nonzero(found.side == one)) for one in (1.0, -1.0)]
    if min(each) < LEAST_PLATEAUS:
        moving = f", and {found.moving} pushes at whose end it still moves" if found.moving else ""
        moving += f", and {found.brief} pushes of less than 3 samples" if found.brief else ""
        fault = (
            f"rests {each[0]} times on one side and {each[1]} times on the other{moving}; expected at least "
            f"{LEAST_PLATEAUS} times on each: push it to and fro more often, hold each push, or record faster"
        )
        raise ConfigError(joint, "", fault)
    return found, fit_play(found, _expected(found, count))


def _from_clusters(time_s: Floats, angle: Floats, count: float, joint: str) -> tuple[Plateaus, Fit]:
    """Plateaus and fit with the side from the angle itself, free of the drift."""
    level = angle - np.polynomial.Polynomial.fit(time_s, angle, 1)(time_s)
    held = float(_sides(level, joint).is_held.mean())
    if held < _LEAST_HELD:
        fault = (
            f"is between its outermost places for {100.0 * (1.0 - held):.0f} % of the time: it rests at more "
            "than two places, give a load signal"
        )
        raise ConfigError(joint, "", fault)
    for _ in range(_PASSES):
        # an angle that is chosen by its own value would seem to have less noise
        both = attrs.evolve(_sides(level, joint), is_held=np.ones(len(level), bool))
        found, fit = _with_side(time_s, angle, both, count, joint)
        level = angle - fit.drift_at(time_s)
    if abs(fit.play_rad) < _APART * found.noise_rad:
        fault = (
            f"rests {1e3 * abs(fit.play_rad):.3g} mrad apart with a noise of "
            f"{1e3 * found.noise_rad:.3g} mrad: the two clusters overlap; give a load signal"
        )
        raise ConfigError(joint, "", fault)
    return found, fit


def _expected(found: Plateaus, count: float) -> float:
    """Standard deviation of a plateau from count and noise [rad]."""
    return math.hypot(count / math.sqrt(12.0), found.noise_rad / math.sqrt(max(0.5 * found.samples, 1.0)))


def _count_sigma(found: Plateaus, count: float) -> float:
    """Standard uncertainty of the play from the count [rad].

    Without noise, each side is rounded by up to half a count, the same way in each repeat. Gaussian noise d
    counts wide averages it out by exp(-2 pi^2 d^2), the first term of the quantiser's Fourier series.
    """
    noise = math.sqrt(max(found.noise_rad**2 - count**2 / 12.0, 0.0)) / count
    return count / math.sqrt(6.0) * math.exp(-2.0 * (math.pi * noise) ** 2)


def _result(found: Plateaus, fit: Fit, count: float, joint: str, load: str) -> Play:
    play = abs(fit.play_rad)
    if play < count:
        fault = (
            f"moves by {1e3 * play:.3g} mrad, less than one count of its encoder ({1e3 * count:.3g} mrad, "
            f"{bits_of(count):.3g} bits): the encoder cannot tell the play"
        )
        raise ConfigError(joint, "", fault)
    side = found.side[fit.used]
    drift = fit.drift_at(found.time_s)
    expected = _expected(found, count)
    excess = fit.scatter_rad if fit.scatter_rad > EXCESS * expected else 0.0
    outside = int(np.count_nonzero(~fit.used)) - fit.short
    result = Play(
        joint=joint,
        load=load,
        play_rad=play,
        # pushes that stop short do so on one side: their mean does not improve with more of them
        sigma_rad=math.hypot(fit.sigma_rad, _count_sigma(found, count), excess),
        count_rad=count,
        noise_rad=found.noise_rad,
        scatter_rad=fit.scatter_rad,
        drift_rad=float(np.ptp(drift)),
        plateaus=(int(np.count_nonzero(side > 0.0)), int(np.count_nonzero(side < 0.0))),
        moving=found.moving,
        short=fit.short,
        outside=outside,
        sprung=found.sprung,
    )
    return attrs.evolve(result, findings=findings(result, expected), notes=notes(result))
