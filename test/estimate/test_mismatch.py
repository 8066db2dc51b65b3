"""A torque with known faults is explained by just these; a sound one, or any other, by nothing."""

import math
from functools import cache
from types import SimpleNamespace
from typing import Any

import attrs
import numpy as np
import pytest

from leg_wear_monitor.estimate.cause import Cause, TorqueExplanation
from leg_wear_monitor.estimate.mismatch import Allowed, explanation
from leg_wear_monitor.mechanism.position import build_linkage, one_cycle
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.verdict.verdict import CauseWords
from leg_wear_monitor.twin.load import load_signature
from leg_wear_monitor.twin.statistics import TorqueProfile

pytestmark = pytest.mark.plain

TURN, PHASES, STEPS = 2.0 * math.pi, 128, 256
SIGN, SCALE, TIMING, LOAD, MASS = Cause.SIGN, Cause.SCALE, Cause.TIMING, Cause.LOAD, Cause.MASS
ALLOWED = Allowed(lag_s=0.005, loads_n=(0.0, 1000.0), friction_nm=2.5, unexplained=0.08)


@pytest.fixture(scope="module")
def torque_of(leg: Any) -> Any:
    """Ideal torque (STEPS,) over a turn [N m], with one body's mass larger by a fraction."""

    @cache
    def torque(body: str = "", more: float = 0.0, rpm: float = 60.0) -> Any:
        own = leg
        if body:
            one = leg.bodies[body]
            heavier = attrs.evolve(one, mass=(1.0 + more) * one.mass, inertia=(1.0 + more) * one.inertia)
            own = attrs.evolve(leg, bodies={**leg.bodies, body: heavier})
        return one_cycle(build_linkage(own), STEPS, rpm * TURN / 60.0).drive_torque

    return torque


@pytest.fixture(scope="module")
def walked(leg: Any, torque_of: Any) -> Any:
    """Gait cycles of a leg; the measured angle is ``offset`` too large, the torque ``lag`` late."""
    lever = load_signature(build_linkage(leg))[:-1:4]

    def at(curve: Any, angle: Any) -> Any:
        return np.interp(angle % TURN, np.arange(STEPS + 1) * TURN / STEPS, np.append(curve, curve[0]))

    def walk(
        cycles: int = 8, *, factor: float = 1.0, offset: float = 0.0, lag: float = 0.0, load: float = 0.0,
        bias: float = 0.4, body: str = "", more: float = 0.0, noise: float = 0.1, extra: Any = None,
        samples: int = 200, speeds: Any = (60.0,),
    ) -> list[Any]:  # fmt: skip
        rng, found = np.random.default_rng(7), []
        for i in range(cycles):
            rpm = speeds[i % len(speeds)]
            angle = (np.arange(samples) + rng.random()) * TURN / samples
            true = angle - offset - lag * rpm * TURN / 60.0
            measured = at(torque_of(body, more, rpm), true) + load * at(lever, true)
            if extra is not None:
                measured = measured + extra(true)
            measured = factor * measured + bias + noise * abs(factor) * rng.standard_normal(samples)
            place = (angle / TURN * PHASES).astype(int) % PHASES
            rows = [
                np.bincount(place, row, PHASES)
                for row in (
                    np.ones(samples),
                    angle % TURN,
                    measured,
                    at(torque_of(rpm=rpm), angle),
                    at(lever, angle),
                )
            ]
            found.append(
                SimpleNamespace(torque_profile=TorqueProfile(*rows), direction=1, moving_s=60.0 / rpm)
            )
        return found

    return walk


def explained(leg: Any, cycles: list[Any]) -> TorqueExplanation | None:
    return explanation(leg, cycles, ALLOWED)


def words(found: TorqueExplanation, **given: Any) -> str:
    config = config_from(given)
    return CauseWords(config.crank, config.drive_torque, found.speed_radps).explanation(found)


def remedied(found: TorqueExplanation, **given: Any) -> str:
    config = config_from(given)
    return " and ".join(map(CauseWords(config.crank, config.drive_torque).remedy, found.named))


@pytest.mark.parametrize(
    "sound",
    [{}, {"bias": 2.0}, {"bias": 0.0}, {"lag": 0.004}, {"offset": 0.02}, {"load": 60.0}, {"factor": 1.03},
     {"noise": 1.0}, {"samples": 50}, {"body": "coupler", "more": 0.1}],
)  # fmt: skip
def test_a_sound_torque_has_no_cause(leg, walked, sound) -> None:
    assert explained(leg, walked(**sound)) is None


@pytest.mark.parametrize(
    ("wrong", "causes"),
    [
        ({"factor": -1.0}, {SIGN: -1.0}),
        ({"factor": 1.0 / 9.0}, {SCALE: 1.0 / 9.0}),
        ({"factor": 1000.0, "bias": 400.0}, {SCALE: 1000.0}),
        ({"factor": 1.5}, {SCALE: 1.5}),
        ({"offset": 0.3}, {TIMING: -0.3}),
        ({"offset": -2.0}, {TIMING: 2.0}),
        ({"lag": 0.05}, {TIMING: -0.05 * TURN}),
        ({"load": -60.0}, {LOAD: -60.0}),
        ({"load": 1400.0}, {LOAD: 1400.0}),
        ({"body": "foot", "more": 1.0}, {MASS: 1.0}),
        # two at once
        ({"factor": -1.5}, {SIGN: -1.5, SCALE: 1.5}),
        ({"factor": -1.0, "offset": 0.4}, {SIGN: -1.0, TIMING: -0.4}),
        ({"factor": 0.1, "lag": 0.04}, {SCALE: 0.1, TIMING: -0.04 * TURN}),
        ({"factor": 3.0, "load": -80.0}, {SCALE: 3.0, LOAD: -80.0}),
        ({"factor": -1.0, "load": -80.0}, {SIGN: -1.0, LOAD: -80.0}),
        ({"offset": 0.3, "load": -80.0}, {TIMING: -0.3, LOAD: -80.0}),
    ],
)
def test_what_is_wrong_is_named_with_its_value(leg, walked, wrong, causes) -> None:
    found = explained(leg, walked(**wrong))
    assert found is not None and found.is_whole and found.after < 0.05
    assert {one.cause for one in found.named} == set(causes)
    for one in found.named:
        assert one.sigma > 0.0
        assert one.value == pytest.approx(causes[one.cause], abs=4.0 * one.sigma)
        assert one.sigma < 0.15 * abs(one.value)
    inputs = {SIGN, SCALE, TIMING} & set(causes)
    assert found.is_input_fault == bool(inputs)


@pytest.mark.parametrize(("bias", "word"), [(-5.0, "drives the crank"), (9.0, "largest friction")])
@pytest.mark.parametrize("factor", [-1.0, 3.0])
def test_a_bias_is_reported_beside_a_wrong_factor(leg, walked, factor, bias, word) -> None:
    found = explained(leg, walked(factor=factor, bias=factor * bias))
    assert found is not None
    assert found.bias.value == pytest.approx(bias if bias < 0.0 else bias - ALLOWED.friction_nm, abs=0.2)
    assert word in words(found)


def test_at_one_speed_an_offset_and_a_lag_are_both_named(leg, walked) -> None:
    found = explained(leg, walked(lag=0.05))
    assert found is not None and [one.cause for one in found.named] == [TIMING]
    text = words(found)
    assert (
        "behind its measured angle" in text and "late: at one speed the two cannot be distinguished" in text
    )
    assert "ms late" in text and "50" in text
    ahead = explained(leg, walked(offset=-0.3))
    assert ahead is not None and "ahead of its measured angle" in words(ahead) and "early" in words(ahead)
    assert "crank.offset_rad to 0.8" in remedied(ahead, **{"crank.offset_rad": 0.5})


@pytest.mark.parametrize(
    ("wrong", "cause", "value", "there", "absent"),
    [
        ({"lag": 0.05}, Cause.LAG, 0.05, "ms late", "measured angle"),
        ({"offset": 0.3}, Cause.CRANK_OFFSET, -0.3, "behind its measured angle", "late"),
    ],
)
def test_at_two_speeds_an_offset_and_a_lag_are_told_apart(
    leg, walked, wrong, cause, value, there, absent
) -> None:
    found = explained(leg, walked(30, speeds=(57.0, 63.0), **wrong))
    assert found is not None and [one.cause for one in found.named] == [cause]
    assert found.named[0].value == pytest.approx(value, abs=4.0 * found.named[0].sigma)
    text = words(found)
    assert there in text and absent not in text and "cannot be distinguished" not in text


def test_a_factor_is_compared_with_known_mistakes(leg, walked) -> None:
    shaft = explained(leg, walked(factor=1.0 / 9.0))
    assert shaft is not None
    assert "the torque on the joint's shaft; crank.gear_ratio is 9" in words(
        shaft, **{"crank.gear_ratio": 9.0}
    )
    assert "drive_torque.gear_ratio to 9" in remedied(shaft, **{"crank.gear_ratio": 9.0})
    assert "shaft" not in words(shaft) and "drive_torque.scale to 9" in remedied(shaft)
    twice = explained(leg, walked(factor=9.0))
    assert twice is not None and "already the torque on the crank" in words(
        twice, **{"drive_torque.gear_ratio": 9.0}
    )
    large = explained(leg, walked(factor=1000.0))
    assert large is not None and "in N mm" in words(large) and "scale to 0.001" in remedied(large)


def test_a_torque_of_nothing_like_this_leg_has_no_named_cause(leg, walked) -> None:
    found = explained(leg, walked(factor=1.0, extra=lambda angle: 12.0 * np.sin(5.0 * angle)))
    assert found is not None and not found.named and not found.is_input_fault
    text = words(found)
    assert "explains half of it" in text and "stays unexplained" in text
    assert f"{found.after:.3g} ± {found.after_sigma:.3g}" in text


def test_a_reversed_sign_on_a_leg_that_does_not_fit_is_named_with_what_remains(leg, walked) -> None:
    found = explained(leg, walked(factor=-1.0, extra=lambda angle: 2.5 * np.sin(7.0 * angle)))
    assert found is not None and [one.cause for one in found.named] == [SIGN] and not found.is_whole
    assert "stays unexplained" in words(found)


def test_two_causes_that_explain_alike_are_both_reported_and_none_is_sure(leg, walked) -> None:
    found = explained(leg, walked(body="shank", more=0.5, noise=1.0))
    assert found is not None and len(found.alternatives) > 1 and not found.named and not found.is_input_fault
    text = words(found)
    assert "shank" in text and "times the predicted one" in text and "cannot be distinguished" in text


def test_too_few_samples_explain_nothing(leg, walked) -> None:
    cycles = walked(factor=-1.0, samples=200)
    for one in cycles:
        one.torque_profile.number[8:] = 0.0
    assert explained(leg, cycles) is None
