"""A fleet's tables are the same however it was updated, and each recording counts once."""

import errno
import json
import os
import shutil
import threading

import pytest
from click.testing import CliRunner

import leg_wear_monitor as lw
from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.cli.main import cli
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.fleet.chain import Found, _counted, count_or_fault, scan
from leg_wear_monitor.fleet.description import load_fleet
from leg_wear_monitor.fleet.directory import LegDirectory, locked
from leg_wear_monitor.fleet.overview import load_overview
from leg_wear_monitor.fleet.update import Fleet
from leg_wear_monitor.workers import package_digest

pytest.importorskip("pyarrow", reason="the extra 'fleet' is not installed")

pytestmark = pytest.mark.usefixtures("one_twin")


def contents(out):
    """All files of a fleet but the ledgers, whose pages need not have one order, by their names."""
    left_out = ("ledger", ".lock")
    files = (path for path in sorted(out.rglob("*")) if path.is_file() and path.name not in left_out)
    return {str(path.relative_to(out)): path.read_bytes() for path in files}


def lines(out, leg):
    return {line["file"]: line for line in LegDirectory(out, leg).lines()}


@pytest.fixture(scope="module")
def home(walk, describe, tmp_path_factory):
    """A fleet of two legs: names that do not sort by time, a truncated recording, and a file that is none."""
    home = tmp_path_factory.mktemp("fleet")
    walk(home / "a/z.mcap", seed=1)
    walk(home / "a/y.mcap", begin_s=100.0, seed=2)
    whole = walk(home / "b/half.mcap", seed=3)
    whole.write_bytes(whole.read_bytes()[: whole.stat().st_size * 7 // 8])
    (home / "b/trash.mcap").write_bytes(b"no recording" * 10)
    describe(home, "a", "b")
    return home


@pytest.fixture(scope="module")
def first(home, update, tmp_path_factory):
    """Its directory after an uninterrupted update in this process, and what that found."""
    out = tmp_path_factory.mktemp("updated")
    return out, update(home / "fleet.yaml", out)


@pytest.fixture(scope="module")
def updated(first):
    """That directory."""
    return first[0]


def test_recordings_are_counted_in_the_order_of_time(updated):
    found = list(LegDirectory(updated, "a").lines())
    assert [(line["file"], line["outcome"]) for line in found] == [
        ("a/z.mcap", "counted"),
        ("a/y.mcap", "counted"),
    ]
    assert found[0]["end_ns"] < found[1]["begin_ns"]
    assert not any(line["is_late"] or line["is_partial"] for line in found)
    growths = [line["clearances"]["A"]["counted_m"] for line in found]
    assert growths == sorted(growths)


def test_a_damaged_recording_costs_itself_and_is_named(first):
    out, found = first
    (trash, half) = found.findings
    assert (trash[0], half[0]) == ("b", "b")
    assert trash[1].startswith("b/trash.mcap: unreadable; parts of it are lost; begins with")
    assert half[1].startswith("b/half.mcap: counted, 2 gait cycles") and "parts of it are lost" in half[1]
    health = load_overview(out).leg("b").recordings
    assert (health.found, health.counted, health.unreadable, health.partial) == (2, 1, 1, 1)
    assert [(bad.file, bad.outcome) for bad in health.bad] == [
        ("b/half.mcap", "counted"),
        ("b/trash.mcap", "unreadable"),
    ]
    assert (out / "legs/b/log").read_text().splitlines() == [trash[1], half[1]]


def _bad_sector(*_):
    raise OSError(errno.EIO, "Input/output error")


class OnBadDisk(Recording):
    """A recording in a bad sector."""

    _joined = _bad_sector


@pytest.mark.parametrize(
    ("name", "bad"),
    [
        ("hashlib.file_digest", _bad_sector),
        ("leg_wear_monitor.fleet.chain.Recording", OnBadDisk),
        ("leg_wear_monitor.playback.replay.Recording", OnBadDisk),
    ],
    ids=["content", "begin", "replay"],
)
def test_what_the_system_could_not_read_is_named_and_tried_again(
    walk, describe, update, tmp_path, monkeypatch, name, bad
):
    walk(tmp_path / "a/1.mcap")
    path, out = describe(tmp_path, "a"), tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(name, bad)
        for _ in range(2):
            ((leg, text),) = update(path, out).findings
            assert leg == "a" and text == load_overview(out).leg("a").fault
            assert text == (
                "a/1.mcap: unreadable; cannot be read: Input/output error; tried again at the next update"
            )
    assert (out / "legs/a/log").read_text().splitlines() == [text]
    assert update(path, out).counted == 1
    leg = load_overview(out).leg("a")
    assert (leg.fault, leg.recordings.counted, leg.recordings.unreadable) == ("", 1, 0)


def test_interrupted_between_two_recordings_it_goes_on_there(home, updated, update, tmp_path):
    lines = []

    def interrupt(*line):
        lines.append(line)
        if len(lines) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        update(home / "fleet.yaml", tmp_path, report=interrupt)
    assert not (tmp_path / "fleet.json").exists()
    update(home / "fleet.yaml", tmp_path, report=interrupt)
    assert len(lines) == 4
    assert contents(tmp_path) == contents(updated)


def test_killed_after_the_table_and_before_the_ledger_is_written_nothing_is_lost_or_twice(
    home, updated, update, tmp_path, monkeypatch
):
    """After the ledger, too, is written: as where a line was cut off, below."""
    with monkeypatch.context() as patch:

        def killed(*_):
            raise KeyboardInterrupt

        patch.setattr(LegDirectory, "expect", killed)
        with pytest.raises(KeyboardInterrupt):
            update(home / "fleet.yaml", tmp_path)
    assert list((tmp_path / "cycles").rglob("*.parquet"))
    update(home / "fleet.yaml", tmp_path)
    assert contents(tmp_path) == contents(updated)


def test_a_line_that_was_cut_off_is_written_again(home, updated, update, tmp_path):
    shutil.copytree(updated, tmp_path / "out")
    records, log = (tmp_path / "out/legs/a" / name for name in ("recordings.jsonl", "log"))
    first, second = records.read_bytes().splitlines(keepends=True)
    (tmp_path / "out/legs/a/pending.json").write_bytes(second)
    records.write_bytes(first + second[:100])
    log.write_bytes(log.read_bytes().splitlines(keepends=True)[0])
    update(home / "fleet.yaml", tmp_path / "out")
    assert contents(tmp_path / "out") == contents(updated)


def test_a_copy_counts_once(walk, describe, update, tmp_path):
    path = walk(tmp_path / "a/1.mcap")
    shutil.copy(path, tmp_path / "a/2.mcap")
    description, out, lines = describe(tmp_path, "a"), tmp_path / "out", []
    assert update(description, out, report=lambda *line: lines.append(line)).counted == 1
    assert lines[0] == ("a", "a/2.mcap: is a copy of a/1.mcap, counted once")
    path.rename(tmp_path / "a/3.mcap")
    assert update(description, out).counted == 0
    shutil.copy(tmp_path / "a/3.mcap", tmp_path / "a/0.mcap")
    assert update(description, out).counted == 0 and update(description, out).is_up_to_date
    assert [line for line in (out / "legs/a/log").read_text().splitlines() if "copy" in line] == [
        "a/2.mcap: is a copy of a/1.mcap, counted once",
        "a/3.mcap: is a copy of a/2.mcap, counted once",
        "a/0.mcap: is a copy of a/2.mcap, counted once",
    ]


def test_a_name_that_a_terminal_obeys_is_escaped_everywhere(walk, describe, update, tmp_path, capfd):
    walk(tmp_path / "a/\x1b[2J\n.mcap")
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / os.fsdecode(b"\xff\x1b]0;x.mcap")).write_bytes(b"no recording")
    done = update(describe(tmp_path, "a", "b"), tmp_path / "out")
    assert done.counted == 1
    assert load_overview(tmp_path / "out").leg("a").recordings.counted == 1
    (bad,) = load_overview(tmp_path / "out").leg("b").recordings.bad
    assert bad.file == r"b/\udcff\x1b]0;x.mcap"
    texts = [text for _, text in done.findings]
    texts += [line["file"] for leg in "ab" for line in LegDirectory(tmp_path / "out", leg).lines()]
    texts += [line for leg in "ab" for line in (tmp_path / f"out/legs/{leg}/log").read_text().split("\n")]
    assert len(texts) == 1 + 2 + 4 and all(text.isprintable() for text in texts)


def test_what_a_killed_update_left_is_removed(home, updated, update, tmp_path):
    shutil.copytree(updated, tmp_path / "out")
    for name in ("legs/a/.summary.json.part", "cycles/leg=a/.0123456789.parquet.part"):
        (tmp_path / "out" / name).touch()
    update(home / "fleet.yaml", tmp_path / "out")
    assert contents(tmp_path / "out") == contents(updated)


def test_what_overlaps_counts_once_and_late_ones_are_said(walk, describe, update, tmp_path):
    walk(tmp_path / "a/1.mcap", begin_s=10.0, seconds=6.0)
    description, out = describe(tmp_path, "a"), tmp_path / "out"
    update(description, out)
    walk(tmp_path / "a/0.mcap", begin_s=0.0, seconds=4.0)
    walk(tmp_path / "a/2.mcap", begin_s=12.0, seconds=6.0)
    walk(tmp_path / "a/3.mcap", begin_s=11.0, seconds=3.0)
    update(description, out)
    found = lines(out, "a")
    assert [name for name, line in found.items() if line["is_late"]] == ["a/0.mcap", "a/3.mcap", "a/2.mcap"]
    assert found["a/3.mcap"]["outcome"] == "already_counted"
    overlapping = found["a/2.mcap"]
    assert overlapping["outcome"] == "counted"
    assert 0.9 < overlapping["lost"]["already_counted"] / (4.0 * 2 * 200) <= 1.0
    assert sum(line["cycles"] for line in found.values()) <= 4 + 8  # of a second, in 0 to 4 s and 10 to 18 s
    spans_h = load_overview(out).leg("a").recordings.counted_h
    assert 3600.0 * spans_h == pytest.approx(4.0 + 8.0, abs=0.1)  # 0 to 4 s and 10 to 18 s
    log = (out / "legs/a/log").read_text()
    assert "a/2.mcap: counted" in log and "s of it are in the ledger already: not counted again" in log
    assert "a/0.mcap: counted" in log and "a later recording was counted before it" in log


def test_the_content_of_two_legs_is_counted_for_none(walk, describe, update, tmp_path):
    shutil.copytree(walk(tmp_path / "a/1.mcap").parent, tmp_path / "b")
    done = update(describe(tmp_path, "a", "b"), tmp_path / "out")
    assert done.counted == 0
    text = "has a recording with the same content; not counted"
    assert done.findings == [("a", f"a/1.mcap: the leg b {text}"), ("b", f"b/1.mcap: the leg a {text}")]
    (tmp_path / "b/1.mcap").unlink()
    with pytest.warns(lw.errors.ConfigWarning, match=r"b/\* matches no recording"):
        assert update(describe(tmp_path, "a", "b"), tmp_path / "out").counted == 1


def test_a_leg_without_its_ledger_stops_and_others_go_on(home, updated, update, tmp_path):
    shutil.copytree(updated, tmp_path / "out")
    (tmp_path / "out/legs/a/ledger").unlink()
    done = update(home / "fleet.yaml", tmp_path / "out")
    assert done.findings == [("a", f"{tmp_path}/out/legs/a/ledger is missing: put a copy of it back")]


def test_a_worker_with_other_code_counts_nothing(home, tmp_path):
    (leg, _) = load_fleet(home / "fleet.yaml").legs
    found = Found(leg.recordings[0], 1, 1, "key")
    fault = count_or_fault(leg, tmp_path, found, 0, "of another version")
    assert fault == "a worker has another version of leg_wear_monitor; install the same one everywhere"
    assert list(tmp_path.iterdir()) == []


def test_what_a_worker_of_a_killed_update_has_counted_is_not_counted_again(walk, describe, tmp_path):
    """It counts between the planning of the next update and its turn, which waits for it."""
    walk(tmp_path / "a/1.mcap")
    (leg,) = load_fleet(describe(tmp_path, "a")).legs
    (found,), directory = scan(leg, {}), LegDirectory(tmp_path / "out", "a")
    lines = []
    with locked(directory.path):
        arguments = leg, tmp_path / "out", found, 0, package_digest()
        waiting = threading.Thread(target=lambda: lines.append(count_or_fault(*arguments)))
        waiting.start()
        orphan = _counted(leg, directory, found, 0)
        assert waiting.is_alive()
    waiting.join()
    assert lines == [orphan] == list(directory.lines())


def test_one_update_at_a_time(home, updated, update):
    with locked(updated), pytest.raises(ConfigError, match="is being updated by another process"):
        update(home / "fleet.yaml", updated)


def test_without_pyarrow_one_line_says_what_to_install(home, update, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    with pytest.raises(LegWearError, match=r"need pyarrow.*pip install 'leg_wear_monitor\[fleet\]'"):
        update(home / "fleet.yaml", tmp_path)


def test_a_leg_is_forecast_with_what_others_measured(walk, update, tmp_path):
    """Its forecast names the parts that it learned from; nothing that is counted changes by it."""
    walk(tmp_path / "old/1.mcap", seed=1)
    path = tmp_path / "fleet.yaml"
    path.write_text('legs:\n  - {id: old, recordings: "old/*", lot: "2026-03"}\n')
    out = tmp_path / "out"
    update(path, out)
    assert (
        not (out / "learning.json").exists() or not json.loads((out / "learning.json").read_text())["pairs"]
    )
    before = json.loads((out / "legs/old/summary.json").read_text())
    assert "lot" not in before["joints"]["A"]["forecast"]["prior"]["basis"]
    cycles = Fleet(out).cycles().leg.value_counts().to_dict()

    ledger = LegDirectory(out, "old").ledger
    counted = lines(out, "old")["old/1.mcap"]["clearances"]["A"]["counted_m"]
    line = ["measure", "A", f"{1e3 * counted + 0.01:.4f}", "--sigma", "0.001", "--ledger", str(ledger)]
    result = CliRunner().invoke(cli, line)
    assert result.exit_code in (0, 1), result.output
    walk(tmp_path / "new/1.mcap", seed=2)
    with path.open("a") as file:
        file.write('  - {id: new, recordings: "new/*", lot: "2026-03"}\n')
    done = update(path, out)
    assert [chain.leg.id for chain in done.chains if chain.new] == ["new"]
    prior = json.loads((out / "legs/new/summary.json").read_text())["joints"]["A"]["forecast"]["prior"]
    assert prior["basis"] == "1 part of lot 2026-03"
    (old,) = [chain for chain in done.chains if chain.is_renewed]  # nothing new was recorded of it
    assert old.leg.id == "old" and done.renewed == 1
    now, own = load_overview(out).leg("old"), json.loads((out / "legs/old/summary.json").read_text())
    assert now.clearances["A"].measured_m == pytest.approx(counted + 1e-5, abs=1e-7)
    assert now.clearances["A"].counted_m == counted and now.recordings.counted == 1
    assert own["joints"]["A"]["forecast"]["measurements"] == len(own["measurements"]) == 1
    assert own["joints"]["A"]["forecast"]["clearance_m"] != before["joints"]["A"]["forecast"]["clearance_m"]
    assert own["clearances"]["A"]["believed_by"] in ("measured", "both")
    assert Fleet(out).cycles().leg.value_counts().to_dict() == cycles | {"new": cycles["old"]}
    assert update(path, out).is_up_to_date

    # a measurement alone, no recording: all legs of the lot follow, and what follows is what a replay gives
    line[1] = "B"
    assert CliRunner().invoke(cli, line).exit_code in (0, 1)
    kept = contents(out)
    done = update(path, out, begin=lambda _: pytest.fail("nothing is to be compiled"))
    assert (done.counted, done.renewed, done.is_up_to_date) == (0, 2, False)
    new = json.loads((out / "legs/new/summary.json").read_text())["joints"]["A"]["forecast"]
    assert new["prior"]["basis"] == "2 parts of lot 2026-03" and update(path, out).is_up_to_date
    shutil.rmtree(out / "legs/new")
    shutil.rmtree(out / "cycles/leg=new")
    update(path, out)
    again = json.loads((out / "legs/new/summary.json").read_text())["joints"]["A"]["forecast"]
    assert again == new
    assert set(contents(out)) == set(kept)


@pytest.mark.slow  # playback/test_sampled_replay.py holds the law for one leg
def test_a_fleet_follows_a_sample_of_the_gait_cycles(walk, describe, update, tmp_path):
    walk(tmp_path / "a/1.mcap", seconds=90.0)
    path = describe(tmp_path, "a")
    done = update(path, tmp_path / "out", sample=0.25)
    (line,) = done.chains[0].new
    sampling = json.loads((tmp_path / "out/legs/a/summary.json").read_text())["sampling"]
    assert line["outcome"] == "counted" and line["cycles"] >= 85
    assert 0.0 < sampling["estimated_cycles"] < line["cycles"]
