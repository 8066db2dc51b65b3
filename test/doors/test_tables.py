"""Tables from spreadsheets and loggers, by the command line: read, proposed, or refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

import leg_wear_monitor as lw

Write = Callable[..., Path]

ROWS = 400
STAMP_S = np.round(1.0 + 0.005 * np.arange(ROWS), 3)
ANGLE = np.round(2.0 * np.pi * STAMP_S % (2.0 * np.pi), 6)
TORQUE = np.round(5.0 * np.sin(ANGLE), 3)
DATES = np.datetime64("2026-03-01T09:00:00.000") + np.round(1000 * STAMP_S).astype("timedelta64[ms]")
DEFAULT = "time,crank_angle,drive_torque"


def text_of(*columns: np.ndarray, separator: str = ",", decimal: str = ".", end: str = "") -> str:
    """Rows of a table."""
    cells = [[str(value).replace(".", decimal) for value in column] for column in columns]
    return "".join(f"{separator.join(row)}{end}\n" for row in zip(*cells, strict=True))


POINT = text_of(STAMP_S, ANGLE, TORQUE)
COMMA = text_of(STAMP_S, ANGLE, TORQUE, separator=";", decimal=",")
GERMAN = [f"{str(each)[8:10]}.{str(each)[5:7]}.{str(each)[:4]} {str(each)[11:]}" for each in DATES]

CASES = {
    "plain": f"{DEFAULT}\n{POINT}",
    "byte order mark": f"\ufeff{DEFAULT}\n{POINT}",
    "a comment before the names": f"# logger 3.2\n{DEFAULT}\n{POINT}",
    "blank lines before the names": f"\n\n{DEFAULT}\n{POINT}",
    "settings before the names": f"logger;3.2\nrate;200\n\ntime;crank_angle;drive_torque\n{COMMA}",
    "names behind a number sign": f"# {DEFAULT}\n{POINT}",
    "a row of units": f"{DEFAULT}\ns,rad,Nm\n{POINT}",
    "a separator at the end of each row": f"{DEFAULT}\n{text_of(STAMP_S, ANGLE, TORQUE, end=',')}",
    "a separator at the end of the names": f"{DEFAULT},\n{POINT}",
    "decimal comma, semicolons": f"time;crank_angle;drive_torque\n{COMMA}",
    "decimal comma, tabs": "time\tcrank_angle\tdrive_torque\n" + COMMA.replace(";", "\t"),
    "decimal comma in quotes": "time,crank_angle,drive_torque\n"
    + "".join(f'"{line}"\n'.replace(";", '","') for line in COMMA.splitlines()),
    "bars": DEFAULT.replace(",", "|") + "\n" + POINT.replace(",", "|"),
    "Windows": f"{DEFAULT}\n{POINT}".replace("\n", "\r\n"),
}


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Write a table into the current directory."""
    monkeypatch.chdir(tmp_path)

    def to(name: str, content: str | bytes) -> Path:
        Path(name).write_bytes(content.encode() if isinstance(content, str) else content)
        return Path(name)

    return to


def samples_of(path: Path, config: Path | None = None) -> tuple[int, int, float]:
    """Samples of a replay and its duration."""
    summary = lw.replay(path, config).summary()
    recording = summary.recording
    return recording.crank_samples, recording.torque_samples, recording.duration_s


@pytest.mark.parametrize("content", CASES.values(), ids=CASES)
def test_the_head_of_a_table_is_understood(run, write: Write, content: str) -> None:
    done = run("check", write("leg.csv", content))
    assert (done.code, done.lines) == (0, [])
    assert f"table of {ROWS} rows over {STAMP_S[-1] - STAMP_S[0]:.6g} s" in done.out
    assert f"from 'crank_angle' in rad: 400 values, {ANGLE.min():.4g} to {ANGLE.max():.4g} rad" in done.out
    assert f"from 'drive_torque' in N m: 400 values, {TORQUE.min():.4g} to {TORQUE.max():.4g} N m" in done.out


def test_a_table_of_each_form_gives_the_same_samples(write: Write) -> None:
    expected = samples_of(write("plain.csv", CASES["plain"]))
    assert expected == (ROWS, ROWS, pytest.approx(STAMP_S[-1] - STAMP_S[0]))
    for name in ("decimal comma, semicolons", "a row of units", "settings before the names"):
        assert samples_of(write("leg.csv", CASES[name])) == expected


PROPOSED = {
    "units in brackets": (
        "Zeit;Kurbelwinkel [deg];Drehmoment [Nm]\n"
        + text_of(STAMP_S, np.degrees(ANGLE).round(4), TORQUE, separator=";", decimal=","),
        {"stamp": "Zeit", "crank_angle": "Kurbelwinkel [deg]", "drive_torque": "Drehmoment [Nm]"},
        {"stamp": "s", "crank_angle": "deg", "drive_torque": "N m"},
    ),
    "units in the names": (
        "t_ms,angle_deg,torque_Nmm,temperature\n"
        + text_of(1000 * STAMP_S, np.degrees(ANGLE).round(4), 1000 * TORQUE, 0 * ANGLE),
        {"stamp": "t_ms", "crank_angle": "angle_deg", "drive_torque": "torque_Nmm"},
        {"stamp": "ms", "crank_angle": "deg", "drive_torque": "N mm"},
    ),
    "units in a row": (
        "Time,Crank Position,Hip Position,Motor Torque\n[s],[rev],[rev],[N·m]\n"
        + text_of(STAMP_S, (ANGLE / 2.0 / np.pi).round(6), 0 * ANGLE, TORQUE),
        {"stamp": "Time", "crank_angle": "Crank Position", "drive_torque": "Motor Torque"},
        {"stamp": "s", "crank_angle": "rev", "drive_torque": "N m"},
    ),
    "time since 1970": (
        "timestamp,position_rad,effort_Nm\n"
        + text_of((1.7e12 + 1000 * STAMP_S).astype(np.int64), ANGLE, TORQUE),
        {"stamp": "timestamp", "crank_angle": "position_rad", "drive_torque": "effort_Nm"},
        {"stamp": "ms", "crank_angle": "rad", "drive_torque": "N m"},
    ),
    "dates": (
        f"date,angle (rad),torque (Nm)\n{text_of(DATES, ANGLE, TORQUE)}",
        {"stamp": "date", "crank_angle": "angle (rad)", "drive_torque": "torque (Nm)"},
        {"stamp": "date", "crank_angle": "rad", "drive_torque": "N m"},
    ),
    "dates in a format": (
        "Datum;Winkel [rad];Drehmoment [Nm]\n"
        + "".join(f"{date};{line}" for date, line in zip(GERMAN, text_of(
            ANGLE, TORQUE, separator=";", decimal=",").splitlines(True), strict=True)),
        {"stamp": "Datum", "crank_angle": "Winkel [rad]", "drive_torque": "Drehmoment [Nm]"},
        {"stamp": "date", "crank_angle": "rad", "drive_torque": "N m"},
    ),
}  # fmt: skip


@pytest.mark.parametrize(("content", "columns", "units"), PROPOSED.values(), ids=PROPOSED)
def test_check_of_a_table_alone_proposes_parameters_with_which_it_is_read(
    run, write: Write, content: str, columns: dict[str, str], units: dict[str, str]
) -> None:
    table = write("leg.csv", content)
    done = run("check", table)
    assert (done.code, done.lines) == (0, [])
    proposal = done.out[done.out.index("/**:") :]
    found = YAML(typ="safe").load(proposal)["/**"]["ros__parameters"]["table"]
    assert found["columns"] == columns
    assert found["units"] == units
    config = write("start.yaml", proposal)
    again = run("check", config, table)
    assert (again.code, again.lines) == (0, [])
    assert samples_of(table, config) == (ROWS, ROWS, pytest.approx(STAMP_S[-1] - STAMP_S[0], abs=1e-6))


def test_an_export_in_the_encoding_of_windows_is_read(run, write: Write) -> None:
    text = "Zeit [s];Winkel [°];Drehmoment [Nm]\n" + text_of(
        STAMP_S, np.degrees(ANGLE), TORQUE, separator=";"
    )
    done = run("check", write("leg.csv", text.encode("cp1252")))
    assert (done.code, done.lines) == (0, [])
    assert 'crank_angle: "Winkel [°]"' in done.out


@pytest.mark.parametrize("start", ["\n", "", "# logger 3.2\n"])
def test_rows_of_numbers_are_rows_without_names(run, write: Write, start: str) -> None:
    table = write("leg.csv", start + text_of(np.arange(ROWS), STAMP_S, ANGLE, TORQUE, end=","))
    done = run("check", table)
    assert done.code == 2
    (line,) = done.lines
    assert "Expected one of: 1 (0), 2 (1.0), 3 (0.0), 4 (" in line
    columns = 'stamp: "2", crank_angle: "3", drive_torque: "4"'
    config = write("start.yaml", f"/**: {{ros__parameters: {{table: {{columns: {{{columns}}}}}}}}}\n")
    assert samples_of(table, config)[:2] == (ROWS, ROWS)


def test_the_message_shows_the_line_that_was_taken_for_the_names(run, write: Write) -> None:
    table = write("leg.csv", "logger 3.2\nZeit,Winkel,Drehmoment\n" + POINT)
    done = run("replay", table)
    assert done.code == 2
    (line,) = done.lines
    assert "line 2 ('Zeit,Winkel,Drehmoment')" in line
    assert "check leg.csv" in line


@pytest.mark.parametrize("unit", ["Nm", "N m"])
def test_a_torque_in_nm_may_be_written_without_a_space(run, write: Write, unit: str) -> None:
    text = f"/**: {{ros__parameters: {{table: {{units: {{drive_torque: {unit}}}}}}}}}\n"
    assert run("check", write("start.yaml", text), write("leg.csv", CASES["plain"])).code == 0


REFUSED = {
    "leg.xlsx": (b"PK\x03\x04", "Save it as CSV"),
    "leg.txt": (CASES["plain"].encode(), "Rename it to leg.csv"),
    "leg.bag": (b"#ROSBAG V2.0\n", "rosbags-convert --src leg.bag --dst leg"),
    "leg.csv": (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n", "git lfs pull"),
    "leg.mcap": (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n", "git lfs pull"),
}


@pytest.mark.parametrize("name", REFUSED)
@pytest.mark.parametrize("verb", ["replay", "commission", "check"])
def test_a_file_that_is_not_read_gets_one_line_with_the_remedy(
    run, write: Write, verb: str, name: str
) -> None:
    content, remedy = REFUSED[name]
    done = run(verb, write(name, content))
    assert done.code == 2
    (line,) = done.lines
    is_refused_by_name = verb == "check" and name == "leg.mcap"
    assert ("Run: leg-wear-monitor replay leg.mcap" if is_refused_by_name else remedy) in line
