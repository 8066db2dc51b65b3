"""Walks of a leg with ideal joints, whose encoder has its zero anywhere."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from leg_wear_monitor import Mechanism
from leg_wear_monitor.estimate.torque_model import TorqueModel, torque_model
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.crank_zero import CrankZero
from leg_wear_monitor.monitor.evaluation import A_CYCLE, EvaluationPeriods
from leg_wear_monitor.twin import CRANK, TORQUE
from leg_wear_monitor.twin.sample import Samples, TrackerSettings, gait_samples

START_NS = 1_700_000_000_000_000_000
TURN = 2.0 * math.pi


@pytest.fixture(scope="session")
def model(leg: Mechanism) -> TorqueModel:
    """Torque of the default leg."""
    return torque_model(leg)


@pytest.fixture(scope="session")
def walk(model: TorqueModel) -> Callable[..., Samples]:
    """Make the samples of a walk: a crank that starts at some angle, read from its encoder's zero."""

    def make(
        seconds: float,
        zero_rad: float,
        rpm: float = 60.0,
        begin_s: float = 0.0,
        factor: float = 1.0,
        noise_nm: float = 0.2,
        is_wrapped: bool = False,
        seed: int = 0,
    ) -> Samples:
        rng, rate = np.random.default_rng(seed), 200.0
        times = begin_s + np.arange(round(seconds * rate)) / rate
        mean = rpm * TURN / 60.0
        angle = mean * times + 0.02 * np.sin(2.0 * mean * times)
        speed = mean * (1.0 + 0.04 * np.cos(2.0 * mean * times))
        acceleration = -0.08 * mean**2 * np.sin(2.0 * mean * times)
        half = 0.5 / rate  # an average over a sampling interval is that of its middle
        before = angle - half * speed, speed - half * acceleration, acceleration
        torque = factor * model.torque(*before)[0] + 0.5 * np.sign(rpm)
        torque = torque + noise_nm * rng.standard_normal(len(times))
        read = angle - zero_rad + 1.0e-3 * rng.standard_normal(len(times))
        stamps = START_NS + np.round(1.0e9 * times).astype(np.int64)
        crank = gait_samples(stamps, CRANK, crank_angle_rad=read % TURN if is_wrapped else read)
        both = np.concatenate([crank, gait_samples(stamps, TORQUE, torque_nm=torque)])
        return both[np.argsort(both["stamp_ns"], kind="stable")]

    return make


@pytest.fixture(scope="session")
def new_search(model: TorqueModel) -> Callable[..., CrankZero]:
    """Make a search at a commanded cadence."""

    def make(rpm: float = 60.0) -> CrankZero:
        config = config_from({"crank.zero": "at_start", "cadence.commanded_rpm": rpm})
        return CrankZero(model, config, TrackerSettings(commanded_speed_radps=rpm * TURN / 60.0))

    return make


@pytest.fixture(scope="session")
def feed() -> Callable[..., Samples]:
    """Pass samples in evaluation periods to a search; what it passes on."""

    def run(
        search: CrankZero,
        samples: Samples,
        cuts: tuple[int, ...] = (),
        periods: EvaluationPeriods | None = None,
    ) -> Samples:
        length_ns = 10**9 // A_CYCLE
        periods = periods or EvaluationPeriods(length_ns)
        out = [samples[:0]]
        for block in np.split(samples, cuts):
            out += [search.passed(piece, ends) for piece, ends in periods.pieces(block)]
        return np.concatenate(out)

    return run
