"""What is wrong with a table is one line each; what can be read is read."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from recordings import losses

from leg_wear_monitor.bags.findings import RecordingError, Severity
from leg_wear_monitor.monitor.config.parameters import config_from

Read = Callable[..., Any]
Found = tuple[int, list[str], list[str]]
HEAD = "time,crank_angle,drive_torque"
GOOD = [f"{0.005 * k + 1.0!r},{(0.03 * k) % 6.283!r},{float(k % 7)!r}" for k in range(1000)]


@pytest.fixture
def table(tmp_path, read):
    """Read a file: number of samples, losses, notes."""

    def make(content, name="a.csv", **parameters):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        given = {f"input.{key.replace('__', '.')}": value for key, value in parameters.items()}
        samples, recording = read(path, config=config_from(given))
        found = {severity: [] for severity in Severity}
        for finding in recording.findings:
            found[finding.severity].append(finding.text)
        assert recording.is_partial == bool(found[Severity.LOSS])
        return len(samples), found[Severity.LOSS], found[Severity.NOTE]

    return make


def lines(*texts, head=HEAD):
    return "\n".join([head, *texts]) + "\n"


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        ("", "is empty, expected a line with the names of the columns"),
        (HEAD, "has no complete line, expected the names of the columns"),
        (HEAD + "\n", "has no row that can be read"),
        (lines("1;2;3"), r"line 2 is lost: 1 cells, expected 3"),
        (lines("1,5,2,5,3,5"), r"line 2 is lost: 6 cells, expected 3; decimal commas\?"),
        (
            lines("1;2,5;3", head=HEAD.replace(",", ";")),
            r"'2,5' is not a number, .* in rad; a decimal comma\?",
        ),
        (lines("x,2,3"), "column 'time': 'x' is not a number, expected one in s"),
        (lines("1700000000000,2,3"), r"1700000000000 s is no time from 1902 to 2038; another unit"),
        (lines("1e999999,2,3"), "1e999999 is no time, expected one in s"),
        (lines("1,2,3").encode("utf-16"), "is not a text in UTF-8"),
        (
            lines("1,2,3", head="t,q,tau"),
            "input.columns.stamp: column 'time' does not exist, expected one of: t, q, tau",
        ),
        (lines("1,2,3,4", head=HEAD + ",time"), "column 'time' is there more than once"),
    ],
)
def test_nothing_that_can_be_read_is_one_line(table, content, fault):
    with pytest.raises(RecordingError, match=fault) as error:
        table(content)
    assert "\n" not in str(error.value) and "a.csv" in str(error.value)


def test_lines_that_cannot_be_read_are_lost_and_the_others_are_not(table):
    bad = ["x,1,2", ",1,2", "5,1", "nan,1,2", "6,1,y", "7,8,9,10"]
    found, losses, _ = table(lines(*GOOD[:500], *bad, "", *GOOD[500:]))
    assert found == 2 * len(GOOD)
    assert losses == [
        "line 504 is lost: 2 cells, expected 3",
        "line 507 is lost: 4 cells, expected 3; decimal commas?",
        "line 502 is lost: column 'time': 'x' is not a number, expected one in s",
        "line 503 is lost: column 'time': empty, expected a time in s",
        "line 505 is lost: column 'time': empty, expected a time in s",
        "1 more lines are lost",
    ]


def test_a_quote_without_an_end_is_reported_with_the_lines_that_it_takes(table):
    found, losses, _ = table(lines(*GOOD[:500], '"5', *GOOD[500:]))
    assert found == 2 * 500
    assert losses == [
        "line 502 is lost: 1 cells, expected 3; a quote has no end on its line, and takes 500 lines with it"
    ]


def test_a_file_that_was_cut_short_loses_its_last_line(table):
    for cut in (3, 1):  # in a number, and before the line break: the number may go on
        found, losses, _ = table(lines(*GOOD)[:-cut])
        assert found == 2 * len(GOOD) - 2
        assert losses == ["line 1001 is lost: it has no line break at its end, so it may be cut short"]


def test_zeros_of_a_computer_that_lost_power_are_no_rows(table):
    found, losses, _ = table(lines(*GOOD).encode() + bytes(5000))
    assert found == 2 * len(GOOD) and len(losses) == 1


def test_a_line_without_an_end_does_not_fill_the_memory(table):
    found, losses, _ = table(lines(*GOOD).encode() + b"1" * 5_000_000)
    assert found == 2 * len(GOOD)
    assert losses == ["line 1002 is lost: it has no line break at its end, so it may be cut short"]


def test_times_that_go_back_repeat_or_jump_are_notes(table):
    found, losses, notes = table(lines(*GOOD[:300], *GOOD[100:300], GOOD[299], *GOOD[600:]))
    assert found == 2 * (300 + 200 + 1 + 400) and not losses
    assert notes == [
        "the time goes back by 0.995 s at line 302",
        "the time repeats at line 502",
        "the time jumps by 1.505 s at line 503; the leg was not monitored in between",
    ]


def test_a_time_of_zero_is_a_note(table):
    _, losses, notes = table(lines("0,1,2", *GOOD))
    assert not losses
    assert (
        notes[-1] == "a time of 0 is that of a clock that is not set, and counts as faulty; set input.start"
    )


@pytest.mark.parametrize("zero", ["0e99999", "0e99999999999999999999", "-0E+9", "1e-99999999999999999999"])
def test_a_zero_with_any_exponent_is_a_time_of_zero(table, zero):
    found, losses, notes = table(lines("1700000000.000000001,1,2", f"{zero},1,2", *GOOD))
    assert found == 2 * (2 + len(GOOD)) and not losses
    assert "the time goes back by 1.7e+09 s at line 3" in notes[0]


def test_a_torque_without_an_angle_is_no_effort(tmp_path, read):
    (tmp_path / "a.csv").write_text(lines("1,,2", *GOOD))
    _, recording = read(tmp_path / "a.csv", config=config_from({"drive_torque.source": "effort"}))
    assert recording.is_partial
    assert "1 torques have no angle in their row" in str(recording.findings)


def turning(rpm, turn=2.0 * np.pi, wrapped=True):
    """Ten seconds at 200 Hz of an angle with this turn."""
    times = 1.0 + 0.005 * np.arange(2000)
    angle = turn * rpm / 60.0 * times
    return {"time": times, "crank_angle": angle % turn if wrapped else angle, "drive_torque": times}


def standing_first():
    """An angle in degrees that rests, and turns at 60 rpm for the last 57th of its ten seconds."""
    columns = turning(60.0, 360.0, wrapped=False)
    return columns | {"crank_angle": np.maximum(columns["crank_angle"], columns["crank_angle"][-35])}


@pytest.mark.parametrize(
    ("columns", "parameters", "doubt"),
    [
        (turning(60.0), {}, ""),
        (standing_first(), {"units.crank_angle": "deg"}, ""),
        (turning(-60.0, wrapped=False), {}, ""),
        (turning(40.0, 360.0), {"units.crank_angle": "deg"}, ""),
        (turning(55.0, 360.0), {}, "in 'rad' a turn is 6.283: is it in 'deg' (input.units.crank_angle)?"),
        (turning(55.0, 1.0), {}, "is it in 'rev' (input.units.crank_angle)?"),
        (turning(60.0), {"units.crank_angle": "deg"}, "is it in 'rad' (input.units.crank_angle)?"),
        (
            turning(60.0, 360.0, wrapped=False),
            {},
            "with input.units.crank_angle 'deg' it would turn at 60 rpm",
        ),
        (
            turning(60.0, wrapped=False),
            {"units.crank_angle": "deg"},
            "at 1.05 rpm, commanded are 60 rpm; with input.units.crank_angle 'rad' it would turn at 60 rpm",
        ),
        (turning(60.0), {"units.stamp": "ms"}, "with input.units.stamp 's' it would turn at 60 rpm"),
        (turning(60.0) | {"v": np.full(2000, 6.3)}, {"columns.crank_speed": "v"}, ""),
        (turning(60.0) | {"v": np.full(2000, 60.0)}, {"columns.crank_speed": "v"}, "is it in 'rpm'"),
        (turning(60.0) | {"v": np.full(2000, 6300.0)}, {"columns.crank_speed": "v"}, "or its unit is wrong"),
        (turning(60.0) | {"v": np.full(2000, -6.3)}, {"columns.crank_speed": "v"}, "or its unit is wrong"),
    ],
)
def test_a_column_that_is_likely_in_another_unit_is_doubted(read, columns, parameters, doubt):
    config = config_from({f"input.{key}": value for key, value in parameters.items()})
    _, recording = read(columns, config=config)
    found = losses(recording)
    assert len(found) == bool(doubt)
    assert not doubt or doubt in found[0]


@pytest.mark.parametrize(
    ("columns", "fault"),
    [
        ({"time": [1.0], "crank_angle": [1.0]}, "column 'drive_torque' does not exist"),
        ({"time": [1.0], "crank_angle": [1.0, 2.0], "drive_torque": [1.0]}, "columns of different lengths"),
        ({"time": [1.0], "crank_angle": ["x"], "drive_torque": [1.0]}, "'crank_angle': 'x' is not a number"),
        ({"time": [1.0], "crank_angle": [[1.0]], "drive_torque": [1.0]}, "has the shape"),
        ({"time": [], "crank_angle": [], "drive_torque": []}, "has no row that can be read"),
        (
            {"time": [np.nan], "crank_angle": [1.0], "drive_torque": [1.0]},
            "row 1 is lost: column 'time': empty",
        ),
        ({"time": [1e18], "crank_angle": [1.0], "drive_torque": [1.0]}, "1e[+]18 s is no time from 1902"),
        (
            {"time": np.array(["2026-03-01"], "M8[ns]"), "crank_angle": [1.0], "drive_torque": [1.0]},
            "input.units.stamp: 's' does not fit column 'time', which has dates",
        ),
    ],
)
def test_arrays_that_are_no_table_are_one_line(read, columns, fault):
    with pytest.raises(RecordingError, match=f"^table 1: .*{fault}"):
        read(columns, config=config_from({}))


def test_a_damaged_parquet_file_is_one_line(table):
    pytest.importorskip("pyarrow")
    with pytest.raises(RecordingError, match="is not a readable Parquet file"):
        table(b"PAR1 and no more", "a.parquet")


def test_a_group_of_rows_that_is_damaged_is_lost_and_the_others_are_not(tmp_path, read):
    pandas, parquet = pytest.importorskip("pandas"), pytest.importorskip("pyarrow.parquet")
    path, frame = tmp_path / "a.parquet", pandas.DataFrame(turning(60.0))
    frame.to_parquet(path, row_group_size=500, compression="zstd")
    group = parquet.ParquetFile(path).metadata.row_group(2).column(1)
    content = bytearray(path.read_bytes())
    begin = group.data_page_offset + group.total_compressed_size // 2
    content[begin : begin + 200] = bytes(200)
    path.write_bytes(content)
    samples, recording = read(path, config=config_from({}))
    assert len(samples) == 3000 and recording.is_partial
    assert any(finding.text.startswith("rows 1001 to 1500 cannot be read") for finding in recording.findings)


def test_rows_without_a_time_are_counted_and_not_listed(tmp_path, read):
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    n = 1000
    times = pyarrow.concat_arrays([pyarrow.array([1.0]), pyarrow.nulls(n, pyarrow.float64())])
    table = pyarrow.table(dict.fromkeys(("time", "crank_angle", "drive_torque"), times))
    parquet.write_table(table, tmp_path / "a.parquet", write_page_checksum=True)
    samples, recording = read(tmp_path / "a.parquet", config=config_from({}))
    texts = [finding.text for finding in recording.findings]
    assert len(samples) == 2 and texts == [
        *(f"row {k} is lost: column 'time': empty, expected a time in s" for k in range(2, 7)),
        f"{n - 5} more rows are lost",
    ]
