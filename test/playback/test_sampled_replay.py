"""A sampled replay: its wear is that of a whole one within its error, and it says that it is sampled."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import leg_wear_monitor as lw
from leg_wear_monitor.cli.main import cli
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.ledger.ledger import open_ledger
from leg_wear_monitor.playback.result import summary_of
from leg_wear_monitor.playback.summary import ReplayResult
from leg_wear_monitor.report.page import page_html
from leg_wear_monitor.report.replay.page import replay_page

CYCLES, SAMPLE = 75, 0.4

Table = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def walk() -> Table:
    """A steady gait with its torque, as a table."""
    ideal = lw.simulate("bionic_leg", clearances=[], cycles=1, trace=200).trace
    return {
        "time": 1.0 + 0.005 * np.arange(200 * CYCLES),
        "crank_angle": np.tile(ideal.crank_angle_rad, CYCLES),
        "drive_torque": np.tile(ideal.drive_torque_nm, CYCLES),
    }


@pytest.fixture(scope="module")
def config() -> lw.MonitorConfig:
    return config_from({"diagnosis.enabled": False})


@pytest.fixture(scope="module")
def ledger(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("sampled") / "wear.ledger"


@pytest.fixture(scope="module")
def sampled(walk: Table, config: lw.MonitorConfig, ledger: Path) -> ReplayResult:
    return lw.replay(walk, config, sample=SAMPLE, ledger=ledger)


def clearances(result: ReplayResult) -> np.ndarray:
    return np.array([joint.counted_m for joint in result.summary().clearances.values()])


def test_the_summary_says_what_was_followed(sampled):
    summary = sampled.summary()
    sampling = summary.sampling
    assert sampling.fraction == SAMPLE
    assert sampling.followed_cycles + sampling.estimated_cycles == pytest.approx(summary.cycles, abs=1.0)
    assert 0.2 < sampling.followed_cycles / summary.cycles < 0.7
    assert "gait cycles were followed" in summary.verdict.why
    evidence = {each.name: each.value for each in summary.verdict.evidence}
    assert evidence["sampled fraction"] == SAMPLE
    assert evidence["standard error A"] == summary.joints["A"].sampling_sigma_m
    status = next(each for each in summary.status if each.name == "sampling")
    assert status.values["A_sigma_m"] == summary.joints["A"].sampling_sigma_m
    known = np.isfinite(summary.history.peak_force_n["A"])
    assert known.sum() == sampling.followed_cycles
    assert summary.joints["A"].peak_force_n == summary.history.peak_force_n["A"][known].max()


def test_the_summary_comes_back_from_its_file_and_makes_a_page(sampled):
    text = sampled.summary().to_json()
    again = summary_of(json.loads(text), "summary.json")
    assert again.to_json() == text
    page = page_html(replay_page(again))
    assert "Sampled replay" in page
    assert "gait cycles were followed" in page


def test_the_ledger_keeps_the_variance_which_a_new_part_has_not(sampled, walk, config, ledger, leg):
    """A second recording, replayed whole, adds none; a third does; an undone reset gives it back."""
    first = np.array([joint.sampling_sigma_m for joint in sampled.summary().joints.values()])
    later = {name: column[:2000] for name, column in walk.items()}
    later["time"] = later["time"] + 1000.0
    whole = lw.replay(later, config, ledger=ledger).summary()
    np.testing.assert_allclose([joint.sampling_sigma_m for joint in whole.joints.values()], first)
    third = lw.replay(walk | {"time": walk["time"] + 2000.0}, config, ledger=ledger, sample=SAMPLE)
    sigma_m = {name: joint.sampling_sigma_m for name, joint in third.summary().joints.items()}
    assert (np.array(list(sigma_m.values())) > first).all()
    kept = open_ledger(leg, third.monitor.config)
    assert kept.entry.totals["estimated_cycles"] > sampled.monitor.sampling.estimated_cycles
    monitor = lw.WearMonitor(leg, third.monitor.config, kept)
    assert monitor.wear_of("G").sampling_m2 == pytest.approx(sigma_m["G"] ** 2)
    monitor.reset_wear("G", 10**18, "ann")
    assert monitor.wear_of("G").sampling_m2 == 0.0
    assert monitor.undo_reset("G", 10**18, "ann").sampling_m2 == pytest.approx(sigma_m["G"] ** 2)
    monitor.close()


def test_all_of_it_is_a_whole_replay(walk, config):
    short = {name: column[:1400] for name, column in walk.items()}
    whole, all_, cut = (lw.replay(short, config, sample=sample) for sample in (None, 1.0, 0.1))
    np.testing.assert_array_equal(clearances(whole), clearances(all_))
    assert all_.monitor.sampling is None
    # shorter than the first block
    np.testing.assert_array_equal(clearances(whole), clearances(cut))
    assert cut.monitor.sampling.estimated_cycles == 0.0


def test_what_is_no_fraction_is_refused(walk):
    with pytest.raises(LegWearError, match="sample: 2 is not a fraction above 0, up to 1"):
        lw.replay(walk, sample=2)
    said = CliRunner().invoke(cli, ["replay", "bags/knocking.mcap", "--sample", "0"])
    assert said.exit_code == 2
    assert "0.0 is not in the range 0.0<x<=1.0" in said.output
