"""Sentences on what cannot be determined, on what does not fit, and on what is worth knowing."""

import math
from collections.abc import Iterator

import numpy as np

from leg_wear_monitor.bags.series.signals import FLOAT64
from leg_wear_monitor.commissioning.evidence.misfit import Load, does_not_fit
from leg_wear_monitor.commissioning.evidence.timing import cadences_rpm
from leg_wear_monitor.commissioning.proposal.found import Found, gear, gear_error, offset_rad
from leg_wear_monitor.estimate.cause import Cause, NamedCause
from leg_wear_monitor.estimate.torque_fit.likeness import repeating
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.fitting import largest_lag_s
from leg_wear_monitor.monitor.verdict.cause_words import CauseWords

_SURE = 3.0
_TOLD = 2.0  # standard deviations that have to be less than what is asked for
_ANEW_RAD = 0.1  # by which offsets of two recordings of one absolute encoder do not differ
_IN_DEGREES = math.degrees(1.0)
_ROUGH_SCALE = 0.05
_ROUGH_REST = 0.15  # a repeating rest that may shift the scale by more than twice what clearances do
_DECLARED_ERROR = 0.3  # by which a drive differs from another one of its kind, and when it is warm
_AT_ZERO_RAD = 0.02


def not_told(found: Found) -> tuple[str, ...]:
    """Parameters that the recording does not determine, and why."""
    told = list(found.doubts)
    if not found.sampling.value:
        told.append(f"drive_torque.sampling: {found.sampling.why}")
    told += _lag(found)
    ratio, is_exact = gear(found)
    if not is_exact:
        error = found.fit.sigma["ratio"] / abs(found.fit.ratio)
        away = error * abs(float(found.fit.crank()[1].mean())) * 3600.0
        told.append(
            f"crank.gear_ratio: {ratio:.7g} is known to ± {error * ratio:.2g}, so the crank angle drifts "
            f"by up to {away:.2g} rad in an hour; enter the ratio of the teeth"
        )
    scale, rest = found.fit.sigma["gain"] / abs(found.fit.gain), repeating(found.fit)
    if scale > _ROUGH_SCALE:
        told.append(f"drive_torque.scale: known to ± {100.0 * scale:.0f} % only; record longer")
    elif rest > _ROUGH_REST:
        told.append(
            f"drive_torque.scale: {100.0 * rest:.0f} % of the torque repeats and does not fit; the scale "
            "may be wrong by as much"
        )
    return tuple(told)


def findings(found: Found, load: Load | None, mechanism: Mechanism) -> tuple[str, ...]:
    """What does not fit, or cannot be used as it is."""
    return tuple(
        text
        for text in (
            _load(load),
            # of a leg that is not known, neither friction nor phases tell anything
            *(
                ()
                if found.doubts
                else (does_not_fit(found.fit, mechanism), _drives(found), _late(found), _anew(found))
            ),
            _position(found),
        )
        if text
    )


def notes(found: Found) -> tuple[str, ...]:
    """What is worth knowing."""
    return tuple(_notes(found))


def _lag(found: Found) -> Iterator[str]:
    timing, most = found.timing, found.base.drive_torque.max_lag_s
    if math.isfinite(timing.declared_s):
        return
    if not timing.is_lag_separated:
        turned = 1.0e-3 * abs(float(np.median(found.fit.crank()[1])))
        yield (
            f"lag: at one cadence, a torque that is late by 1 ms looks like {turned:.2g} rad of offset; "
            "record two cadences in one recording, or declare drive.lag_s"
        )
    elif _TOLD * timing.error_s > most:
        error = 1.0e3 * _TOLD * timing.error_s
        yield (
            f"lag: known to ± {error:.2g} ms only, more than drive_torque.max_lag_s ({1.0e3 * most:g} ms), "
            "because clearances shift the torque's phase with the cadence; record cadences further apart"
        )


def _otherwise(found: Found) -> Iterator[str]:
    """Declared figures of the drive that the recording contradicts."""
    declared = found.declared
    pairs = (
        ("load friction", declared.load_friction, found.load_friction, ""),
        ("constant friction", declared.coulomb_nm, found.friction_nm, " N m"),
    )
    for name, figure, (value, sigma), unit in pairs:
        if abs(figure - value) > _SURE * sigma + _DECLARED_ERROR * figure:
            yield (
                f"the {name} of the drive is {value:.2g} ± {sigma:.1g}{unit}, {figure:.3g}{unit} is "
                "declared: is drive.type right?"
            )


def _load(load: Load | None) -> str:
    if load is None:
        return ""
    return (
        f"a foot load of {load.force_n:.3g} N ± {load.sigma_n:.2g} N explains {100.0 * load.explained:.0f} % "
        "of what does not fit; the proposal allows for it, but record with the foot in the air"
    )


def _drives(found: Found) -> str:
    one = found.fit
    friction, sigma = found.friction_nm
    size = float(one.predicted.std()) / abs(one.gain)
    if friction < -_SURE * sigma and abs(friction) > 0.02 * size:
        words = CauseWords(found.base.crank, found.base.drive_torque)
        return f"{words.cause(NamedCause(Cause.BIAS, friction, sigma))}: zero the torque sensor"
    return ""


def _late(found: Found) -> str:
    late, most = found.timing.late_s, largest_lag_s(found.base)
    if not abs(late) - _SURE * found.timing.error_s > most:
        return ""
    return (
        f"the torque is late by {1.0e3 * late:.3g} ms, more than drive_torque.max_lag_s and the declared lag "
        f"of the drive ({1.0e3 * most:.3g} ms)"
    )


def _anew(found: Found) -> str:
    offsets = [offset_rad(found, number) for number in sorted(found.fit.offset_rad)]
    apart = max(abs((each - offsets[0] + math.pi) % TURN - math.pi) for each in offsets)
    if apart < _ANEW_RAD:
        return ""
    each = ", ".join(f"{offset:.3f}" for offset in offsets)
    return (
        f"the encoder starts at another zero in each recording: the torque's phase gives the offsets {each} "
        "rad; the proposed offset is that of the last recording and is valid until the next boot"
    )


def _position(found: Found) -> str:
    measured = found.fit.gear_ratio
    if abs(measured / _IN_DEGREES - 1.0) < 2.0 * gear_error(found.fit):
        return "the joint's position looks like degrees; ROS expects radians: gear ratio 57.2958"
    if found.motion.is_wrapped and gear(found)[0] != 1.0:
        return (
            f"the joint's position is wrapped to a turn, but its gear ratio is {measured:.6g}: the monitor "
            "needs a continuous position"
        )
    return ""


def _notes(found: Found) -> Iterator[str]:
    yield from found.choice.also
    yield from _otherwise(found)
    ratio = gear(found)[0]
    if ratio != 1.0 and len(found.fit.offset_rad) == 1:
        is_zero = bool(abs(found.motion.first_rad[-1]) < _AT_ZERO_RAD)
        seems = "its first reading is 0" if is_zero else "motor encoders often do"
        yield (
            f"the encoder turns {ratio:.6g} times in a turn of the crank; if it starts at zero at each boot "
            f"({seems}), the offset from the torque's phase is valid until the next boot; then run "
            "commission again"
        )
    for topic, name in (
        (found.best.joint.topic, "joint_states"),
        (found.best.torque.topic, "drive_torque"),
    ):
        if topic != f"/{name}" and not (name == "drive_torque" and topic == found.best.joint.topic):
            yield f"start the monitor with -r {name}:={topic}, replay with --{name.replace('_', '-')} {topic}"
    if found.best.torque.source == FLOAT64:
        yield "a Float64 has no stamp: the torque has its time of arrival, so delayed messages are a lag"
    speeds = cadences_rpm(found.fit)
    if len(speeds) > 1:
        each = " and ".join(f"{speed:g}" for speed in speeds)
        yield (
            f"the leg walks at about {each} rpm; cadence.commanded_rpm is the most frequent one: "
            "set it to the cadence of its work"
        )
