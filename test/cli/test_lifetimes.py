"""One answer to "how long": the same numbers in the terminal, on the page, in summary and status."""

import json
import re

import numpy as np
import pytest

from leg_wear_monitor.monitor.forecast.forecast import clearance_mm, three_digits

pytest.importorskip("mcap")
pytest.importorskip("rosbags")

from leg_wear_monitor.bags.mcap_writer import McapWriter
from leg_wear_monitor.messages import encode

SECONDS, RATE_HZ = 14, 200
FRACTIONS = ("p10", "p50", "p90")


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """A steady gait, long enough for a growth rate and much shorter than a minute."""
    n = SECONDS * RATE_HZ
    stamps = 1_700_000_000 * 10**9 + np.arange(n, dtype=np.int64) * (10**9 // RATE_HZ)
    angle = 2.0 * np.pi * np.arange(n)[:, None] / RATE_HZ
    path = tmp_path_factory.mktemp("bag") / "walk.mcap"
    with McapWriter(path) as writer:
        joints = writer.channel("/joint_states", encode.JOINT_STATE)
        writer.write_many(joints, stamps, encode.joint_states(stamps, ["crank"], position=angle))
    return path


def test_terminal_page_summary_and_status_agree(run, bag, tmp_path, unpainted):
    result = run("replay", str(bag), "--out", "out")
    assert result.exit_code == 0
    record = json.loads((tmp_path / "out" / "summary.json").read_text())
    page = (tmp_path / "out" / "report.html").read_text()
    status = {one["name"]: one["values"] for one in record["status"]}
    rows = {line.split()[0]: line.split() for line in result.stdout.splitlines() if line.strip()}
    lasting = result.stdout.split("lasts", 1)[1].splitlines()
    for name, joint in record["joints"].items():
        forecast = joint["forecast"]
        assert forecast["answer"].startswith("from the growth so far")
        words = [
            three_digits(forecast[unit][fraction]) for unit in ("hours", "days") for fraction in FRACTIONS
        ]
        assert [line.split()[1:] for line in lasting if line.startswith(f"{name} ")] == [words]
        assert re.search(r"\s*".join(f"<td[^>]*>{re.escape(word)}</td>" for word in words), page)
        assert [status[f"joint {name}"][f"{fraction}_days"] for fraction in FRACTIONS] == list(
            forecast["days"].values()
        )
        assert rows[name][0] == name
    assert [line.split()[0] for line in lasting if line.startswith("leg ")] == ["leg"]
    table = lasting[: next(i for i, line in enumerate(lasting) if line.startswith("hours of walking")) + 1]
    assert all(len(line) <= 80 and "…" not in line for line in table)
    assert three_digits(record["forecast"]["hours"]["p50"]) in page
    assert "not enough data" not in result.stdout + page
    assert "counted clearance" in page and "counted clearance" in result.stdout
    assert " 0.300 " in result.stdout and "0.30000" not in result.stdout


@pytest.mark.plain
def test_three_digits():
    values = (0.0, 0.01234, 9.996, 123.4, 45678.9, 3.2e12)
    assert [*map(three_digits, values)] == ["0", "0.0123", "10.0", "123", "45700", "3.20e+12"]


@pytest.mark.plain
@pytest.mark.parametrize(
    ("sigma_m", "text"), [(5.0e-6, "0.300"), (4.0e-7, "0.3000"), (9.0e-5, "0.30"), (0.0, "0.300000")]
)
def test_a_clearance_has_the_digits_that_are_known(sigma_m, text):
    assert clearance_mm(3.0000012e-4, 3.0e-4 - 1.2816 * sigma_m, 3.0e-4 + 1.2816 * sigma_m) == text
