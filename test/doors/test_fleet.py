"""A fleet of three legs, those of the sample recordings: verdicts, files, kills, and faults."""

import json
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

import leg_wear_monitor as lw

pytest.importorskip("mcap", reason="the extra 'bags' is not installed")

LEGS = {"healthy": "healthy", "knocking": "stop", "bad_input": "not_monitored"}
WORST_FIRST = ["knocking", "bad_input", "healthy"]


def torque_of_a_cycle() -> tuple[np.ndarray, np.ndarray]:
    """Crank angle [rad] in rising order, and drive torque of ideal joints [N m]."""
    ideal = lw.simulate("bionic_leg", clearances=[], cycles=1, trace=360).trace
    order = np.argsort(ideal.crank_angle_rad)
    return ideal.crank_angle_rad[order], ideal.drive_torque_nm[order]


def write_walk(cycle: tuple[np.ndarray, np.ndarray], path: Path, begin_s: float = 0.0, seed: int = 0) -> None:
    """Write four seconds of a steady gait at 60 rpm."""
    times = begin_s + 0.005 * np.arange(800)
    angle = 2.0 * np.pi * times + np.random.default_rng(seed).normal(0.0, 2.0e-4, len(times))
    torque = np.interp(angle % (2.0 * np.pi), *cycle, period=2.0 * np.pi)
    table = np.column_stack([1_700_000_000.0 + times, angle, torque])
    np.savetxt(path, table, "%.6f", ",", header="time,crank_angle,drive_torque", comments="")


@pytest.fixture(scope="module")
def described(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Description of the fleet; a leg's recordings are in a directory of its name."""
    home, bags = tmp_path_factory.mktemp("fleet"), lw.share_directory() / "bags"
    entries = []
    for leg in LEGS:
        (home / leg).mkdir()
        shutil.copy(bags / f"{leg}.mcap", home / leg / "first.mcap")
        entries.append(f"  - {{id: {leg}, recordings: '{leg}/*', config: {bags}/{leg}.yaml}}\n")
    (home / "fleet.yaml").write_text(f"legs:\n{''.join(entries)}")
    return home / "fleet.yaml"


@pytest.fixture(scope="module")
def fleet(run, described) -> tuple[Path, Path]:
    """Description and directory of the fleet, updated once."""
    out = described.parent / "out"
    done = run("fleet", "update", described, "--out", out, "--workers", 1, "--fresh-days", 3650)
    assert done.code == 0, done.lines
    return described, out


def overview(out: Path) -> dict:
    return json.loads((out / "fleet.json").read_text())


def ledgers(out: Path) -> dict[str, list[str]]:
    """Rows of the ledgers by leg."""
    found = {}
    for path in sorted(out.glob("legs/*/ledger")):
        with closing(sqlite3.connect(path)) as db:
            found[path.parent.name] = sorted(db.iterdump())
    return found


@pytest.mark.chaotic
def test_each_leg_has_the_verdict_of_its_recording_and_the_worst_is_first(fleet) -> None:
    found = overview(fleet[1])
    assert [leg["id"] for leg in found["legs"]] == WORST_FIRST
    assert {leg["id"]: leg["state"]["verdict"]["state"] for leg in found["legs"]} == LEGS
    assert {state: number for state, number in found["counts"].items() if number} == dict.fromkeys(
        LEGS.values(), 1
    )
    assert lw.Fleet(fleet[0].parent / "out").overview.to_dict() == found


def test_its_documents_have_no_fields_but_those_that_are_kept(fleet, unknown) -> None:
    assert unknown("fleet", overview(fleet[1])) == set()
    for leg in LEGS:
        assert unknown("replay", json.loads((fleet[1] / f"legs/{leg}/summary.json").read_text())) == set()


def test_a_leg_has_the_state_that_a_replay_of_its_recording_has(fleet, tmp_path) -> None:
    bag = lw.share_directory() / "bags" / "healthy.mcap"
    alone = json.loads(
        lw.replay(bag, bag.with_suffix(".yaml"), ledger=tmp_path / "ledger").summary().to_json()
    )
    (leg,) = (leg for leg in overview(fleet[1])["legs"] if leg["id"] == "healthy")
    for name in ("clearances", "life", "diagnosis", "load", "life_cycles"):
        assert leg["state"][name] == alone[name], name
    assert leg["state"]["verdict"]["state"] == alone["verdict"]["state"]


def test_the_table_and_the_page_have_each_leg(fleet, run) -> None:
    pytest.importorskip("pandas")
    table = lw.Fleet(fleet[1]).to_pandas()
    assert table.leg.tolist() == WORST_FIRST
    worst = table.iloc[0]
    assert (worst.worst_joint, worst.fault_code) == ("G", "CLEARANCE_DETECTED_G")
    assert worst.clearance_m > worst.limit_m
    assert "--ledger out/legs/knocking/ledger" in worst.do  # as seen from the directory of the description
    lines = (fleet[1] / "fleet.csv").read_text().splitlines()
    assert [line.split(",")[0] for line in lines] == ["leg", *WORST_FIRST]
    recordings = lw.Fleet(fleet[1]).recordings()
    assert set(recordings.outcome) == {"counted"} and recordings.set_index("leg").cycles["healthy"] == 10
    page = (fleet[1] / "report.html").read_text()
    at = [page.index(f'href="legs/{leg}/report.html"') for leg in WORST_FIRST]
    assert at == sorted(at)
    assert all((fleet[1] / f"legs/{leg}/report.html").is_file() for leg in LEGS)
    assert worst.how_soon in page  # one deadline, that of the leg's verdict
    assert run("fleet", "report", fleet[1], "--fresh-days", 3650).code == 0
    assert (fleet[1] / "report.html").read_text() == page
    assert run("fleet", "report", fleet[0], "--out", fleet[1], "--fresh-days", 0.001).code == 0
    assert "OUTDATED, WAS HEALTHY" in (fleet[1] / "report.html").read_text()
    assert run("fleet", "report", fleet[1], "--fresh-days", 3650).code == 0


def test_a_second_update_counts_nothing_and_changes_no_file(fleet, run) -> None:
    def contents() -> dict[str, bytes]:
        return {str(path): path.read_bytes() for path in fleet[1].rglob("*") if path.is_file()}

    before = contents()
    done = run("fleet", "update", fleet[0], "--out", fleet[1], "--workers", 1, "--fresh-days", 3650)
    assert (done.code, done.out.splitlines()[0]) == (0, "recordings added now: 0")
    assert contents() == before


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Description of two legs with two short walks each, whose names do not sort by time."""
    home, cycle = tmp_path_factory.mktemp("short"), torque_of_a_cycle()
    for number, leg in enumerate("ab"):
        (home / leg).mkdir()
        write_walk(cycle, home / leg / "z.csv", seed=2 * number)
        write_walk(cycle, home / leg / "y.csv", begin_s=100.0, seed=2 * number + 1)
    (home / "fleet.yaml").write_text("legs: [{id: a, recordings: 'a/*'}, {id: b, recordings: 'b/*'}]\n")
    return home / "fleet.yaml"


@pytest.fixture(scope="module")
def whole(run, short) -> Path:
    """The fleet of short walks after an update that nothing disturbed."""
    out = short.parent / "whole"
    assert run("fleet", "update", short, "--out", out, "--workers", 1).code == 0
    return out


def test_a_killed_update_goes_on_and_ends_with_the_same_ledgers(run, short, whole, tmp_path) -> None:
    """The line about a recording is written just before its wear is in the ledger: kills hit this moment."""
    command = [sys.executable, "-m", "leg_wear_monitor", "fleet", "update", str(short), "--workers", "1"]
    out, choose, lines = tmp_path / "killed", random.Random(7), 0
    for _ in range(4):
        with subprocess.Popen(
            [*command, "--out", str(out)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as process:
            while process.poll() is None and lines_in(out) <= lines:
                time.sleep(0.001)
            time.sleep(choose.uniform(0.0, 0.05))
            process.send_signal(signal.SIGKILL)
        lines = lines_in(out)
    assert run("fleet", "update", short, "--out", out, "--workers", 1).code == 0
    assert ledgers(out) == ledgers(whole)
    assert overview(out) == overview(whole)


def lines_in(out: Path) -> int:
    """Number of lines about recordings of all legs."""
    return sum(path.read_bytes().count(b"\n{") for path in out.glob("legs/*/recordings.jsonl"))


@pytest.mark.parametrize("lost", ["line", "time of change", "wear"])
def test_what_is_lost_beside_the_ledger_changes_no_wear(run, short, whole, tmp_path, lost) -> None:
    home = tmp_path / "home"
    shutil.copytree(short.parent, home)
    out, before = home / "whole", ledgers(whole)
    if lost == "line":
        (out / "legs/a/recordings.jsonl").unlink()
    elif lost == "time of change":
        (home / "a/z.csv").touch()
    else:  # killed between the line about a recording and its wear in the ledger
        shutil.rmtree(out / "legs/b")
        (home / "b/y.csv").rename(home / "later.csv")
        assert run("fleet", "update", home / "fleet.yaml", "--out", out, "--workers", 1).code == 0
        early = (out / "legs/b/ledger").read_bytes()
        (home / "later.csv").rename(home / "b/y.csv")
        assert run("fleet", "update", home / "fleet.yaml", "--out", out, "--workers", 1).code == 0
        (out / "legs/b/ledger").write_bytes(early)
    done = run("fleet", "update", home / "fleet.yaml", "--out", out, "--workers", 1)
    assert (done.code, ledgers(out)) == (0, before), done.lines
    assert [leg["counted"] for leg in overview(out)["legs"]] == [2, 2]
    assert run("fleet", "update", home / "fleet.yaml", "--out", out).out.startswith("recordings added now: 0")


def test_a_new_recording_is_counted_a_copy_is_not_and_a_bad_leg_stops_no_other(
    run, short, whole, tmp_path
) -> None:
    home = tmp_path / "home"
    shutil.copytree(short.parent, home)
    before = overview(home / "whole")
    cycle = torque_of_a_cycle()
    write_walk(cycle, home / "a/new.csv", begin_s=200.0, seed=9)
    shutil.copy(home / "a/y.csv", home / "a/copy.csv")
    (home / "b/trash.mcap").write_bytes(b"no recording")
    (home / "c").mkdir()
    write_walk(cycle, home / "c/x.csv", seed=11)
    (home / "whole/legs/c").mkdir()
    (home / "whole/legs/c/ledger").write_bytes(b"no ledger")
    (home / "fleet.yaml").write_text(
        "legs: [{id: a, recordings: 'a/*'}, {id: b, recordings: 'b/*'}, {id: c, recordings: 'c/*'}]\n"
    )
    done = run("fleet", "update", home / "fleet.yaml", "--out", home / "whole", "--workers", 2)
    assert (done.code, done.out.splitlines()[0]) == (1, "recordings added now: 1")
    copy, trash, ledger = sorted(done.lines)
    assert "a: a/copy.csv: already counted" in copy
    assert "b: b/trash.mcap: unreadable; " in trash
    assert "c: " in ledger and "ledger" in ledger
    legs = {leg["id"]: leg for leg in overview(home / "whole")["legs"]}
    assert legs["a"]["state"]["life_cycles"] > before["legs"][0]["state"]["life_cycles"]
    assert legs["a"]["last_recording"] == "a/new.csv" and legs["c"]["state"] is None


def test_a_repair_and_a_measurement_show_at_the_next_update(run, fleet, tmp_path) -> None:
    out = tmp_path / "out"
    shutil.copytree(fleet[1], out)
    ledger, config = out / "legs/knocking/ledger", lw.share_directory() / "bags/knocking.yaml"
    assert run("reset", "G", "--ledger", ledger, "--config", config).code == 0
    update = ("fleet", "update", fleet[0], "--out", out, "--workers", 1, "--fresh-days", 3650)
    assert run(*update).code == 0
    leg = lw.Fleet(out).overview.leg("knocking")
    knee = leg.state.clearances["G"]
    assert (leg.word, knee.status.value, knee.modelled_m) == ("watch", "watch", knee.new_m)
    assert run("measure", "B", "0.63", "--sigma", "0.006", "--ledger", ledger, "--config", config).code == 1
    assert run(*update).code == 0
    leg = lw.Fleet(out).overview.leg("knocking")
    assert leg.state.verdict.fault_code == "CLEARANCE_B"
    assert (leg.state.clearances["B"].best_estimate_m, leg.state.life.get("B")) == (0.00063, None)
    assert "CLEARANCE_B" in (out / "report.html").read_text()


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("legs: []", "legs: is empty. Expected at least one leg"),
        ("legs: [{id: a, recordings: x, lot: y}]", "legs.a.lot: unknown key"),
        ("legs: [{id: a/b, recordings: x}]", "legs.a/b.id: 'a/b' is not a name for a directory"),
        ("legs: [{id: a, recordings: '*.mcap'}, {id: A, recordings: x}]", "legs: the id A occurs twice"),
        ("legs: [{id: a, recordings: '*.mcap'}, {id: b, recordings: x.mcap}]", "x.mcap is a recording of"),
        ("legs: [{id: a, recordings: x.mcap, config: none.yaml}]", "none.yaml: "),
    ],
)
def test_a_wrong_description_is_one_line(run, tmp_path, text, fault) -> None:
    (tmp_path / "x.mcap").touch()
    (tmp_path / "fleet.yaml").write_text(text)
    done = run("fleet", "update", tmp_path / "fleet.yaml")
    errors = [line for line in done.lines if line.startswith("error: ")]
    assert (done.code, len(errors)) == (2, 1) and fault in errors[0], done.lines
    assert not (tmp_path / "fleet").exists()


def test_a_name_is_no_formula_in_a_spreadsheet() -> None:
    leg = lw.LegOverview(id='=HYPERLINK("x")')
    table = lw.FleetOverview(counts={}, legs=(leg,), advice="").to_csv()
    assert table.splitlines()[1].startswith('"\'=HYPERLINK(""x"")"')
