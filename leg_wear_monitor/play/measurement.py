"""Play of a joint from its angle over time, and from the load that reverses."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import attrs
import numpy as np

from leg_wear_monitor.bags.bag import TABLES, Recordable, find_files, listed
from leg_wear_monitor.bags.findings import Finding, RecordingError
from leg_wear_monitor.bags.series import JointName, Signals, TorqueSource, read_signals
from leg_wear_monitor.errors import ConfigError, LegWearError, did_you_mean
from leg_wear_monitor.estimate.joint_motion import Series
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.inputs import EFFORT, WRENCH
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.play.fit import MANY, Fit, Plateaus, Play, Sides, fit_play, plateaus, sides

# The count of an encoder: the step between neighbouring values of its angle.


_LEAST_VALUES = 4  # fewer different values: the smallest step may be several counts
_OFF = 0.02  # counts that a value may be off its step: decimals of a table, rounding
_LEAST_RAD = TURN / 2**30  # finer than any encoder: rounding of the numbers


def found_count(angle: Floats) -> float | None:
    """Count [rad] that all values of an angle are multiples of; None if the values do not show one.

    Parameters
    ----------
    angle : (n,) array, rad
    """
    values = np.unique(angle)
    steps = np.diff(values)
    steps = steps[steps > _LEAST_RAD]
    if len(steps) + 1 < _LEAST_VALUES:
        return None
    count = float(steps.min())
    # the mean over all steps, as decimals round each one
    numbers = np.rint(steps / count)
    count = float(steps.sum() / numbers.sum())
    return count if float(np.max(np.abs(steps / count - numbers))) < _OFF * max(1.0, numbers.max()) else None


def bits_of(count_rad: float) -> float:
    """Bits of an encoder with a count [rad]."""
    return float(np.log2(TURN / count_rad))


# What makes a measured play doubtful, and further information on it.


EXCESS = 3.0  # times what count and noise explain


def findings(play: Play, expected_rad: float) -> tuple[str, ...]:
    """Findings of a play, with the remedy.

    Parameters
    ----------
    play : Play
    expected_rad : float
        Standard deviation of a plateau that count and noise explain.
    """
    return tuple(_findings(play, expected_rad))


def _findings(play: Play, expected_rad: float) -> list[str]:
    found = []
    pushes = sum(play.plateaus) + play.moving + play.short + play.outside
    if play.scatter_rad > EXCESS * expected_rad:
        found.append(
            f"the repeats scatter by {_mrad(play.scatter_rad)}, count and noise explain "
            f"{_mrad(expected_rad)}: stiction stops the joint short of its end, or the pushes bend the leg "
            "by different amounts; push harder and longer, or always alike"
        )
    if play.short > MANY * pushes:
        found.append(
            f"in {play.short} of {pushes} pushes the joint stopped short of its end (stiction): push harder"
        )
    if play.moving > MANY * pushes:
        found.append(f"in {play.moving} of {pushes} pushes the angle still moved at the end: hold longer")
    if play.sigma_rad > 0.5 * play.play_rad:
        found.append(
            f"the play of {_mrad(play.play_rad)} is less than two standard deviations "
            f"({_mrad(play.sigma_rad)}): it is not resolved"
        )
    return found


def notes(play: Play) -> tuple[str, ...]:
    """Notes on a play: the drift that was removed, the pushes that were left out."""
    sentences = []
    if play.drift_rad > play.count_rad:
        sentences.append(
            f"the angle drifted by {_mrad(play.drift_rad)} during the pushes; the drift is removed"
        )
    for number, what in (
        (play.moving, "the angle still moved at the end"),
        (play.short, "the joint stopped short of its end"),
        (play.outside, "the angle went beyond the others"),
    ):
        if number:
            sentences.append(f"{_pushes(number)} left out: {what}")
    if play.sprung:
        sentences.append(
            f"in {_pushes(play.sprung)} the joint sprang back while the signal kept its value; its outermost "
            "rest counts"
        )
    if not play.load:
        sentences.append(
            "without a load signal, the play is the distance between the places where the joint rests: a "
            "joint that rests before its end has more"
        )
    return tuple(sentences)


def _pushes(number: int) -> str:
    return f"{number} {'push' if number == 1 else 'pushes'}"


def _mrad(value_rad: float) -> str:
    return f"{1e3 * value_rad:.3g} mrad"


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
    fraction = float(_sides(level, joint).is_held.mean())
    if fraction < _LEAST_HELD:
        fault = (
            f"is between its outermost places for {100.0 * (1.0 - fraction):.0f} % of the time: it rests at "
            "more than two places, give a load signal"
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


# Angles and loads of recordings: joints and torques of a bag, columns of a table.


_OPTIONS = {
    "input.columns.stamp": "--time",
    "input.columns.crank_angle": "--joint",
    "input.columns.drive_torque": "--load",
}
_NOT_ZERO = "1970-01-02T00:00:00Z"  # only differences of times count, and a stamp of 0 is one of no clock
_STALE = 3.0  # sampling intervals after which the last load no longer counts


@attrs.frozen(eq=False)
class Rocked:
    """A joint that was rocked: times [s], angles [rad], and the load at these times if there is one."""

    time_s: Floats
    angle_rad: Floats
    load: Floats | None
    findings: tuple[Finding, ...]


def read_rocked(
    recording: Recordable,
    config: MonitorConfig,
    joint: str,
    loads: Sequence[str],
    progress: Callable[[float], None],
) -> Rocked:
    """Read the angle of a joint, and the sum of the loads.

    Parameters
    ----------
    recording : path or table in memory
        MCAP, .db3, CSV or Parquet file, bag directory, columns by name.
    config : MonitorConfig
        Column of the time and units of tables.
    joint : str
        Name of a joint in a bag, of a column in a table.
    loads : sequence of str
        ``effort``, ``effort:JOINT``, ``TOPIC``, ``TOPIC:AXIS`` or ``TOPIC:JOINT`` in a bag, a column in a
        table. Two that push to one side each add up.
    progress : callable
        Takes the fraction read.

    Raises
    ------
    RecordingError
        If the recording cannot be read, or has no such joint or load.
    """
    files, _ = find_files([recording])
    name = ", ".join(str(one.path) for one in files)
    if files[0].storage in TABLES:
        return _of_table(recording, config, joint, loads, progress)
    signals, findings = read_signals([recording], MonitorConfig(), progress=progress)
    angle = _joint(signals, joint, name)
    return _aligned(angle, {load: _load(signals, joint, load, name) for load in loads}, name, findings)


def _of_table(
    table: Recordable,
    config: MonitorConfig,
    joint: str,
    loads: Sequence[str],
    progress: Callable[[float], None],
) -> Rocked:
    name = str(table) if isinstance(table, str | Path) else "table"
    found: dict[str, Series] = {}
    for load in loads or [""]:
        columns = attrs.evolve(config.input.columns, crank_angle=joint, crank_speed="", drive_torque=load)
        given = attrs.evolve(config.input, columns=columns, start=config.input.start or _NOT_ZERO)
        try:
            signals, findings = read_signals(
                [table], MonitorConfig(crank_joint=joint, input=given), progress=progress
            )
        except RecordingError as error:
            key = _OPTIONS.get(error.key, error.key)
            raise RecordingError(
                error.source, key, error.fault.removesuffix(', or "" if there is none')
            ) from error
        sources = signals.torques.items()
        if load and not sources:
            raise RecordingError(name, "--load", f"column {load!r} has no value")
        if load:
            found[load] = next(each for source, each in sources if source.component in ("", "z"))
    return _aligned(_joint(signals, joint, name), found, name, [_named(one, joint, load) for one in findings])


def _named(finding: Finding, joint: str, load: str) -> Finding:
    """A finding with the names of the columns: a rocked joint is no crank."""
    text = finding.text.replace("crank_angle is", f"{joint} is").replace("drive_torque is", f"{load} is")
    return attrs.evolve(finding, text=text.replace("; the leg was not monitored in between", ""))


def _joint(signals: Signals, joint: str, name: str) -> Series:
    """Series of a joint; of several topics, the one with the most samples."""
    found = [each for key, each in signals.joints.items() if key.joint == joint]
    if not found:
        known = {key.joint for key in signals.joints}
        fault = f"{joint!r} is not a joint of the recording, it has {listed(known)}"
        raise RecordingError(name, "--joint", fault + did_you_mean(joint, sorted(known)))
    return max(found, key=lambda each: len(each.time_s))


def _load(signals: Signals, joint: str, load: str, name: str) -> Series:
    """Series of a load by its name."""
    named = {label: each for key, each in signals.torques.items() for label in _labels(key, joint)}
    named |= {f"{key.topic}:{key.joint}": each for key, each in signals.joints.items()}
    for label in (load, f"/{load}"):
        if label in named:
            return named[label]
    raise RecordingError(name, "--load", f"{load!r} is not in the recording, expected one of {listed(named)}")


def _labels(key: JointName | TorqueSource, joint: str) -> list[str]:
    """Names by which ``--load`` finds a torque."""
    if isinstance(key, JointName):
        return []
    if key.source == EFFORT:
        return [f"effort:{key.component}", *(["effort"] if key.component == joint else [])]
    return [f"{key.topic}:{key.component}"] if key.source == WRENCH else [key.topic]


def _aligned(angle: Series, loads: dict[str, Series], name: str, findings: list[Finding]) -> Rocked:
    """Sum of the loads at the times of the angle: the last ones received, unless that is too old."""
    total, known = np.zeros(len(angle.time_s)), np.ones(len(angle.time_s), bool)
    for label, load in loads.items():
        if len(load.time_s) < 2:
            raise ConfigError(name, "--load", f"{label!r} has {len(load.time_s)} values, expected a signal")
        last = np.searchsorted(load.time_s, angle.time_s, side="right") - 1
        interval = float(np.median(np.diff(load.time_s)))
        # a step of the angle may be longer than one of the load
        longest = _STALE * max(
            interval, float(np.median(np.diff(angle.time_s))) if len(angle.time_s) > 1 else 0.0
        )
        known &= (last >= 0) & (angle.time_s - load.time_s[np.maximum(last, 0)] <= longest)
        if not known.any():
            fault = f"{label!r} was not recorded at the same time as the joint"
            raise ConfigError(name, "--load", fault)
        total += load.value[np.maximum(last, 0)]
    return Rocked(angle.time_s[known], angle.value[known], total[known] if loads else None, tuple(findings))
