"""Conversion of reports to serialized output messages, byte-identical live and in replay."""

import math
from collections.abc import Iterable, Iterator, Sequence

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.messages import encode
from leg_wear_monitor.messages.qos import LATCHED, RELIABLE, SENSOR_DATA, Qos
from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level
from leg_wear_monitor.monitor.alarms.fault_codes import code_of
from leg_wear_monitor.monitor.alarms.words import state_of
from leg_wear_monitor.monitor.config.parameter_file import NODE
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.forecast.forecast import LegForecast
from leg_wear_monitor.monitor.forecast.words import answer_words, lifetime_values
from leg_wear_monitor.monitor.reports import (
    AlarmList,
    CycleReport,
    JointReport,
    Reports,
    SampleReports,
    Status,
    VerdictReport,
)
from leg_wear_monitor.monitor.status import verdict_status
from leg_wear_monitor.monitor.verdict.words import with_unit
from leg_wear_monitor.twin.kinds import CRANK


@attrs.frozen
class Output:
    """An output topic of the monitor: name relative to the node, type and offered quality of service."""

    name: str
    type: str
    qos: Qos = RELIABLE


CLEARANCES = Output("~/clearance_states", encode.JOINT_STATE)
IMPACTS = Output("~/impact_forces", encode.JOINT_STATE, SENSOR_DATA)
TORQUE = Output("~/predicted_torque", encode.WRENCH_STAMPED, SENSOR_DATA)
FORECAST = Output("~/forecast", encode.DIAGNOSTIC_ARRAY)
ALARMS = Output("~/alarms", encode.DIAGNOSTIC_ARRAY, LATCHED)
VERDICT = Output("~/verdict", encode.DIAGNOSTIC_ARRAY, LATCHED)
DIAGNOSTICS = Output("/diagnostics", encode.DIAGNOSTIC_ARRAY)
OUTPUTS = (CLEARANCES, IMPACTS, TORQUE, FORECAST, ALARMS, VERDICT, DIAGNOSTICS)

_AXES = {"x": 0, "y": 1, "z": 2}
_DIGITS = 15


@attrs.frozen(eq=False)
class Outgoing:
    """Messages for one topic.

    Attributes
    ----------
    output : Output
    stamp_ns : (n,) array of int
    messages : (n, bytes) array of uint8
        One message per row.
    """

    output: Output
    stamp_ns: NDArray[np.int64]
    messages: NDArray[np.uint8]


class Messages:
    """Converts reports to messages.

    Parameters
    ----------
    config : MonitorConfig
    clearance_joints : sequence of str
        The clearance joints, in the order of the reports.
    node : str
        Full name of the node; without its leading slash, it prefixes the names in diagnostics.
    """

    def __init__(self, config: MonitorConfig, clearance_joints: Sequence[str], node: str = NODE) -> None:
        self.config, self._node = config, node.lstrip("/")
        self._clearances = [f"{joint}_clearance" for joint in clearance_joints]
        self._impacts = [f"{joint}_impact" for joint in clearance_joints]

    def of(self, reports: Reports) -> Iterator[Outgoing]:
        """All messages for reports: those of samples, of gait cycles, of alarms and of the verdict."""
        yield from self.of_samples(reports.samples)
        for cycle in reports.cycles:
            yield _single(CLEARANCES, cycle.stamp_ns, self.clearances(cycle))
        for alarms in reports.alarms:
            yield _single(ALARMS, alarms.stamp_ns, self.alarms(alarms))
        for verdict in reports.verdicts:
            yield _single(VERDICT, verdict.stamp_ns, self.verdict(verdict))

    def of_samples(self, samples: SampleReports) -> Iterator[Outgoing]:
        """Torque at each tracked sample, and contact forces at each crank sample."""
        followed = np.isfinite(samples.predicted_torque_nm)
        if followed.any():
            yield self._torques(samples, followed)
        followed &= samples.kind == CRANK
        if self.config.publish_impact_forces and followed.any():
            yield self._forces(samples, followed)

    def _torques(self, samples: SampleReports, which: NDArray[np.bool_]) -> Outgoing:
        stamps = samples.stamp_ns[which]
        torque = np.zeros((len(stamps), 3))
        torque[:, _AXES[self.config.drive_torque.axis]] = samples.predicted_torque_nm[which]
        return Outgoing(TORQUE, stamps, encode.wrenches(stamps, torque=torque, frame_id=self.config.frame_id))

    def _forces(self, samples: SampleReports, which: NDArray[np.bool_]) -> Outgoing:
        stamps, forces = samples.stamp_ns[which], samples.contact_force_n[which]
        rows = encode.joint_states(stamps, self._impacts, effort=forces, frame_id=self.config.frame_id)
        return Outgoing(IMPACTS, stamps, rows)

    def clearances(self, cycle: CycleReport) -> bytes:
        """The message of `CLEARANCES` for a gait cycle."""
        joints = cycle.joints
        growth = [math.nan if joint.growth_mps is None else joint.growth_mps for joint in joints]
        row = encode.joint_states(
            [cycle.stamp_ns],
            self._clearances,
            position=[[joint.clearance_m for joint in joints]],
            velocity=[growth],
            effort=[[joint.peak_force_n for joint in joints]],
            frame_id=self.config.frame_id,
        )
        raw: bytes = row[0].tobytes()
        return raw

    def forecast(self, cycle: CycleReport) -> bytes:
        """The message of `FORECAST` after a gait cycle: remaining life of each joint and of the leg."""
        leg = [] if cycle.forecast is None else [_leg_lifetime(cycle.forecast)]
        return self._array(cycle.stamp_ns, [*map(_lifetime, cycle.joints), *leg])

    def alarms(self, alarms: AlarmList) -> bytes:
        """The message of `ALARMS`: the present state of all alarms."""
        return self._array(alarms.stamp_ns, map(_alarm, alarms.alarms))

    def verdict(self, report: VerdictReport) -> bytes:
        """The message of `VERDICT`: one status, as the first one of `DIAGNOSTICS`."""
        return self._array(report.stamp_ns, [verdict_status(report.verdict)])

    def diagnostics(self, stamp_ns: int, statuses: Iterable[Status]) -> bytes:
        """The message of `DIAGNOSTICS`."""
        return self._array(stamp_ns, statuses)

    def _array(self, stamp_ns: int, statuses: Iterable[Status]) -> bytes:
        hardware = self.config.hardware
        lines = [
            (
                f"{self._node}: {status.name}",
                int(status.level),
                status.message,
                hardware,
                {
                    "fault_code": status.fault_code,
                    **{key: plain(value) for key, value in status.values.items()},
                },
            )
            for status in statuses
        ]
        return encode.diagnostic_array(stamp_ns, lines)


def _single(output: Output, stamp_ns: int, raw: bytes) -> Outgoing:
    return Outgoing(output, np.array([stamp_ns], np.int64), np.frombuffer(raw, np.uint8)[None, :])


def topic_of(output: Output, node: str) -> str:
    """Full name of a topic, for a node such as ``/robot/leg_wear_monitor``."""
    return node + output.name[1:] if output.name.startswith("~") else output.name


def plain(value: float) -> str:
    """A number as text: integers without a decimal point, other numbers with fifteen digits."""
    return str(int(value)) if float(value).is_integer() else f"{value:.{_DIGITS}g}"


def _alarm(alarm: Alarm) -> Status:
    values = {
        with_unit("value", alarm.unit): alarm.value,
        with_unit("limit", alarm.unit): alarm.limit,
        with_unit("worst", alarm.unit): alarm.worst,
        "raised_s": alarm.raised_ns / 1e9,
        "acknowledged": float(alarm.acknowledged),
        "present_level": float(alarm.present),
    }
    return Status(alarm.name, alarm.level, state_of(alarm), values, code_of(alarm))


def _lifetime(joint: JointReport) -> Status:
    name, forecast = f"forecast {joint.joint}", joint.forecast
    if forecast is None:
        return Status(name, Level.OK, "not enough growth or data", {})
    values = lifetime_values(forecast)
    values |= {
        f"clearance_{fraction}_m": value for fraction, value in attrs.asdict(forecast.clearance_m).items()
    }
    values["measurements"] = float(forecast.measurements)
    if forecast.prior is not None:
        values["wear_coefficient_sigma"] = forecast.prior.sigma
    return Status(name, Level.OK, answer_words(forecast), values)


def _leg_lifetime(forecast: LegForecast) -> Status:
    """Life until the first joint reaches its limit, and each joint's probability of being the first."""
    values = lifetime_values(forecast)
    values |= {f"{joint}_first_probability": value for joint, value in forecast.first_probability.items()}
    values["simulated_lives"] = float(forecast.simulated_lives)
    return Status("forecast leg", Level.OK, forecast.answer.value, values)
