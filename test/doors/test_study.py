"""The figures of a short study within their scatter, and its points and page again from what is there.

``python test/doors/test_study.py`` renews the figures that are kept: means and standard deviations of studies
that differ in the seed of their ensemble.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import leg_wear_monitor as lw

KEPT = Path(__file__).parent / "kept" / "location.json"
STUDY = """title: location
question: where?
sweeps: [{{clearances: [[A, B], [G], [I, J]]}}]
clearance_m: 0.0003
ensemble: {{runs: 4, cycles: 5, skip_cycles: 1, traced_cycles: 1, perturb_fraction: 0.3, seed: {seed}}}
"""
SEEDS = 20  # of the figures that are kept
# Largest distance from the mean of any of the 13 figures, in standard deviations over the seeds; by Student
# with 19 degrees of freedom, a larger one of a draw beside these 20 has a chance below 1e-6.
FAR = 9.0


def line(directory: Path, seed: int) -> list[str]:
    """Arguments of the study, whose settings are written into a directory."""
    (directory / "location.yaml").write_text(STUDY.format(seed=seed))
    return ["study", str(directory / "location.yaml"), "--workers", "1"]


def figures(out: Path) -> dict[str, float]:
    """Means over the runs of each point in a study's directory, by point, statistic and joint."""
    found = {}
    for path in (out / "points").iterdir():
        with np.load(path, allow_pickle=False) as arrays:
            joints, point = list(arrays["joints"]), ", ".join(arrays["clearance_joints"])
            found[f"{point}: rms_torque_nm"] = float(arrays["rms_torque_nm"].mean())
            for k, joint in enumerate(arrays["clearance_joints"]):
                force = arrays["mean_force_n"][:, joints.index(joint)].mean()
                found[f"{point}: mean_force_n {joint}"] = float(force)
                work = arrays["archard_integral_j_per_cycle"][:, k].mean()
                found[f"{point}: archard_integral_j_per_cycle {joint}"] = float(work)
    return found


@pytest.fixture(scope="module")
def study(run: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp("study")
    assert run(*line(home, 1), "--out", home / "out").code == 0
    return home


@pytest.mark.chaotic
def test_its_figures_are_those_that_are_kept(study: Path) -> None:
    kept, found = json.loads(KEPT.read_text()), figures(study / "out")
    assert found.keys() == kept.keys()
    far = {name: (found[name] - mean) / sigma for name, (mean, sigma) in kept.items()}
    assert {name: value for name, value in far.items() if abs(value) > FAR} == {}


def test_a_point_that_is_damaged_is_refused_and_computed_again_to_the_bit(study: Path, run: Any) -> None:
    """The study computes this point alone, and writes the same page."""
    before = {path.name: path.read_bytes() for path in (study / "out").rglob("*") if path.is_file()}
    point = next((study / "out" / "points").iterdir())
    point.write_bytes(before[point.name][:-200] + bytes(200))
    refused = run("report", study / "out")
    assert refused.code == 2 and point.name in refused.lines[0]
    point.unlink()
    done = run(*line(study, 1), "--out", study / "out")
    assert done.code == 0 and done.out.startswith("points: 3, 1 computed now\n")
    assert {path.name: path.read_bytes() for path in (study / "out").rglob("*") if path.is_file()} == before


def test_the_tables_of_a_study_have_the_documented_columns(study: Path) -> None:
    pytest.importorskip("pandas")
    tables = lw.load_study(study / "out")
    page = (lw.share_directory() / "docs" / "appendix" / "study.md").read_text(encoding="utf-8")
    for name, table in tables.items():
        assert f"`{name}`" in page
        assert all(f"`{column.split('.')[0]}" in page for column in table.columns), name
    assert list(tables["points"]["clearances"]) == ["A, B", "G", "I, J"]
    assert list(tables["joints"]["joint"]) == ["A", "B", "G", "I", "J"]
    assert (tables["points"]["toe_position_m.mean"] > 0.0).all() and tables["exponents"].empty
    means = figures(study / "out")  # over runs and cycles
    for row in tables["points"].to_dict("records"):
        assert row["rms_torque_nm.mean"] == pytest.approx(means[f"{row['clearances']}: rms_torque_nm"])
    for row in tables["joints"].to_dict("records"):
        point = next(each for each in ("A, B", "G", "I, J") if row["joint"] in each)
        for name in ("mean_force_n", "archard_integral_j_per_cycle"):
            assert row[f"{name}.mean"] == pytest.approx(means[f"{point}: {name} {row['joint']}"])
    with pytest.raises(lw.ConfigError):
        lw.load_study(study)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("sweeps: []\nspeed: 60", "study.yaml: speed: unknown key"),
        ("sweeps: [{speed_rpm: [60], clearance_m: [0.0003]}]", "varies clearance_m and speed_rpm"),
        ("sweeps: [{keep: [forces]}]", "'forces' is not one of response, exponent"),
        ("sweeps: [{clearances: [[Z]]}]", "'Z' has no clearance settings"),
        ("sweeps: [{speed_rpm: [60]}]", "has no clearance joint"),
    ],
)
def test_a_wrong_study_file_is_refused_in_one_line(run: Any, tmp_path: Path, line: str, said: str) -> None:
    (tmp_path / "study.yaml").write_text(f"title: a\nquestion: b\n{line}\n")
    done = run("study", tmp_path / "study.yaml", "--out", tmp_path / "out")
    assert done.code == 2 and len(done.lines) == 1 and said in done.lines[0]


def renewed() -> dict[str, list[float]]:
    """Means and standard deviations over seeds."""
    all_found = []
    for seed in range(SEEDS):
        with tempfile.TemporaryDirectory() as directory:
            command = [sys.executable, "-m", "leg_wear_monitor", *line(Path(directory), seed)]
            subprocess.run([*command, "--out", f"{directory}/out"], check=True, capture_output=True)
            all_found.append(figures(Path(directory) / "out"))
    return {
        name: [float(np.mean(each)), float(np.std(each, ddof=1))]
        for name in sorted(all_found[0])
        if (each := [found[name] for found in all_found])
    }


if __name__ == "__main__":
    KEPT.write_text(json.dumps(renewed(), indent=1) + "\n")
