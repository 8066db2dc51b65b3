"""Encoding of an entry as its difference from the previous one: some kB instead of all surfaces bit for bit.

Five seconds of walking change nearly all sectors of all surfaces by numbers of 40 random bits, which cannot
be compressed without loss. So the rise of a surface is quantised in steps of the 20th part of its largest
rise. The remainder is added to the next rise, so errors do not accumulate: an error is at most a 36th part of
the largest rise between two entries, which is the wear of a sector in 0.14 s of 5 s.
"""

import json
import zlib
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.ledger.entry import Entry, JointWear
from leg_wear_monitor.monitor.ledger.rows import alarm_of, alarm_values
from leg_wear_monitor.monitor.ledger.run import Run
from leg_wear_monitor.monitor.ledger.walked import WalkedLoad

STEPS = 20  # quantisation steps of a surface's largest rise

_MOST = 200_000_000  # bytes of a decompressed record, as a limit against damaged ones


def encode(entry: Entry, run: Run, before: Entry, shared: int) -> tuple[bytes, Entry]:
    """Encode an entry; returns the record, and the entry as it will be decoded from the record.

    Parameters
    ----------
    entry : Entry
    run : Run
        Run of the entry.
    before : Entry
        The previous entry, as it will be decoded.
    shared : int
        Number of the first spans of `before` that belong to the same run; equal ones are not repeated.

    Raises
    ------
    ValueError
        If the joints differ from those of the previous entry, or depths are not finite numbers.
    """
    if [joint.name for joint in entry.joints] != [joint.name for joint in before.joints]:
        raise ValueError("the entry has other joints than the one before")
    same = 0
    while same < min(shared, len(entry.spans), len(before.spans)) and _span(entry, same) == _span(
        before, same
    ):
        same += 1
    values = {
        "run": attrs.astuple(run),
        "stamp_ns": entry.stamp_ns,
        "totals": entry.totals,
        "parts": [(j.cycles, j.moving_s, j.replaced_ns, j.sampling_m2) for j in entry.joints],
        "alarms": [alarm_values(alarm) for alarm in entry.alarms],
        "same": same,
        "spans": [_span(entry, i) for i in range(same, len(entry.spans))],
        "loads": [attrs.astuple(load) for load in entry.loads],
    }
    scale, steps = _rise(_depth(before), _depth(entry))
    along = np.diff(steps, axis=2, prepend=0).astype("i1")
    text = json.dumps(values, separators=(",", ":"), allow_nan=False).encode()
    content = b"\0".join([text, scale.tobytes() + along.tobytes()])
    return zlib.compress(content, 9), _entry(values, before, _risen(_depth(before), scale, steps))


def decode(record: bytes, before: Entry) -> tuple[Run, Entry]:
    """Decode run and entry of a record, given the previous entry.

    Raises
    ------
    ValueError
        If the bytes are not a valid record.
    """
    unpacked = zlib.decompressobj()
    try:
        text, _, rest = unpacked.decompress(record, _MOST).partition(b"\0")
        values = json.loads(text)
        shape = _depth(before).shape
        count = shape[0] * shape[1]
        scale = np.frombuffer(rest, "<f4", count).reshape(*shape[:2], 1)
        along = np.frombuffer(rest, "i1", offset=4 * count).reshape(shape)
        steps = np.cumsum(along, axis=2, dtype="i1")
        run = Run(*values["run"])
        return run, _entry(values, before, _risen(_depth(before), scale, steps))
    except (zlib.error, KeyError, TypeError, IndexError) as error:
        raise ValueError(f"no record of an entry: {error}") from error


def _depth(entry: Entry) -> Floats:
    """Depths (joints, 2, N) [m]."""
    return np.stack([joint.depth for joint in entry.joints])


def _rise(kept: Floats, now: Floats) -> tuple[Floats, Floats]:
    """Quantisation step [m] of each surface (joints, 2, 1), and the rise of each sector in steps."""
    rise = now - kept
    if not np.isfinite(rise).all():
        raise ValueError("a surface has a depth that is not a number")
    scale = (np.abs(rise).max(axis=2, keepdims=True) / STEPS).astype("<f4")
    steps = np.divide(rise, scale, out=np.zeros_like(rise), where=scale > 0.0)
    return scale, np.clip(np.rint(steps), -2 * STEPS + 1, 2 * STEPS - 1).astype("i1")


def _risen(kept: Floats, scale: Floats, steps: Floats) -> Floats:
    """Depths after a rise, bit for bit the same in encoding and decoding."""
    return np.asarray(np.maximum(kept + steps * scale.astype(float), 0.0))


def _span(entry: Entry, i: int) -> list[int]:
    return [*entry.spans[i], entry.span_epochs[i] if entry.span_epochs else 0]


def _entry(values: dict[str, Any], before: Entry, depth: Floats) -> Entry:
    spans = [_span(before, i) for i in range(values["same"])] + values["spans"]
    epochs = tuple(epoch for *_, epoch in spans)
    return Entry(
        stamp_ns=values["stamp_ns"],
        joints=tuple(
            JointWear(joint.name, own, *part)
            for joint, own, part in zip(before.joints, depth, values["parts"], strict=True)
        ),
        totals=values["totals"],
        alarms=tuple(alarm_of(*each) for each in values["alarms"]),
        spans=tuple((begin, end) for begin, end, _ in spans),
        span_epochs=epochs if any(epochs) else (),
        loads=tuple(WalkedLoad(*load) for load in values.get("loads", ())),  # before format 17 without
    )
