"""`reference` writes a file that a parameter file can name."""

import math
import warnings
from pathlib import Path

import numpy as np
import pytest

from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.person import nominal_stance, read_toe_force
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.monitor.diagnosis import reference_file
from leg_wear_monitor.twin import references
from leg_wear_monitor.twin.load import load_signatures


def test_references_of_two_cadences_are_written_and_named(run, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(reference_file, "BEFOREHAND_CYCLES", 1)
    monkeypatch.setattr(references, "CLEARANCE_FACTORS", (2.0,))
    monkeypatch.setattr(references, "_SETTLING", 0)
    result = run("reference", "bionic_leg", "--cadence", "57", "--cadence", "-60", "--out", "leg.npz")
    assert result.code == 0, result.err
    assert "bionic_leg at 57 rpm: 24 legs, 1 gait cycles each" in result.out
    assert "bionic_leg at -60 rpm: 33 legs, 1 gait cycles each" in result.out
    assert "written: leg.npz, after " in result.out
    assert result.err == ""  # no progress bar in a pipe
    (tmp_path / "monitor.yaml").write_text("/**: {ros__parameters: {diagnosis: {reference: leg.npz}}}")
    assert ", references at 57, -60 rpm" in run("check", "monitor.yaml").out
    (tmp_path / "jansen.yaml").write_text(
        "/**: {ros__parameters: {mechanism: jansen_leg, diagnosis: {reference: leg.npz}}}"
    )
    result = run("check", "jansen.yaml")
    assert result.code == 2
    assert "leg.npz: has torque references of a different leg (bionic_leg)" in result.err


TABLE = "crank_angle,foot_load,foot_load_along\n"


def test_a_reference_under_a_load_is_of_a_leg_that_carries_it(run, tmp_path: Path, monkeypatch) -> None:
    """The table is another discretisation of a force; the torque is that of the force, by virtual work."""
    monkeypatch.setattr(reference_file, "BEFOREHAND_CYCLES", 2)
    monkeypatch.setattr(references, "CLEARANCE_FACTORS", (2.0,))
    leg = load_mechanism("bionic_leg")
    linkage = build_linkage(leg)
    force = 300.0 * nominal_stance(linkage).force(points=360)
    rows = [f"{math.radians(i)},{up},{along}\n" for i, (along, up) in enumerate(force)]
    (tmp_path / "stance.csv").write_text(TABLE + "".join(rows))
    made = {}
    for name, load in (("air", ()), ("ground", ("--load", "stance.csv"))):
        assert run("reference", "bionic_leg", *load, "--out", f"{name}.npz").code == 0
        made[name], *_ = reference_file.read_references(tmp_path / f"{name}.npz", leg)
    assert not made["air"].parameters.load.size
    known = made["ground"].parameters.load
    assert known == pytest.approx(300.0 * nominal_stance(linkage).force(), abs=1.5)
    (expected,) = load_signatures(linkage, [known])
    air, ground = (made[name].torque_nm[0].astype(float).mean(axis=0) for name in ("air", "ground"))
    added, of_force = (np.fft.rfft(torque)[:4] / len(torque) for torque in (ground - air, expected))
    # joints rub more under a force, and two steps vary by a tenth each, drawn with one seed: 0.134 of the
    # largest harmonic here; without the force it would be 1, and 2 with its sign reversed
    assert np.abs(added - of_force).max() < 0.4 * np.abs(of_force).max()


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("crank_angle,load\n0.1,2\n", "foot_load: unknown column. The file has crank_angle, load"),
        (TABLE + "0.1,2,3\n0.2,two,3\n", "stance.csv: foot_load: row 2: 'two' is not a finite number"),
        (TABLE + "0.1,2\n", "stance.csv: foot_load_along: row 1: None is not a finite number"),
        (TABLE + "0.1,2,3\n" * 20, "Expected 12 or more of one gait cycle"),
        (TABLE + "".join(f"{0.5 * i},2,3\n" for i in range(20)), "of one gait cycle"),
        (
            TABLE + "".join(f"{0.017 * i},300,0\n" for i in range(36)),
            "stance.csv: crank_angle: no rows over 5.69 rad of the turn. Expected at most 0.57 rad",
        ),
        (
            TABLE + "".join(f"{0.5 * i},{-300 * (i % 2)},0\n" for i in range(13)),
            "stance.csv: foot_load: 0 N at most and -300 N at least. Expected a ground that pushes up",
        ),
        ("", "Expected 12 or more"),
    ],
)  # fmt: skip
def test_a_load_that_is_no_gait_cycle_is_refused(run, tmp_path: Path, text: str, fault: str) -> None:
    (tmp_path / "stance.csv").write_text(text)
    result = run("reference", "--load", "stance.csv", "--out", "leg.npz")
    assert result.code == 2
    assert fault in result.err
    assert len(result.err.splitlines()) == 1


@pytest.mark.parametrize(("peak", "shown"), [("0.3", "0.3 N"), ("3e6", "3e+06 N"), ("300", "")])
def test_a_load_in_another_unit_is_warned_of(tmp_path: Path, peak: str, shown: str) -> None:
    (tmp_path / "stance.csv").write_text(TABLE + "".join(f"{0.5 * i},{peak},0\n" for i in range(13)))
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        read_toe_force(tmp_path / "stance.csv")
    usual = f"foot_load: {shown} at most, usually 10 to 5000 N. Is it in a different unit?"
    assert [str(each.message).split(": ", 1)[1] for each in found] == ([usual] if shown else [])


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (["--cadence", "nan", "--out", "leg.npz"], "--cadence"),
        (["--cadence", "0.0", "--out", "leg.npz"], "does not turn the crank"),
        (["no_leg", "--out", "leg.npz"], "no mechanism of this name"),
        (["--out", "nowhere/leg.npz"], "--out: nowhere/leg.npz: cannot be written: No such file"),
        ([], "--out"),
        (["--load", "none.csv", "--out", "leg.npz"], "none.csv: cannot be read: "),
        (["slider_crank", "--load", "none.csv", "--out", "leg.npz"], "no point called toe"),
    ],
)
def test_bad_command_lines_are_one_line(run, arguments: list[str], fault: str) -> None:
    result = run("reference", *arguments)
    assert result.code == 2
    assert fault in result.err
    assert len(result.err.splitlines()) == 1
