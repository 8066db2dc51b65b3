"""Averages cancel over a part of a turn, instants do not; what shows no strong impacts tells neither."""

from collections.abc import Callable

import numpy as np
import pytest

from leg_wear_monitor.commissioning.evidence import Sampling, added_up, sampling_of
from leg_wear_monitor.estimate.joint_motion import Series, motion_of, paired
from leg_wear_monitor.estimate.torque_fit import Start, fit
from leg_wear_monitor.estimate.torque_model import TorqueModel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN

from .conftest import MakeWalk, Robot, Walk, columns_of

Judge = Callable[[Walk], Sampling]
FINE = 25  # steps of impacts in a sampling interval of 5 ms


def impacts(walk: Walk, size_nm: float, sampling: str, seed: int) -> Floats:
    """Torques of flights of 4 ms to 20 ms, each with an impact after it that takes back its impulse.

    A third of the turn is quiet, as that of a leg.
    """
    rng, samples = np.random.default_rng(seed), len(walk.time_s)
    fine = np.zeros(samples * FINE)
    at = 0
    while True:
        pause, flight, impact = rng.integers(20, 200), rng.integers(20, 100), rng.integers(4, 10)
        at += pause + flight + impact
        if at > len(fine):
            break
        if walk.angle_rad[at // FINE - 1] % TURN > TURN / 1.5:
            continue
        fine[at - flight - impact : at - impact] = -size_nm
        fine[at - impact : at] = size_nm * flight / impact
    parts = fine.reshape(samples, FINE)
    return np.asarray(parts.mean(axis=1) if sampling == "average" else parts[:, -1])


@pytest.fixture
def judged(model: TorqueModel) -> Judge:
    """Judge the samples of a walk that is known in all else."""

    def judge(walk: Walk) -> Sampling:
        position, torque = columns_of(Robot(), walk)
        recording = np.zeros(len(position), np.int64)
        motion = motion_of(Series(walk.time_s, position, recording))
        pair = paired(motion, Series(walk.time_s, torque, recording))
        return sampling_of(fit(pair, model, Start(1.0, 0.0, 1, 1.0, 0)), model)

    return judge


@pytest.mark.parametrize("sampling", ["average", "instant"])
@pytest.mark.parametrize("seed", range(3))
def test_impacts_tell_averages_from_instants_at_one_cadence(
    sampling: str, seed: int, ideal_walk: MakeWalk, judged: Judge
) -> None:
    walk = ideal_walk(70.0, friction_nm=0.5)
    hit = walk.torque_nm + impacts(walk, 5.0, sampling, seed)
    found = judged(Walk(walk.time_s, walk.angle_rad, hit))
    assert found.value == sampling
    assert "odds" in found.why


def test_a_change_of_cadence_between_averages_is_not_taken_for_instants(
    ideal_walk: MakeWalk, judged: Judge
) -> None:
    walk = ideal_walk(40.0, 75.0)
    # a smoothed motion lags behind a sudden change, and with it the leg's torque
    change = 8.0 * np.exp(-(((walk.time_s - 15.0) / 0.15) ** 2))
    hit = walk.torque_nm + change + impacts(walk, 5.0, "average", 7)
    assert judged(Walk(walk.time_s, walk.angle_rad, hit)).value == "average"


def test_the_sample_recording_has_averages(walked: Walk, judged: Judge) -> None:
    assert judged(walked).value == "average"


def test_without_impacts_one_cadence_tells_neither(ideal_walk: MakeWalk, judged: Judge) -> None:
    found = judged(ideal_walk(70.0))
    assert found.value == ""
    assert "shows no strong impacts" in found.why


@pytest.mark.parametrize(("sampling", "size_nm"), [("average", 3.0), ("instant", 1.0)])
def test_noise_hides_impacts(sampling: str, size_nm: float, ideal_walk: MakeWalk, judged: Judge) -> None:
    walk = ideal_walk(70.0)
    noise = 5.0 * np.random.default_rng(4).standard_normal(len(walk.time_s))
    hit = walk.torque_nm + noise + impacts(walk, size_nm, sampling, 5)
    assert judged(Walk(walk.time_s, walk.angle_rad, hit)).value == ""


def test_independent_samples_add_up_and_steps_of_a_bounded_process_cancel() -> None:
    rng = np.random.default_rng(6)
    independent = rng.standard_normal(20000)
    assert added_up(independent, 0.0, 25)[0] == pytest.approx(1.0, abs=0.1)
    # the window is a triangle: steps of white noise have 2 / 25 of the energy that the window's slopes leave
    wide, error = added_up(np.diff(independent), 0.0, 25)
    slopes = np.diff(np.concatenate([[0.0], np.convolve(np.ones(25), np.ones(25)), [0.0]]))
    window = np.convolve(np.ones(25), np.ones(25))
    assert wide == pytest.approx(float(slopes @ slopes / (window @ window)) / 2.0, abs=5.0 * error)


def test_too_few_samples_tell_nothing() -> None:
    assert np.isnan(added_up(np.ones(100), 0.0, 25)[0])
