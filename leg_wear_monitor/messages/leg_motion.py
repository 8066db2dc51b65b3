"""The moving leg for a page: crank angle, journals, forces and impacts twenty times a second.

Made only while somebody looks, and kept nowhere: a recording has all of it from its samples.
"""

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.files import finite_or_none, received_json
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.messages import encode
from leg_wear_monitor.messages.qos import SENSOR_DATA
from leg_wear_monitor.messages.streams import Output
from leg_wear_monitor.monitor.reports import SampleReports

MOTION = Output("~/motion", encode.STRING, SENSOR_DATA)

PERIOD_NS = 50_000_000
PHASES = 72  # equal parts of a gait cycle, by crank angle
_LEAST_FILLED = 0.5  # of the phases: a torque that comes more seldom is not drawn
_MOST_CHARACTERS = 20_000  # of a message; that of a leg with five joints has 2 000
_MOST_JOINTS = 50


@attrs.frozen
class JointMotion:
    """A clearance joint at one instant.

    Attributes
    ----------
    eccentricity_m : tuple of two floats
        Centre of the journal from that of its bushing, in the plane of the leg.
    force_n : float
        Contact force.
    impact_n : float
        Largest force since the last frame, if contact began in between; 0 if it did not.
    """

    eccentricity_m: tuple[float, ...]
    force_n: float
    impact_n: float = 0.0


@attrs.frozen
class CycleTorque:
    """Mean drive torque of a gait cycle in each of 72 equal parts of a turn; None where there is none."""

    measured_nm: tuple[float | None, ...]
    predicted_nm: tuple[float | None, ...]


@attrs.frozen
class MotionFrame:
    """The leg at one instant.

    Attributes
    ----------
    stamp_ns : int
    crank_angle_rad : float
    joints : dict of str to JointMotion
        The clearance joints.
    torque : CycleTorque or None
        Of the gait cycle that ended since the last frame.
    """

    stamp_ns: int
    crank_angle_rad: float
    joints: dict[str, JointMotion]
    torque: CycleTorque | None = None

    def to_json(self) -> str:
        """In one line."""
        return json.dumps(attrs.asdict(self), allow_nan=False, separators=(",", ":"))


def received_frame(text: str, source: str) -> MotionFrame:
    """A frame from the text of a message, which anybody may have sent.

    Raises
    ------
    ConfigError
        If it is none.
    """
    record = received_json(text, source, _MOST_CHARACTERS)
    frame: MotionFrame = structure(record, MotionFrame, source, "")
    pairs = all(len(joint.eccentricity_m) == 2 for joint in frame.joints.values())
    phases = frame.torque is None or {len(each) for each in attrs.astuple(frame.torque)} == {PHASES}
    if not pairs or not phases or len(frame.joints) > _MOST_JOINTS:
        raise ConfigError(source, "", "is no frame of a leg")
    return frame


@attrs.frozen
class CycleMotion:
    """A whole gait cycle in equal parts of a turn of the crank.

    Attributes
    ----------
    stamp_ns : int
        Its end.
    torque : CycleTorque
        Drive torque.
    joints : dict of str to tuple of JointMotion
        The clearance joints, at the first sample of each part.
    """

    stamp_ns: int
    torque: CycleTorque
    joints: dict[str, tuple[JointMotion, ...]]


class LegMotion:
    """Frames of reports, at the first sample of each twentieth of a second of the samples' stamps.

    Parameters
    ----------
    joints : sequence of str
        The clearance joints.
    by_phase : bool
        At the first sample of each of `PHASES` of the crank angle instead.
    """

    def __init__(self, joints: Sequence[str], *, by_phase: bool = False) -> None:
        self._joints, self._by_phase = tuple(joints), by_phase
        self._last = -1
        self._largest_n, self._least_n = np.zeros(len(joints)), np.full(len(joints), math.inf)
        self._torque = _PhaseMeans()

    def of(self, samples: SampleReports) -> Iterator[MotionFrame]:
        """Frames of samples; none while the leg is not followed."""
        begin = 0
        steps = samples.stamp_ns // PERIOD_NS
        if self._by_phase:
            steps = np.nan_to_num(samples.crank_angle_rad * (PHASES / math.tau)).astype(int) % PHASES
        for i in np.flatnonzero(np.diff(steps, prepend=self._last)).tolist():
            self._take(samples, begin, i + 1)
            begin = i + 1
            if not math.isnan(samples.crank_angle_rad[i]):
                yield self._frame(samples, i)
        self._take(samples, begin, len(samples))
        if len(samples):
            self._last = int(steps[-1])

    def _take(self, samples: SampleReports, begin: int, end: int) -> None:
        forces = np.nan_to_num(samples.contact_force_n[begin:end])
        if len(forces):
            self._largest_n = np.maximum(self._largest_n, forces.max(axis=0))
            self._least_n = np.minimum(self._least_n, forces.min(axis=0))
        self._torque.take(
            samples.crank_angle_rad[begin:end],
            samples.measured_torque_nm[begin:end],
            samples.predicted_torque_nm[begin:end],
        )

    def _frame(self, samples: SampleReports, i: int) -> MotionFrame:
        places, forces = samples.eccentricity_m[i], samples.contact_force_n[i]
        impacts = np.where(self._least_n == 0.0, self._largest_n, 0.0)
        joints = {
            joint: JointMotion(tuple(_rounded(places[k], 1.0e9)), *_rounded([forces[k], impacts[k]], 10.0))
            for k, joint in enumerate(self._joints)
        }
        self._largest_n[:], self._least_n[:] = 0.0, math.inf
        angle = round(float(samples.crank_angle_rad[i]), 4)
        return MotionFrame(int(samples.stamp_ns[i]), angle, joints, self._torque.pop())


def whole_cycles(joints: Sequence[str], reports: Iterable[SampleReports]) -> list[CycleMotion]:
    """The gait cycles of reports that follow on each other; the one that has begun before is left out."""
    motion, frames, cycles = LegMotion(joints, by_phase=True), list[MotionFrame](), list[CycleMotion]()
    for frame in (frame for samples in reports for frame in motion.of(samples)):
        if frame.torque:
            if frames:
                cycles.append(_cycle(frame.stamp_ns, frame.torque, frames))
            frames.clear()
        frames.append(frame)
    return cycles[1:]


def _cycle(stamp_ns: int, torque: CycleTorque, frames: Sequence[MotionFrame]) -> CycleMotion:
    """Frames by the part of the turn; a part without one is like the one before."""
    at, last, filled = {_phase(frame.crank_angle_rad): frame for frame in frames}, frames[-1], []
    for phase in range(PHASES):
        last = at.get(phase, last)
        filled.append(last)
    joints = {joint: tuple(frame.joints[joint] for frame in filled) for joint in last.joints}
    return CycleMotion(stamp_ns, torque, joints)


def _phase(angle_rad: float) -> int:
    return int(angle_rad * (PHASES / math.tau)) % PHASES


def _rounded(values: Any, per_unit: float) -> list[float]:
    """Values in steps that a picture shows; 0 for what is not known."""
    return [round(value * per_unit) / per_unit for value in np.nan_to_num(values).tolist()]


class _PhaseMeans:
    """Means of both torques by phase, cycle by cycle."""

    def __init__(self) -> None:
        self._sums = np.zeros((3, PHASES))  # count, measured, predicted
        self._last = -1
        self._done: CycleTorque | None = None

    def take(self, angle_rad: Floats, measured_nm: Floats, predicted_nm: Floats) -> None:
        known = np.isfinite(angle_rad) & np.isfinite(measured_nm) & np.isfinite(predicted_nm)
        phases = (angle_rad[known] * (PHASES / math.tau)).astype(int) % PHASES
        steps = np.diff(phases, prepend=self._last if self._last >= 0 else phases[:1])
        turns = np.flatnonzero(np.abs(steps) > PHASES // 2).tolist()
        both = np.stack([np.ones(len(phases)), measured_nm[known], predicted_nm[known]])
        for begin, end in zip([0, *turns], [*turns, len(phases)], strict=True):
            for sums, values in zip(self._sums, both[:, begin:end], strict=True):
                np.add.at(sums, phases[begin:end], values)
            if end < len(phases):
                self._finish()
        if len(phases):
            self._last = int(phases[-1])

    def pop(self) -> CycleTorque | None:
        """The last whole cycle, once."""
        done, self._done = self._done, None
        return done

    def _finish(self) -> None:
        count = self._sums[0]
        if (count > 0).mean() >= _LEAST_FILLED:
            with np.errstate(invalid="ignore"):
                means = (self._sums[1:] / count).round(3)
            self._done = CycleTorque(*(tuple(map(finite_or_none, row)) for row in means.tolist()))
        self._sums[:] = 0.0
