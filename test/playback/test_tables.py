"""A table through the monitor: the verdict, the wear and every report are those of the same bag."""

import json
from pathlib import Path

import numpy as np
import pytest
from raw_messages import crank_and_torque, messages_of, write_messages

import leg_wear_monitor as lw
from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.playback.replay import REPORTS_FILE
from leg_wear_monitor.playback.summary import ReplayResult
from leg_wear_monitor.twin import CRANK, LOAD

Columns = dict[str, np.ndarray]
NS = {"input.units.stamp": "ns"}


@pytest.fixture(scope="module")
def walked() -> Columns:
    """The healthy sample recording's first seconds, a row each 5 ms, and the torque at the crank's times."""
    with Recording([share_directory() / "bags" / "healthy.mcap"], lw.MonitorConfig()) as recording:
        samples = np.concatenate([block.samples for block in recording.blocks()])
    crank, torque = samples[samples["kind"] == CRANK], samples[samples["kind"] != CRANK]
    at = np.interp(crank["stamp_ns"], torque["stamp_ns"], torque["torque_nm"])
    columns = {"time": crank["stamp_ns"], "crank_angle": crank["crank_angle_rad"], "drive_torque": at}
    return {name: column[: 7 * 200] for name, column in columns.items()}


@pytest.fixture(scope="module")
def bag(walked: Columns, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bag") / "walk.mcap"
    columns = (walked["time"], walked["crank_angle"], walked["drive_torque"])
    sent = crank_and_torque(*columns, arrival_ns=(0, 0))
    # one chunk: a chunk's end is in /diagnostics
    return write_messages(path, sent, chunk_bytes=10_000_000)


def write_csv(path: Path, columns: Columns) -> Path:
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    path.write_text("\n".join([",".join(columns), *(",".join(map(repr, row)) for row in rows), ""]))
    return path


@pytest.fixture(scope="module")
def replayed(bag: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[ReplayResult, Path]:
    """The bag's replay, and the directory with its ledger and its reports."""
    place = tmp_path_factory.mktemp("replayed")
    return lw.replay(bag, config_from(NS), out=place, ledger=place / "own.ledger"), place


def test_a_csv_file_is_replayed_bit_for_bit_as_the_bag(
    walked: Columns, bag: Path, replayed: tuple[ReplayResult, Path], tmp_path: Path
) -> None:
    table, config, (expected, place) = write_csv(tmp_path / "walk.csv", walked), config_from(NS), replayed
    found = lw.replay(table, config, out=tmp_path, ledger=tmp_path / "own.ledger")
    of_table, of_bag = (json.loads(result.summary().to_json()) for result in (found, expected))
    assert of_table["verdict"]["state"] == "healthy"
    assert of_table["recording"].pop("files") == [str(table)]
    assert of_bag["recording"].pop("files") == [str(bag)]
    of_table["monitor"].pop("ledger", None), of_bag["monitor"].pop("ledger", None)
    assert of_table == of_bag
    assert messages_of(tmp_path / REPORTS_FILE) == messages_of(place / REPORTS_FILE)
    assert found.monitor.wear_depth_m.tobytes() == expected.monitor.wear_depth_m.tobytes()
    again = lw.replay(bag, config, ledger=tmp_path / "own.ledger")
    assert again.monitor.is_all_counted


def test_units_a_sign_and_an_offset_change_no_more_than_rounding(
    walked: Columns, replayed: tuple[ReplayResult, Path]
) -> None:
    other = {
        "t": walked["time"] / 1.0e6 - 1.7e12,
        "angle": (np.rad2deg(0.7 - walked["crank_angle"])) % 360.0,
        "torque": walked["drive_torque"] * 1000.0,
    }
    config = config_from(
        {
            "input.columns.stamp": "t",
            "input.columns.crank_angle": "angle",
            "input.columns.drive_torque": "torque",
            "input.units.stamp": "ms",
            "input.units.crank_angle": "deg",
            "input.units.drive_torque": "N mm",
            "crank.sign": -1,
            "crank.offset_rad": 0.7,
        }
    )
    found, expected = lw.replay(other, config).summary(), replayed[0].summary()
    assert found.verdict.state is expected.verdict.state
    assert found.cycles == expected.cycles
    for joint, clearance in expected.clearances.items():
        assert found.clearances[joint].counted_m == pytest.approx(clearance.counted_m, rel=1.0e-6)


@pytest.mark.parametrize("source", ["wrench", "float64", "contact"])
def test_columns_of_the_foot_load_are_read(walked: Columns, tmp_path: Path, source: str) -> None:
    """From CSV and Parquet, in kilonewtons and with another sign."""
    stands = walked["crank_angle"] % TURN < 0.5 * TURN
    columns = walked | {"up": -0.3 * stands, "along": 0.02 * stands}
    parameters = NS | {
        "foot_load.source": source,
        "foot_load.sign": -1,
        "input.columns.foot_load": "up",
        "input.columns.foot_load_along": "along" if source == "wrench" else "",
        "input.units.foot_load": "kN",
    }
    table = write_csv(tmp_path / "walk.csv", columns)
    parquet = tmp_path / "walk.parquet"
    pytest.importorskip("pyarrow.parquet").write_table(pytest.importorskip("pyarrow").table(columns), parquet)
    found = []
    for path in (table, parquet, columns):
        with Recording([path], config_from(parameters)) as recording:
            samples = np.concatenate([block.samples for block in recording.blocks()])
        found.append(samples[samples["kind"] == LOAD]["foot_force_n"])
    along = -20.0 if source == "wrench" else 0.0
    wanted = np.outer(stands, [0.0, 1.0] if source == "contact" else [along, 300.0])
    for force in found:
        np.testing.assert_allclose(force, wanted, atol=1.0e-9)
    load = lw.replay(table, config_from(parameters)).summary().load
    assert load.source == "measured"
    assert load.peak_n == (None if source == "contact" else pytest.approx(300.0, rel=0.01))


def test_a_missing_column_of_the_foot_load_is_named(walked: Columns) -> None:
    with pytest.raises(RecordingError, match=r"input.columns.foot_load: column 'foot_load' does not exist"):
        lw.replay(walked, config_from(NS | {"foot_load.source": "float64"}))
