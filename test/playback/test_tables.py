"""A table through the monitor: the verdict, the wear and every report are those of the same bag."""

import json
from pathlib import Path

import numpy as np
import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.bags.mcap_writer import McapWriter
from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.messages import encode
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.playback.replay import REPORTS_FILE
from leg_wear_monitor.twin import CRANK, LOAD

Columns = dict[str, np.ndarray]
NS = {"input.units.stamp": "ns"}


@pytest.fixture(scope="module")
def walked() -> Columns:
    """The healthy sample recording, a row each 5 ms, and the torque at the crank's times."""
    with Recording([share_directory() / "bags" / "healthy.mcap"], lw.MonitorConfig()) as recording:
        samples = np.concatenate([block.samples for block in recording.blocks()])
    crank, torque = samples[samples["kind"] == CRANK], samples[samples["kind"] != CRANK]
    at = np.interp(crank["stamp_ns"], torque["stamp_ns"], torque["torque_nm"])
    return {"time": crank["stamp_ns"], "crank_angle": crank["crank_angle_rad"], "drive_torque": at}


@pytest.fixture(scope="module")
def bag(walked: Columns, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bag") / "walk.mcap"
    stamps, torque = walked["time"], walked["drive_torque"]
    joints = encode.joint_states(stamps, ["crank"], position=walked["crank_angle"])
    wrenches = encode.wrenches(stamps, torque=np.stack([0.0 * torque, 0.0 * torque, torque], axis=1))
    with McapWriter(path, chunk_bytes=10_000_000) as writer:  # one chunk: a chunk's end is in /diagnostics
        crank = writer.channel("/joint_states", encode.JOINT_STATE)
        drive = writer.channel("/drive_torque", encode.WRENCH_STAMPED)
        for k, stamp in enumerate(stamps.tolist()):
            writer.write(crank, stamp, bytes(joints[k]))
            writer.write(drive, stamp, bytes(wrenches[k]))
    return path


def write_csv(path: Path, columns: Columns) -> Path:
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    path.write_text("\n".join([",".join(columns), *(",".join(map(repr, row)) for row in rows), ""]))
    return path


def reported(path: Path) -> dict[str, list[tuple[int, bytes]]]:
    """Times and messages of a file by topic."""
    messages: dict[str, list[tuple[int, bytes]]] = {}
    with path.open("rb") as file:
        reader = pytest.importorskip("mcap.reader").make_reader(file)
        for _, channel, message in reader.iter_messages(log_time_order=False):
            messages.setdefault(channel.topic, []).append((message.log_time, message.data))
    return messages


def test_a_csv_file_is_replayed_bit_for_bit_as_the_bag(walked: Columns, bag: Path, tmp_path: Path) -> None:
    table = write_csv(tmp_path / "walk.csv", walked)
    config = config_from(NS)
    kept = {name: tmp_path / f"{name}.ledger" for name in ("bag", "csv")}
    results = {
        name: lw.replay(path, config, out=tmp_path / name, ledger=kept[name])
        for name, path in (("bag", bag), ("csv", table))
    }
    told = {name: json.loads(result.summary().to_json()) for name, result in results.items()}
    assert told["csv"]["verdict"]["state"] == "healthy"
    assert told["csv"]["recording"].pop("files") == [str(table)]
    assert told["bag"]["recording"].pop("files") == [str(bag)]
    told["bag"]["monitor"].pop("ledger", None), told["csv"]["monitor"].pop("ledger", None)
    assert told["csv"] == told["bag"]
    assert reported(tmp_path / "csv" / REPORTS_FILE) == reported(tmp_path / "bag" / REPORTS_FILE)
    assert results["csv"].monitor.wear_depth_m.tobytes() == results["bag"].monitor.wear_depth_m.tobytes()
    again = lw.replay(table, config, ledger=kept["bag"])
    assert again.monitor.is_all_counted


def test_units_a_sign_and_an_offset_change_no_more_than_rounding(walked: Columns, bag: Path) -> None:
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
    found, expected = lw.replay(other, config).summary(), lw.replay(bag).summary()
    assert found.verdict.state is expected.verdict.state
    assert found.cycles == expected.cycles
    for joint, clearance in expected.clearances.items():
        assert found.clearances[joint].counted_m == pytest.approx(clearance.counted_m, rel=1.0e-6)


def test_a_table_in_memory_is_commissioned(walked: Columns) -> None:
    turned = {**walked, "crank_angle": -walked["crank_angle"] + 1.0}
    result = lw.commission(turned, config_from(NS))
    assert result.item("crank.sign").value == -1
    assert result.item("crank.offset_rad").value == pytest.approx(1.0, abs=0.03)
    assert result.config is not None and result.config.input == config_from(NS).input


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
