"""A replay is the live run: the same samples, the same reports, however they were cut and stored."""

import itertools
import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.bags.mcap_writer import McapWriter
from leg_wear_monitor.messages import encode
from leg_wear_monitor.messages.cdr import Decoder
from leg_wear_monitor.messages.encode import LegDrawing
from leg_wear_monitor.messages.leg_markers import LegMarkers
from leg_wear_monitor.messages.outputs import Messages
from leg_wear_monitor.messages.streams import JOINT_STATE, WRENCH_STAMPED, ForecastTimes, topic_of
from leg_wear_monitor.monitor.config.inputs import Cadence
from leg_wear_monitor.monitor.config.settings import LedgerFile
from leg_wear_monitor.monitor.forecast.forecast import Answer, Quantiles
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.monitor.ledger.ledger import open_ledger
from leg_wear_monitor.playback.result import summary_of

SECONDS, RATE_HZ = 8, 200
CYCLES = SECONDS - 2  # the first and the last are not whole

PLOTTED = lw.MonitorConfig(publish_scalars=True, publish_markers=True)

ALL_COUNTED = "everything in this recording is in the ledger already: nothing was counted"

Messages_ = list[tuple[int, int, bytes]]


@pytest.fixture(scope="module")
def walk(leg: lw.Mechanism) -> Messages_:
    """A steady gait as messages in order of arrival: type, log time, bytes."""
    n = SECONDS * RATE_HZ
    ideal = lw.simulate(leg, clearances=[], cycles=1, trace=360).trace
    angle = 2.0 * np.pi * np.arange(n) / RATE_HZ
    angle += np.random.default_rng(1).normal(0.0, 2.0e-4, n)
    order = np.argsort(ideal.crank_angle_rad)
    torque = np.interp(
        angle % (2.0 * np.pi),
        ideal.crank_angle_rad[order],
        ideal.drive_torque_nm[order],
        period=2.0 * np.pi,
    )
    stamps = 1_700_000_000 * 10**9 + np.arange(n, dtype=np.int64) * (10**9 // RATE_HZ)
    still = np.zeros(n)
    joints = encode.joint_states(stamps, ["hip", "crank"], position=np.stack([still, angle], axis=1))
    wrench = encode.wrenches(stamps, torque=np.stack([still, still, torque], axis=1), frame_id="pelvis")
    messages = []
    for i, stamp in enumerate(stamps.tolist()):
        messages.append((JOINT_STATE, stamp + 100_000, bytes(joints[i])))
        messages.append((WRENCH_STAMPED, stamp + 100_001, bytes(wrench[i])))
    return messages


@pytest.fixture(scope="module")
def bag(walk: Messages_, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bag") / "walk.mcap"
    with McapWriter(path, chunk_bytes=20_000) as writer:
        channels = {
            JOINT_STATE: writer.channel("/joint_states", encode.JOINT_STATE),
            WRENCH_STAMPED: writer.channel("/drive_torque", encode.WRENCH_STAMPED),
        }
        for kind, log_time_ns, raw in walk:
            writer.write(channels[kind], log_time_ns, raw)
    return path


@pytest.fixture(scope="module")
def out(bag: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """Directory and result of a replay."""
    directory = tmp_path_factory.mktemp("out")
    return directory, lw.replay(bag, PLOTTED, out=directory)


def reported(path: Path) -> dict[str, list[bytes]]:
    """Messages of a file by topic, with all checksums looked at."""
    reader = pytest.importorskip("mcap.reader")
    messages: dict[str, list[bytes]] = {}
    with path.open("rb") as file:
        for _, channel, message in reader.make_reader(file, validate_crcs=True).iter_messages(
            log_time_order=False
        ):
            messages.setdefault(channel.topic, []).append(message.data)
    return messages


def test_a_replay_reports_bit_for_bit_what_the_monitor_reported_live(
    leg: lw.Mechanism, walk: Messages_, out: tuple[Path, Any]
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
    replayed = reported(out[0] / "reports.mcap")
    assert len(live["/leg_wear_monitor/impact_forces"]) > 0.9 * SECONDS * RATE_HZ
    assert len(live["/leg_wear_monitor/clearance_states"]) >= CYCLES
    assert len(live["/leg_wear_monitor/joints/G/clearance_m"]) >= CYCLES
    assert len(live["/leg_wear_monitor/markers"]) == pytest.approx(10 * SECONDS, abs=3)
    begun_with, *changes = replayed.pop("/leg_wear_monitor/alarms")
    assert changes == live.pop("/leg_wear_monitor/alarms", [])
    new = lw.WearMonitor(leg, config)
    assert begun_with == messages.alarms(new.alarms)
    begun_with, *changes = replayed.pop("/leg_wear_monitor/verdict")
    assert changes == live.pop("/leg_wear_monitor/verdict")
    assert begun_with == messages.verdict(new.verdict)
    assert len(changes) >= 2  # at first there is no gait cycle
    begun_with, *changes = replayed.pop("/leg_wear_monitor/state")
    assert changes == live.pop("/leg_wear_monitor/state")
    assert begun_with == messages.state(new.state_report)
    assert len(changes) >= CYCLES
    for topic, rows in live.items():
        assert replayed[topic] == rows
    assert set(replayed) - set(live) == {"/diagnostics", "/leg_wear_monitor/forecast"}
    assert replayed["/leg_wear_monitor/forecast"] == forecasts
    assert len(replayed["/diagnostics"]) >= SECONDS - 1
    assert monitor.wear_depth_m.tobytes() == out[1].monitor.wear_depth_m.tobytes()


@pytest.mark.no_cover
def test_what_a_replay_gives_does_not_depend_on_how_it_was_stored(
    walk: Messages_, bag: Path, out: tuple[Path, Any], tmp_path: Path
) -> None:
    half = len(walk) // 2 // 2 * 2
    for i, part in enumerate((walk[:half], walk[half:])):
        with McapWriter(tmp_path / f"walk_{i}.mcap", chunk_bytes=500_000) as writer:
            torque = writer.channel("/leg/drive_torque", encode.WRENCH_STAMPED)
            joints = writer.channel("/leg/joint_states", encode.JOINT_STATE)
            for kind, log_time_ns, raw in part:
                writer.write(joints if kind == JOINT_STATE else torque, log_time_ns, raw)
    other = lw.replay(tmp_path, lw.MonitorConfig())
    assert np.array_equal(
        other.history.joint_column("clearance_m"), out[1].history.joint_column("clearance_m")
    )
    assert other.monitor.wear_depth_m.tobytes() == out[1].monitor.wear_depth_m.tobytes()


def test_the_summary_is_plain_json_and_tells_of_every_joint(out: tuple[Path, Any]) -> None:
    result = out[1]
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


def test_the_page_says_how_long_the_leg_lasts(out: tuple[Path, Any], unpainted: None) -> None:
    pytest.importorskip("jinja2")
    from leg_wear_monitor.report.page import page_html
    from leg_wear_monitor.report.replay.page import replay_page

    summary = out[1].summary()
    # this torque is that of an ideal leg, which is not what a leg with clearances needs
    assert summary.forecast.answer is Answer.OUTSIDE_VALIDITY
    assert "The leg lasts" not in page_html(replay_page(summary))
    life = Quantiles(700.0, 1000.0, 17532.0)
    first = dict.fromkeys(summary.joints, 0.1) | {"G": 0.6}
    days = Quantiles(*(hours / 8.0 for hours in attrs.astuple(life)))
    leg = attrs.evolve(summary.forecast, hours=life, days=days, first_probability=first, first="G")
    verdict = attrs.evolve(summary.verdict, not_valid=())
    html = page_html(replay_page(attrs.evolve(summary, forecast=leg, verdict=verdict)))
    assert "The leg lasts 1000 hours of walking or 125 days (p10 700 hours of walking or 87.5 days, " in html
    assert "p90 17500 hours of walking or 2190 days); G (knee) is the first" in html
    assert "with a probability of 60 %." in html


def test_the_page_shows_where_measured_clearances_lay_in_what_was_expected(
    out: tuple[Path, Any], unpainted: None
) -> None:
    pytest.importorskip("jinja2")
    from leg_wear_monitor.report.page import page_html
    from leg_wear_monitor.report.replay.page import replay_page

    looked = [Measurement(7, "A", "ann", 3e-4, 1e-6, 0.0, 9, 0, fraction, True) for fraction in (0.2, 0.6)]
    summary = out[1].summary()
    without = page_html(replay_page(summary))
    assert "No clearance was measured yet" in without
    html = page_html(replay_page(attrs.evolve(summary, measurements=tuple(looked))))
    assert html.count('<figure class="chart">') == without.count('<figure class="chart">') + 1
    assert "80 % lie between p10 and p90" in html and "No clearance was measured yet" not in html


def test_the_ledger_of_the_parameters_is_left_alone_and_one_that_is_asked_for_is_continued(
    bag: Path, tmp_path: Path
) -> None:
    live, own = tmp_path / "live.db", tmp_path / "own.db"
    config = attrs.evolve(lw.MonitorConfig(), ledger=LedgerFile(path=str(live)))
    first = lw.replay(bag, config, ledger=own)
    assert own.exists() and not live.exists()
    again = lw.replay(bag, config, ledger=own)
    assert again.monitor.lost.already_counted > 0.95 * 2 * SECONDS * RATE_HZ
    assert len(again.history) == 0
    assert again.monitor.wear_depth_m.tobytes() == first.monitor.wear_depth_m.tobytes()
    assert not first.findings
    assert [str(finding) for finding in again.findings] == [f"{bag}: {ALL_COUNTED}"]
    assert again.summary().recording.findings[0].text == ALL_COUNTED


def test_what_is_counted_already_is_no_doubt_and_another_machine_is_not_counted(
    bag: Path, tmp_path: Path, leg: lw.Mechanism
) -> None:
    own = tmp_path / "own.db"
    lw.replay(bag, lw.MonitorConfig(), ledger=own)
    again = lw.replay(bag, lw.MonitorConfig(), ledger=own)
    assert not again.is_believable and not again.is_unusable
    assert again.summary().gait.is_counted
    fast = attrs.evolve(lw.MonitorConfig(), cadence=Cadence(commanded_rpm=240.0))
    other = lw.replay(bag, fast, ledger=tmp_path / "other.db")
    assert other.is_unusable and len(other.history) == CYCLES
    text = f"{tmp_path / 'other.db'}: nothing of this recording is written into the ledger"
    assert text in [str(finding) for finding in other.findings]
    config = attrs.evolve(fast, ledger=LedgerFile(path=str(tmp_path / "other.db")))
    kept = open_ledger(leg, config)
    assert kept is not None and kept.entry is None
    kept.close()


def test_the_same_recording_again_changes_neither_ledger_nor_report(bag: Path, tmp_path: Path) -> None:
    own, out = tmp_path / "own.db", tmp_path / "out"
    lw.replay(bag, lw.MonitorConfig(), ledger=own, out=out)
    kept, report = rows(own), (out / "reports.mcap").read_bytes()
    again = lw.replay(bag, lw.MonitorConfig(), ledger=own, out=out)
    # an alarm that the ledger holds stays the reason
    verdict, nothing = again.summary().verdict, "everything that was received is in the ledger already"
    assert verdict.fault_code == "TORQUE_MISMATCH"
    assert verdict.why.endswith(f"; the leg is not monitored now: {nothing}: nothing was counted")
    assert rows(own) == kept
    assert (out / "reports.mcap").read_bytes() == report
    assert [path.name for path in out.iterdir()] == ["reports.mcap"]
    elsewhere = tmp_path / "elsewhere"
    lw.replay(bag, lw.MonitorConfig(), ledger=own, out=elsewhere)
    assert (elsewhere / "reports.mcap").exists()


def part(walk: Messages_, path: Path, begin_s: float, end_s: float) -> Path:
    """A part of the walk as a recording."""
    begin, end = (2 * round(time_s * RATE_HZ) for time_s in (begin_s, end_s))
    with McapWriter(path) as writer:
        joints = writer.channel("/joint_states", encode.JOINT_STATE)
        torque = writer.channel("/drive_torque", encode.WRENCH_STAMPED)
        for kind, log_time_ns, raw in walk[begin:end]:
            writer.write(joints if kind == JOINT_STATE else torque, log_time_ns, raw)
    return path


@pytest.mark.parametrize(
    "order",
    [
        pytest.param((0, 1), id="in order"),
        pytest.param((1, 0), id="the later one first", marks=pytest.mark.slow),
    ],
)
def test_what_two_recordings_have_in_common_is_counted_once_and_told(
    walk: Messages_, tmp_path: Path, leg: lw.Mechanism, order: tuple[int, int]
) -> None:
    parts = [part(walk, tmp_path / "a.mcap", 0.0, 5.0), part(walk, tmp_path / "b.mcap", 3.0, SECONDS)]
    first, second = (lw.replay(parts[i], lw.MonitorConfig(), ledger=tmp_path / "own.db") for i in order)
    assert not first.findings
    (told,) = second.findings
    assert str(told).startswith(f"{parts[order[1]]}: ")
    assert str(told).endswith(" s of it are in the ledger already: not counted again")
    common_s = float(told.text.split()[0])
    lag_s, lost_s = 0.3, 0.3  # what the tracker leaves at an end, and what it needs at a begin
    assert 2.0 - lag_s - lost_s <= common_s <= 2.0
    assert second.monitor.verdict.verdict.fault_code != "ALREADY_COUNTED"
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
    bag: Path, tmp_path: Path
) -> None:
    class CutError(Exception):
        pass

    def cut(fraction: float) -> None:
        if fraction > 0.6:
            raise CutError

    whole = lw.replay(bag, lw.MonitorConfig(), ledger=tmp_path / "whole.db", out=tmp_path / "whole")
    path = tmp_path / "own.db"
    with pytest.raises(CutError):
        lw.replay(bag, lw.MonitorConfig(), ledger=path, out=tmp_path / "own", progress=cut)
    begun = rows(path)
    again = lw.replay(bag, lw.MonitorConfig(), ledger=path, out=tmp_path / "own")
    assert rows(path) == rows(tmp_path / "whole.db") != begun
    assert {found.name for found in tmp_path.iterdir()} == {"whole.db", "own.db", "whole", "own"}
    reports = [(tmp_path / name / "reports.mcap").read_bytes() for name in ("whole", "own")]
    assert reports[0] == reports[1]
    assert again.summary().to_json() == whole.summary().to_json()


def test_a_ledger_that_cannot_be_written_is_refused_before_the_work(
    bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "own.db"
    open_ledger(lw.load_mechanism("bionic_leg"), ledger_at(path)).abandon()
    before = path.read_bytes()
    monkeypatch.setattr("leg_wear_monitor.monitor.ledger.file._is_writable", lambda _path: False)
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


@pytest.mark.no_cover
def test_progress_goes_from_little_to_all(bag: Path) -> None:
    fractions: list[float] = []
    lw.replay(bag, lw.MonitorConfig(), progress=fractions.append)
    assert fractions == sorted(fractions) and fractions[-1] == 1.0


def test_a_crank_that_hardly_turns_gives_a_result_of_nothing(bag: Path, unpainted: None) -> None:
    """Nothing is made up, and the reason is said."""
    pytest.importorskip("jinja2")
    from leg_wear_monitor.report.page import page_html
    from leg_wear_monitor.report.replay.page import replay_page

    config = lw.MonitorConfig()
    result = lw.replay(bag, attrs.evolve(config, crank=attrs.evolve(config.crank, gear_ratio=100.0)))
    summary = result.summary()
    assert summary.cycles == 0 and summary.joints == {}
    assert summary.gait.missing.startswith("the crank turns 0.08 times in 8 s")
    page = page_html(replay_page(summary))
    assert "forces and wear are not reported" in page
    assert "the crank turns 0.08 times in 8 s" in page
