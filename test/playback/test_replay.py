"""A replay is the live run: the same samples, the same reports, however they were cut and stored."""

import itertools
import json
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import attrs
import numpy as np
import pytest
from raw_messages import Message, messages_of, write_messages
from short_walk import torque_of_a_cycle, walk_messages

import leg_wear_monitor as lw
from leg_wear_monitor.messages.cdr import Decoder
from leg_wear_monitor.messages.encode import LegDrawing
from leg_wear_monitor.messages.leg_markers import LegMarkers
from leg_wear_monitor.messages.outputs import Messages
from leg_wear_monitor.messages.streams import ForecastTimes, topic_of
from leg_wear_monitor.monitor.config.inputs import Cadence
from leg_wear_monitor.monitor.config.settings import LedgerFile
from leg_wear_monitor.monitor.forecast.forecast import Answer, Quantiles
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.monitor.ledger.ledger import open_ledger
from leg_wear_monitor.playback.result import summary_of
from leg_wear_monitor.playback.summary import ReplayResult

SECONDS, RATE_HZ = 8, 200
CYCLES = SECONDS - 2  # the first and the last are not whole

PLOTTED = lw.MonitorConfig(publish_scalars=True, publish_markers=True)

ALL_COUNTED = "everything in this recording is in the ledger already: nothing was counted"


@pytest.fixture(scope="module")
def walk(leg: lw.Mechanism) -> list[Message]:
    """A steady gait as messages in order of arrival."""
    return walk_messages(torque_of_a_cycle(leg), seconds=SECONDS, seed=1)


@pytest.fixture(scope="module")
def bag(walk: list[Message], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_messages(tmp_path_factory.mktemp("bag") / "walk.mcap", walk, chunk_bytes=20_000)


@attrs.frozen
class Replayed:
    """A replay with a ledger: what it wrote, its result, and the fractions of its progress."""

    out: Path
    ledger: Path
    result: ReplayResult
    fractions: list[float]


def replayed(bag: Path, place: Path, config: lw.MonitorConfig = PLOTTED) -> Replayed:
    out, ledger, fractions = place / "out", place / "own.db", []
    result = lw.replay(bag, config, out=out, ledger=ledger, progress=fractions.append)
    return Replayed(out, ledger, result, fractions)


@pytest.fixture(scope="module")
def first(bag: Path, tmp_path_factory: pytest.TempPathFactory) -> Replayed:
    """A replay into a new ledger, which is not that of its parameters."""
    place = tmp_path_factory.mktemp("first")
    return replayed(bag, place, attrs.evolve(PLOTTED, ledger=LedgerFile(path=str(place / "live.db"))))


@pytest.fixture(scope="module")
def again(bag: Path, first: Replayed, tmp_path_factory: pytest.TempPathFactory) -> Replayed:
    """The same recording again, into copies of the ledger and the reports."""
    place = shutil.copytree(first.out.parent, tmp_path_factory.mktemp("again") / "copy")
    return replayed(bag, place)


def test_a_replay_reports_bit_for_bit_what_the_monitor_reported_live(
    leg: lw.Mechanism, walk: list[Message], first: Replayed
) -> None:
    config = PLOTTED
    monitor, decoder = lw.WearMonitor(leg, config), Decoder(config)
    messages, markers = Messages(config, monitor.clearance_joints), LegMarkers(monitor, LegDrawing(leg))
    live: dict[str, list[bytes]] = {}
    forecasts: list[bytes] = []
    times = ForecastTimes()
    begin, sizes = 0, np.random.default_rng(3)
    while begin < len(walk):
        end = begin + int(sizes.integers(1, 60))
        samples = [decoder.one(raw, kind, time) for kind, time, raw in walk[begin:end]]
        reports = monitor.update(np.concatenate(samples))
        forecasts += [messages.forecast(cycle) for cycle in times.due(reports)]
        for outgoing in (*messages.of(reports), *markers.of(reports)):
            topic = topic_of(outgoing.output, "/leg_wear_monitor")
            live.setdefault(topic, []).extend(row.tobytes() for row in outgoing.messages)
        begin = end
    reported = messages_of(first.out / "reports.mcap")
    assert len(live["/leg_wear_monitor/impact_forces"]) > 0.9 * SECONDS * RATE_HZ
    assert len(live["/leg_wear_monitor/clearance_states"]) >= CYCLES
    assert len(live["/leg_wear_monitor/joints/G/clearance_m"]) >= CYCLES
    assert len(live["/leg_wear_monitor/markers"]) == pytest.approx(10 * SECONDS, abs=3)
    begun_with, *changes = reported.pop("/leg_wear_monitor/alarms")
    assert changes == live.pop("/leg_wear_monitor/alarms", [])
    new = lw.WearMonitor(leg, config)
    assert begun_with == messages.alarms(new.alarms)
    begun_with, *changes = reported.pop("/leg_wear_monitor/verdict")
    assert changes == live.pop("/leg_wear_monitor/verdict")
    assert begun_with == messages.verdict(new.verdict)
    assert len(changes) >= 2  # at first there is no gait cycle
    begun_with, *changes = reported.pop("/leg_wear_monitor/state")
    assert changes == live.pop("/leg_wear_monitor/state")
    assert begun_with == messages.state(new.state_report)
    assert len(changes) >= CYCLES
    for topic, rows in live.items():
        assert reported[topic] == rows
    assert set(reported) - set(live) == {"/diagnostics", "/leg_wear_monitor/forecast"}
    assert reported["/leg_wear_monitor/forecast"] == forecasts
    assert len(reported["/diagnostics"]) >= SECONDS - 1
    assert monitor.wear_depth_m.tobytes() == first.result.monitor.wear_depth_m.tobytes()


@pytest.mark.no_cover
def test_what_a_replay_gives_does_not_depend_on_how_it_was_stored(
    walk: list[Message], bag: Path, first: Replayed, tmp_path: Path
) -> None:
    half = len(walk) // 2 // 2 * 2
    for i, part in enumerate((walk[:half], walk[half:])):
        write_messages(tmp_path / f"walk_{i}.mcap", part, namespace="/leg", chunk_bytes=500_000)
    other = lw.replay(tmp_path, lw.MonitorConfig())
    assert np.array_equal(
        other.history.joint_column("clearance_m"), first.result.history.joint_column("clearance_m")
    )
    assert other.monitor.wear_depth_m.tobytes() == first.result.monitor.wear_depth_m.tobytes()


def test_the_summary_is_plain_json_and_tells_of_every_joint(first: Replayed) -> None:
    result = first.result
    text = result.summary(2.0).to_json()
    record = json.loads(text)
    assert summary_of(record, "summary.json").to_json() == text
    assert record["real_time_factor"] == pytest.approx(result.duration_s / 2.0)
    assert record["cycles"] == len(result.history) >= CYCLES
    assert record["recording"]["crank_samples"] == record["recording"]["torque_samples"] == SECONDS * RATE_HZ
    assert not record["recording"]["is_partial"] and not record["recording"]["findings"]
    assert set(record["joints"]) == set(result.monitor.clearance_joints) == set(record["wear_depth_m"])
    for name, joint in record["joints"].items():
        opened = joint["opened_m"]
        assert 0.0 < opened < 1.0e-6
        depth = record["wear_depth_m"][name]
        assert np.mean(depth["bushing"]) + np.mean(depth["journal"]) >= opened
        assert joint["peak_force_n"] > joint["mean_force_n"] > 0.0
    assert record["lost"]["faulty"].keys() and not any(record["lost"]["faulty"].values())
    assert "does not mean the joints are healthy" in record["advice"]


def test_the_page_says_how_long_the_leg_lasts_and_where_measured_clearances_lay(
    first: Replayed, unpainted: None
) -> None:
    pytest.importorskip("jinja2")
    from leg_wear_monitor.report.page import page_html
    from leg_wear_monitor.report.replay.page import replay_page

    summary = first.result.summary()
    # this torque is that of an ideal leg, which is not what a leg with clearances needs
    assert summary.forecast.answer is Answer.OUTSIDE_VALIDITY
    without = page_html(replay_page(summary))
    assert "The leg lasts" not in without and "No clearance was measured yet" in without
    life = Quantiles(700.0, 1000.0, 17532.0)
    days = Quantiles(*(hours / 8.0 for hours in attrs.astuple(life)))
    probability = dict.fromkeys(summary.joints, 0.1) | {"G": 0.6}
    leg = attrs.evolve(summary.forecast, hours=life, days=days, first_probability=probability, first="G")
    looked = [Measurement(7, "A", "ann", 3e-4, 1e-6, 0.0, 9, 0, fraction, True) for fraction in (0.2, 0.6)]
    verdict = attrs.evolve(summary.verdict, not_valid=())
    changes = {"forecast": leg, "verdict": verdict, "measurements": tuple(looked)}
    html = page_html(replay_page(attrs.evolve(summary, **changes)))
    assert "The leg lasts 1000 hours of walking or 125 days (p10 700 hours of walking or 87.5 days, " in html
    assert "p90 17500 hours of walking or 2190 days); G (knee) is the first" in html
    assert "with a probability of 60 %." in html
    assert "80 % lie between p10 and p90" in html and "No clearance was measured yet" not in html


def test_the_ledger_of_the_parameters_is_left_alone_and_one_that_is_asked_for_is_continued(
    bag: Path, first: Replayed, again: Replayed
) -> None:
    assert first.ledger.exists() and not first.ledger.with_name("live.db").exists()
    one, other = first.result, again.result
    assert other.monitor.lost.already_counted > 0.95 * 2 * SECONDS * RATE_HZ
    assert len(other.history) == 0
    assert other.monitor.wear_depth_m.tobytes() == one.monitor.wear_depth_m.tobytes()
    assert not one.findings
    assert [str(finding) for finding in other.findings] == [f"{bag}: {ALL_COUNTED}"]
    assert other.summary().recording.findings[0].text == ALL_COUNTED
    # what is counted already is no doubt
    assert not other.is_believable and not other.is_unusable
    assert other.summary().gait.is_counted


def test_the_same_recording_again_changes_neither_ledger_nor_report(
    bag: Path, first: Replayed, again: Replayed, tmp_path: Path
) -> None:
    # an alarm that the ledger holds stays the reason
    verdict, nothing = again.result.summary().verdict, "everything that was received is in the ledger already"
    assert verdict.fault_code == "TORQUE_MISMATCH"
    assert verdict.why.endswith(f"; the leg is not monitored now: {nothing}: nothing was counted")
    assert rows(again.ledger) == rows(first.ledger)
    assert [path.name for path in again.out.iterdir()] == ["reports.mcap"]
    assert (again.out / "reports.mcap").read_bytes() == (first.out / "reports.mcap").read_bytes()
    lw.replay(bag, PLOTTED, ledger=again.ledger, out=tmp_path)
    assert (tmp_path / "reports.mcap").exists()


def test_another_machine_is_not_counted(bag: Path, tmp_path: Path, leg: lw.Mechanism) -> None:
    ledger = tmp_path / "other.db"
    fast = attrs.evolve(lw.MonitorConfig(), cadence=Cadence(commanded_rpm=240.0))
    other = lw.replay(bag, fast, ledger=ledger)
    assert other.is_unusable and len(other.history) == CYCLES
    text = f"{ledger}: nothing of this recording is written into the ledger"
    assert text in [str(finding) for finding in other.findings]
    kept = open_ledger(leg, attrs.evolve(fast, ledger=LedgerFile(path=str(ledger))))
    assert kept is not None and kept.entry is None
    kept.close()


@pytest.mark.parametrize(
    "order",
    [
        pytest.param((0, 1), id="in order"),
        pytest.param((1, 0), id="the later one first", marks=pytest.mark.slow),
    ],
)
def test_what_two_recordings_have_in_common_is_counted_once_and_reported(
    walk: list[Message], tmp_path: Path, leg: lw.Mechanism, order: tuple[int, int]
) -> None:
    a, b = walk[: 2 * 5 * RATE_HZ], walk[2 * 3 * RATE_HZ :]
    parts = [write_messages(tmp_path / "a.mcap", a), write_messages(tmp_path / "b.mcap", b)]
    one, other = (lw.replay(parts[i], lw.MonitorConfig(), ledger=tmp_path / "own.db") for i in order)
    assert not one.findings
    (finding,) = other.findings
    assert str(finding).startswith(f"{parts[order[1]]}: ")
    assert str(finding).endswith(" s of it are in the ledger already: not counted again")
    common_s = float(finding.text.split()[0])
    lag_s, lost_s = 0.3, 0.3  # what the tracker leaves at an end, and what it needs at a begin
    assert 2.0 - lag_s - lost_s <= common_s <= 2.0
    assert other.monitor.verdict.verdict.fault_code != "ALREADY_COUNTED"
    kept = open_ledger(leg, ledger_at(tmp_path / "own.db"))
    assert kept is not None and kept.entry is not None
    assert SECONDS - 2 * (lag_s + lost_s) <= kept.entry.moving_s <= SECONDS
    spans = sorted(kept.counted_ns.tolist())
    kept.close()
    # no time is in two spans
    assert all(before[1] <= after[0] for before, after in itertools.pairwise(spans))


def rows(path: Path) -> list[str]:
    """All that a ledger holds."""
    with closing(sqlite3.connect(path)) as db:
        return list(db.iterdump())


def test_a_replay_that_is_cut_off_is_not_in_the_ledger_and_comes_out_the_same_when_repeated(
    bag: Path, first: Replayed, tmp_path: Path
) -> None:
    class CutError(Exception):
        pass

    def cut(fraction: float) -> None:
        if fraction > 0.6:
            raise CutError

    with pytest.raises(CutError):
        lw.replay(bag, PLOTTED, ledger=tmp_path / "own.db", out=tmp_path / "out", progress=cut)
    begun = rows(tmp_path / "own.db")
    repeated = replayed(bag, tmp_path)
    assert rows(repeated.ledger) == rows(first.ledger) != begun
    assert {found.name for found in tmp_path.iterdir()} == {"own.db", "out"}
    assert (repeated.out / "reports.mcap").read_bytes() == (first.out / "reports.mcap").read_bytes()
    assert repeated.result.summary().to_json() == first.result.summary().to_json()


def test_a_ledger_that_cannot_be_written_is_refused_before_the_work(
    bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "own.db"
    open_ledger(lw.load_mechanism("bionic_leg"), ledger_at(path)).abandon()
    before = path.read_bytes()
    monkeypatch.setattr("leg_wear_monitor.monitor.ledger.file._is_opened_to_write", lambda _path: False)
    with pytest.raises(lw.LegWearError, match=r"own.db: cannot be written: attempt to write a readonly"):
        lw.replay(bag, lw.MonitorConfig(), ledger=path)
    assert path.read_bytes() == before


def ledger_at(path: Path) -> lw.MonitorConfig:
    return attrs.evolve(lw.MonitorConfig(), ledger=LedgerFile(path=str(path)))


def test_a_recording_is_not_written_over_by_its_own_reports(bag: Path, tmp_path: Path) -> None:
    path = tmp_path / "reports.mcap"
    path.write_bytes(bag.read_bytes())
    with pytest.raises(lw.LegWearError, match="is to be read and written"):
        lw.replay(path, lw.MonitorConfig(), out=tmp_path)
    assert path.read_bytes() == bag.read_bytes()


def test_progress_goes_from_little_to_all(first: Replayed) -> None:
    assert first.fractions == sorted(first.fractions) and first.fractions[-1] == 1.0


def test_a_crank_that_hardly_turns_gives_a_result_of_nothing(bag: Path) -> None:
    """Nothing is made up, and the reason is said."""
    config = lw.MonitorConfig()
    result = lw.replay(bag, attrs.evolve(config, crank=attrs.evolve(config.crank, gear_ratio=100.0)))
    summary = result.summary()
    assert summary.cycles == 0 and summary.joints == {}
    assert summary.gait.missing.startswith("the crank turns 0.08 times in 8 s")
