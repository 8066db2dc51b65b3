"""Makes the forecast of a leg again, when something was measured after its last recording was counted."""

import attrs

from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.fleet.description.fleet_description import FleetLeg
from leg_wear_monitor.fleet.directory.leg_directory import LegDirectory, json_object
from leg_wear_monitor.fleet.learning.of_fleet import ledger_copy
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.monitor.alarms.alarm import Alarm
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.evaluation.specs import CLEARANCE
from leg_wear_monitor.monitor.forecast.forecast import ForecastBasis, JointForecast
from leg_wear_monitor.monitor.forecast.forecaster import Forecaster
from leg_wear_monitor.monitor.judgement import with_measured
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.monitor.verdict.belief import believed
from leg_wear_monitor.monitor.verdict.situation import JointSituation, SeenClearance
from leg_wear_monitor.monitor.verdict.verdict import Figure, Verdict
from leg_wear_monitor.playback.condition import (
    believed_fields,
    joint_forecast,
    ledger_verdict,
    leg_forecast,
    life_of,
)
from leg_wear_monitor.playback.result.condition import JointClearance
from leg_wear_monitor.playback.result.document import part_document
from leg_wear_monitor.playback.result.replay_summary import summary_of
from leg_wear_monitor.playback.summary import leg_life
from leg_wear_monitor.whole_file import write_whole

_BELIEVED = ("believed_m", "believed_sigma_m", "believed_by")


def is_renewal_due(directory: LegDirectory) -> bool:
    """Whether something was measured, or learned, that the last forecast of a leg does not know."""
    line = directory.last_counted()
    return line is not None and bool(line.get("basis")) and line["knows"] != directory.knowledge()


def renew(leg: FleetLeg, directory: LegDirectory) -> str:
    """Make the forecast of a leg again, in its last record and its summary; why not, empty if it is made.

    Clearances, verdict and remaining life follow the measurements in its ledger and what the fleet has
    learned. Growth is that at the end of its last recording. The ledger is left as it is.
    """
    try:
        _renew(leg, directory)
    except LegWearError as error:
        return f"its forecast is not renewed: {error}"
    return ""


def _renew(leg: FleetLeg, directory: LegDirectory) -> None:
    line, knows, source = directory.last_counted(), directory.knowledge(), str(directory.records)
    if line is None:
        raise ConfigError(source, "", "no recording is counted")
    basis = structure(line["basis"], ForecastBasis, source, "basis")
    verdict = structure(line["verdict"], Verdict, source, "verdict")
    before = structure(line["clearances"], dict[str, JointClearance], source, "clearances")
    mechanism = fitted(load_mechanism(leg.config.mechanism), leg.config)
    with ledger_copy(mechanism, leg.config, directory.ledger) as ledger:
        entry, event = ledger.entry, ledger.last_verdict
        replaced = {part.name: part.replaced_ns for part in entry.joints} if entry else {}
        replaced_ns = [replaced.get(joint, 0) for joint in mechanism.clearance_joints]
        known = ledger.measurements, replaced_ns, ledger.corrections
        forecaster = Forecaster(mechanism, leg.used_config.forecast, *known)
    if event is not None and _differs(now := ledger_verdict(event), verdict):
        verdict = now
    told = forecaster.again(basis, replaced_ns)
    forecasts = dict(zip(mechanism.clearance_joints, told.joints, strict=True))
    measured = zip(mechanism.clearance_joints, forecaster.last_measured(replaced_ns), strict=True)
    alarms = {alarm.subject: alarm for alarm in entry.alarms if alarm.kind == CLEARANCE.kind} if entry else {}
    clearances = {
        joint: _clearance(joint, before[joint], one, forecasts[joint], alarms.get(joint), verdict)
        for joint, one in measured
        if joint in before
    }
    life = life_of(forecasts, told.leg, verdict)
    summary = summary_of(json_object(directory.summary), str(directory.summary))
    summary = attrs.evolve(
        summary,
        verdict=verdict,
        joints={
            joint: attrs.evolve(
                one,
                forecast=joint_forecast(forecasts[joint], verdict),
                **{name: getattr(clearances[joint], name) for name in _BELIEVED},
            )
            for joint, one in summary.joints.items()
        },
        clearances=clearances,
        life=life,
        forecast=leg_life(leg_forecast(told.leg, verdict)),
        measurements=forecaster.measurements,
    )
    write_whole(directory.summary, summary.to_json().encode())
    found = {"verdict": verdict, "clearances": clearances, "life": life, "knows": knows}
    directory.renew({**line, **part_document(found)})


def _differs(one: Verdict, other: Verdict) -> bool:
    """Whether two verdicts say something else; the values of their evidence may be of another time."""
    return (one.state, one.fault_code, one.joints) != (other.state, other.fault_code, other.joints)


def _clearance(
    joint: str,
    before: JointClearance,
    measured: Measurement | None,
    forecast: JointForecast,
    alarm: Alarm | None,
    verdict: Verdict,
) -> JointClearance:
    """Clearance of a joint with what is measured now."""
    seen_m, sigma_m = before.seen_m, before.seen_sigma_m
    situation = JointSituation(
        joint=joint,
        counted_m=before.counted_m,
        limit_m=before.limit_m,
        believed_m=forecast.clearance_m.p50,
        seen=()
        if seen_m is None or sigma_m is None
        else tuple(SeenClearance(by, seen_m, sigma_m) for by in before.seen_by),
    )
    one = believed(with_measured(situation, measured), alarm, Figure.CLEARANCES not in verdict.not_valid)
    return attrs.evolve(
        before,
        measured_m=measured.clearance_m if measured else None,
        measured_sigma_m=measured.sigma_m if measured else None,
        **(believed_fields(one) if one else dict.fromkeys(_BELIEVED)),
    )
