"""Names, kinds of files, metadata and databases that are not what they seem."""

import os
import socket
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np

from campaign import recordings_stored
from campaign.case import Case, Outcome
from campaign.recordings_damaged import compared
from campaign.recordings_stored import Sent, traffic, write_mcap

Generator = np.random.Generator
Made = tuple[str, list[str]]  # what it is, and what is named to be read
_BAD = (
    "\x1b[2J\x1b]0;owned\x07",
    "a\nb",
    "\u202eevil",
    "\x00",
    "\udcff",
    "\u200b",
    "\x9b31m",
    "<script>",
    "x" * 5000,
)


def _bad_text(rng: Generator) -> str:
    return _BAD[int(rng.integers(len(_BAD)))]


def _sound() -> bytes:
    return recordings_stored.stored()["mcap, zstd"][1]["x.mcap"]


def _named_badly(directory: Path, rng: Generator) -> Made:
    """A file whose name no terminal should see, whole or cut."""
    text = [each for each in _BAD if "\x00" not in each and len(each) < 200][int(rng.integers(7))]
    content = _sound()
    name = text.replace("/", "_").encode("utf-8", "surrogateescape") + b".mcap"
    with open(os.fsencode(directory) + b"/" + name, "wb") as file:
        file.write(content[: len(content) // (1 + int(rng.integers(2)))])
    return f"file called {name!r}", [os.fsdecode(name)]


def _long_name(_directory: Path, rng: Generator) -> Made:
    length = int(rng.choice([256, 300, 5000]))
    return f"name of {length} characters", ["x" * length + ".mcap"]


def _no_file(directory: Path, rng: Generator) -> Made:
    name = ("x.mcap", "x.db3", "x.mcap.zstd", "metadata.yaml")[int(rng.integers(4))]
    kind = ("pipe", "directory", "socket", "link to a device", "link to itself")[int(rng.integers(5))]
    within = name == "metadata.yaml" or bool(rng.integers(2))
    home = directory / "bag" if within else directory
    home.mkdir(exist_ok=True)
    if within:
        (home / "good.mcap").write_bytes(_sound())
    if kind == "pipe":
        os.mkfifo(home / name)
    elif kind == "directory":
        (home / name).mkdir()
    elif kind == "socket":
        with closing(socket.socket(socket.AF_UNIX)) as end:
            end.bind(os.path.relpath(home / name))
    else:
        (home / name).symlink_to("/dev/zero" if "device" in kind else name)
    return f"{kind} as {name}, {'in a bag' if within else 'alone'}", ["bag" if within else name]


def _bad_topics(directory: Path, rng: Generator) -> Made:
    """Topics with names that obey nobody; the crank's is one of them or is missing."""
    text = _bad_text(rng).replace("\udcff", "?")
    moved = bool(rng.integers(2))
    sent: Sent = [(f"/{text}/joint_states" if moved and "joint" in topic else topic, time, raw)
                  for topic, time, raw in traffic()]  # fmt: skip
    sent += [(f"/{text}", sent[-1][1], b"\0")]
    write_mcap(directory / "x.mcap", sent)
    return f"topics called {text[:20]!r}", ["x.mcap"]


def _bad_joint(directory: Path, rng: Generator) -> Made:
    text = ("wheel", "crank ", "\x1b[31mcrank", "x" * 3000)[int(rng.integers(4))]
    write_mcap(directory / "x.mcap", traffic(crank=text))
    return f"crank called {text[:20]!r}", ["x.mcap"]


def _two_legs(directory: Path, rng: Generator) -> Made:
    """Two legs given as one: by other topics, by another crank's name, by other angles."""
    how = int(rng.integers(3))
    other = [traffic(), traffic(crank="wheel"), traffic(seed=2, phase_rad=float(rng.uniform(0.5, 5.5)))][how]
    if how == 0:
        other = [(f"/right{topic}", time, raw) for topic, time, raw in other]
    write_mcap(directory / "a.mcap", traffic())
    write_mcap(directory / "b.mcap", other)
    return f"two legs, {('topics', 'names', 'angles')[how]}", ["a.mcap", "b.mcap"]


def _metadata(directory: Path, rng: Generator) -> Made:
    laughs = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
        f"{chr(98 + i)}: &{chr(98 + i)} [{', '.join(['*' + chr(97 + i)] * 10)}]\n" for i in range(12)
    )
    merges = "a: &a {k: v}\n" + "".join(
        f"{chr(98 + i)}: &{chr(98 + i)} {{<<: [{', '.join(['*' + chr(97 + i)] * 10)}]}}\n" for i in range(9)
    )
    head = "rosbag2_bagfile_information:\n  relative_file_paths: "
    texts = {
        "aliases": f"{laughs}{head}*m\n  compression_mode: *m\n",
        "merges": f"{merges}{head}[x.mcap]\n",
        "brackets": f"{head}{'[' * 20_000}",
        "braces": f"{head}{'{a: ' * 20_000}",
        "aliases as topics": f"{laughs}{head}[x.mcap]\n  topics_with_message_count: *m\n",
        "another's files": f"{head}[../../../etc/passwd, /dev/zero, x.mcap]\n",
        "the same file often": f"{head}[{', '.join(['x.mcap'] * 5000)}]\n",
        "large": f"{head}[x.mcap]\n#" + "x" * 2_000_000,
        "numbers": f"{head}[1, 2, {'9' * 6000}]\n",
        "a tag": f"{head}!!python/object/apply:os.system [x]\n",
        "no text": "\udcff\udcfe",
        "nothing": "",
    }
    what = sorted(texts)[int(rng.integers(len(texts)))]
    recordings_stored.lay_out(
        directory,
        {"bag/x.mcap": _sound(), "bag/metadata.yaml": texts[what].encode("utf-8", "surrogateescape")},
    )
    return f"metadata.yaml of {what}", ["bag"]


def _database(directory: Path, rng: Generator) -> Made:
    """A database with another's schema, rows of another kind, or rows of no topic."""
    statements = {
        "no index": "DROP INDEX IF EXISTS timestamp_idx",
        "no topics": "DELETE FROM topics",
        "rows of no topic": "UPDATE messages SET topic_id = 77 WHERE id % 2",
        "texts": "UPDATE messages SET data = 'text', timestamp = 'now' WHERE id % 3 = 0",
        "a huge row": "UPDATE messages SET data = zeroblob(200000000) WHERE id = 5",
        "bad names": "UPDATE topics SET name = name || char(27) || '[2J', type = char(27)",
        "numbers for texts": "UPDATE messages SET timestamp = 1e300 WHERE id < 9; "
        "UPDATE topics SET type = x'00ff'",
        "a renamed column": "ALTER TABLE messages RENAME COLUMN data TO stuff",
        "extreme times": "UPDATE messages SET timestamp = -9223372036854775808 WHERE id % 2",
    }
    what = sorted(statements)[int(rng.integers(len(statements)))]
    path = directory / "x.db3"
    path.write_bytes(recordings_stored.stored()["db3"][1]["x.db3"])
    with closing(sqlite3.connect(path)) as database:
        database.executescript(statements[what])
    return f"db3 with {what}", ["x.db3"]


def _journal(directory: Path, rng: Generator) -> Made:
    """A database whose rows are partly in a journal beside it, which may be damaged too."""
    name = ("x.db3", "x%41.db3", "x?mode=rw.db3", "x#y.db3")[int(rng.integers(4))]
    mode = ("wal", "delete")[int(rng.integers(2))]
    path = directory / name
    path.write_bytes(recordings_stored.stored()["db3"][1]["x.db3"])
    made = directory / "made.db3"
    made.write_bytes(path.read_bytes())
    with closing(sqlite3.connect(made, isolation_level=None)) as database:
        database.execute(f"PRAGMA journal_mode = {mode}")
        database.execute("PRAGMA cache_size = 1")
        database.execute("BEGIN")
        database.execute("CREATE TABLE extra AS SELECT * FROM messages")
        database.execute("DELETE FROM messages WHERE id > 300")
        if mode == "wal":
            database.execute("ROLLBACK" if rng.integers(2) else "COMMIT")
        end = "-wal" if mode == "wal" else "-journal"
        _copy(made, path)
        _copy(Path(f"{made}{end}"), Path(f"{path}{end}"), rng if rng.integers(2) else None)
    for each in directory.glob("made*"):
        each.unlink()
    return f"{name} with a {end}", [name]


def _copy(source: Path, target: Path, rng: Generator | None = None) -> None:
    """Copy a file as it is now, or damaged."""
    content = bytearray(source.read_bytes() if source.exists() else b"")
    if rng is not None and content:
        content[int(rng.integers(len(content)))] ^= 1
    target.write_bytes(content)


_TRAPS: tuple[Callable[[Path, Generator], Made], ...] = (
    _named_badly, _long_name, _no_file, _bad_topics, _bad_joint, _two_legs, _metadata, _database, _journal,
    _metadata, _database, _no_file,
)  # fmt: skip


def trap(seed: int) -> Case:
    """A case of a trap; it is laid when the case runs, in the child's directory."""
    make = _TRAPS[seed % len(_TRAPS)]

    def run(directory: Path) -> tuple[Outcome, str]:
        _, named = make(directory, np.random.default_rng(seed))
        return compared(*(Path(name) for name in named))

    return Case(description=f"trap: {make.__name__.strip('_')}", run=run)
