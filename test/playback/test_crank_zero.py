"""Recordings of two boots of a robot whose motor's encoder starts at zero, replayed by one command."""

import math
from pathlib import Path

import numpy as np
import pytest
from raw_messages import Message, crank_and_torque, write_messages

import leg_wear_monitor as lw
from leg_wear_monitor.estimate.torque_model import TorqueModel, torque_model
from leg_wear_monitor.messages.cdr import Decoder
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.config.settings import MonitorConfig

START_NS, RATE_HZ, TURN = 1_700_000_000 * 10**9, 200, 2.0 * math.pi
BOOTS = (1.9, 0.0), (-0.7, 30.0)  # crank angle at the start [rad], time of the start [s]


@pytest.fixture(scope="module")
def model(leg: lw.Mechanism) -> TorqueModel:
    return torque_model(leg)


@pytest.fixture(scope="module")
def config() -> MonitorConfig:
    """An encoder on the motor's shaft, which turns the other way."""
    crank = {"crank.zero": "at_start", "crank.sign": -1, "crank.gear_ratio": 9.0}
    return config_from({**crank, "diagnosis.enabled": False})


def messages(model: TorqueModel, config: MonitorConfig, start_rad: float, start_s: float) -> list[Message]:
    """Messages of a walk, whose encoder begins at 0."""
    rng, n = np.random.default_rng(round(start_s)), 5 * RATE_HZ
    angle = start_rad + TURN * np.arange(n) / RATE_HZ
    crank = config.crank
    position = crank.sign * crank.gear_ratio * (angle - start_rad + 1.0e-3 * rng.standard_normal(n))
    speed = np.full(n, TURN)
    torque = model.torque(angle - 0.5 * TURN / RATE_HZ, speed, 0.0 * speed)[0] + rng.standard_normal(n)
    stamps = START_NS + round(start_s * 1.0e9) + np.arange(n, dtype=np.int64) * (10**9 // RATE_HZ)
    return crank_and_torque(stamps, position, torque, names=("hip", "crank"))


def test_each_boot_has_its_zero_and_a_replay_is_the_live_run(
    leg: lw.Mechanism, model: TorqueModel, config: MonitorConfig, tmp_path: Path
) -> None:
    boots = [messages(model, config, *boot) for boot in BOOTS]
    result = lw.replay([write_messages(tmp_path / f"{i}.mcap", boot) for i, boot in enumerate(boots)], config)
    live, decoder, zeros = lw.WearMonitor(leg, result.monitor.config), Decoder(config), []
    for i, boot in enumerate(boots):
        if i:
            live.pause(BOOTS[1][1] - (boots[0][-1][1] - boots[0][0][1]) / 1.0e9 + 1.0e-9)
        for begin in range(0, len(boot), 37):
            arrived = boot[begin : begin + 37]
            live.update(np.concatenate([decoder.one(raw, kind, log_ns) for kind, log_ns, raw in arrived]))
        zeros.append({one.name: one for one in live.status()}["crank zero"].values)
    for (start_rad, _), zero in zip(BOOTS, zeros, strict=True):
        assert abs(math.remainder(zero["offset_rad"] - start_rad, TURN)) < 0.02
    assert zeros[1]["times_found"] == 2.0
    assert zeros[1]["not_monitored_s"] == 0.0
    statuses = {one.name: one for one in result.monitor.status()}
    assert statuses["crank zero"].values == zeros[1]
    assert result.monitor.wear_depth_m.tobytes() == live.wear_depth_m.tobytes()
    assert result.evidence.believable == 8  # all whole gait cycles
    assert result.monitor.lost.unmonitored_s < 0.5  # until the tracker has the crank, twice
