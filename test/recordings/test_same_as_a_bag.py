"""The same values as CSV, as Parquet, as arrays and as MCAP give the same samples, bit for bit."""

from collections.abc import Callable
from decimal import Decimal
from typing import Any

import numpy as np
import pytest

from leg_wear_monitor.monitor.config.inputs import TORQUE_SOURCES
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.recordings import encode

Read = Callable[..., Any]
NS = {"table.units.stamp": "ns", "table.columns.crank_speed": "crank_speed"}
NAMES = ("time", "crank_angle", "crank_speed", "drive_torque")
FIELDS = ("stamp_ns", "crank_angle_rad", "crank_velocity_radps", "torque_nm")


@pytest.fixture(scope="module")
def sent(traffic):
    return traffic()


def columns_of(samples):
    """A row a sample, with NaN where it has no value."""
    return {name: samples[field].copy() for name, field in zip(NAMES, FIELDS, strict=True)}


def cell(value):
    if isinstance(value, int):
        return str(value)
    return "" if np.isnan(value) else repr(value)


def write_csv(path, columns, separator=","):
    rows = zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True)
    lines = [separator.join(columns), *(separator.join(map(cell, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
def test_a_csv_file_gives_the_samples_of_the_bag(tmp_path, sent, write_bag, read, separator):
    """Their stamps go back now and then, as torques are late: the order of the rows is that of arrival."""
    samples, _ = read(write_bag(tmp_path / "a.mcap", sent))
    columns = columns_of(samples)
    if separator == " ":  # in which an empty cell cannot be written
        columns = {name: np.nan_to_num(column) for name, column in columns.items()}
        samples = read(columns, config=config_from(NS))[0]
    found, _ = read(write_csv(tmp_path / "a.csv", columns, separator), config=config_from(NS))
    assert found.tobytes() == samples.tobytes()


def test_arrays_frames_and_parquet_give_the_samples_of_the_bag(tmp_path, sent, expected, read):
    columns = columns_of(expected(sent))
    assert read(columns, config=config_from(NS))[0].tobytes() == expected(sent).tobytes()
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(columns)
    assert read(frame, config=config_from(NS))[0].tobytes() == expected(sent).tobytes()
    assert read(frame.set_index("time"), config=config_from(NS))[0].tobytes() == expected(sent).tobytes()
    pytest.importorskip("pyarrow")
    frame.to_parquet(tmp_path / "a.parquet")
    assert read(tmp_path / "a.parquet", config=config_from(NS))[0].tobytes() == expected(sent).tobytes()


def test_dates_are_stamps_to_the_nanosecond(tmp_path, sent, expected, read):
    config = config_from(NS | {"table.units.stamp": "date"})
    columns = columns_of(expected(sent))
    dates = columns["time"].view("datetime64[ns]")
    assert read(columns | {"time": dates}, config=config)[0].tobytes() == expected(sent).tobytes()
    for mark in ("", "Z", "+00:00"):
        lines = write_csv(tmp_path / "a.csv", columns).read_text().splitlines()
        cells = [f"{str(date).replace('T', ' ')}{mark}" for date in dates]
        dated = [f"{date},{line.partition(',')[2]}" for date, line in zip(cells, lines[1:], strict=True)]
        (tmp_path / "a.csv").write_text("\n".join([lines[0], *dated]) + "\n")
        assert read(tmp_path / "a.csv", config=config)[0].tobytes() == expected(sent).tobytes()


@pytest.mark.parametrize(("unit", "power"), [("s", 9), ("ms", 6), ("us", 3), ("ns", 0)])
@pytest.mark.parametrize("start_ns", [0, 1_700_000_000 * 10**9])
def test_times_in_any_unit_are_exact_to_a_microsecond(tmp_path, read, unit, power, start_ns):
    stamps = start_ns + np.random.default_rng(power).integers(1, 10**13, 300)
    lines = [f"{Decimal(int(stamp)).scaleb(-power)},0.5" for stamp in stamps]
    (tmp_path / "a.csv").write_text("\n".join(["time,crank_angle", *lines]) + "\n")
    config = config_from({"table.units.stamp": unit, "table.columns.drive_torque": ""})
    found = read(tmp_path / "a.csv", config=config)[0]["stamp_ns"]
    assert np.abs(found - stamps).max() < 1000
    assert unit != "ns" or np.array_equal(found, stamps)


@pytest.mark.parametrize("source", TORQUE_SOURCES)
def test_a_torque_comes_as_the_parameters_say(read, source):
    config = config_from({"drive_torque.source": source, "drive_torque.axis": "x", "drive_torque.sign": -1})
    columns = {
        "time": np.arange(1.0, 4.0),
        "crank_angle": np.arange(3.0),
        "drive_torque": np.arange(5.0, 8.0),
    }
    samples, _ = read(columns, config=config)
    assert len(samples) == (3 if source == "effort" else 6)
    torques = samples[np.isfinite(samples["torque_nm"])]
    assert torques["torque_nm"].tolist() == [-5.0, -6.0, -7.0]
    assert torques["stamp_ns"].tolist() == [10**9, 2 * 10**9, 3 * 10**9]


def test_units_become_si(read):
    config = config_from(
        {
            "table.units.stamp": "ms",
            "table.units.crank_angle": "deg",
            "table.units.crank_speed": "rpm",
            "table.units.drive_torque": "N mm",
            "table.columns.crank_speed": "speed",
            "table.start": "2026-03-01T00:00:00Z",
        }
    )
    columns = {"time": [0, 1], "crank_angle": [90, 180], "speed": [60, 30], "drive_torque": [12345, 0.1]}
    samples, _ = read(columns, config=config)
    assert samples["crank_angle_rad"][::2].tolist() == [np.pi / 2.0, np.pi]
    assert samples["crank_velocity_radps"][::2].tolist() == pytest.approx([2.0 * np.pi, np.pi], rel=1e-15)
    assert samples["torque_nm"][1::2].tolist() == [12.345, 0.0001]
    first_ns = int(np.datetime64("2026-03-01", "ns").astype(np.int64))
    assert samples["stamp_ns"].tolist() == [first_ns, first_ns, first_ns + 10**6, first_ns + 10**6]


def test_further_encoders_are_columns_by_their_names(read):
    config = config_from(
        {"encoders.names": ["knee", "hip"], "encoders.joints": ["C", "B"], "encoders.signs": [1.0, -1.0]}
    )
    columns = {
        "time": [1.0, 2.0, 3.0],
        "crank_angle": [0.1, 0.2, 0.3],
        "drive_torque": [np.nan] * 3,
        "knee": [1.0, np.nan, 3.0],
        "hip": [4.0, 5.0, np.nan],
    }
    samples, _ = read(columns, config=config)
    assert samples["crank_angle_rad"].tolist() == [0.1, 0.2, 0.3]
    assert np.array_equal(
        samples["encoder_rad"][:, :2], [[1.0, -4.0], [np.nan, -5.0], [3.0, np.nan]], equal_nan=True
    )


def test_rows_without_a_time_come_at_their_rate(tmp_path, read):
    config = config_from(
        {
            "table.columns.drive_torque": "",
            "table.columns.crank_angle": "2",
            "table.rate_hz": 400.0,
            "table.start": "1970-01-01T00:00:01",
        }
    )
    (tmp_path / "a.csv").write_text("7,0.1\n7,x\n7,0.3\n")  # and no names: columns have numbers
    samples, recording = read(tmp_path / "a.csv", config=config)
    assert samples["stamp_ns"].tolist() == [10**9, 10**9 + 5 * 10**6]
    assert [finding.text for finding in recording.findings] == [
        "drive_torque: is not a topic of the recording; it has /joint_states",
        "line 2 is lost: column '2': 'x' is not a number. Expected a value in rad",
    ]


def test_several_files_and_a_bag_are_one_recording(tmp_path, traffic, write_bag, expected, read):
    first, second = traffic(), traffic(start_ns=1_700_000_003 * 10**9)
    bag = write_bag(tmp_path / "a.mcap", second)
    table = write_csv(tmp_path / "b.csv", columns_of(expected(first)))
    samples, recording = read(bag, table, config=config_from(NS))
    assert samples.tobytes() == np.concatenate([expected(first), expected(second)]).tobytes()
    assert any("begins" in finding.text for finding in recording.findings)


def test_a_file_larger_than_a_block_is_read_whole(tmp_path, read):
    stamps = 1 + np.arange(60_000)
    columns = {"time": stamps, "crank_angle": np.random.default_rng(0).normal(size=len(stamps))}
    config = config_from({"table.units.stamp": "ms", "table.columns.drive_torque": ""})
    path = write_csv(tmp_path / "a.csv", columns)
    samples, _ = read(path, config=config)
    assert np.array_equal(samples["crank_angle_rad"], columns["crank_angle"])
    assert np.array_equal(samples["stamp_ns"], stamps * 10**6)


def test_a_number_that_is_none_is_a_faulty_sample_and_an_empty_cell_is_no_sample(tmp_path, read):
    (tmp_path / "a.csv").write_text("time,crank_angle,drive_torque\n1.1,nan,\n1.2,0.5,nan\n1.3,,4\n")
    samples, _ = read(tmp_path / "a.csv", config=config_from({}))
    assert samples["stamp_ns"].tolist() == [1_100_000_000, 1_200_000_000, 1_200_000_000, 1_300_000_000]
    assert (samples["fault"] != 0).tolist() == [True, False, True, False]


def test_a_message_of_a_number_is_that_of_the_library(store):
    kind = store.types["std_msgs/msg/Float64"]
    raw = encode.float64s([1.5, -2.0])
    assert bytes(raw[1]) == bytes(store.serialize_cdr(kind(-2.0), "std_msgs/msg/Float64"))
