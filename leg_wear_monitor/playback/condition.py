"""Condition of the leg at the end of a replay; what the verdict does not believe has no remaining life."""

import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import attrs

from leg_wear_monitor.monitor.encoders.clearance_estimate import ClearanceObservation
from leg_wear_monitor.monitor.forecast.forecast import JointForecast, LegForecast
from leg_wear_monitor.monitor.ledger.entry import VerdictEvent
from leg_wear_monitor.monitor.verdict.belief import BelievedClearance
from leg_wear_monitor.monitor.verdict.verdict import Evidence, Figure, State, Verdict
from leg_wear_monitor.playback.result.condition import JointClearance, LifeHours, life_hours

if TYPE_CHECKING:
    from leg_wear_monitor.playback.summary import ReplayResult


def joint_forecast(told: JointForecast | None, verdict: Verdict) -> JointForecast | None:
    """A joint's forecast; without its remaining life if the verdict does not believe that."""
    if told is None or Figure.FORECAST not in verdict.not_valid:
        return told
    return attrs.evolve(told, cycles=None, hours=None, days=None)


def leg_forecast(told: LegForecast | None, verdict: Verdict) -> LegForecast | None:
    """The leg's forecast; without its remaining life if the verdict does not believe that."""
    if told is None or Figure.FORECAST not in verdict.not_valid:
        return told
    return attrs.evolve(told, cycles=None, hours=None, days=None, first_probability={})


def clearances(result: "ReplayResult") -> dict[str, JointClearance]:
    """Clearance of each joint, as counted and as encoders or the drive torque show it best."""
    monitor, last = result.monitor, result.history.last
    limits = dict(zip(monitor.clearance_joints, monitor.clearance_limits_m, strict=True))
    diagnosis, found, believed = monitor.diagnosis, {}, monitor.believed_clearances
    for k, joint in enumerate(last.joints if last else ()):
        seen = []
        if joint.seen and joint.seen.observation is ClearanceObservation.SEEN:
            seen.append((joint.seen.sigma_m, joint.seen.clearance_m, "encoders"))
        if diagnosis.clearance_m and math.isfinite(diagnosis.clearance_m[k]):
            seen.append((diagnosis.sigma_m[k], diagnosis.clearance_m[k], "torque"))
        sigma_m, clearance_m, by = min(seen) if seen else (None, None, None)
        one = believed[joint.joint]
        found[joint.joint] = JointClearance(
            counted_m=joint.clearance_m,
            seen_m=clearance_m,
            seen_sigma_m=sigma_m,
            seen_by=(by,) if by else (),
            new_m=monitor.mechanism.clearances[joint.joint].radial_clearance,
            limit_m=limits[joint.joint],
            measured_m=joint.measured.clearance_m if joint.measured else None,
            measured_sigma_m=joint.measured.sigma_m if joint.measured else None,
            **(believed_fields(one) if one else {}),
        )
    return found


def believed_fields(one: BelievedClearance) -> dict[str, Any]:
    """A believed clearance as the fields of a `JointClearance` or a `ReplayJoint`."""
    sigma_m = None if math.isnan(one.sigma_m) else one.sigma_m
    return {"believed_m": one.clearance_m, "believed_sigma_m": sigma_m, "believed_by": one.by}


def life(result: "ReplayResult", verdict: Verdict) -> dict[str, LifeHours | None]:
    """Remaining life of each joint and of the leg; None where it is not known or not believed."""
    last = result.history.last
    if last is None:
        return {}
    return life_of({joint.joint: joint.forecast for joint in last.joints}, last.forecast, verdict)


def life_of(
    joints: Mapping[str, JointForecast | None], leg: LegForecast | None, verdict: Verdict
) -> dict[str, LifeHours | None]:
    """Remaining life of each joint and of the ``leg`` by their forecasts, as far as it is believed."""
    told: dict[str, JointForecast | LegForecast | None] = {
        name: joint_forecast(each, verdict) for name, each in joints.items()
    }
    told["leg"] = leg_forecast(leg, verdict)
    return {name: life_hours(each.hours) if each else None for name, each in told.items()}


def ledger_verdict(event: VerdictEvent) -> Verdict:
    """A verdict of a ledger."""
    return Verdict(
        state=State(event.state),
        joints=tuple(json.loads(event.joints)),
        why=event.why,
        since_ns=event.since_ns,
        do=event.to_do,
        evidence=tuple(_evidence(each) for each in json.loads(event.evidence)),
        not_valid=tuple(map(Figure, json.loads(event.not_valid))),
        fault_code=event.fault_code,
    )


def _evidence(record: dict[str, Any]) -> Evidence:
    return Evidence(**{field.name: record[field.name] for field in attrs.fields(Evidence)})
