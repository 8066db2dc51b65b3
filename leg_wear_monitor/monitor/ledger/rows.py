"""Entries and events as rows of the ledger's tables, and back."""

import json
import sqlite3
from collections.abc import Iterator
from typing import Any, TypeVar

import attrs
import numpy as np

from leg_wear_monitor.estimate.drive import Channel
from leg_wear_monitor.estimate.signature import CommissionedTorque
from leg_wear_monitor.files import finite_or_none, or_nan
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.ledger.entry import (
    AlarmEvent,
    Audit,
    ClearancePoint,
    Commissioned,
    CorrectedClearance,
    Entry,
    Event,
    ForecastPoint,
    IdentifiedLeg,
    JointWear,
    Measurement,
    Run,
    SimulatedReference,
    VerdictEvent,
    WalkedLoad,
    together,
)
from leg_wear_monitor.monitor.ledger.schema import add, replace, sealed
from leg_wear_monitor.state import Evidence, Figure, Level, State, Verdict
from leg_wear_monitor.twin.reference import POINTS, UNLIKE, CrankProfile, LegParameters
from leg_wear_monitor.twin.torque_reference import CADENCES, CYCLES, TorqueReference

_Row = TypeVar("_Row", Measurement, CorrectedClearance, ForecastPoint, ClearancePoint)

# events whose fields are the columns of a table
_TABLES: dict[type, str] = {
    ClearancePoint: "history",
    CorrectedClearance: "correction",
    ForecastPoint: "forecast",
    Measurement: "measurement",
}


_VERDICT_LISTS = ("joints", "evidence", "not_valid")


# --- runs and entries ---


def write_run(db: sqlite3.Connection, run: Run) -> None:
    """Insert or replace a run; to be called within a transaction."""
    values = (run.number, int(run.closed), run.interval_s, run.epoch, run.boot_id)
    replace(db, "run", [values], "id = ?", (run.number,))


def read_last_run(db: sqlite3.Connection) -> Run:
    """The last run."""
    last = db.execute(
        "SELECT id, closed, interval_s, epoch, boot_id FROM run ORDER BY id DESC LIMIT 1"
    ).fetchone()
    return Run(last[0], bool(last[1]), *last[2:]) if last else Run()


def write_entry(db: sqlite3.Connection, run: int, entry: Entry, whole: bool) -> None:
    """Replace the entry in force; to be called within a transaction.

    Parameters
    ----------
    db : sqlite3.Connection
    run : int
        Run of the entry's spans and loads.
    entry : Entry
    whole : bool
        Whether the surfaces are written, too, not only their means.
    """
    replace(db, "entry", [(1, run, entry.stamp_ns)])
    replace(db, "joint", [(j.name, *j.surface_means_m, *attrs.astuple(j)[2:]) for j in entry.joints])
    if whole:
        replace(db, "surface", [(joint.name, _blob(joint.depth)) for joint in entry.joints])
    replace(db, "total", (_totals(db) | entry.totals).items())
    replace(db, "alarm", [_alarm_values(alarm) for alarm in entry.alarms])
    replace(db, "span", [(run, part, *span) for part, span in enumerate(entry.spans)], "run = ?", (run,))
    replace(db, "load", [(run, *attrs.astuple(load)) for load in entry.loads], "run = ?", (run,))


def read_entry(db: sqlite3.Connection) -> Entry | None:
    """The entry in force, None in a new ledger.

    The surfaces are those that were last written. Where their means are later ones, what was counted since
    lies around a surface as the wear before it.
    """
    found = db.execute("SELECT run, stamp_ns FROM entry").fetchone()
    if found is None:
        return None
    run, stamp_ns = found
    spans = db.execute(
        "SELECT begin_ns, end_ns, epoch FROM span WHERE run = ? ORDER BY part", (run,)
    ).fetchall()
    joints = db.execute(
        f"SELECT name, {_PART}, bushing_m, journal_m FROM joint JOIN surface USING (name) ORDER BY name"
    )
    return Entry(
        stamp_ns=stamp_ns,
        joints=tuple(_risen(_joint(*row[:6]), row[6:]) for row in joints),
        totals=_totals(db),
        alarms=tuple(_alarm_of(*row) for row in db.execute("SELECT * FROM alarm ORDER BY kind, subject")),
        spans=tuple(spans),
        loads=_loads(db, "run = ?", run),
    )


def _totals(db: sqlite3.Connection) -> dict[str, float]:
    return dict(db.execute("SELECT name, value FROM total"))


_PART = "depth, cycles, moving_s, replaced_ns, wear_coefficient_per_pa"


def _joint(name: str, depth: bytes, *rest: Any) -> JointWear:
    """A part of its name and the columns `_PART`."""
    return JointWear(name, _floats(depth).reshape(2, -1), *rest)


def _risen(joint: JointWear, means_m: tuple[float, float]) -> JointWear:
    """A joint whose surfaces have later means."""
    depth = joint.depth
    for surface, was_m, mean_m in zip(depth, joint.surface_means_m, means_m, strict=True):
        if mean_m != was_m:  # equal ones stay to the bit
            surface[:] = surface * (mean_m / was_m) if was_m > 0.0 else mean_m
    return joint


def _alarm_values(alarm: Alarm) -> tuple[str | int | float | None, ...]:
    """Values of an alarm's row, None where a number is not known."""
    found = (alarm.worst, alarm.limit, alarm.sigma)
    return (
        alarm.kind, alarm.subject, int(alarm.level), int(alarm.present), int(alarm.acknowledged),
        alarm.raised_ns, *map(finite_or_none, found), alarm.cause,
    )  # fmt: skip


def _alarm_of(
    kind: str, subject: str, level: int, present: int, acknowledged: int, raised_ns: int,
    worst: float | None, limit: float | None, sigma: float | None, cause: str,
) -> Alarm:  # fmt: skip
    """The alarm of `_alarm_values`."""
    return Alarm(
        kind=kind, subject=subject, level=Level(level), present=Level(present), raised_ns=raised_ns,
        acknowledged=bool(acknowledged), cause=cause,
        worst=or_nan(worst), limit=or_nan(limit), sigma=or_nan(sigma),
    )  # fmt: skip


def read_spans(db: sqlite3.Connection) -> Ints:
    """Begin and end (n, 2) [ns] of all counted time spans, in all epochs."""
    spans = db.execute("SELECT DISTINCT begin_ns, end_ns FROM span ORDER BY begin_ns, end_ns").fetchall()
    return np.array(spans, dtype=np.int64).reshape(-1, 2)


def read_loads(db: sqlite3.Connection) -> tuple[WalkedLoad, ...]:
    """Foot loads of all runs."""
    return together(_loads(db, "run > ?", 0))


def _loads(db: sqlite3.Connection, which: str, run: int) -> tuple[WalkedLoad, ...]:
    rows = db.execute(
        f"SELECT about_n, cycles, moving_s, mean_n, sigma_n FROM load WHERE {which} ORDER BY run, about_n",
        (run,),
    )
    return tuple(WalkedLoad(*row) for row in rows)


# --- events ---


def write_event(db: sqlite3.Connection, event: Event) -> None:
    """Append an event; to be called within a transaction.

    A measurement that has a row is a withdrawn one: its row says so from then on. A reset, and its undoing,
    delete the signatures of the drive torque: they are of other clearances. Stamps do not order them, which
    may be of recordings, while that of a reset is of the operator's clock.
    """
    match event:
        case Measurement(withdrawn_ns=withdrawn_ns, withdrawn_by=who, id=row) if row:
            with sealed(db, "measurement", "id = ?", (row,)):
                db.execute(
                    "UPDATE measurement SET withdrawn_ns = ?, withdrawn_by = ? WHERE id = ?",
                    (withdrawn_ns, who, row),
                )
        case AlarmEvent(stamp_ns, alarm):
            values = _alarm_event_values(alarm)
            add(db, "alarm_history", {"stamp_ns": stamp_ns, **values})
        case Audit(stamp_ns, who, what, was, undoes):
            state = _audit_values(was) if was else {}
            add(db, "audit", {"stamp_ns": stamp_ns, "who": who, "what": what, **state, "undoes": undoes})
            if what in ("reset_wear", "undo_reset"):
                with sealed(db, "torque_commissioning"):
                    db.execute("DELETE FROM torque_commissioning")
        case Commissioned(stamp_ns, encoders, centre_rad, mean, covariance):
            errors = np.concatenate([centre_rad, mean, covariance.ravel()])
            values = {"stamp_ns": stamp_ns, "encoders": "\n".join(encoders), "errors": _blob(errors)}
            add(db, "commissioning", values)
        case CommissionedTorque(before=before):
            if before is not None:
                add(db, "torque_commissioning", _baseline_values(before) | {"is_before": 1})
            add(db, "torque_commissioning", _baseline_values(event) | {"is_before": 2 * event.is_interim})
        case IdentifiedLeg(stamp_ns, bodies, parameters):
            add(db, "identified_leg", {"stamp_ns": stamp_ns, **_leg_values(bodies, parameters)})
        case SimulatedReference():
            _write_reference(db, event)
        case VerdictEvent(stamp_ns, verdict):
            add(db, "verdict", {"stamp_ns": stamp_ns, **_verdict_values(verdict)})
        case _:
            values = attrs.asdict(event, filter=lambda field, _: field.name != "id")
            add(db, _TABLES[type(event)], values)


def _alarm_event_values(alarm: Alarm) -> dict[str, Any]:
    return {
        "kind": alarm.kind,
        "subject": alarm.subject,
        "level": int(alarm.level),
        "acknowledged": int(alarm.acknowledged),
        "value": alarm.value,
        "limit_value": alarm.limit,
    }


def _audit_values(was: JointWear) -> dict[str, Any]:
    values = attrs.asdict(was, filter=lambda field, _: field.name != "name")
    return {"joint": was.name} | values | {"depth": _blob(was.depth)}


def _verdict_values(verdict: Verdict) -> dict[str, Any]:
    """Values of a verdict's row, lists as JSON."""
    values = verdict.to_dict()
    texts = {name: json.dumps(values[name], allow_nan=False) for name in _VERDICT_LISTS}
    values["to_do"] = values.pop("do")
    return values | texts


def _baseline_values(baseline: CommissionedTorque) -> dict[str, Any]:
    return {
        "stamp_ns": baseline.stamp_ns,
        "cycles": baseline.cycles,
        "clearance_m": _blob(baseline.clearance_m),
        "signatures": _blob(baseline.signatures),
        "sigma_m": _blob(baseline.sigma_m),
        **attrs.asdict(baseline.channel),
        "speed_radps": baseline.speed,
        "temperature_c": finite_or_none(baseline.temperature_c),
        "period_s": finite_or_none(baseline.period_s),
        "averaged": baseline.together,
        "is_instant": int(baseline.is_instant),
    }


def _leg_values(names: tuple[str, ...], leg: LegParameters) -> dict[str, Any]:
    return {
        "bodies": "\n".join(names),
        "mass": _blob(leg.mass),
        "length": _blob(leg.length),
        "friction": leg.friction,
        "compliance_rad_per_nm": leg.compliance,
        "damping_ratio": leg.damping,
        "load_n": _blob(leg.load),
        "load_sigma": leg.load_sigma,
    }


def _write_reference(db: sqlite3.Connection, event: SimulatedReference) -> None:
    """Write a reference; a whole one takes the place of that of its cadence, and of one that is not whole."""
    reference, profile = event.reference, event.reference.profile
    values = {
        "stamp_ns": event.stamp_ns,
        **_leg_values(event.bodies, reference.parameters),
        "is_whole": int(reference.is_whole),
        "speed_radps": profile.speed,
        "legs": len(reference.clearance_m),
        "ripple_rad": _blob(np.stack([profile.cosine, profile.sine])),
        "clearance_m": _blob(reference.clearance_m),
        "expected_torque_nm": reference.torque_nm[0].astype("<f2").tobytes(),
        "torque_nm": b"".join(one.astype("<f2").tobytes() for one in reference.torque_nm[1:]),
    }
    with sealed(db, "torque_reference"):
        db.execute("DELETE FROM torque_reference WHERE NOT is_whole")
        if reference.is_whole:
            alike = (profile.speed, UNLIKE * abs(profile.speed))
            db.execute("DELETE FROM torque_reference WHERE abs(speed_radps - ?) <= ?", alike)
            newest = f"SELECT id FROM torque_reference ORDER BY id DESC LIMIT {CADENCES - 1}"
            db.execute(f"DELETE FROM torque_reference WHERE id NOT IN ({newest})")
    add(db, "torque_reference", values)


def read_rows(db: sqlite3.Connection, kind: type[_Row], which: str = "TRUE") -> tuple[_Row, ...]:
    """Events whose fields are the columns of a table, in the order of their entry."""
    names = [field.name for field in attrs.fields(kind)]
    rows = db.execute(f"SELECT {', '.join(names)} FROM {_TABLES[kind]} WHERE {which} ORDER BY id")
    return tuple(kind(**dict(zip(names, row, strict=True))) for row in rows)


def read_measurements(db: sqlite3.Connection) -> tuple[Measurement, ...]:
    """All measured clearances in the order of their entry, including withdrawn ones."""
    return tuple(attrs.evolve(each, counts=bool(each.counts)) for each in read_rows(db, Measurement))


def read_alarm_history(db: sqlite3.Connection) -> tuple[AlarmEvent, ...]:
    """All changes of alarms, in the order of their entry."""
    rows = db.execute(
        "SELECT stamp_ns, kind, subject, level, acknowledged, value, limit_value "
        "FROM alarm_history ORDER BY id"
    )
    return tuple(AlarmEvent(row[0], _alarm_event_of(*row[1:])) for row in rows)


def _alarm_event_of(
    kind: str, subject: str, level: int, acknowledged: int, value: float | None, limit: float | None
) -> Alarm:
    """The alarm of `_alarm_event_values`."""
    return Alarm(
        kind=kind, subject=subject, level=Level(level), acknowledged=bool(acknowledged),
        value=or_nan(value), limit=or_nan(limit),
    )  # fmt: skip


def read_verdicts(db: sqlite3.Connection) -> Iterator[Verdict]:
    """The stored verdicts, the last one first."""
    rows = db.execute(
        "SELECT state, why, since_ns, to_do, fault_code, joints, evidence, not_valid "
        "FROM verdict ORDER BY id DESC"
    )
    return (_verdict_of(*row) for row in rows)


def _verdict_of(state: str, why: str, since_ns: int, to_do: str, fault_code: str, *row: str) -> Verdict:
    """The verdict of `_verdict_values`."""
    joints, evidence, not_valid = map(json.loads, row)
    return Verdict(
        state=State(state),
        joints=tuple(joints),
        why=why,
        since_ns=since_ns,
        do=to_do,
        evidence=tuple(Evidence(**each) for each in evidence),
        not_valid=tuple(map(Figure, not_valid)),
        fault_code=fault_code,
    )


def read_last_reset(db: sqlite3.Connection, joint: str) -> Audit | None:
    """The last `reset_wear` of a joint that was not undone, None if there is none."""
    row = db.execute(
        f"SELECT id, stamp_ns, who, what, joint, {_PART} FROM audit AS a "
        "WHERE joint = ? AND what = 'reset_wear' "
        "AND NOT EXISTS (SELECT 1 FROM audit WHERE undoes = a.id) ORDER BY id DESC LIMIT 1",
        (joint,),
    ).fetchone()
    if row is None:
        return None
    number, stamp_ns, who, what = row[:4]
    return Audit(stamp_ns, who, what, _joint(*row[4:]), id=number)


def read_former_states(db: sqlite3.Connection) -> tuple[JointWear, ...]:
    """Parts as they were before each change of their wear, in the order of time."""
    found = db.execute(f"SELECT joint, {_PART} FROM audit WHERE joint IS NOT NULL ORDER BY id")
    return tuple(_joint(*row) for row in found)


def read_commissioned(db: sqlite3.Connection) -> Commissioned | None:
    """Stored errors of further encoders, None if none were commissioned."""
    query = "SELECT stamp_ns, encoders, errors FROM commissioning ORDER BY id DESC LIMIT 1"
    row = db.execute(query).fetchone()
    if row is None:
        return None
    encoders, errors = tuple(row[1].split("\n")), _floats(row[2])
    m = len(encoders)
    p = 1 + 2 * m
    return Commissioned(row[0], encoders, errors[:m], errors[m : m + p], errors[m + p :].reshape(p, p))


def read_commissioned_torques(db: sqlite3.Connection) -> list[CommissionedTorque]:
    """Stored signatures of the drive torque of the present parts: the last ones of each cadence.

    Those before a correction, or before it was known better, have other standard deviations. A leg with
    a lasting change has one of its own, as long as no baseline of its cadence follows.
    """
    found: list[CommissionedTorque] = []
    interims: list[CommissionedTorque] = []
    last = None
    for row in db.execute(
        "SELECT stamp_ns, cycles, speed_radps, delay_s, time_constant_s, load_friction, second_order, "
        "mean_s, clearance_m, signatures, sigma_m, temperature_c, period_s, averaged, is_instant, is_before "
        "FROM torque_commissioning ORDER BY id DESC"
    ):
        stamp_ns, cycles, speed, *drive = row[:8]
        clearance_m, signatures, sigma_m = map(_floats, row[8:11])
        channel = Channel(**dict(zip(attrs.fields_dict(Channel), drive, strict=True)))
        one = CommissionedTorque(
            stamp_ns, clearance_m, signatures.reshape(cycles, -1), sigma_m, channel, speed,
            or_nan(row[11]), or_nan(row[12]), row[13], bool(row[14]),
        )  # fmt: skip
        if row[15] == 2:  # of a leg with a lasting change
            if not any(_is_alike(one, other) for other in found + interims):
                interims.append(attrs.evolve(one, is_interim=True))
            continue
        if row[15]:
            found = [attrs.evolve(each, before=one) if each is last else each for each in found]
            continue
        last = one
        # those of unknown clearances grow with them; another correction has others
        if found and not np.allclose(one.sigma_m, found[0].sigma_m, rtol=0.1, atol=0.0):
            break
        if not any(_is_alike(one, other) for other in found):
            found.append(one)
    return found[:CADENCES] + interims


def _is_alike(one: CommissionedTorque, other: CommissionedTorque) -> bool:
    """Whether two are of the same cadence."""
    return abs(one.speed - other.speed) <= UNLIKE * abs(other.speed)


_LEG = "stamp_ns, bodies, mass, length, friction, compliance_rad_per_nm, damping_ratio, load_n, load_sigma"


def read_identified_leg(db: sqlite3.Connection) -> IdentifiedLeg | None:
    """Masses, lengths, friction and drive of the leg, None if they were not identified."""
    row = db.execute(f"SELECT {_LEG} FROM identified_leg ORDER BY id DESC LIMIT 1").fetchone()
    return IdentifiedLeg(row[0], *_leg_of(*row[1:])) if row else None


def read_simulated_references(db: sqlite3.Connection) -> list[SimulatedReference]:
    """Torque references that were simulated for the leg, the last one first.

    One whose simulation was not finished is among them.
    """
    rows = db.execute(
        f"SELECT {_LEG}, is_whole, speed_radps, legs, ripple_rad, clearance_m, expected_torque_nm, torque_nm "
        "FROM torque_reference ORDER BY id DESC"
    )
    return [SimulatedReference(row[0], *_reference_of(row[1:9], *row[9:])) for row in rows]


def _reference_of(
    leg: tuple[Any, ...], is_whole: int, speed: float, legs: int, *parts: bytes
) -> tuple[tuple[str, ...], TorqueReference]:
    """Bodies and reference of a row."""
    names, parameters = _leg_of(*leg)
    ripple, known = map(_floats, parts[:2])
    expected, wider = (
        np.frombuffer(part, "<f2").astype(np.float16).reshape(-1, POINTS) for part in parts[2:]
    )
    profile = CrankProfile(speed, *ripple.reshape(2, -1))
    reference = TorqueReference(profile, known.reshape(legs, -1), (expected,), parameters)
    shape = (legs - 1, -1, POINTS) if is_whole else (-1, CYCLES, POINTS)
    return names, attrs.evolve(reference, torque_nm=(expected, *wider.reshape(shape)))


def _leg_of(*row: Any) -> tuple[tuple[str, ...], LegParameters]:
    """Names of the bodies and parameters of the leg, of the values of `_leg_values`."""
    bodies, mass, length, friction, compliance, damping, load, load_sigma = row
    force = _floats(load).reshape(-1, 2)
    leg = LegParameters(_floats(mass), _floats(length), friction, compliance, damping, force, load_sigma)
    return tuple(bodies.split("\n")), leg


def _blob(values: Floats) -> bytes:
    return np.ascontiguousarray(values, dtype="<f8").tobytes()


def _floats(blob: bytes) -> Floats:
    return np.frombuffer(blob, "<f8").astype(float)
