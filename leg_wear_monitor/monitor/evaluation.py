"""Alarm evaluation of gait cycles and input, once in each evaluation period."""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.compiled.kernel import Records, entry, new_records
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.alarm_specs import AlarmSpec
from leg_wear_monitor.monitor.alarms import Alarm, Limit, acknowledged, cleared, evaluated, has_changed
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.input_health import (
    causes,
    input_health,
)
from leg_wear_monitor.monitor.inputs import InputGuard
from leg_wear_monitor.monitor.reports import AlarmList, CycleReport
from leg_wear_monitor.monitor.verdict.situation import is_observed
from leg_wear_monitor.monitor.verdict.verdict import table
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, NO_LOAD, Samples
from leg_wear_monitor.twin.statistics import Intake, Tracking

# All alarms of a monitor, and the limits that its parameters set for them.


_NO_SOURCES: Mapping[str, tuple[float, str]] = {}


def joint_specs(config: MonitorConfig) -> tuple[AlarmSpec, ...]:
    """Specs of the alarms of each clearance joint."""
    return (*alarm_specs.JOINT, *(alarm_specs.ENCODERS if config.encoders.names else ()))


def specs_of(
    config: MonitorConfig, clearance_joints: tuple[str, ...]
) -> Iterator[tuple[AlarmSpec, int, Alarm]]:
    """Specs of all alarms in their order, each with the number of its joint and its initial alarm."""
    for k, joint in enumerate(clearance_joints):
        yield from ((spec, k, spec.new(joint)) for spec in joint_specs(config))
    of_leg: tuple[AlarmSpec, ...] = (*alarm_specs.TORQUE, *alarm_specs.GAIT, *alarm_specs.OF_INPUT)
    of_leg += alarm_specs.OF_FOOT_LOAD if config.foot_load.source != NO_LOAD else ()
    yield from ((spec, 0, spec.new()) for spec in of_leg)


def limits_of(
    config: MonitorConfig, clearance_joints: tuple[str, ...], torque_size_nm: float
) -> dict[str, Limit]:
    """Limit of every alarm by its name; ``torque_size_nm`` is the RMS of the predicted drive torque."""
    specs = specs_of(config, clearance_joints)
    return {alarm.name: spec.limits(config, torque_size_nm, k) for spec, k, alarm in specs}


class AlarmBoard:
    """Present state of some alarms.

    Parameters
    ----------
    alarms : iterable of Alarm
    limits : mapping of str to Limit
        By the names of the alarms.

    Attributes
    ----------
    alarms : dict of str to Alarm
        By name, always in the same order.
    limits : mapping of str to Limit
    """

    def __init__(self, alarms: Iterable[Alarm], limits: Mapping[str, Limit]) -> None:
        self.alarms = {alarm.name: alarm for alarm in alarms}
        self.limits = limits

    @property
    def _clearances(self) -> list[str]:
        """Names of the alarms of clearances, in the order of the joints."""
        return [name for name, one in self.alarms.items() if one.kind == alarm_specs.CLEARANCE.kind]

    @property
    def clearance_limits_m(self) -> tuple[float, ...]:
        """Limit of each clearance joint's clearance."""
        return tuple(self.limits[name].error for name in self._clearances)

    @property
    def observed(self) -> tuple[str, ...]:
        """Alarms of clearances that are present because of something else than counting."""
        return tuple(name for name in self._clearances if is_observed(self.alarms[name]))

    def evaluate(
        self,
        values: Mapping[str, float],
        stamp_ns: int,
        cycles: int = 1,
        sources: Mapping[str, tuple[float, str]] = _NO_SOURCES,
        impact_factor: float = 1.0,
    ) -> tuple[AlarmList, ...]:
        """Evaluate values by alarm name; returns one list of all alarms if the shown state has changed.

        Parameters
        ----------
        values : mapping of str to float
        stamp_ns : int
        cycles : int
            Number of gait cycles that the values represent.
        sources : mapping of str to (float, str)
            Standard deviation and source of some values, by alarm name.
        impact_factor : float
            On the limits of impact forces.
        """
        found = []
        for name, value in values.items():
            limit = self._limit(name, impact_factor)
            found.append(evaluated(self.alarms[name], value, limit, stamp_ns, cycles, *sources.get(name, ())))
        return self._set(found, stamp_ns)

    def reaches(self, name: str, value: float) -> bool:
        """True if a value reaches the limit of WARN of an alarm."""
        return self.limits[name].reaches(value, Level.WARN)

    def _limit(self, name: str, impact_factor: float) -> Limit:
        """Limit of an alarm, with a factor on the limits of impact forces."""
        is_impact = impact_factor != 1.0 and self.alarms[name].kind == alarm_specs.IMPACT.kind
        return self.limits[name].times(impact_factor) if is_impact else self.limits[name]

    def evaluate_early(
        self, values: Mapping[str, float], stamp_ns: int, impact_factor: float = 1.0
    ) -> tuple[AlarmList, ...]:
        """Evaluate values that may still rise until the gait cycle ends: they can only raise their alarms."""
        found = []
        for name, value in values.items():
            before, limit = self.alarms[name], self._limit(name, impact_factor)
            after = evaluated(before, value, limit, stamp_ns)
            if limit.on_delay == 1 and after.present > before.present:
                found.append(after)
        return self._set(found, stamp_ns)

    def acknowledge(self, unmeasured: Collection[str] = ()) -> tuple[tuple[Alarm, ...], tuple[Alarm, ...]]:
        """Acknowledge all alarms; returns the cleared ones and the remaining ones in their new state.

        Parameters
        ----------
        unmeasured : collection of str
            Alarms whose values are not measured any more, in addition to alarms without a limit. They become
            normal, because no value can take them back.
        """
        names = {*unmeasured, *(self.alarms.keys() - self.limits)}
        gone = {name: attrs.evolve(self.alarms[name], present=Level.OK, beyond=(0, 0)) for name in names}
        alarms = (self.alarms | gone).values()
        now = [acknowledged(alarm) for alarm in alarms if alarm.level is not Level.OK]
        self.alarms |= {alarm.name: alarm for alarm in now}
        normal = tuple(alarm for alarm in now if alarm.level is Level.OK)
        return normal, tuple(alarm for alarm in now if alarm.level is not Level.OK)

    def acknowledge_one(self, name: str) -> None:
        """Acknowledge one alarm."""
        self.alarms = self.alarms | {name: acknowledged(self.alarms[name])}

    def clear(self, names: Iterable[str]) -> None:
        """Make alarms as new whose part is not there any more."""
        self.alarms = self.alarms | {name: cleared(self.alarms[name]) for name in names}

    def restore(self, alarms: Iterable[Alarm]) -> None:
        """Restore alarms from another run.

        Alarms of an encoder or a foot load that is no longer configured stay until they are acknowledged.
        """
        for alarm in alarms:
            is_done = alarm.acknowledged and alarm.name not in self.limits
            self.alarms[alarm.name] = cleared(alarm) if is_done else alarm

    def level(self, *names: str) -> Level:
        """Highest shown level of some alarms."""
        return max(self.alarms[name].level for name in names)

    def _set(self, found: list[Alarm], stamp_ns: int) -> tuple[AlarmList, ...]:
        before = self.alarms
        self.alarms = before | {alarm.name: alarm for alarm in found}
        if any(has_changed(before[alarm.name], alarm) for alarm in found):
            return (AlarmList(stamp_ns, tuple(self.alarms.values())),)
        return ()


# Evaluation periods: a quarter of the commanded gait cycle each, at whose end alarms are evaluated.
#
# They depend only on the order of arrival, so the instants of evaluation do not depend on how samples are cut
# into blocks. A period ends when two samples in a row lie outside of it; one alone may have a stray stamp. It
# also ends after many samples without a later time, or a stream of such would never be evaluated.


A_CYCLE = 4
IDLE_LIMIT, LIMIT = 50, 50_000  # number of samples without a time, number of all samples

PERIOD_STATE = np.dtype(
    [
        ("begin", "i8"),  # begin of the period [ns]
        ("newest", "i8"),  # newest stamp in the period [ns]
        ("idle", "i8"),  # samples since the newest
        ("outside", "i8"),  # 1 where the last sample lay outside
        ("count", "i8"),  # samples
    ]
)


@entry
def find_period_end(stamp, first, length, states):  # type: ignore[no-untyped-def]
    """Index after the sample, from ``first`` on, that ends the period; -1 if none does.

    ``stamp`` (n,) [ns], not above 0 if a sample has no stamp; ``length`` of a period [ns]; the only state in
    ``states`` is changed.
    """
    state = states[0]
    for i in range(first, stamp.shape[0]):
        at = stamp[i]
        state.idle += 1
        state.count += 1
        if at > 0:
            if state.begin == 0:
                state.begin, state.newest = at, at
            since = at - state.begin  # stamps above 0 cannot overflow
            outside = since >= length or since < -length
            if at > state.newest and not outside:
                state.newest, state.idle = at, 0
            if outside and state.outside > 0:
                state.begin, state.newest = at, at
                state.idle, state.outside, state.count = 0, 0, 0
                return i + 1
            state.outside = 1 if outside else 0
        if state.idle >= IDLE_LIMIT or state.count >= LIMIT:
            state.idle, state.count = 0, 0
            return i + 1
    return -1


class EvaluationPeriods:
    """Cuts a stream of samples at the ends of its evaluation periods.

    Parameters
    ----------
    length_ns : int
        Of a period.
    """

    def __init__(self, length_ns: int) -> None:
        self._length = length_ns
        self.state: Records = new_records(1, PERIOD_STATE)

    def pieces(self, samples: Samples) -> Iterator[tuple[Samples, bool]]:
        """Pieces of a block, and whether a period ends with each."""
        stamp: NDArray[np.int64] = np.ascontiguousarray(samples["stamp_ns"])
        begin = 0
        while begin < len(samples):
            end = int(find_period_end(stamp, begin, self._length, self.state))
            yield samples[begin : end if end > 0 else None], end > 0
            begin = end if end > 0 else len(samples)


_FASTER = 1.1  # factor on the commanded cadence; the default tolerance is a tenth


class AlarmEvaluation:
    """Evaluates a twin's gait cycles and its input.

    Parameters
    ----------
    twin : DigitalTwin
    config : MonitorConfig
    cycle_ns : int
        Duration of a commanded gait cycle.
    guard : InputGuard

    Attributes
    ----------
    health : dict of str to float
        Health of the input at its last evaluation; empty before.
    is_late : bool
        True if samples may be missing because this program was late, not the sender.
    """

    def __init__(
        self,
        twin: DigitalTwin,
        config: MonitorConfig,
        cycle_ns: int,
        guard: InputGuard,
    ) -> None:
        self._twin = twin
        self.guard = guard
        self._cycle_ns = cycle_ns
        self.config = config
        alarms = [alarm for _, _, alarm in specs_of(config, twin.clearance_joints)]
        self.board = AlarmBoard(alarms, limits_of(config, twin.clearance_joints, twin.torque_size_nm))
        self.health: dict[str, float] = {}
        self.is_late = False
        self._last_causes: tuple[str, ...] | None = None  # causes of unused samples, at the last evaluation
        self._cadence_rpm = 0.0  # cadence of the last gait cycle, 0 before the first
        self._skipped, self._skipped_before = 0, 0  # up to the last evaluation, and up to the one before
        self._begin(twin.intake)

    def _begin(self, intake: Intake) -> None:
        """Begin to collect the data for the next evaluation of the input, from some counts on."""
        self._before, self._withheld_before = intake, self._withheld
        self._samples: tuple[Samples, ...] = ()
        self._periods, self._cycles = 0, 0

    def configure(self, config: MonitorConfig) -> None:
        """Use other limits from now on."""
        self.config = config
        twin = self._twin
        self.board.limits = limits_of(config, twin.clearance_joints, twin.torque_size_nm)

    def is_model_valid(self) -> bool:
        """True if the model is valid for the present motion: cadence and torque are as expected."""
        return self.board.level(alarm_specs.CADENCE.name(), alarm_specs.MISMATCH.name()) is not Level.ERROR

    def add_samples(self, piece: Samples) -> None:
        """Add received samples."""
        self._samples = (*self._samples, piece)

    @property
    def causes(self) -> tuple[str, ...]:
        """Causes of unused samples, at present and over the duration of the last gait cycle."""
        now = (self.guard.cause,) if self.guard.cause else ()
        return now + (self._causes() if self._last_causes is None else self._last_causes)

    @property
    def _withheld(self) -> int:
        return self.guard.conflicting + self.guard.implausible

    def _causes(self) -> tuple[str, ...]:
        withheld = self._withheld - self._withheld_before
        crank, texts = self.config.crank_joint, table().samples
        return tuple(causes(self._before, self._twin.intake, withheld, self._received, crank, texts))

    @property
    def _received(self) -> Samples:
        """Samples since the last evaluation of the input."""
        return np.concatenate((np.zeros(0, GAIT_SAMPLE), *self._samples))

    def end_cycle(
        self, report: CycleReport, observed: Mapping[str, float], is_refused: bool = False
    ) -> tuple[AlarmList, ...]:
        """Evaluate a whole gait cycle; returns all alarms if one changed.

        Parameters
        ----------
        report : CycleReport
        observed : mapping of str to float
            Values of the observers, by the names of their alarms.
        is_refused : bool
            True if the crank's input has a fault: cadence and forces are then not the leg's.
        """
        self._cycles += 1
        values, factor = dict(observed), 1.0
        if is_refused:
            clearance = alarm_specs.CLEARANCE
            values |= {clearance.name(joint.joint): clearance.value(joint) for joint in report.joints}
        else:
            cycle = {alarm_specs.CADENCE.kind: abs(report.cadence_rpm - self.config.cadence.commanded_rpm)}
            values |= {spec.name(): spec.value(cycle) for spec in alarm_specs.GAIT}
            for joint in report.joints:
                values |= {spec.name(joint.joint): spec.value(joint) for spec in joint_specs(self.config)}
            factor = self._impact_factor(report.cadence_rpm)
            self._cadence_rpm = report.cadence_rpm
        for name in self.board.observed:  # it is evaluated with all that is known, at the period's end
            values.pop(name, None)
        return self.board.evaluate(values, report.stamp_ns, impact_factor=factor)

    def _impact_factor(self, rpm: float) -> float:
        """Factor on the limits of impact forces at a cadence; the limits hold for the commanded cadence.

        Forces grow with the square of the speed and more: peaks of a healthy leg are 4.1 kN at 60 and 6.9 kN
        at 75 rpm (medians of joint A over an hour). A gait cycle that ends slower
        than it began has the limits of the one before. Up to a tenth faster than commanded, as by a ripple,
        and slower, the limits stay.
        """
        cadence = self.config.cadence
        commanded = abs(cadence.commanded_rpm)
        fastest = min(max(abs(rpm), abs(self._cadence_rpm)), commanded + cadence.tolerance_rpm)
        return (fastest / commanded) ** 2 if fastest > _FASTER * commanded else 1.0

    def end_period(self, skipped: int = 0, is_refused: bool = False) -> tuple[AlarmList, ...]:
        """Evaluate impacts of the running gait cycle, and once per duration of a cycle the input.

        Parameters
        ----------
        skipped : int
            Number of samples skipped so far because their wear is already counted.
        is_refused : bool
            True if the crank has an input fault: its cadence and its impacts are not known.
        """
        peaks = {
            alarm_specs.IMPACT.name(joint): float(peak)
            for joint, peak in zip(self._twin.clearance_joints, self._twin.peak_force_n, strict=True)
        }
        factor = self._impact_factor(self._twin.speed_radps * 30.0 / math.pi)
        stamp_ns = self._twin.intake.followed_stamp_ns
        early = () if is_refused else self.board.evaluate_early(peaks, stamp_ns, factor)
        sources = {alarm_specs.SOURCES.name(): alarm_specs.SOURCES.value(self.guard)}
        early += self.board.evaluate(sources, self.guard.stamp_ns)
        self._periods += 1
        if self._periods < A_CYCLE:
            return early
        return early + self._evaluate_input(skipped, is_refused)

    def pause(self) -> None:
        """Note a pause of the recording: the evaluation of the input starts again with the next sample."""
        self.health, self._last_causes = {}, None
        self._begin(attrs.evolve(self._twin.intake, newest_stamp_ns=0))

    def _of_input(self, health: Mapping[str, float]) -> dict[str, float]:
        """Values of the input's alarms, by their names."""
        has_load = self.config.foot_load.source != NO_LOAD
        read = (*alarm_specs.INPUT, alarm_specs.FOOT_LOAD_RATE) if has_load else alarm_specs.INPUT
        return {spec.name(): spec.value(health) for spec in read}

    def _evaluate_input(self, skipped: int, is_refused: bool) -> tuple[AlarmList, ...]:
        intake, config = self._twin.intake, self.config
        is_whole = skipped == self._skipped == self._skipped_before
        received = self._received
        health = input_health(self._before, intake, received, is_whole)
        values = self._of_input(health)
        if self.is_late:
            # missing samples may be lost by this program; if none are missing, it says the same as a replay.
            # A rate of 0 belongs to a kind that is not sent
            unknown = input_health(self._before, intake, received, is_whole=False)
            without = self._of_input(unknown)
            over_time = {name: value for name, value in values.items() if math.isnan(without[name])}
            if any(value and self.board.reaches(name, value) for name, value in over_time.items()):
                health, values = unknown, without
        if self._cycles == 0 and not is_refused and self._twin.tracking is Tracking.OUT_OF_STEP:
            speed_rpm = self._twin.speed_radps * 30.0 / math.pi
            values[alarm_specs.CADENCE.name()] = abs(speed_rpm - config.cadence.commanded_rpm)
        self.health, self._last_causes = health, self._causes()
        self._skipped, self._skipped_before = skipped, self._skipped
        self._begin(intake)
        cycle_ns = self._cycle_ns if math.isnan(health["duration_s"]) else 1.0e9 * health["duration_s"]
        cycles = round(cycle_ns / self._cycle_ns)
        return self.board.evaluate(values, intake.newest_stamp_ns, max(1, cycles))
