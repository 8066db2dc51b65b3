"""No signal that arrives ends an estimator: each gives a finite result, or says why it has none."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import leg_wear_monitor as lw
from leg_wear_monitor.commissioning.commission import propose
from leg_wear_monitor.estimate.joint_motion import series
from leg_wear_monitor.estimate.torque_model import TorqueModel, torque_model
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.recordings.series import JointName, Signals, TorqueSource
from leg_wear_monitor.twin import CRANK, KINDS, LOAD, TORQUE

START_NS, STEP_NS, RATE = 10**18, 10_000_000, 100
SIGNALS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "zero": lambda angle: 0.0 * angle,
    "constant": lambda angle: 0.0 * angle + 3.7,
    "tiny": lambda angle: 1.0e-308 * np.sin(angle),
    "huge": lambda angle: 1.0e300 * np.sin(angle),
    "infinite": lambda angle: np.where(np.sin(angle) > 0.5, np.inf, angle),
    "missing": lambda angle: np.where(np.sin(angle) > 0.0, np.nan, np.sin(angle)),
    "repeated": lambda angle: np.repeat(angle[::8], 8)[: len(angle)],
    "noise": lambda angle: np.random.default_rng(1).standard_normal(len(angle)),
    "sine": lambda angle: 9.0 * np.sin(angle),
    "angle": lambda angle: angle,
}
signals = st.sampled_from(sorted(SIGNALS))


def turned(seconds: float) -> np.ndarray:
    """Crank angles of a steady walk at 60 rpm [rad]."""
    return math.tau * np.arange(round(seconds * RATE)) / RATE


def within(values: np.ndarray, kind: int) -> np.ndarray:
    """Values that are read from a recording: NaN in place of an impossible one."""
    return np.where(np.abs(values) <= KINDS[kind].largest, values, np.nan)


def stamps(number: int) -> np.ndarray:
    return START_NS + STEP_NS * np.arange(number)


@pytest.fixture(scope="module")
def model(leg: lw.Mechanism) -> TorqueModel:
    return torque_model(leg)


@settings(max_examples=10, deadline=None)
@given(angle=signals, torque=signals)
def test_commission_proposes_or_says_why_not(
    leg: lw.Mechanism, model: TorqueModel, angle: str, torque: str
) -> None:
    phase = turned(12.0)
    stamp_ns, recording = stamps(len(phase)), np.zeros(len(phase), np.int64)
    joint, drive = (
        series(stamp_ns, within(SIGNALS[one](phase), kind), recording, START_NS)
        for one, kind in ((angle, CRANK), (torque, TORQUE))
    )
    topics = JointName("/joint_states", "crank"), TorqueSource("float64", "/drive_torque")
    try:
        result = propose(
            Signals({topics[0]: joint}, {topics[1]: drive}), leg, lw.MonitorConfig(), model=model
        )
    except lw.LegWearError as error:
        assert str(error)
        return
    assert result.config is None or math.isfinite(result.config.crank.offset_rad)
    assert result.config is not None or result.not_told


@settings(max_examples=8, deadline=None)
@given(signal=signals, torque=signals, load=signals)
def test_crank_zero_encoders_and_foot_load_go_on(
    leg: lw.Mechanism, signal: str, torque: str, load: str
) -> None:
    config = config_from(
        {
            "crank.zero": "at_start",
            "encoders.names": ["hip", "knee"],
            "encoders.joints": ["B", "G"],
            "foot_load.source": "wrench",
            "load.model": "measured",
            "diagnosis.enabled": False,
        }
    )
    monitor, phase = lw.WearMonitor(leg, config), turned(6.0)
    # first a crank that is sound, so that the estimators have gait cycles, then the signal
    for number, one in enumerate(("angle", signal)):
        stamp_ns = stamps(len(phase)) + number * 6 * 10**9
        crank = lw.gait_samples(stamp_ns, CRANK, crank_angle_rad=SIGNALS[one](phase))
        crank["encoder_rad"][:, 0], crank["encoder_rad"][:, 1] = SIGNALS[signal](phase), phase
        drive = lw.gait_samples(stamp_ns, TORQUE, torque_nm=SIGNALS[torque](phase))
        foot = lw.gait_samples(stamp_ns, LOAD)
        foot["foot_force_n"][:] = SIGNALS[load](phase)[:, None]
        with np.errstate(over="ignore", invalid="ignore"):
            monitor.update(np.stack([crank, drive, foot], axis=1).ravel())
    state = monitor.state
    assert state.verdict.joints == ()
    assert np.isfinite(monitor.clearances_m).all()
