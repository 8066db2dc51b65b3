"""`check` says what is understood of a table, `replay` takes it, and a bad one is one line."""

from pathlib import Path

import numpy as np
import pytest

PARAMETERS = """/**:
  ros__parameters:
    input:
      columns: {stamp: t, crank_angle: q, drive_torque: tau}
      units: {stamp: ms, crank_angle: deg, drive_torque: N mm}
"""


@pytest.fixture
def table(tmp_path: Path) -> Path:
    times = 5.0 * np.arange(1, 1001)
    rows = [f"{t!r},{(0.36 * t) % 360.0!r},{1000.0 * (k % 9)!r},x" for k, t in enumerate(times.tolist())]
    path = tmp_path / "leg.csv"
    path.write_text("\n".join(["t,q,tau,note", *rows, ""]))
    (tmp_path / "monitor.yaml").write_text(PARAMETERS)
    return path


def test_check_says_what_is_understood_of_a_table(run, table: Path) -> None:
    result = run("check", "monitor.yaml", "leg.csv")
    assert result.exit_code == 0, result.stderr
    lines = [line.strip() for line in result.stdout.splitlines()[1:]]
    assert lines == [
        "leg.csv       table of 1000 rows over 4.995 s, 200 rows a second; time from 't' in ms",
        "crank_angle from 'q' in deg: 1000 values, 0 to 6.252 rad",
        "drive_torque from 'tau' in N mm: 1000 values, 0 to 8 N m",
        "not read: note",
    ]


def test_check_warns_of_what_is_lost_or_doubtful(run, table: Path) -> None:
    table.write_text(table.read_text()[:-5])
    result = run("check", "monitor.yaml", "leg.csv")
    assert result.exit_code == 1
    assert "leg.csv: line 1001 is lost" in result.stderr
    Path("monitor.yaml").write_text(PARAMETERS.replace("ms", "s"))
    result = run("check", "monitor.yaml", "leg.csv")
    assert result.exit_code == 1
    assert "with input.units.stamp 'ms' it would turn at 60 rpm" in result.stderr


def test_check_says_that_no_value_of_a_column_can_be_used(run, table: Path) -> None:
    head, *rows = table.read_text().splitlines()
    nothing = [
        ",".join(
            [
                "nan" if name == "tau" else cell
                for name, cell in zip(head.split(","), row.split(","), strict=True)
            ]
        )
        for row in rows
    ]
    table.write_text("\n".join([head, *nothing, ""]))
    output = run("check", "monitor.yaml", "leg.csv").stdout
    assert "drive_torque from 'tau' in N mm: 1000 values, all of them NaN or infinite" in output


def test_a_missing_column_is_one_line(refused, table: Path) -> None:
    for verb in ("check", "replay", "commission"):
        line = refused(verb, "leg.csv")
        assert line.startswith("error: leg.csv: input.columns.stamp: column 'time' does not exist")
        assert "t, q, tau, note" in line


def test_a_start_that_is_no_date_is_refused(run, tmp_path: Path) -> None:
    for start, code in (("'2026-03-01 09:00'", 0), ("yesterday", 2)):
        (tmp_path / "a.yaml").write_text(f"/**:\n  ros__parameters:\n    input: {{start: {start}}}\n")
        assert run("check", "a.yaml").exit_code == code
