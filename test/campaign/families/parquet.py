"""Parquet files, damaged or with footers that lie: refused, reported, or as if whole."""

import io
from functools import cache, partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from campaign.case import Case
from campaign.recordings_damaged import DAMAGES, Damage, Generator, compared
from campaign.recordings_stored import START_NS, read
from leg_wear_monitor.twin.sample import Samples

SHORT, LONG = 40, 1000

_WAYS: tuple[dict[str, object], ...] = (
    {"compression": "none", "write_page_checksum": True},
    {"compression": "zstd", "write_page_checksum": True, "data_page_version": "2.0"},
    {"compression": "snappy"},
    {"compression": "gzip", "use_dictionary": False, "data_page_size": 500, "write_page_checksum": True},
    {"compression": "none", "use_dictionary": False, "write_statistics": False, "write_page_checksum": True},
)
_GROUPS = (300, 301, 199)


@cache
def _stored(way: int) -> bytes:
    k = np.arange(sum(_GROUPS))
    angle = 2.0 * np.pi * k / 200.0 % (2.0 * np.pi)
    torque = np.random.default_rng(1).normal(size=len(k))
    table = pa.table(
        {"time": START_NS * 1.0e-9 + k / 200.0, "crank_angle": angle, "drive_torque": torque, "other": k}
    )
    file = io.BytesIO()
    with pq.ParquetWriter(file, table.schema, **_WAYS[way]) as writer:
        for begin, rows in zip(np.cumsum((0, *_GROUPS)), _GROUPS, strict=False):
            writer.write_table(table.slice(begin, rows))
    return file.getvalue()


@cache
def _true() -> Samples:
    import tempfile

    with tempfile.TemporaryDirectory() as place:
        (Path(place) / "x.parquet").write_bytes(_stored(0))
        return read(Path(place) / "x.parquet")[0]


def _varint(number: int) -> bytes:
    rest, found = number << 1, b""
    while rest > 127:
        rest, found = rest >> 7, found + bytes([rest & 127 | 128])
    return found + bytes([rest])


def _footer(content: bytearray) -> int:
    """Where the footer begins."""
    return len(content) - 8 - int.from_bytes(content[-8:-4], "little")


def _replaced(content: bytearray, changes: list[tuple[bytes, bytes]]) -> None:
    begin = _footer(content)
    footer = bytes(content[begin:-8])
    for old, new in changes:
        footer = footer.replace(old, new)
    content[begin:] = footer + len(footer).to_bytes(4, "little") + b"PAR1"


def _rows(content: bytearray, rng: Generator) -> str:
    """A group declares another number of rows; its columns and the file do so, too, or do not."""
    group = int(rng.integers(3))
    claimed = int(rng.choice([0, 1, 150, 298, 302, 5000, 2**31, 2**40, 2**62]))
    changes = [(_varint(_GROUPS[group]), _varint(claimed))]
    if is_total := bool(rng.integers(2)):
        changes.append((_varint(sum(_GROUPS)), _varint(sum(_GROUPS) - _GROUPS[group] + claimed)))
    _replaced(content, changes)
    return (
        f"group {group} of {_GROUPS[group]} rows claims {claimed}{', as does the file' if is_total else ''}"
    )


def _name(content: bytearray, rng: Generator) -> str:
    name = (b"time", b"other", b"crank_angle")[int(rng.integers(3))]
    new = (b"\xff\xfe", b"", b"\x1b[2J", b"a\nb", b"x" * 3000, b"drive_torque")[int(rng.integers(6))]
    _replaced(content, [(name, new)])  # the length before it stays, or is changed with it
    if rng.integers(2):
        _replaced(content, [(bytes([len(name)]) + new, bytes([min(len(new), 127)]) + new)])
    return f"{name!r} is called {new[:20]!r}"


def _in_the_footer(damage: Damage, content: bytearray, rng: Generator) -> str:
    begin = _footer(content)
    footer = content[begin:-8]
    what = damage(footer, rng)
    content[begin:] = footer + len(footer).to_bytes(4, "little") + b"PAR1"
    return f"footer: {what}"


def _many(content: bytearray, rng: Generator) -> str:
    """A footer of small records without end: columns without a name, or a text."""
    begin, size = _footer(content), int(rng.integers(1_000_000, 8_000_000))
    one = (b"\x26\x00\x00", b"\x48\x00\x00", b"\x18\x00\x00", b"y")[int(rng.integers(4))]
    place = int(rng.integers(begin, len(content) - 8))
    content[place:place] = one * (size // len(one))
    content[-8:-4] = (len(content) - 8 - begin).to_bytes(4, "little")
    return f"{size} bytes of {one!r} in the footer"


_IN_A_FOOTER = tuple(partial(_in_the_footer, damage) for damage in DAMAGES)
_KINDS: tuple[Damage, ...] = (_rows, _name, _many, *DAMAGES, _rows, *_IN_A_FOOTER)


def warm() -> None:
    """Read one."""
    _true()


def case(seed: int) -> Case:
    """Of the kinds in turn, in all ways of writing."""
    rng, way = np.random.default_rng(seed), seed % len(_WAYS)
    content = bytearray(_stored(way))
    what = _KINDS[(seed * 7) % len(_KINDS)](content, rng)
    return Case(
        description=f"{_WAYS[way]}: {what}",
        prepare=lambda directory: (directory / "x.parquet").write_bytes(content),
        run=lambda directory: compared(directory / "x.parquet", true=_true()),
        memory_mb=560.0,
    )
