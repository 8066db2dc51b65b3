"""Forecasts of a fleet with what it learned, and the files of that."""

import hashlib
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.configuration import part_document
from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.files import json_text, write_whole
from leg_wear_monitor.fleet.description import FleetLeg
from leg_wear_monitor.fleet.directory import LegDirectory, json_object
from leg_wear_monitor.fleet.learning import LearnedPair, LearnedPart, Part, learn, parts_of
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.spec import Clearance, Mechanism
from leg_wear_monitor.monitor.alarm_specs import CLEARANCE, with_its_unit
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.state import DiagnosisState
from leg_wear_monitor.monitor.forecast.forecast import ForecastBasis, JointCondition, JointForecast
from leg_wear_monitor.monitor.forecast.forecaster import Forecaster
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    SCHEMA_VERSION,
    CoefficientPrior,
    LearnedCoefficient,
    LearnedJoint,
    LearnedPriors,
    nominal_per_pa,
)
from leg_wear_monitor.monitor.judgement import joint_clearance, leg_alarm, life_of, with_measured
from leg_wear_monitor.monitor.ledger.entry import Entry, JointWear, Measurement
from leg_wear_monitor.monitor.ledger.file import copy_of, measurements_of
from leg_wear_monitor.monitor.ledger.ledger import Ledger, open_ledger
from leg_wear_monitor.monitor.status import verdict_status
from leg_wear_monitor.monitor.verdict.situation import JointSituation, KnownClearance
from leg_wear_monitor.monitor.verdict.verdict import has_changed
from leg_wear_monitor.playback.result import ReplayStatus, summary_of
from leg_wear_monitor.playback.summary import joint_forecast, leg_forecast
from leg_wear_monitor.state import Figure, JointClearance, LegAlarm, Level, TorqueDiagnosis, Verdict

# What a fleet has learned, as files: ``learning.json``, and for each leg the file of ``forecast.priors``.


LEARNING, LEARNING_VERSION = "learning.json", 1


def priors_of(leg: str, parts: Sequence[Part], learned: Mapping[str, LearnedPair]) -> LearnedPriors:
    """Priors of a leg's joints; joints of pairs of which nothing is measured are left out.

    Parameters
    ----------
    leg : str
    parts : sequence of Part
        Of the fleet, or of this leg.
    learned : mapping of str to LearnedPair
        By material pair, from `learn`.
    """
    joints = {}
    for part in sorted(parts, key=lambda part: part.key):
        pair = learned.get(part.pair)
        if part.leg != leg or not part.is_present or pair is None:
            continue
        own = {each.part.key: each.prior for each in pair.measured}
        present = own.get(part.key) or pair.lots.get(part.lot, pair.new_lot)
        joints[part.joint] = LearnedJoint(
            replaced_ns=part.replaced_ns,
            present=_coefficient(part, present),
            next=_coefficient(part, pair.new_lot),
        )
    return LearnedPriors(schema_version=SCHEMA_VERSION, leg=leg, joints=joints)


def write_learning(
    directory: Path, parts: Sequence[Part], learned: Mapping[str, LearnedPair], measured: str = ""
) -> dict[str, Path]:
    """Write ``learning.json``, and ``priors/LEG.json`` for each leg; the same content for the same parts.

    Parameters
    ----------
    directory : pathlib.Path
        Of the fleet's results; it exists.
    parts : sequence of Part
    learned : mapping of str to LearnedPair
    measured : str
        Digest of the measurements, by which the next update knows whether there are others.

    Returns
    -------
    dict of str to pathlib.Path
        The file of priors of each leg.

    Raises
    ------
    ConfigError
        If the disk does not take a file.
    """
    written = {}
    for leg in sorted({part.leg for part in parts}):
        written[leg] = LegDirectory(directory, leg).priors
        text = json_text(attrs.asdict(priors_of(leg, parts, learned)))
        write_whole(written[leg], text.encode())
    # last: it says that all of this is learned
    write_whole(directory / LEARNING, json_text(document(learned, measured)).encode())
    return written


def learned_from(directory: Path) -> str:
    """Digest of the measurements that a fleet has learned from; empty if it has not learned yet."""
    try:
        record = json.loads((directory / LEARNING).read_bytes())
    except (OSError, ValueError):  # none yet, or damaged: it is learned again
        return ""
    return str(record.get("measured", "")) if isinstance(record, dict) else ""


def document(learned: Mapping[str, LearnedPair], measured: str = "") -> dict[str, Any]:
    """Content of ``learning.json``."""
    return {
        "schema_version": LEARNING_VERSION,
        "measured": measured,
        "pairs": {name: _pair(learned[name]) for name in sorted(learned)},
    }


def _pair(pair: LearnedPair) -> dict[str, Any]:
    return {
        "prior_sigma": pair.prior_sigma,
        "lot_sigma": pair.lot_sigma,
        "part_sigma": pair.part_sigma,
        "new_lot": attrs.asdict(pair.new_lot),
        "lots": {lot: attrs.asdict(pair.lots[lot]) for lot in sorted(pair.lots)},
        "parts": [_part(each) for each in pair.measured],
    }


def _part(learned: LearnedPart) -> dict[str, Any]:
    part = learned.part
    return {
        "leg": part.leg,
        "joint": part.joint,
        "replaced_ns": part.replaced_ns,
        "lot": part.lot,
        "factor": part.factor,
        "factor_sigma": part.precision**-0.5,
        "prior": attrs.asdict(learned.prior),
        "residual": learned.residual,
        "counts": learned.counts,
        "finding": learned.finding,
    }


def _coefficient(part: Part, prior: CoefficientPrior) -> LearnedCoefficient:
    return LearnedCoefficient(
        wear_coefficient_per_pa=part.nominal_per_pa * math.exp(prior.mean),
        sigma=prior.sigma,
        basis=prior.basis,
    )


# Learning from the ledgers of a fleet, before an update or after it.


def learn_fleet(legs: Sequence[FleetLeg], out: Path) -> tuple[dict[str, Path], tuple[tuple[str, str], ...]]:
    """Learn from the measured clearances in the ledgers of a fleet, and write what was learned.

    Parameters
    ----------
    legs : sequence of FleetLeg
        In any order; the result is the same. A leg without a ledger has new parts.
    out : pathlib.Path
        Directory of the fleet, which exists.

    Returns
    -------
    priors : dict of str to pathlib.Path
        File for ``forecast.priors`` of each leg; empty if no clearance was measured.
    findings : tuple of (str, str)
        The leg, and a line about a part that contradicts the others, or a ledger that cannot be read.
    """
    ledgers = {leg.id: LegDirectory(out, leg.id).ledger for leg in legs}
    measured = measured_in(legs, out)
    if not measured:  # nobody ever measured: no ledger is copied
        return write_learning(out, (), {}), ()
    parts: list[Part] = []
    findings = []
    for leg in sorted(legs, key=lambda leg: leg.id):
        if leg.config.wear_acceleration != 1.0:
            if measurements_of(ledgers[leg.id]):
                findings.append((leg.id, "nothing is learned from it: its wear is accelerated"))
            continue
        try:
            parts += leg_parts(leg, ledgers[leg.id])
        except LegWearError as error:
            findings.append((leg.id, f"nothing is learned from it: {error}"))
    pairs = learn(parts)
    for pair in pairs.values():
        findings += [(each.part.leg, each.finding) for each in pair.measured if each.finding]
    priors = write_learning(out, parts, pairs, measured)
    return priors if pairs else {}, tuple(sorted(findings))


def measured_in(legs: Sequence[FleetLeg], out: Path) -> str:
    """Digest of all that was ever measured in a fleet; empty if nothing was. No ledger is copied."""
    texts = [(leg.id, leg.lot, measurements_of(LegDirectory(out, leg.id).ledger)) for leg in legs]
    if not any(text for _, _, text in texts):
        return ""
    return hashlib.sha256(repr(sorted(texts)).encode()).hexdigest()[:20]


def leg_parts(leg: FleetLeg, path: Path) -> list[Part]:
    """Parts of a leg, with the measured clearances of its ledger if there is one; it is left unchanged.

    Raises
    ------
    LegWearError
        If the ledger cannot be read.
    """
    mechanism = fitted(load_mechanism(leg.config.mechanism), leg.config)
    if not path.exists():
        return parts_of(leg.id, mechanism, leg.config.forecast, (), {}, lot=leg.lot)
    with ledger_copy(mechanism, leg.config, path) as ledger:
        entry, measurements, corrections = ledger.entry, ledger.measurements, ledger.corrections
    replaced_ns = {wear.name: wear.replaced_ns for wear in entry.joints} if entry else {}
    known = leg.config.forecast, measurements, replaced_ns
    return parts_of(leg.id, mechanism, *known, lot=leg.lot, corrections=corrections)


@contextmanager
def ledger_copy(mechanism: Mechanism, config: MonitorConfig, path: Path) -> Iterator[Ledger]:
    """A ledger opened in a copy: it is left unchanged.

    Raises
    ------
    LegWearError
        If it cannot be read.
    """
    with copy_of(path) as copy:
        settings = attrs.evolve(config, ledger=attrs.evolve(config.ledger, path=str(copy)))
        ledger = open_ledger(mechanism, settings)
        if ledger is None:
            raise LegWearError(f"{path}: no ledger")
        with closing(ledger):
            yield ledger


# Makes the forecast of a leg again, when its ledger was changed after its last recording was counted.


_SAME_M = 1e-15
"""Differences of wear up to this are those of its rounding."""


def is_renewal_due(directory: LegDirectory) -> bool:
    """Whether something was measured, repaired or learned that the last record of a leg does not know."""
    line = directory.last_counted()
    return line is not None and bool(line.get("basis")) and line["knows"] != directory.knowledge()


def renew(leg: FleetLeg, directory: LegDirectory) -> str:
    """Make the forecast of a leg again, in its last record and its summary; why not, empty if it is made.

    Clearances, alarms, verdict and remaining life follow the measurements in its ledger, its replaced parts
    and acknowledged alarms, and what the fleet has learned. Growth and torque are those at the end of its
    last recording, and not known after a part was replaced. The ledger is left as it is.
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
        entry, now = ledger.entry, ledger.last_verdict
        replaced = {part.name: part.replaced_ns for part in entry.joints} if entry else {}
        replaced_ns = [replaced.get(joint, 0) for joint in mechanism.clearance_joints]
        known = ledger.measurements, replaced_ns, ledger.corrections
        forecaster = Forecaster(mechanism, leg.used_config.forecast, *known)
    if now is not None and has_changed(verdict, now):
        verdict = now
    if Figure.FORECAST in verdict.not_valid:
        basis = attrs.evolve(basis, is_valid=False)
    recorded = before
    basis, before = _with_parts(entry, mechanism, basis, before)
    new_parts = tuple(joint for joint in before if before[joint] is not recorded[joint])
    forecast = forecaster.again(basis, replaced_ns)
    forecasts = dict(zip(mechanism.clearance_joints, forecast.joints, strict=True))
    measured = zip(mechanism.clearance_joints, forecaster.last_measured(replaced_ns), strict=True)
    alarms = {alarm.subject: alarm for alarm in entry.alarms if alarm.kind == CLEARANCE.kind} if entry else {}
    clearances = {
        joint: _clearance(joint, before[joint], one, forecasts[joint], alarms.get(joint), verdict)
        for joint, one in measured
        if joint in before
    }
    lives = life_of(forecasts, forecast.leg, verdict)
    summary = summary_of(json_object(directory.summary), str(directory.summary))
    summary = attrs.evolve(
        summary,
        verdict=verdict,
        joints={
            joint: attrs.evolve(
                one,
                forecast=joint_forecast(forecasts[joint], verdict),
                **(_NEW_PART if joint in new_parts else {}),
            )
            for joint, one in summary.joints.items()
        },
        clearances=clearances,
        **lives,
        forecast=leg_forecast(forecast.leg, verdict),
        measurements=forecaster.measurements,
        alarms=attrs.evolve(summary.alarms, now=_alarms(entry, summary.alarms.now)),
        diagnosis=_diagnosis(new_parts) if new_parts else summary.diagnosis,
        status=_status(summary.status, verdict, mechanism.clearance_joints, new_parts),
    )
    write_whole(directory.summary, summary.to_json().encode())
    found = {"verdict": verdict, "clearances": clearances, "life": lives["life"], "knows": knows}
    found |= {"settings": leg.settings}
    directory.renew({**line, **part_document(found)})


def _with_parts(
    entry: Entry | None, mechanism: Mechanism, basis: ForecastBasis, before: dict[str, JointClearance]
) -> tuple[ForecastBasis, dict[str, JointClearance]]:
    """A basis and clearances with the parts that were replaced since: of these, only the wear is known."""
    parts = {part.name: part for part in entry.joints} if entry else {}
    conditions, observed, clearances = list(basis.conditions), list(basis.observed), dict(before)
    for k, condition in enumerate(basis.conditions):
        joint = condition.joint
        if joint not in parts:
            continue
        if parts[joint].mean_m > condition.wear_m - _SAME_M:  # wear never shrinks: it is the same part
            conditions[k] = _regrown(condition, parts[joint], mechanism.clearances[joint])
            continue
        wear = parts[joint]
        observed[k] = None
        worn = {"wear_m": wear.mean_m, "wear_sigma_m": wear.sampling_m2**0.5}
        conditions[k] = attrs.evolve(condition, **worn, growth_m=None, growth_error_m=0.0)
        if joint in before:
            clearances[joint] = JointClearance(
                counted_m=mechanism.clearances[joint].radial_clearance + wear.mean_m,
                new_m=before[joint].new_m,
                limit_m=before[joint].limit_m,
            )
    return attrs.evolve(basis, conditions=tuple(conditions), observed=tuple(observed)), clearances


def _regrown(condition: JointCondition, part: JointWear, clearance: Clearance) -> JointCondition:
    """A joint's condition, its growth as with the wear coefficient of now."""
    was, now = part.wear_coefficient_per_pa, nominal_per_pa(clearance)
    if condition.growth_m is None or was in (0.0, now):
        return condition
    growth_m, error_m = (now / was * each for each in (condition.growth_m, condition.growth_error_m))
    return attrs.evolve(condition, growth_m=growth_m, growth_error_m=error_m)


# what is not known yet of a part that was replaced since the recording
_NEW_PART: dict[str, Any] = dict.fromkeys(
    ("opened_m", "growth_m_per_cycle", "growth_error_m_per_cycle", "growth_mps", "encoders")
)


def _alarms(entry: Entry | None, before: Iterable[LegAlarm]) -> tuple[LegAlarm, ...]:
    """All alarms of a leg as its ledger has them now: it keeps those that are raised, without last values."""
    raised = {alarm.name: leg_alarm(with_its_unit(alarm)) for alarm in (entry.alarms if entry else ())}
    gone: dict[str, Any] = {"level": Level.OK, "state": "OK", "value": None, "worst": None, "raised_ns": 0}
    now = []
    for alarm in before:
        if one := raised.pop(alarm.name, None):
            is_same = one.raised_ns == alarm.raised_ns
            now.append(attrs.evolve(one, value=alarm.value if is_same else None))
        else:
            now.append(alarm if alarm.level is Level.OK else attrs.evolve(alarm, **gone))
    return (*now, *raised.values())


def _diagnosis(new_parts: Sequence[str]) -> TorqueDiagnosis:
    """The drive torque has shown nothing of new parts yet."""
    words = f"joint {', '.join(new_parts)} was replaced after the recording"
    return TorqueDiagnosis(state=DiagnosisState.WAITING.value, reason=words)


def _status(
    before: Iterable[ReplayStatus], verdict: Verdict, joints: Iterable[str], new_parts: Sequence[str]
) -> tuple[ReplayStatus, ...]:
    """The verdict's line, and those of the recording that still hold: of its input, gait and load.

    Alarms, clearances and lives are in the summary itself.
    """
    gone = {"verdict", "alarms", *(f"joint {joint}" for joint in joints)}
    if new_parts:
        gone |= {"torque", "diagnosis", "encoders"}
    of_verdict = verdict_status(verdict)
    line = ReplayStatus(**{name: getattr(of_verdict, name) for name in attrs.fields_dict(ReplayStatus)})
    return (line, *(status for status in before if status.name not in gone))


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
        believed_m=forecast.now_m,
        seen=()
        if seen_m is None or sigma_m is None
        else tuple(KnownClearance(by, seen_m, sigma_m) for by in before.seen_by),
    )
    return joint_clearance(with_measured(situation, measured), alarm, [verdict], before.new_m)
