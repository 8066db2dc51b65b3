"""Checks of samples as they come in: crank angles that interleave or have a wrong unit, torque outliers."""

import math

import numpy as np

from leg_wear_monitor.compiled.kernel import Record, entry, kernel, new_records, record_of
from leg_wear_monitor.monitor.verdict.verdict import table
from leg_wear_monitor.twin import CRANK, TORQUE
from leg_wear_monitor.twin.sample import (
    BRIDGE_LIMIT_S,
    GAIT_SAMPLE,
    GATE_RAD,
    NO_FAULT,
    OUT_OF_RANGE,
    Samples,
    TrackerSettings,
)
from leg_wear_monitor.twin.tracker import LARGEST_ANGLE, LARGEST_TORQUE

# Series of crank angles: each sample belongs to the series whose motion it continues best.
#
# The records of settings and states have the fields that are used here, and further ones.


_TURN = 2.0 * math.pi
WIDEST = 0.25  # distance from a series [rad] beyond which nothing belongs to it
_SETTLING = 0.02  # s, over which the speed of a series is averaged


@kernel
def wrapped(angle):
    """An angle in [-pi, pi)."""
    return angle - _TURN * math.floor(angle / _TURN + 0.5)


@kernel
def guess_speed(settings, state, k, stamp, angle):
    """Speed of a series of one sample: rest, commanded, or the other series' speed, whichever fits best."""
    if state.number[k] != 1:
        return
    h = 1.0e-9 * (stamp - state.stamp[k])
    moved, least = wrapped(angle - state.angle[k]), math.inf
    for speed in (0.0, settings.commanded, state.speed[1 - k]):
        off = abs(wrapped(moved - speed * h))
        if off < least:
            least, state.speed[k] = off, speed


@kernel
def distance(settings, state, k, stamp, angle):
    """How far an angle is from where series k would be; infinite where it cannot belong to it."""
    if state.number[k] == 0:
        return math.inf
    h = 1.0e-9 * (stamp - state.stamp[k])
    if abs(h) > settings.gap:
        return math.inf
    off = abs(wrapped(angle - state.angle[k] - state.speed[k] * h))
    # possible motion of the crank by its greatest acceleration
    widest = min(WIDEST, settings.gate + 0.5 * (settings.largest * h) ** 2)
    return off if off <= widest else math.inf


@kernel
def extend(state, k, stamp, angle):
    """One more sample of series k; a late or repeated one contains nothing new."""
    h = 1.0e-9 * (stamp - state.stamp[k])
    if h <= 0.0:
        return
    off = wrapped(angle - state.angle[k] - state.speed[k] * h)
    state.speed[k] += off / (h + _SETTLING)
    state.angle[k], state.stamp[k] = angle, stamp
    state.number[k] += 1


@kernel
def begin(state, k, stamp, angle):
    """A new series takes the place of series k."""
    state.number[k], state.stamp[k] = 1, stamp
    state.angle[k], state.speed[k] = angle, 0.0


# Crank angles that a single leg cannot give: two series that interleave, and angles in a wrong unit.
#
# Both are found from the samples' order of arrival alone, so that a replay has the same result as the live
# run.
#
# *Series*: each sample belongs to the series whose motion it continues best. Where two series go on side by
# side and neither continues the other, two sources send one crank's angle. *Unit*: the angle as it was sent,
# not wrapped to a turn, runs beyond the largest accepted speed, evenly and for some time.


SETTINGS = np.dtype(
    [
        ("gate", "f8"),  # largest difference of an angle from its series [rad]
        ("largest", "f8"),  # largest accepted speed [rad/s]
        ("gap", "f8"),  # longest gap within a series [s]
        ("alone", "f8"),  # time after which a missing series is forgotten [s]
        ("commanded", "f8"),  # speed [rad/s]
        ("torque", "f8"),  # RMS of the predicted drive torque [N m]
    ]
)
_RECENT = 512  # torques that an outlier is compared with
STATE = np.dtype(
    [
        # for both series
        ("number", "i8", (2,)),  # samples
        ("stamp", "i8", (2,)),  # stamp of the last sample [ns]
        ("angle", "f8", (2,)),  # [rad]
        ("speed", "f8", (2,)),  # [rad/s]
        ("last", "i8"),  # which of them had the last sample
        ("switches", "i8"),  # changes of `last` since the younger series began
        ("since", "i8"),  # stamp of the last such change [ns]
        ("two", "i8"),  # 1 if two sources send
        # for the unit
        ("anchor", "i8"),  # stamp of the last step's end [ns]
        ("anchor_angle", "f8"),  # [rad]
        ("step_speed", "f8"),  # speed of the last step [rad/s]
        ("fast", "i8"),  # fast steps in a row
        ("fast_speed", "f8"),  # mean speed of fast steps [rad/s]
        ("plausible", "f8"),  # time for which the angle has moved like a leg [s]
        ("other_unit", "i8"),  # 1 if the unit is wrong
        # samples withheld
        ("conflicting", "i8"),  # samples withheld since two sources send
        ("implausible", "i8"),  # samples withheld because the unit is wrong
        ("torque_outliers", "i8"),
        # for the drive torque
        ("recent", "f8", (_RECENT,)),  # sizes of the last torques [N m]
        ("torques", "i8"),  # number of torques
    ]
)

# Samples that make a series, and changes from one to the other. Glitches at random angles continue each other
# by chance in one of twelve (2 * WIDEST of a turn): eight in a row are one in thirty million.
_SERIES, _INTERLEAVED = 8, 8
_STEP_NS = 20_000_000  # least time of a step: noise of 1 mrad over it is 0.05 rad/s
_STEPS = 3  # fast steps in a row: the jump of an angle that wraps is one


@kernel
def _are_two(settings, state, stamp, angle):
    """True if two series continue side by side after one more sample."""
    for k in range(2):
        guess_speed(settings, state, k, stamp, angle)
    near = distance(settings, state, 0, stamp, angle)
    far = distance(settings, state, 1, stamp, angle)
    k = 0 if near <= far else 1
    strong = 0 if state.number[0] >= state.number[1] else 1
    if max(near, far) < math.inf and state.number[1 - strong] < _SERIES:
        k = strong  # a series must show itself by samples that the other does not explain
    if min(near, far) < math.inf:
        extend(state, k, stamp, angle)
    else:
        k = 0 if state.number[0] < state.number[1] else 1
        begin(state, k, stamp, angle)
        state.switches = 0
    if k != state.last:
        state.last, state.since = k, stamp
        state.switches += 1
    if min(state.number[0], state.number[1]) >= _SERIES and state.switches >= _INTERLEAVED:
        state.two = 1
    if abs(stamp - state.since) > 1.0e9 * settings.alone:
        # the other series has ended; a new series must appear again
        state.two, state.number[1 - k], state.switches, state.since = 0, 0, 0, stamp
    return state.two == 1


@kernel
def _is_other_unit(settings, state, stamp, angle):
    """True if the angle advances as no leg does, after one more sample."""
    step = stamp - state.anchor
    if state.anchor == 0 or abs(step) > 1.0e9 * settings.gap:
        state.anchor, state.anchor_angle, state.fast = stamp, angle, 0
    elif step >= _STEP_NS:
        h, before = 1.0e-9 * step, state.step_speed
        speed = (angle - state.anchor_angle) / h
        state.anchor, state.anchor_angle, state.step_speed = stamp, angle, speed
        if abs(speed) > settings.largest:
            along = speed * math.copysign(1.0, before)
            is_even = 0.5 * abs(before) < along < 2.0 * abs(before)
            state.fast = state.fast + 1 if is_even else 1
            if is_even:  # but not the jump of a wrapped angle
                state.plausible, state.fast_speed = 0.0, 0.5 * (state.fast_speed + abs(speed))
        else:
            state.fast = 0
            # at rest, the unit has no effect
            if abs(speed) > 0.1 * abs(settings.commanded):
                state.plausible += h
    if state.fast >= _STEPS:
        state.other_unit = 1
    elif state.plausible * abs(settings.commanded) >= _TURN:  # a gait cycle's time
        state.other_unit = 0
    return state.other_unit == 1


# A torque is an outlier if it is large against the prediction, and against most of the torques before it.
# Knocks of joints with 2 mm of clearance have 130 times the predicted RMS as instants, and 31 times as means
# over 5 ms; more than a tenth of large torques are no outliers, but a wrong unit, a load or a blocked leg.
_FAR, _FAR_FROM_OTHERS, _MANY, _LEAST_KNOWN = 40.0, 4.0, 0.1, 50


@kernel
def _is_torque_outlier(settings, state, torque):
    """True if a drive torque is far from the previous torques."""
    size = abs(torque)
    known = min(state.torques, _RECENT)
    is_far = not size <= LARGEST_TORQUE
    if not is_far and size > _FAR * settings.torque and known >= _LEAST_KNOWN:
        larger = 0
        for i in range(known):
            if state.recent[i] * _FAR_FROM_OTHERS > size:
                larger += 1
        is_far = larger < _MANY * known
    state.recent[state.torques % _RECENT] = size
    state.torques += 1
    return is_far


@entry
def check_samples(all_settings, states, stamp, kind, angle, out_torque, out_fault):
    """Mark samples (n,) that cannot be used, and leave torques out that are outliers.

    Crank samples are marked as long as two sources send or the unit is wrong. ``out_fault`` (n,) are the
    known faults, ``out_torque`` (n,) the torques, NaN for an outlier. ``all_settings`` and ``states`` have
    one record each; the state is changed.
    """
    settings, state = all_settings[0], states[0]
    for i in range(stamp.shape[0]):
        has_torque = out_fault[i] == NO_FAULT and stamp[i] > 0 and math.isfinite(out_torque[i])
        if has_torque and _is_torque_outlier(settings, state, out_torque[i]):
            state.torque_outliers += 1
            out_torque[i] = math.nan
            if kind[i] == TORQUE:
                out_fault[i] = OUT_OF_RANGE
                continue
        is_usable = kind[i] == CRANK and out_fault[i] == NO_FAULT and stamp[i] > 0
        if not is_usable or not abs(angle[i]) <= LARGEST_ANGLE:
            continue
        if _is_other_unit(settings, state, stamp[i], angle[i]):
            # its series mean nothing
            state.number[0], state.number[1], state.two = 0, 0, 0
            state.implausible += 1
            out_fault[i] = OUT_OF_RANGE
        elif _are_two(settings, state, stamp[i], angle[i]):
            state.conflicting += 1
            out_fault[i] = OUT_OF_RANGE


# Withholds samples from the twin that no single leg can send.


_ALONE_S = 1.0
_DEGREES, _NEAR = 180.0 / math.pi, 1.5  # largest factor between a leg's speed and the commanded speed


class InputGuard:
    """Checks samples before the twin follows them.

    An unusable crank sample gets the fault ``out_of_range``: it is counted, its time is unmonitored, and it
    adds no wear. A torque that is an outlier is left out.

    Parameters
    ----------
    settings : TrackerSettings
    size_nm : float
        RMS of the predicted drive torque.
    """

    def __init__(self, settings: TrackerSettings, size_nm: float) -> None:
        self._commanded = abs(settings.commanded_speed_radps)
        gap, speed = BRIDGE_LIMIT_S, settings.commanded_speed_radps
        alone = max(_ALONE_S, gap)
        self._settings = new_records(1, SETTINGS)
        self._settings[0] = GATE_RAD, settings.largest_speed, gap, alone, speed, size_nm
        self._states = new_records(1, STATE)
        self._state: Record = record_of(self._states)

    def warm_up(self) -> None:
        """Compile, before the first sample."""
        self.checked(np.zeros(1, GAIT_SAMPLE))
        self._states[:] = new_records(1, STATE)

    def checked(self, samples: Samples) -> Samples:
        """The same samples; a copy with faults where some cannot be used."""
        fault, torque = np.array(samples["fault"]), np.array(samples["torque_nm"])
        stamp, kind, angle = (np.array(samples[name]) for name in ("stamp_ns", "kind", "crank_angle_rad"))
        outliers = self.torque_outliers
        check_samples(self._settings, self._states, stamp, kind, angle, torque, fault)
        if np.array_equal(fault, samples["fault"]) and outliers == self.torque_outliers:
            return samples
        samples = samples.copy()
        samples["fault"], samples["torque_nm"] = fault, torque
        return samples

    @property
    def stamp_ns(self) -> int:
        """Stamp of the last checked crank sample; 0 before the first."""
        return int(self._state.stamp[self._state.last])

    @property
    def sources(self) -> int:
        """Present number of series of crank angles: 2 if two different series interleave."""
        return 1 + int(self._state.two)

    @property
    def conflicting(self) -> int:
        """Number of samples withheld because two sources sent them."""
        return int(self._state.conflicting)

    @property
    def implausible(self) -> int:
        """Number of samples withheld because their angle changes as in no leg."""
        return int(self._state.implausible)

    @property
    def torque_outliers(self) -> int:
        """Number of torques that are outliers."""
        return int(self._state.torque_outliers)

    @property
    def speed_ratio(self) -> float:
        """Speed of the angle over the commanded speed if no leg moves so fast; otherwise NaN."""
        if not self._state.other_unit:
            return math.nan
        return float(self._state.fast_speed) / self._commanded

    @property
    def cause(self) -> str:
        """Reason why crank samples are withheld at present, and the remedy; empty if none are."""
        texts, ratio = table().samples, self.speed_ratio
        if self.sources > 1:
            return texts["two_sources"]
        if math.isnan(ratio):
            return ""
        is_in_degrees = _DEGREES / _NEAR < ratio < _DEGREES * _NEAR
        return texts["degrees" if is_in_degrees else "fast"].format(ratio=f"{ratio:.2g}")
