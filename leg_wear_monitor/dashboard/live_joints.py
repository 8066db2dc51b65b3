"""Joints as a monitor's messages tell them."""

from collections.abc import Mapping

import attrs

from leg_wear_monitor.dashboard.leg_view import LegSetup
from leg_wear_monitor.dashboard.received import hours_of, joint_forecast_of
from leg_wear_monitor.playback.result.condition import JointClearance, LifeHours, life_hours
from leg_wear_monitor.playback.result.parts import ClearanceChange, LegLife, ReplayJoint, ReplayStatus

_SEEN_BY = (("encoders", "encoders", "{}_seen_m"), ("diagnosis", "torque", "{}_clearance_m"))

_BELIEVED_BY = "believed_by_"

Statuses = Mapping[str, ReplayStatus]


@attrs.frozen
class LiveJoints:
    """Each joint's report, clearance and remaining life, by its name."""

    reports: dict[str, ReplayJoint]
    clearances: dict[str, JointClearance]
    life: dict[str, LifeHours | None]

    def life_with(self, leg: LegLife | None) -> dict[str, LifeHours | None]:
        """The lives with that of the leg; empty before there is one."""
        return self.life | ({"leg": life_hours(leg.hours)} if leg else {})


def joints_of(
    setup: LegSetup,
    statuses: Statuses,
    forecasts: Statuses,
    cycle: Mapping[str, Mapping[str, float | None]],
) -> LiveJoints:
    """The joints of a leg that were heard of.

    Parameters
    ----------
    setup : LegSetup
    statuses, forecasts : mapping of str to ReplayStatus
        Of ``/diagnostics`` and ``~/forecast``, by name.
    cycle : mapping
        Values of the last gait cycle by column and joint.
    """
    found = LiveJoints({}, {}, {})
    for joint in setup.joints:
        status = statuses.get(f"joint {joint}")
        counted_m = status.values.get("clearance_m") if status else None
        if status is None or counted_m is None:
            continue
        told = forecasts.get(f"forecast {joint}")
        found.reports[joint] = _report(status, counted_m, told, cycle, joint)
        found.clearances[joint] = _clearance(setup, joint, status, counted_m, statuses)
        found.life[joint] = life_hours(hours_of(status))
    return found


def _report(
    status: ReplayStatus,
    counted_m: float,
    told: ReplayStatus | None,
    cycle: Mapping[str, Mapping[str, float | None]],
    joint: str,
) -> ReplayJoint:
    values = status.values
    last_peak_n = cycle.get("peak_force_n", {}).get(joint)
    return ReplayJoint(
        clearance_m=ClearanceChange(counted_m, counted_m, values.get("clearance_max_m") or counted_m),
        growth_m_per_cycle=values.get("growth_m_per_cycle"),
        growth_mps=values.get("growth_mps"),
        forecast=joint_forecast_of(told) if told else None,
        peak_force_n=values.get("peak_force_n") if last_peak_n is None else last_peak_n,
        mean_force_n=values.get("mean_force_n"),
        impacts=int(values.get("impacts") or 0.0),
        growth_error_m_per_cycle=None,
    )


def _clearance(
    setup: LegSetup, joint: str, status: ReplayStatus, counted_m: float, statuses: Statuses
) -> JointClearance:
    """What is counted, and what encoders or the drive torque show best."""
    seen = []
    for name, by, key in _SEEN_BY:
        values = statuses[name].values if name in statuses else {}
        clearance_m, sigma_m = values.get(key.format(joint)), values.get(f"{joint}_sigma_m")
        if clearance_m is not None and sigma_m is not None:
            seen.append((sigma_m, clearance_m, by))
    sigma_m, clearance_m, by = min(seen) if seen else (None, None, "")
    limit_m = status.values.get("clearance_limit_m")
    believed = (key.removeprefix(_BELIEVED_BY) for key in status.values if key.startswith(_BELIEVED_BY))
    return JointClearance(
        counted_m=counted_m,
        seen_m=clearance_m,
        seen_sigma_m=sigma_m,
        seen_by=(by,) if by else (),
        new_m=setup.new_m[joint],
        limit_m=setup.limits_m[joint] if limit_m is None else limit_m,
        measured_m=status.values.get("measured_clearance_m"),
        measured_sigma_m=status.values.get("measured_sigma_m"),
        believed_m=status.values.get("believed_m"),
        believed_sigma_m=status.values.get("believed_sigma_m"),
        believed_by=next(believed, None),
    )
