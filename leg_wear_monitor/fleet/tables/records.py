"""Tables of the recordings of a fleet: verdicts, lives, and the recordings themselves."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from leg_wear_monitor.fleet.directory.leg_directory import LegDirectory, Line
from leg_wear_monitor.fleet.tables.parquet import arrow
from leg_wear_monitor.fleet.tables.used import used_fraction

Legs = Iterable[tuple[str, str, LegDirectory]]
"""Id, lot and files of each leg."""

_WHERE = {"leg": "string", "lot": "string", "key": "string"}

RECORDINGS = {
    **_WHERE,
    "file": "string",
    "outcome": "string",
    "begin_ns": "int64",
    "end_ns": "int64",
    "duration_s": "float64",
    "cycles": "int64",
    "unmonitored_s": "float64",
    "already_counted": "int64",
    "is_partial": "bool_",
    "is_late": "bool_",
    "findings": "string",
}
VERDICTS = {
    **_WHERE,
    "stamp_ns": "int64",
    "state": "string",
    "fault_code": "string",
    "joints": "string",
    "since_ns": "int64",
    "why": "string",
    "do": "string",
    "not_valid": "string",
}
LIVES = {
    **_WHERE,
    "stamp_ns": "int64",
    "joint": "string",
    "counted_m": "float64",
    "seen_m": "float64",
    "seen_sigma_m": "float64",
    "seen_by": "string",
    "new_m": "float64",
    "limit_m": "float64",
    "used_fraction": "float64",
    "p10_h": "float64",
    "p50_h": "float64",
    "p90_h": "float64",
}


def recordings_table(legs: Legs) -> Any:
    """Table with a row for each recording, in the order in which a leg counted them."""
    return _table(RECORDINGS, legs, _recording)


def verdicts_table(legs: Legs) -> Any:
    """Table with a row for each counted recording: the verdict at its end."""
    return _table(VERDICTS, legs, _verdict)


def lives_table(legs: Legs) -> Any:
    """Table with a row for each counted recording and joint, and for the whole ``leg``, at its end."""
    return _table(LIVES, legs, _lives)


def _table(columns: dict[str, str], legs: Legs, rows: Callable[[Line], Iterator[Line]]) -> Any:
    pyarrow = arrow()
    schema = pyarrow.schema([(name, getattr(pyarrow, kind)()) for name, kind in columns.items()])
    found = []
    for leg, lot, directory in legs:
        for line in {line["key"]: line for line in directory.lines()}.values():
            where = {"leg": leg, "lot": lot, "key": line["key"]}
            found += [where | row for row in rows(line)]
    return pyarrow.Table.from_pylist(found, schema=schema)


def _recording(line: Line) -> Iterator[Line]:
    lost = line["lost"] or {}
    given = {name: line[name] for name in RECORDINGS if name in line}
    counts = {name: lost.get(name) for name in ("unmonitored_s", "already_counted")}
    yield given | counts | {"findings": "; ".join(line["findings"])}


def _verdict(line: Line) -> Iterator[Line]:
    verdict = line["verdict"]
    if verdict:
        texts = {name: ",".join(verdict[name]) for name in ("joints", "not_valid")}
        yield {"stamp_ns": line["end_ns"], **{k: verdict[k] for k in VERDICTS if k in verdict}, **texts}


def _lives(line: Line) -> Iterator[Line]:
    for joint in (*line["clearances"], "leg") if line["verdict"] else ():
        clearance = line["clearances"].get(joint) or {}
        row = {"stamp_ns": line["end_ns"], "joint": joint, **clearance, **(line["life"].get(joint) or {})}
        if clearance:
            counted_m, seen_m = clearance["counted_m"], clearance["seen_m"]
            best_m = clearance.get("believed_m") or (counted_m if seen_m is None else seen_m)
            row["used_fraction"] = used_fraction(best_m, clearance["new_m"], clearance["limit_m"])
            row["seen_by"] = ",".join(clearance["seen_by"])
        yield row
