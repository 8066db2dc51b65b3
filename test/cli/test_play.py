"""`play` on bags and tables of synthetic rocks."""

import json
import math
from pathlib import Path

import attrs
import numpy as np
import pytest
from play.rocks import COUNTS_PER_TURN, SIGNALS, Rocks, rocks, servo

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.bags.mcap_writer import McapWriter
from leg_wear_monitor.messages import encode
from leg_wear_monitor.play.fit import effects
from leg_wear_monitor.twin.angle_reference import angle_model

START_NS = 1_772_352_000 * 10**9


@pytest.fixture(scope="module")
def one() -> Rocks:
    return rocks(1, bits=14, counts=20.0, noise=0.5, stuck=0.0, drift=5.0, pushes=24)


@pytest.fixture
def table(one: Rocks, tmp_path: Path) -> str:
    columns = np.column_stack([one.time_s, np.degrees(one.angle_rad), one.load, np.ones(len(one.load))])
    names = "time,knee,push,still"
    np.savetxt(tmp_path / "rocks.csv", columns, "%.12g", ",", header=names, comments="")
    (tmp_path / "units.yaml").write_text("/**: {ros__parameters: {input: {units: {crank_angle: deg}}}}\n")
    return "rocks.csv"


@pytest.fixture
def bag(one: Rocks, tmp_path: Path) -> str:
    stamps = START_NS + np.round(1e9 * one.time_s).astype(np.int64)
    position = np.column_stack([np.zeros(len(stamps)), one.angle_rad])
    effort = np.column_stack([np.zeros(len(stamps)), one.load])
    wrench = np.zeros((len(stamps), 3))
    wrench[:, 1] = one.load
    with McapWriter(tmp_path / "rocks.mcap") as writer:
        joints = writer.channel("/joint_states", encode.JOINT_STATE)
        target = writer.channel("/target", encode.JOINT_STATE)
        pushes = writer.channel("/push", encode.WRENCH_STAMPED)
        names = ["crank", "knee"]
        writer.write_many(
            joints, stamps, encode.joint_states(stamps, names, position=position, effort=effort)
        )
        writer.write_many(target, stamps, encode.joint_states(stamps, ["goal"], position=one.load[:, None]))
        # sent a little later than the angle
        writer.write_many(pushes, stamps + 10**6, encode.wrenches(stamps + 10**6, torque=wrench))
    return "rocks.mcap"


@pytest.mark.parametrize("load", ["effort", "effort:knee", "/push:y", "push:y", "/target:goal", None])
def test_a_bag_gives_the_play(run, bag: str, one: Rocks, load: str | None) -> None:
    result = run("play", bag, "--joint", "knee", *(["--load", load] if load else []), "--json", "play.json")
    assert result.exit_code == 0, result.stderr
    (found,) = json.loads(Path("play.json").read_text())["plays"]
    assert abs(found["play_rad"] - one.play_rad) < one.count_rad
    assert found["count_rad"] == pytest.approx(one.count_rad, rel=1e-6)
    assert found["load"] == (load or "")
    assert f"{math.degrees(found['play_rad']):.3g} deg" in result.stdout
    assert "16384 per turn" in result.stdout


def test_a_table_gives_the_play(run, table: str, one: Rocks) -> None:
    given = ("play", table, "--joint", "knee", "--config", "units.yaml")
    for load in (("--load", "push"), ()):
        result = run(*given, *load, "--json", "-")
        assert result.exit_code == 0, result.stderr
        assert abs(json.loads(result.stdout)["plays"][0]["play_rad"] - one.play_rad) < one.count_rad


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--joint", "hip"), "rocks.csv: --joint: column 'hip' does not exist, expected one of: time, knee"),
        (("--joint", "knee", "--load", "pull"), "rocks.csv: --load: column 'pull' does not exist"),
        (("--joint", "knee", "--load", "still"), "still: does not reverse"),
        (("--joint", "still"), "still: is constant"),
        (("--joint", "knee", "--counts-per-turn", "0"), "--counts-per-turn"),
        (("--joint", "knee", "--load", "push", "--counts-per-turn", "100"), "less than one count"),
        ((), "--joint"),
    ],
)
def test_a_bad_table_is_one_line(refused, table: str, options: tuple[str, ...], said: str) -> None:
    assert said in refused("play", table, *options, "--config", "units.yaml")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            ("--joint", "kne"),
            "'kne' is not a joint of the recording, it has crank, goal, knee; did you mean knee?",
        ),
        (("--joint", "knee", "--load", "pull"), "--load: 'pull' is not in the recording, expected one of"),
        (("--joint", "knee", "--load", "push:x"), "push:x: does not reverse"),
    ],
)
def test_a_bad_bag_is_one_line(refused, bag: str, options: tuple[str, ...], said: str) -> None:
    assert said in refused("play", bag, *options)


@pytest.mark.parametrize("counts", [8.0, 14.8])
@pytest.mark.parametrize("signal", SIGNALS)
def test_a_servo_log_in_counts_gives_the_play(run, tmp_path: Path, signal: str, counts: float) -> None:
    log = servo(1, counts=counts)
    dates = np.datetime64("2026-11-12T10:03:29.555", "ms") + np.round(1e3 * log["time"]).astype(int)
    lines = [",".join(["when", *list(log)[1:]])]
    columns = [column.astype(int).astype(str) for column in list(log.values())[1:]]
    lines += [",".join(row) for row in zip(np.datetime_as_string(dates, "ms") + "Z", *columns, strict=True)]
    lines[1] = lines[1].split(",")[0] + "," * (len(log) - 1)  # nothing was measured yet
    (tmp_path / "servo.csv").write_text("\n".join(lines) + "\n")
    loads = [part for column in SIGNALS[signal] for part in ("--load", column)]
    unit = ("--unit", "counts", "--counts-per-turn", str(COUNTS_PER_TURN))
    times = ("--time", "when", "--time-unit", "date")
    result = run("play", "servo.csv", "--joint", "pos", *loads, *unit, *times, "--json", "play.json")
    assert result.exit_code == 0, result.stdout + result.stderr
    (found,) = json.loads(Path("play.json").read_text())["plays"]
    assert abs(found["play_rad"] * COUNTS_PER_TURN / (2.0 * math.pi) - counts) < 1.0
    assert f"side by {' + '.join(SIGNALS[signal])}" in result.stdout
    assert ("sprang back" in result.stdout) == (signal == "push that keeps its value")
    assert "crank" not in result.stdout + result.stderr
    if signal == "push of -1, 0, 1":
        no_load = run("play", "servo.csv", "--joint", "pos", *unit, *times)
        assert no_load.exit_code == 2
        assert "it rests at more than two places, give a load signal" in no_load.stderr
        no_turn = run("play", "servo.csv", "--joint", "pos", *unit[:2], *times)
        assert "--counts-per-turn: is missing, expected it with --unit counts" in no_turn.stderr
        no_date = run("play", "servo.csv", "--joint", "pos", *unit, *times[:2])
        assert "a date (input.units.stamp: date)?" in no_date.stderr


CLEARANCES = {"A": 0.0004, "G": 0.0007}
DEGREES = (20, 100, 180, 260, 330)


@pytest.fixture
def postures(tmp_path: Path) -> list[str]:
    """Tables of an encoder at the knee of the leg with clearances, in five postures."""
    leg = attrs.evolve(load_mechanism("bionic_leg"), clearance_joints=tuple(CLEARANCES))
    effect = effects(angle_model(leg, ["G"]), np.radians(DEGREES))
    count = 2.0 * math.pi / 2**16
    for number, play in enumerate(effect @ list(CLEARANCES.values())):
        one = rocks(number, bits=16, counts=play / count, noise=0.5, stuck=0.0, drift=3.0, pushes=24)
        columns = np.column_stack([one.time_s, one.angle_rad, one.load])
        np.savetxt(tmp_path / f"{number}.csv", columns, "%.12g", ",", header="time,G,push", comments="")
    return [f"{number}.csv" for number in range(len(DEGREES))]


def test_postures_tell_clearances_apart_and_print_what_measure_takes(run, postures: list[str]) -> None:
    angles = [part for each in DEGREES for part in ("--crank-angle", str(each))]
    given = ("--joint", "G", "--load", "push", "--mechanism", "bionic_leg", "--clearances", "A,G")
    result = run("play", *postures, *given, *angles, "--json", "play.json")
    assert result.exit_code == 0, result.stdout + result.stderr
    found = json.loads(Path("play.json").read_text())["clearances"]
    for one in found["joints"]:
        error = abs(one["clearance_m"] - CLEARANCES[one["joint"]])
        assert error < 3.0 * one["sigma_m"] < 1.0e-4
        measure = f"leg-wear-monitor measure {one['joint']} {1e3 * one['clearance_m']:.4f} --sigma "
        assert measure in result.stdout


def test_one_posture_does_not_tell_joints_apart(run, postures: list[str]) -> None:
    given = ("--joint", "G", "--load", "push", "--mechanism", "bionic_leg", "--clearances", "A,G")
    result = run("play", postures[0], *given, "--crank-angle", "20")
    assert result.exit_code == 1
    assert "not told apart: A (at most" in result.stdout
    assert "leg-wear-monitor measure" not in result.stdout


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--mechanism", "bionic_leg"), "--crank-angle: 0 given for 1 recordings, expected one for each"),
        (("--crank-angle", "20"), "need --mechanism"),
        (
            ("--mechanism", "bionic_leg", "--crank-angle", "20", "--encoder", "K"),
            "'K' is not a revolute joint",
        ),
        (("--mechanism", "bionic_leg", "--crank-angle", "20", "--clearances", "Q"), "Q"),
    ],
)
def test_a_bad_mechanism_is_one_line(
    refused, postures: list[str], options: tuple[str, ...], said: str
) -> None:
    assert said in refused("play", postures[0], "--joint", "G", "--load", "push", *options)
