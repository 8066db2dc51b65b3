"""All joints, torques, directions and signs, each fitted; which of them are as good as the best."""

from collections.abc import Callable, Iterable

import attrs
import numpy as np

from leg_wear_monitor.bags.series.signals import EFFORT, JointName, TorqueSource
from leg_wear_monitor.commissioning.search.gear_scan import scan
from leg_wear_monitor.estimate.torque_fit.fit import Fit, fit
from leg_wear_monitor.estimate.torque_fit.motion import JointMotion
from leg_wear_monitor.estimate.torque_fit.pairing import Pair, paired, steady_stretch
from leg_wear_monitor.estimate.torque_fit.series import Series
from leg_wear_monitor.estimate.torque_fit.start import Start
from leg_wear_monitor.estimate.torque_fit.torque_model import TorqueModel

_PEAKS = 2  # ratios that are fitted, of each direction and sign
_HOPELESS = 0.3  # of the best explained fraction, below which a pair gets one fit only
_LEAST_PAIRS = 4  # so that there is a runner-up
_ON_ONE_SHAFT_RAD = 0.005  # more than smoothed noise; the ripple of a gait that a wheel has not is larger
SAME_GEAR = 0.05


@attrs.frozen(eq=False)
class Candidate:
    """A joint as the crank, a torque as its drive torque, and the fit of one with the other."""

    joint: JointName
    torque: TorqueSource
    fit: Fit


def candidates(
    joints: dict[JointName, JointMotion],
    torques: dict[TorqueSource, Series],
    model: TorqueModel,
    progress: Callable[[float], None] = lambda _fraction: None,
) -> list[Candidate]:
    """Fits of all joints that turn with all torques, the best first; none if there is too little of them."""
    starts: list[tuple[JointName, TorqueSource, Pair, Pair, list[Start]]] = []
    for joint, motion in joints.items():
        for torque, series in torques.items():
            if torque.source == EFFORT and (torque.topic, torque.component) != (joint.topic, joint.joint):
                continue  # the monitor takes the crank's own effort
            pair = paired(motion, series)
            steady = steady_stretch(pair)
            found = sorted(scan(steady, model, _PEAKS), key=lambda start: -start.explained)
            if found:
                starts.append((joint, torque, pair, steady, found))
    best = max((each[-1][0].explained for each in starts), default=0.0)
    starts.sort(key=lambda each: -each[-1][0].explained)
    fitted: list[Candidate] = []
    for i, (joint, torque, pair, steady, found) in enumerate(starts):
        is_hopeless = found[0].explained < _HOPELESS * best
        if is_hopeless and i >= _LEAST_PAIRS:
            continue
        kept = found[:1] if is_hopeless else found
        fitted += [Candidate(joint, torque, _refined(pair, steady, model, start)) for start in kept]
        progress((i + 1) / len(starts))
    return sorted(fitted, key=lambda each: each.fit.mismatch)


def _refined(pair: Pair, steady: Pair, model: TorqueModel, start: Start) -> Fit:
    """Fit of the steady stretch, which makes the ratio exact enough for the fit of all."""
    near = fit(steady, model, start)
    offset = near.offset_rad[start.recording]
    return fit(pair, model, attrs.evolve(start, ratio=near.ratio, offset_rad=offset))


def on_one_shaft(one: Fit, other: Fit) -> bool:
    """Whether two joints turn in a fixed ratio: the crank angles that they give differ by a constant."""
    angle, there = one.crank()[0], other.crank()[0]
    time_s, times = one.pair.time_s, other.pair.time_s
    both = (time_s >= times[0]) & (time_s <= times[-1])
    apart = (angle - np.interp(time_s, times, there))[both]
    return len(apart) > 0 and float(apart.std()) < _ON_ONE_SHAFT_RAD


def first(found: Iterable[Candidate], holds: Callable[[Candidate], bool]) -> Candidate | None:
    """Best candidate of which something holds."""
    return next((each for each in found if holds(each)), None)


def same_gear(one: Fit, other: Fit) -> bool:
    """Whether two fits have about the same gear ratio."""
    return abs(one.gear_ratio / other.gear_ratio - 1.0) < SAME_GEAR
