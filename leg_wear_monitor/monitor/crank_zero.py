"""Holds samples back until the crank's zero is found, then passes them on.

An encoder on the motor's shaft starts at zero at each boot. Samples wait while the zero is looked for, and
follow it: no gait cycle is lost, as long as it is found among the samples that may wait. It is looked for at
the ends of evaluation periods, which do not depend on how samples are cut into blocks.
"""

import math
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from leg_wear_monitor.compiled.kernel import Record, entry, kernel, new_records, record_of
from leg_wear_monitor.estimate.torque_model import TorqueModel
from leg_wear_monitor.monitor.alarms import CRANK_ZERO
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.crank_walk import LEAST_TURNS, MOST_TURNS, Walk, Zero, last_walk, zero_of
from leg_wear_monitor.monitor.inputs import begin, distance, extend, guess_speed
from leg_wear_monitor.monitor.observer import Observer
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.monitor.verdict.verdict import estimate
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin import CRANK
from leg_wear_monitor.twin.sample import (
    BRIDGE_LIMIT_S,
    GAIT_SAMPLE,
    GATE_RAD,
    NO_FAULT,
    Samples,
    TrackerSettings,
)
from leg_wear_monitor.twin.tracker import LARGEST_ANGLE

# Restarts of the crank's encoder: places where its angle does not continue, in the order of arrival.


_TURN = 2.0 * math.pi

SETTINGS = np.dtype(
    [
        ("gate", "f8"),  # largest difference of an angle from its series [rad]
        ("largest", "f8"),  # largest accepted speed [rad/s]
        ("gap", "f8"),  # longest within a series [s]
        ("commanded", "f8"),  # speed [rad/s]
    ]
)
STATE = np.dtype(
    [
        # for the crank's series, and for a second series that may take its place
        ("number", "i8", (2,)),  # samples
        ("stamp", "i8", (2,)),  # stamp of the last sample [ns]
        ("angle", "f8", (2,)),  # [rad]
        ("speed", "f8", (2,)),  # [rad/s]
        ("first_stamp", "i8"),  # first stamp of the second series [ns]
        ("first_angle", "f8"),  # [rad]
        ("event", "i8"),  # at the sample where the search ended
    ]
)

# The angle leaves its series; it is back, or a different series has taken its place without a restart; it is
# in a different series, so the encoder has restarted.
LEAVES, CONTINUES, RESTARTS = range(3)

_SURE = 3  # samples of a new series; the tracker accepts a series after five, see `twin.tracker.tracking`
_WRAP = 1.5 * _TURN  # an angle that is wrapped to a turn jumps by less


@kernel
def _is_counted_on(settings, state):
    """True if the angle after a gap is too large for an encoder that restarted in it."""
    gap = 1.0e-9 * (state.first_stamp - state.stamp[0])
    return gap > settings.gap and abs(state.first_angle) > settings.largest * gap + _TURN


@kernel
def _belongs(settings, state, k, stamp, angle):
    """True if an angle continues series k."""
    guess_speed(settings, state, k, stamp, angle)
    ahead = state.speed[k] * 1.0e-9 * (stamp - state.stamp[k])
    if abs(angle - state.angle[k] - ahead) > _WRAP:
        return False
    return distance(settings, state, k, stamp, angle) < math.inf


@kernel
def _take_over(state):
    """The second series becomes the crank's."""
    state.number[0], state.stamp[0] = state.number[1], state.stamp[1]
    state.angle[0], state.speed[0] = state.angle[1], state.speed[1]
    state.number[1] = 0


@kernel
def _event(settings, state, stamp, angle):
    """Event at one more sample; -1 for none."""
    if state.number[0] == 0:
        begin(state, 0, stamp, angle)
        return -1
    since = 1.0e-9 * (stamp - state.stamp[0])
    if -settings.gap <= since <= 0.0:  # late or repeated
        return -1
    if _belongs(settings, state, 0, stamp, angle):
        extend(state, 0, stamp, angle)
        was_left = state.number[1] > 0
        state.number[1] = 0
        return CONTINUES if was_left else -1
    if state.number[1] > 0 and _belongs(settings, state, 1, stamp, angle):
        extend(state, 1, stamp, angle)
        if state.number[1] < _SURE:
            return -1
        event = CONTINUES if _is_counted_on(settings, state) else RESTARTS
        _take_over(state)
        return event
    event = LEAVES if state.number[1] == 0 else -1
    begin(state, 1, stamp, angle)
    state.first_stamp, state.first_angle = stamp, angle
    return event


@entry
def find_event(all_settings, states, stamp, kind, angle, fault, first):
    """Index of the sample, from ``first`` on, at which the next event is; -1 if there is none.

    ``all_settings`` and ``states`` have one record each; the state is changed, and its ``event`` names the
    event.
    """
    settings, state = all_settings[0], states[0]
    for i in range(first, stamp.shape[0]):
        if kind[i] != CRANK or fault[i] != NO_FAULT or stamp[i] <= 0 or not abs(angle[i]) <= LARGEST_ANGLE:
            continue
        event = _event(settings, state, stamp[i], angle[i])
        if event >= 0:
            state.event = event
            return i
    return -1


_A_CYCLE = 4  # evaluation periods of a gait cycle
_MOST_PERIODS = _A_CYCLE * (MOST_TURNS + 4)  # samples wait so long; enough for a slower cadence
_MOST_SAMPLES = 400_000  # 30 MB
_LONGEST_DOUBT = _A_CYCLE  # periods after which an angle that neither continues nor restarts is a new series

_LONGEST_REST = 4 * _A_CYCLE  # periods between attempts, because an attempt takes a tenth of a second

_NONE: Samples = np.zeros(0, GAIT_SAMPLE)


@attrs.define
class CrankZeroState:
    """State of the search.

    Attributes
    ----------
    zero : Zero or None
        The present one.
    times_found : int
    turns : int
        Turns of the present walk.
    why : str
        Why no zero was found; empty while there was no attempt.
    attempts : int
        Attempts in vain of this search.
    rest : int
        Periods until the next attempt.
    waiting : tuple of Samples
        Samples that wait for the zero, by evaluation periods; the last one is not over.
    doubtful : tuple of Samples
        Samples since the angle has left its series.
    doubts : int
        Periods since then.
    has_passed : bool
        True if samples were passed on in this run.
    waiting_s : float
        Time of the samples that wait, up to the last period that is over.
    dropped_s, before_s : float
        Time of samples that waited too long in this search, and in all before the first samples were passed
        on, after which the twin counts the time.
    """

    zero: Zero | None = None
    times_found: int = 0
    turns: int = 0
    why: str = ""
    attempts: int = 0
    rest: int = 0
    waiting: tuple[Samples, ...] = ()
    doubtful: tuple[Samples, ...] = ()
    doubts: int = 0
    has_passed: bool = False
    waiting_s: float = 0.0
    dropped_s: float = 0.0
    before_s: float = 0.0


class CrankZero(Observer):
    """Finds the zero of the crank's encoder.

    Parameters
    ----------
    model : TorqueModel
    config : MonitorConfig
    tracker : TrackerSettings
    """

    def __init__(self, model: TorqueModel, config: MonitorConfig, tracker: TrackerSettings) -> None:
        self._model, self._config = model, config
        self._gap_s = BRIDGE_LIMIT_S
        self._settings = new_records(1, SETTINGS)
        speed = tracker.commanded_speed_radps
        self._settings[0] = GATE_RAD, tracker.largest_speed, self._gap_s, speed
        self._series = new_records(1, STATE)
        self._event: Record = record_of(self._series)
        self.state = CrankZeroState()

    def warm_up(self) -> None:
        """Compile, before the first sample."""
        self.passed(_NONE, ends_period=False)

    def passed(self, samples: Samples, ends_period: bool) -> Samples:
        """Samples to track now, with the zero: these samples, earlier ones that waited, or none.

        Parameters
        ----------
        samples : (n,) array of GAIT_SAMPLE
        ends_period : bool
            True if an evaluation period ends with them.
        """
        out: list[Samples] = []
        stamp, kind, fault = (np.array(samples[name]) for name in ("stamp_ns", "kind", "fault"))
        angle, begin = np.array(samples["crank_angle_rad"]), 0
        while True:
            at = find_event(self._settings, self._series, stamp, kind, angle, fault, begin)
            self._add(samples[begin : at if at >= 0 else None], out)
            if at < 0:
                break
            self._take_event(out)
            self._add(samples[at : at + 1], out)
            begin = at + 1
        if ends_period:
            self._end_period(out)
        return np.concatenate([_NONE, *out])

    @property
    def cause(self) -> str:
        """Why nothing is monitored at present; empty if the zero is known."""
        state = self.state
        if state.zero is not None:
            return ""
        turns = f"{min(state.turns, LEAST_TURNS)} of {LEAST_TURNS} turns"
        if state.turns > LEAST_TURNS:
            turns = f"{state.turns} turns were not enough"
        return f"searching for the crank's zero: {turns}" + (f", {state.why}" if state.why else "")

    @property
    def unmonitored_s(self) -> float:
        """Time [s] of samples that wait, or waited in vain, as far as the twin does not count it."""
        state = self.state
        last_s = _duration_s(state.waiting[-1:], self._gap_s)
        return state.before_s + state.dropped_s + state.waiting_s + last_s

    @property
    def notes(self) -> Mapping[str, Sequence[str]]:
        """Why nothing is monitored at present."""
        return {CRANK_ZERO: (self.cause,)} if self.cause else {}

    @property
    def statuses(self) -> Sequence[Status]:
        """The zero of the crank's encoder and its runner-up, or why it is not known."""
        state, zero = self.state, self.state.zero
        found = ("offset_rad", "sigma_rad", "mismatch", "other_rad", "other_mismatch")
        values = {
            **{name: getattr(zero, name, math.nan) for name in found},
            "turns": float(zero.turns if zero else state.turns),
            "least_turns": float(LEAST_TURNS),
            "times_found": float(state.times_found),
            "not_monitored_s": self.unmonitored_s,
        }
        if zero is None:
            return (Status("crank zero", Level.WARN, self.cause, values, CRANK_ZERO),)
        offset = estimate(zero.offset_rad, zero.sigma_rad, "rad")
        return (Status("crank zero", Level.OK, f"crank angle at joint position 0: {offset}", values),)

    def _add(self, samples: Samples, out: list[Samples]) -> None:
        """Add samples without an event."""
        state = self.state
        if not len(samples):
            return
        if state.doubtful:
            state.doubtful = (*state.doubtful, samples.copy())
        elif state.zero is not None:
            out.append(self._placed(samples, state.zero))
        else:
            *before, last = state.waiting or (_NONE,)
            state.waiting = (*before, np.concatenate([last, samples]))

    def _placed(self, samples: Samples, zero: Zero) -> Samples:
        self.state.has_passed = True
        samples = samples.copy()
        samples["crank_angle_rad"] += zero.offset_rad
        return samples

    def _take_event(self, out: list[Samples]) -> None:
        """Settle the doubtful samples before the sample of an event is added."""
        state, event = self.state, int(self._event.event)
        if event == LEAVES:
            state.doubtful, state.doubts = (_NONE,), 0
            return
        doubtful, state.doubtful = np.concatenate([_NONE, *state.doubtful]), ()
        if event == RESTARTS:
            self._begin()
        self._add(doubtful, out)

    def _begin(self) -> None:
        """Begin to look for the zero of an encoder that has restarted."""
        state = self.state
        self._drop(len(state.waiting))
        state.zero, state.turns, state.why, state.waiting_s = None, 0, "", 0.0
        state.attempts, state.rest = 0, 0

    def _drop(self, number: int) -> None:
        """Drop the samples of the first periods; their time is not monitored."""
        state, following = self.state, self.state.waiting[number : number + 1]
        if number:
            # the step to the first kept sample is lost as well
            lost = (*state.waiting[:number], *(part[part["kind"] == CRANK][:1] for part in following))
            state.dropped_s += _duration_s(lost, self._gap_s)
            state.waiting = state.waiting[number:]

    def _end_period(self, out: list[Samples]) -> None:
        state = self.state
        if state.doubtful:
            state.doubts += 1
            if state.doubts > _LONGEST_DOUBT:
                doubtful, state.doubtful = np.concatenate(state.doubtful), ()
                self._begin()
                self._series["number"] = 0
                self._add(doubtful, out)
        if state.zero is None:
            self._look()
            out += self._released()

    def _look(self) -> None:
        """Look for the zero among the samples that wait."""
        state = self.state
        waiting = np.concatenate([_NONE, *state.waiting])
        walk = last_walk(waiting, self._config.cadence, self._gap_s)
        state.turns, state.rest = walk.turns, max(0, state.rest - 1)
        if walk.turns < LEAST_TURNS:
            state.why = walk.why
        elif not state.rest:
            found = self._found(walk)
            if isinstance(found, Zero):
                state.zero, state.why, state.times_found = found, "", state.times_found + 1
                return
            state.attempts += 1
            state.why, state.rest = found, min(state.attempts * _A_CYCLE, _LONGEST_REST)
        self._drop(self._too_many())
        state.waiting_s = _duration_s(state.waiting, self._gap_s)
        state.waiting = (*state.waiting, _NONE)

    def _found(self, walk: Walk) -> Zero | str:
        """The zero from the newest turns, else from all; else why it cannot be found."""
        sampling = self._config.drive_torque.sampling
        if walk.turns > LEAST_TURNS:
            # a fault of the torque that is over must not be waited out
            found = zero_of(walk.newest(LEAST_TURNS), self._model, sampling)
            if isinstance(found, Zero):
                return found
        return zero_of(walk, self._model, sampling)

    def _too_many(self) -> int:
        """Number of periods whose samples cannot wait any longer."""
        lengths = np.cumsum([len(part) for part in reversed(self.state.waiting)])
        return max(len(lengths) - _MOST_PERIODS, int(np.count_nonzero(lengths > _MOST_SAMPLES)))

    def _released(self) -> list[Samples]:
        """All samples that wait, with the zero; none while it is not found."""
        state = self.state
        if state.zero is None:
            return []
        if not state.has_passed:
            state.before_s += state.dropped_s
        waiting, state.waiting, state.waiting_s, state.dropped_s = state.waiting, (), 0.0, 0.0
        return [self._placed(np.concatenate([_NONE, *waiting]), state.zero)]


def _duration_s(parts: tuple[Samples, ...], longest_gap_s: float) -> float:
    """Time [s] that crank samples cover, without gaps."""
    samples = np.concatenate([_NONE, *parts])
    is_sound = (samples["kind"] == CRANK) & (samples["fault"] == NO_FAULT) & (samples["stamp_ns"] > 0)
    steps_s = 1.0e-9 * np.diff(np.sort(samples["stamp_ns"][is_sound]))
    return float(steps_s[steps_s <= longest_gap_s].sum())
