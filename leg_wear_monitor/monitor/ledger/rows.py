"""Entries and events as rows of the ledger's tables, and back."""

import sqlite3

import attrs
import numpy as np

from leg_wear_monitor.estimate.commissioned_torque import CommissionedTorque
from leg_wear_monitor.estimate.signature import Channel
from leg_wear_monitor.json_text import finite_or_none, or_nan
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level
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
    SimulatedReference,
    VerdictEvent,
    Withdrawal,
)
from leg_wear_monitor.monitor.ledger.run import Run
from leg_wear_monitor.monitor.ledger.walked import WalkedLoad
from leg_wear_monitor.twin.reference.crank_profile import UNLIKE, CrankProfile
from leg_wear_monitor.twin.reference.leg_parameters import COUPLING_DAMPING, LegParameters
from leg_wear_monitor.twin.reference.leg_simulation import POINTS
from leg_wear_monitor.twin.reference.torque_reference import CADENCES, CYCLES, TorqueReference


def write_run(db: sqlite3.Connection, run: Run) -> None:
    """Insert or replace a run; to be called within a transaction."""
    values = (run.number, int(run.closed), run.interval_s, run.epoch, run.boot_id)
    db.execute("INSERT OR REPLACE INTO run VALUES (?, ?, ?, ?, ?)", values)


def write_entry(db: sqlite3.Connection, run: int, head: int, entry: Entry) -> None:
    """Replace the entry in force; to be called within a transaction.

    Parameters
    ----------
    db : sqlite3.Connection
    run : int
        Run of the entry's spans.
    head : int
        Number of the transaction.
    entry : Entry
    """
    db.execute("INSERT OR REPLACE INTO entry VALUES (1, ?, ?)", (run, entry.stamp_ns))
    db.executemany(
        "INSERT INTO joint VALUES (?, ?, ?, ?, ?, ?, ?)",
        [
            (head, j.name, _depth_bytes(j), j.cycles, j.moving_s, j.replaced_ns, j.sampling_m2)
            for j in entry.joints
        ],
    )
    db.execute("DELETE FROM joint WHERE head != ?", (head,))
    db.executemany("INSERT OR REPLACE INTO total VALUES (?, ?)", entry.totals.items())
    db.execute("DELETE FROM alarm")
    db.executemany(
        "INSERT INTO alarm VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        [alarm_values(alarm) for alarm in entry.alarms],
    )
    epochs = entry.span_epochs or (0,) * len(entry.spans)
    db.execute("DELETE FROM span WHERE run = ? AND part >= ?", (run, len(entry.spans)))
    db.executemany(
        "INSERT OR REPLACE INTO span VALUES (?, ?, ?, ?, ?)",
        [
            (run, part, *span, epoch)
            for part, (span, epoch) in enumerate(zip(entry.spans, epochs, strict=True))
        ],
    )
    db.execute("DELETE FROM load WHERE run = ?", (run,))
    db.executemany(
        "INSERT INTO load VALUES (?, ?, ?, ?, ?, ?)", [(run, *attrs.astuple(load)) for load in entry.loads]
    )


def write_event(db: sqlite3.Connection, event: Event) -> None:
    """Append an event; to be called within a transaction."""
    match event:
        case AlarmEvent(stamp_ns, a):
            db.execute(
                "INSERT INTO alarm_history "
                "(stamp_ns, kind, subject, level, acknowledged, value, limit_value) "
                "VALUES (?, ?, ?, ?, ?, ?, ?)",
                (stamp_ns, a.kind, a.subject, int(a.level), int(a.acknowledged), a.value, a.limit),
            )
        case ClearancePoint(stamp_ns, cycle, joint, clearance_m, clearance_max_m):
            db.execute(
                "INSERT INTO history (stamp_ns, cycle, joint, clearance_m, clearance_max_m) "
                "VALUES (?, ?, ?, ?, ?)",
                (stamp_ns, cycle, joint, clearance_m, clearance_max_m),
            )
        case Measurement() | CorrectedClearance() | ForecastPoint() | VerdictEvent():
            _append(db, event)
        case Withdrawal(stamp_ns, who, measurement):
            db.execute(
                "UPDATE measurement SET withdrawn_ns = ?, withdrawn_by = ? WHERE id = ?",
                (stamp_ns, who, measurement),
            )
        case Commissioned(stamp_ns, encoders, centre_rad, mean, covariance):
            errors = np.concatenate([centre_rad, mean, covariance.ravel()])
            db.execute(
                "INSERT INTO commissioning (stamp_ns, encoders, errors) VALUES (?, ?, ?)",
                (stamp_ns, "\n".join(encoders), errors.astype("<f8").tobytes()),
            )
        case CommissionedTorque():
            parts = (event.clearance_m, event.signatures, event.sigma_m)
            db.execute(
                "INSERT INTO torque_commissioning (stamp_ns, cycles, clearance_m, signatures, sigma_m, "
                "delay_s, time_constant_s, load_friction, speed_radps) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    event.stamp_ns,
                    event.cycles,
                    *(part.astype("<f8").tobytes() for part in parts),
                    event.channel.delay_s,
                    event.channel.time_constant_s,
                    event.channel.load_friction,
                    event.speed,
                ),
            )
        case IdentifiedLeg(stamp_ns, names, mass, length, friction):
            db.execute("INSERT INTO friction (stamp_ns, factor) VALUES (?, ?)", (stamp_ns, friction))
            db.execute(
                "INSERT INTO drive (stamp_ns, compliance_rad_per_nm, damping_ratio) VALUES (?, ?, ?)",
                (stamp_ns, event.compliance, event.damping),
            )
            force = event.load.astype("<f8").tobytes()
            db.execute("INSERT INTO ground_load (stamp_ns, force_n) VALUES (?, ?)", (stamp_ns, force))
            db.executemany(
                "INSERT INTO body (stamp_ns, name, mass, length) VALUES (?, ?, ?, ?)",
                [(stamp_ns, *factors) for factors in zip(names, mass, length, strict=True)],
            )
        case SimulatedReference():
            _write_reference(db, event)
        case Audit(stamp_ns, who, what, was, undoes):
            state: tuple[object, ...] = (None,) * 6
            if was:
                surfaces, life = _depth_bytes(was), (was.moving_s, was.replaced_ns, was.sampling_m2)
                state = was.name, was.cycles, surfaces, *life
            db.execute(
                "INSERT INTO audit "
                "(stamp_ns, who, what, joint, cycles, depth, moving_s, replaced_ns, sampling_m2, undoes) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (stamp_ns, who, what, *state, undoes),
            )


_TABLES = {
    Measurement: "measurement",
    CorrectedClearance: "correction",
    ForecastPoint: "forecast",
    VerdictEvent: "verdict",
}


def _append(
    db: sqlite3.Connection, event: Measurement | CorrectedClearance | ForecastPoint | VerdictEvent
) -> None:
    """Append a row to the table whose columns are the event's fields."""
    table = _TABLES[type(event)]
    values = attrs.asdict(event, filter=lambda field, _: field.name != "id")
    places = ", ".join("?" * len(values))
    db.execute(f"INSERT INTO {table} ({', '.join(values)}) VALUES ({places})", tuple(values.values()))


def read_measurements(db: sqlite3.Connection) -> tuple[Measurement, ...]:
    """All measured clearances in the order of their entry, including withdrawn ones."""
    names = [field.name for field in attrs.fields(Measurement)]
    rows = db.execute(f"SELECT {', '.join(names)} FROM measurement ORDER BY id")
    found = (Measurement(**dict(zip(names, row, strict=True))) for row in rows)
    return tuple(attrs.evolve(each, counts=bool(each.counts)) for each in found)


def read_corrections(db: sqlite3.Connection) -> tuple[CorrectedClearance, ...]:
    """All counted clearances that were corrected by the drive torque, in the order of their entry."""
    names = [field.name for field in attrs.fields(CorrectedClearance)]
    rows = db.execute(f"SELECT {', '.join(names)} FROM correction ORDER BY id")
    return tuple(CorrectedClearance(*row) for row in rows)


def read_commissioned(db: sqlite3.Connection) -> Commissioned | None:
    """Stored errors of further encoders, None if none were commissioned."""
    row = db.execute(
        "SELECT stamp_ns, encoders, errors FROM commissioning ORDER BY id DESC LIMIT 1"
    ).fetchone()
    if row is None:
        return None
    encoders, errors = tuple(row[1].split("\n")), np.frombuffer(row[2], "<f8").astype(float)
    m = len(encoders)
    p = 1 + 2 * m
    return Commissioned(row[0], encoders, errors[:m], errors[m : m + p], errors[m + p :].reshape(p, p))


def read_commissioned_torques(db: sqlite3.Connection) -> list[CommissionedTorque]:
    """Stored signatures of the drive torque since a part was replaced: the last ones of each cadence.

    Those before a correction were of other clearances.
    """
    found: list[CommissionedTorque] = []
    for row in db.execute(
        "SELECT stamp_ns, cycles, speed_radps, delay_s, time_constant_s, load_friction, clearance_m, "
        "signatures, sigma_m FROM torque_commissioning "
        "WHERE stamp_ns > (SELECT coalesce(max(replaced_ns), 0) FROM joint) ORDER BY id DESC"
    ):
        stamp_ns, cycles, speed, delay_s, time_constant_s, load_friction = row[:6]
        clearance_m, signatures, sigma_m = (np.frombuffer(part, "<f8").astype(float) for part in row[6:])
        channel = Channel(delay_s=delay_s, time_constant_s=time_constant_s, load_friction=load_friction)
        one = CommissionedTorque(
            stamp_ns, clearance_m, signatures.reshape(cycles, -1), sigma_m, channel, speed
        )
        if not any(abs(one.speed - other.speed) <= UNLIKE * abs(other.speed) for other in found):
            found.append(one)
        if not one.is_as_counted or not one.speed or len(found) == CADENCES:
            break
    return found


def read_identified_leg(db: sqlite3.Connection) -> IdentifiedLeg | None:
    """Masses, lengths, friction and drive of the leg, None if they were not identified.

    Rows of older formats were identified with the friction of the mechanism file, with a rigid drive, or in
    the air.
    """
    rows = db.execute(
        "SELECT stamp_ns, name, mass, length FROM body "
        "WHERE stamp_ns = (SELECT stamp_ns FROM body ORDER BY id DESC LIMIT 1) ORDER BY id"
    ).fetchall()
    if not rows:
        return None
    stamps, names, mass, length = zip(*rows, strict=True)
    friction, drive, load = (
        db.execute(f"SELECT {value} FROM {table} WHERE stamp_ns = ? ORDER BY id DESC", stamps[:1]).fetchone()
        for table, value in (
            ("friction", "factor"),
            ("drive", "compliance_rad_per_nm, damping_ratio"),
            ("ground_load", "force_n"),
        )
    )
    compliance, damping = drive or (0.0, COUPLING_DAMPING)
    factor = friction[0] if friction else 1.0
    return IdentifiedLeg(
        stamps[0], names, mass, length, factor, compliance, damping, _force(load[0] if load else b"")
    )


def _write_reference(db: sqlite3.Connection, event: SimulatedReference) -> None:
    """Write a reference; a whole one takes the place of that of its cadence, and of one that is not whole."""
    values, speed = _reference_values(event), event.reference.profile.speed
    if event.reference.is_whole:
        db.execute(
            "DELETE FROM torque_reference WHERE abs(speed_radps - ?) <= ?", (speed, UNLIKE * abs(speed))
        )
    db.execute("DELETE FROM torque_reference WHERE NOT is_whole")
    places = ", ".join("?" * len(values))
    db.execute(f"INSERT INTO torque_reference VALUES (NULL, {places})", values)
    newest = f"SELECT id FROM torque_reference WHERE is_whole ORDER BY id DESC LIMIT {CADENCES}"
    db.execute(f"DELETE FROM torque_reference WHERE is_whole AND id NOT IN ({newest})")


def _reference_values(event: SimulatedReference) -> tuple[float | bytes | str, ...]:
    """Values of the columns of a reference, without its id."""
    reference = event.reference
    profile, leg, known = reference.profile, reference.parameters, reference.clearance_m
    ripple = np.stack([profile.cosine, profile.sine])
    return (
        int(reference.is_whole),
        event.stamp_ns,
        profile.speed,
        *(part.astype("<f8").tobytes() for part in (ripple, known)),
        len(known),
        "\n".join(event.bodies),
        *(part.astype("<f8").tobytes() for part in (leg.mass, leg.length)),
        leg.friction,
        leg.compliance,
        leg.damping,
        leg.load.astype("<f8").tobytes(),
        reference.torque_nm[0].astype("<f2").tobytes(),
        b"".join(one.astype("<f2").tobytes() for one in reference.torque_nm[1:]),
    )


def read_simulated_references(db: sqlite3.Connection) -> list[SimulatedReference]:
    """Torque references that were simulated for the leg, the last one first.

    One whose simulation was not finished is among them.
    """
    rows = db.execute(
        "SELECT is_whole, stamp_ns, bodies, speed_radps, legs, friction, compliance_rad_per_nm, "
        "damping_ratio, load_n, ripple_rad, clearance_m, mass, length, expected_torque_nm, torque_nm "
        "FROM torque_reference ORDER BY id DESC"
    )
    return [_reference_of(*row) for row in rows]


def _reference_of(
    is_whole: int,
    stamp_ns: int,
    bodies: str,
    speed: float,
    legs: int,
    friction: float,
    compliance: float,
    damping: float,
    load_n: bytes,
    *parts: bytes,
) -> SimulatedReference:
    """Reference of a row."""
    ripple, known, mass, length = (np.frombuffer(part, "<f8").astype(float) for part in parts[:4])
    expected, wider = (
        np.frombuffer(part, "<f2").astype(np.float16).reshape(-1, POINTS) for part in parts[4:]
    )
    profile, leg = (
        CrankProfile(speed, *ripple.reshape(2, -1)),
        LegParameters(mass, length, friction, compliance, damping, _force(load_n)),
    )
    reference = TorqueReference(profile, known.reshape(legs, -1), (expected,), leg)
    cycles = len(expected) if reference.is_of_parameters else CYCLES
    shape = (legs - 1, -1, POINTS) if is_whole else (-1, cycles, POINTS)
    reference = attrs.evolve(reference, torque_nm=(expected, *wider.reshape(shape)))
    return SimulatedReference(stamp_ns, tuple(bodies.split("\n")), reference)


def _force(part: bytes) -> Floats:
    """A force (n, 2) [N]."""
    return np.frombuffer(part, "<f8").astype(float).reshape(-1, 2)


def read_last_reset(db: sqlite3.Connection, joint: str) -> Audit | None:
    """The last `reset_wear` of a joint that was not undone, None if there is none.

    Rows of older formats do not contain the whole state of the joint: `joint` is then None.
    """
    row = db.execute(
        "SELECT id, stamp_ns, who, what, joint, depth, cycles, moving_s, replaced_ns, "
        "coalesce(sampling_m2, 0) FROM audit AS a "
        "WHERE joint = ? AND what = 'reset_wear' "
        "AND NOT EXISTS (SELECT 1 FROM audit WHERE undoes = a.id) ORDER BY id DESC LIMIT 1",
        (joint,),
    ).fetchone()
    if row is None:
        return None
    was = None if row[7] is None else _joint(*row[4:])
    number, stamp_ns, who, what = row[:4]
    return Audit(stamp_ns, who, what, was, id=number)


def read_entry(db: sqlite3.Connection) -> tuple[int, Entry] | None:
    """Run and content of the entry in the tables, None in a new ledger."""
    found = db.execute("SELECT run, stamp_ns FROM entry").fetchone()
    if found is None:
        return None
    run, stamp_ns = found
    spans = db.execute(
        "SELECT begin_ns, end_ns, epoch FROM span WHERE run = ? ORDER BY part", (run,)
    ).fetchall()
    joints = db.execute("SELECT * FROM joint ORDER BY name")  # before format 9 without sampling_m2
    return run, Entry(
        stamp_ns=stamp_ns,
        joints=tuple(_joint(*row[1:]) for row in joints),
        totals=dict(db.execute("SELECT name, value FROM total")),
        alarms=tuple(alarm_of(*row) for row in db.execute("SELECT * FROM alarm")),
        spans=tuple((begin, end) for begin, end, _ in spans),
        span_epochs=tuple(epoch for *_, epoch in spans) if any(epoch for *_, epoch in spans) else (),
        loads=read_loads(db, "run = ?", run),
    )


def read_spans(db: sqlite3.Connection) -> list[tuple[int, int, int]]:
    """Begin, end [ns] and epoch of all counted time spans."""
    return db.execute("SELECT begin_ns, end_ns, epoch FROM span").fetchall()


def read_loads(db: sqlite3.Connection, which: str, run: int) -> tuple[WalkedLoad, ...]:
    """Foot loads of the runs that a condition on ``run`` selects; none before format 17."""
    if not db.execute("SELECT 1 FROM sqlite_master WHERE name = 'load'").fetchone():
        return ()
    rows = db.execute(
        f"SELECT about_n, cycles, moving_s, mean_n, sigma_n FROM load WHERE {which} ORDER BY run, about_n",
        (run,),
    )
    return tuple(WalkedLoad(*row) for row in rows)


def read_last_verdict(db: sqlite3.Connection) -> VerdictEvent | None:
    """The last change of the verdict."""
    names = [field.name for field in attrs.fields(VerdictEvent)]
    row = db.execute(f"SELECT {', '.join(names)} FROM verdict ORDER BY id DESC LIMIT 1").fetchone()
    return VerdictEvent(**dict(zip(names, row, strict=True))) if row else None


def read_last_run(db: sqlite3.Connection) -> Run:
    """The last run."""
    last = db.execute(
        "SELECT id, closed, interval_s, epoch, boot_id FROM run ORDER BY id DESC LIMIT 1"
    ).fetchone()
    return Run(last[0], bool(last[1]), *last[2:]) if last else Run()


def _depth_bytes(joint: JointWear) -> bytes:
    return np.ascontiguousarray(joint.depth, dtype="<f8").tobytes()


def _joint(
    name: str, depth: bytes, cycles: int, moving_s: float, replaced_ns: int, sampling_m2: float = 0.0
) -> JointWear:
    surfaces = np.frombuffer(depth, "<f8").reshape(2, -1).copy()
    return JointWear(name, surfaces, cycles, moving_s, replaced_ns, sampling_m2)


def alarm_values(alarm: Alarm) -> list[str | int | float | None]:
    """Values of an alarm as of a row, None where a number is not known."""
    found = (alarm.worst, alarm.limit, alarm.sigma)
    return [
        alarm.kind, alarm.subject, int(alarm.level), int(alarm.present), bool(alarm.acknowledged),
        alarm.raised_ns, *map(finite_or_none, found), alarm.cause,
    ]  # fmt: skip


def alarm_of(
    kind: str,
    subject: str,
    level: int,
    present: int,
    acknowledged: int,
    raised_ns: int,
    worst: float | None,
    limit: float | None,
    sigma: float | None = None,  # before format 10 without it and the cause
    cause: str = "",
) -> Alarm:
    """The alarm of `alarm_values`."""
    return Alarm(
        kind=kind, subject=subject, level=Level(level), present=Level(present),
        acknowledged=bool(acknowledged), raised_ns=raised_ns, cause=cause,
        worst=or_nan(worst), limit=or_nan(limit), sigma=or_nan(sigma),
    )  # fmt: skip
