"""Conversion of reports to serialized output messages, byte-identical live and in replay."""

import json
from collections.abc import Iterable, Iterator, Sequence

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.files import or_nan
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.alarms import Alarm, code_of, state_of
from leg_wear_monitor.monitor.config.parameters import NODE
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.forecast.forecast import LegForecast, answer_words, lifetime_values
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
from leg_wear_monitor.monitor.verdict.verdict import with_unit
from leg_wear_monitor.recordings import encode
from leg_wear_monitor.recordings.leg_markers import MARKERS
from leg_wear_monitor.recordings.streams import LATCHED, SENSOR_DATA, ForecastTimes, Outgoing, Output, single
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin import CRANK

CLEARANCES = Output("~/clearance_states", encode.JOINT_STATE)
IMPACTS = Output("~/impact_forces", encode.JOINT_STATE, SENSOR_DATA)
TORQUE = Output("~/predicted_torque", encode.WRENCH_STAMPED, SENSOR_DATA)
FORECAST = Output("~/forecast", encode.DIAGNOSTIC_ARRAY, LATCHED)
ALARMS = Output("~/alarms", encode.DIAGNOSTIC_ARRAY, LATCHED)
VERDICT = Output("~/verdict", encode.DIAGNOSTIC_ARRAY, LATCHED)
STATE = Output("~/state", encode.STRING, LATCHED)
DIAGNOSTICS = Output("/diagnostics", encode.DIAGNOSTIC_ARRAY)
OUTPUTS = (CLEARANCES, IMPACTS, TORQUE, FORECAST, ALARMS, VERDICT, STATE, DIAGNOSTICS, MARKERS)
"""Outputs of every monitor."""

_DIGITS = 15


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
        self._forecasts = ForecastTimes()
        self._clearances = [f"{joint}_clearance" for joint in clearance_joints]
        self._impacts = [f"{joint}_impact" for joint in clearance_joints]

    def of(self, reports: Reports) -> Iterator[Outgoing]:
        """All messages for reports except forecasts: samples, gait cycles, alarms, verdict and state."""
        yield from self._of_samples(reports.samples)
        yield from map(self._clearance_states, reports.cycles)
        yield from map(self.alarms, reports.alarms)
        yield from map(self.verdict, reports.verdicts)
        yield from map(self.state, reports.states)

    def forecasts(self, reports: Reports) -> Iterator[Outgoing]:
        """Forecasts after the gait cycles after which one is due."""
        return map(self.forecast, self._forecasts.due(reports))

    def _of_samples(self, samples: SampleReports) -> Iterator[Outgoing]:
        """Torque at each tracked sample, and contact forces at each crank sample."""
        followed = np.isfinite(samples.predicted_torque_nm)
        if followed.any():
            yield self._torques(samples.stamp_ns[followed], samples.predicted_torque_nm[followed])
        followed &= samples.kind == CRANK
        if self.config.publish_impact_forces and followed.any():
            yield self._forces(samples, followed)

    def _torques(self, stamps: NDArray[np.int64], torques: Floats) -> Outgoing:
        torque = np.zeros((len(stamps), 3))
        torque[:, "xyz".index(self.config.drive_torque.axis)] = torques
        return Outgoing(TORQUE, stamps, encode.wrenches(stamps, torque=torque, frame_id=self.config.frame_id))

    def _forces(self, samples: SampleReports, which: NDArray[np.bool_]) -> Outgoing:
        stamps, forces = samples.stamp_ns[which], samples.contact_force_n[which]
        rows = encode.joint_states(stamps, self._impacts, effort=forces, frame_id=self.config.frame_id)
        return Outgoing(IMPACTS, stamps, rows)

    def _clearance_states(self, cycle: CycleReport) -> Outgoing:
        joints = cycle.joints
        rows = encode.joint_states(
            [cycle.stamp_ns],
            self._clearances,
            position=[[joint.clearance_m for joint in joints]],
            velocity=[[or_nan(joint.growth_mps) for joint in joints]],
            effort=[[joint.peak_force_n for joint in joints]],
            frame_id=self.config.frame_id,
        )
        return single(CLEARANCES, cycle.stamp_ns, rows.tobytes())

    def forecast(self, cycle: CycleReport) -> Outgoing:
        """Remaining life of each joint and of the leg after a gait cycle."""
        leg = [] if cycle.forecast is None else [_leg_lifetime(cycle.forecast)]
        return self._array(FORECAST, cycle.stamp_ns, [*map(_lifetime, cycle.joints), *leg])

    def alarms(self, alarms: AlarmList) -> Outgoing:
        """The present state of all alarms."""
        return self._array(ALARMS, alarms.stamp_ns, map(_alarm, alarms.alarms))

    def verdict(self, report: VerdictReport) -> Outgoing:
        """One status, as the first one of `DIAGNOSTICS`."""
        return self._array(VERDICT, report.stamp_ns, [verdict_status(report.verdict)])

    def state(self, report: VerdictReport) -> Outgoing:
        """JSON of the state of the leg, in one line."""
        text = json.dumps(report.state.to_dict(), allow_nan=False)
        return single(STATE, report.stamp_ns, encode.string(text))

    def diagnostics(self, stamp_ns: int, statuses: Iterable[Status]) -> Outgoing:
        """Statuses of the monitor."""
        return self._array(DIAGNOSTICS, stamp_ns, statuses)

    def _array(self, output: Output, stamp_ns: int, statuses: Iterable[Status]) -> Outgoing:
        lines = []
        for status in statuses:
            values = {key: plain(value) for key, value in status.values.items()}
            values = {"fault_code": status.fault_code, **values}
            name = f"{self._node}: {status.name}"
            lines.append((name, int(status.level), status.message, self.config.hardware, values))
        return single(output, stamp_ns, encode.diagnostic_array(stamp_ns, lines))


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
    if forecast.clearance_m is not None:
        quantiles = attrs.asdict(forecast.clearance_m)
        values |= {f"clearance_{fraction}_m": value for fraction, value in quantiles.items()}
    values["measurements"] = float(forecast.measurements)
    if forecast.prior is not None:
        values["wear_coefficient_sigma"] = forecast.prior.sigma
    return Status(name, Level.OK, answer_words(forecast), values)


def _leg_lifetime(forecast: LegForecast) -> Status:
    """Life until the first joint reaches its limit, and each joint's probability of being the first."""
    values = lifetime_values(forecast)
    values |= {f"{joint}_first_probability": value for joint, value in forecast.first_probability.items()}
    return Status("forecast leg", Level.OK, forecast.answer.value, values)
