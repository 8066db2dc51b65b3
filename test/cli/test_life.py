"""What `life` prints and writes."""

import json

ONE = ("life", "--mechanism", "four_bar", "--legs", "1", "--cycles", "2", "--opens-m", "2e-5")


def test_life_tells_when_each_joint_reaches_its_limit(run, tmp_path):
    result = run(*ONE, "--limit-m", "5.2e-4", "--out", "out")
    assert result.exit_code == 0
    life = json.loads((tmp_path / "out" / "life.json").read_text())
    assert (tmp_path / "out" / "life.png").read_bytes().startswith(b"\x89PNG")
    assert set(life["joints"]) == {"B", "C"}
    for joint, figures in life["joints"].items():
        assert figures["clearance_m"] == sorted(figures["clearance_m"])
        assert f"{joint} reaches 520 µm after" in result.stdout


def test_life_refuses_what_cannot_be(run):
    assert run(*ONE, "--limit-m", "-1").exit_code == 2
    assert run(*ONE, "--clearances", "Z").exit_code == 2
