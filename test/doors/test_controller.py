"""A controller drives the crank: gains on the errors of angle and speed, feed-forward, a largest torque."""

import math

import numpy as np
import pytest
from mechanism_of import document_of, mechanism_of

import leg_wear_monitor as lw

TURN = 2.0 * math.pi
SPEED, INERTIA = 5.0, 0.02  # rad/s, kg m^2


def rotor(inertia: float = INERTIA, **track) -> lw.Mechanism:
    """A rotor on a fixed pin, which closed forms know."""
    return mechanism_of(
        {
            "name": "rotor",
            "gravity": [0.0, 0.0],
            "ground": {"points": {"A": [0.0, 0.0]}},
            "bodies": {
                "rotor": {"mass": 1.0, "inertia": inertia, "com": [0.0, 0.0], "points": {"A": [0.0, 0.0]}}
            },
            "joints": {"A": {"bushing": "ground", "journal": "rotor"}},
            "drive": {"body": "rotor", "track": {"speed_radps": SPEED} | track},
            "assembly": {"crank_angle": 0.0, "rotor": [0.0, 0.0, 0.0]},
        }
    )


def four_bar(**drive) -> lw.Mechanism:
    document = document_of("four_bar")
    document["drive"] = {"body": "crank"} | drive
    return mechanism_of(document)


def tracking(**track) -> lw.Mechanism:
    return four_bar(track={"speed_radps": SPEED} | track)


def moved(
    mechanism: lw.Mechanism, duration_s: float, clearances: tuple[str, ...] = ()
) -> lw.SimulationResult:
    return lw.simulate(mechanism, clearances=clearances, duration_s=duration_s, model="full")


def kinetic_j(speed_radps: float) -> float:
    """Change of the rotor's kinetic energy since its start at the wanted speed."""
    return 0.5 * INERTIA * (speed_radps**2 - SPEED**2)


@pytest.mark.parametrize("t_end", [0.1, 0.35, 0.8])
def test_a_rotor_settles_as_the_closed_form_says(t_end: float) -> None:
    """A step of feed-forward moves it to where the gain holds it, as a damped oscillator."""
    kp, kd, step = 2.0, 0.06, 0.5
    found = moved(rotor(kp_nm_per_rad=kp, kd_nm_s_per_rad=kd, feed_forward_nm=step), t_end)
    decay = kd / (2.0 * INERTIA)
    wave = math.sqrt(kp / INERTIA - decay**2)
    swing = math.exp(-decay * t_end)
    error = step / kp * (1.0 - swing * (math.cos(wave * t_end) + decay / wave * math.sin(wave * t_end)))
    rate = step / kp * swing * (wave + decay**2 / wave) * math.sin(wave * t_end)
    assert found.cycles * TURN == pytest.approx(SPEED * t_end + error, rel=1.0e-9)
    assert found.energy_j.stored == pytest.approx(kinetic_j(SPEED + rate), rel=1.0e-9)


@pytest.mark.parametrize("asked", [7.0, -7.0])
def test_the_drive_gives_no_more_than_its_largest_torque(asked: float) -> None:
    found, torque = moved(rotor(feed_forward_nm=asked, max_torque_nm=0.4), 0.2), math.copysign(0.4, asked)
    assert found.energy_j.stored == pytest.approx(kinetic_j(SPEED + torque / INERTIA * 0.2), rel=1.0e-9)
    assert found.drive_torque_nm.mean == pytest.approx(torque, rel=1.0e-12)


def test_the_feed_forward_follows_the_phase_of_the_wanted_motion() -> None:
    """Linear between its phases, and from the last on to the first: over a turn its mean is the table's."""
    table = {"feed_forward_nm": [1.0, -2.0, 0.5], "feed_forward_phase": [0.0, 0.25, 0.75]}
    mean = 0.25 * (1.0 - 2.0) / 2.0 + 0.5 * (-2.0 + 0.5) / 2.0 + 0.25 * (0.5 + 1.0) / 2.0
    assert moved(rotor(inertia=20.0, **table), TURN / SPEED).drive_torque_nm.mean == pytest.approx(
        mean, rel=1.0e-6
    )


def test_without_gains_it_is_a_constant_torque() -> None:
    tracked, constant = tracking(feed_forward_nm=-0.3), four_bar(torque=-0.3, initial_speed=SPEED)
    one, other = (moved(mechanism, 0.6) for mechanism in (tracked, constant))
    assert abs(one.cycles * TURN - 0.6 * SPEED) > 0.1  # it has left the motion to follow
    assert one.cycles == pytest.approx(other.cycles, abs=1.0e-9)
    assert one.energy_j.stored == pytest.approx(other.energy_j.stored, abs=1.0e-9)


def at_the_end(mechanism: lw.Mechanism) -> lw.SimulationResult:
    return lw.simulate(mechanism, clearances=(), duration_s=1.0, trace=16)


def test_high_gains_tend_to_a_constant_speed() -> None:
    """Ten times the gains, a tenth of the error; the torque tends to that of the ideal linkage."""
    errors, torques = [], []
    for gain in (1.0, 10.0, 100.0):
        found = at_the_end(tracking(kp_nm_per_rad=30.0 * gain, kd_nm_s_per_rad=10.0 * gain))
        errors.append(abs(found.cycles * TURN - SPEED))
        torques.append(found.trace.drive_torque_nm[-1])
    assert errors[1] == pytest.approx(0.1 * errors[0], rel=0.1)
    assert errors[2] == pytest.approx(0.01 * errors[0], rel=0.1)
    steady = at_the_end(four_bar(speed=SPEED)).trace.drive_torque_nm[-1]
    assert torques[2] == pytest.approx(steady, rel=5.0e-3)


def test_the_ideal_torque_as_feed_forward_leaves_little_to_the_gains() -> None:
    ideal = lw.simulate(four_bar(speed=SPEED), clearances=(), cycles=1, trace=128).trace
    table = {
        "feed_forward_nm": ideal.drive_torque_nm.tolist(),
        "feed_forward_phase": (np.arange(128) / 128).tolist(),
    }
    gains = {"kp_nm_per_rad": 2.0, "kd_nm_s_per_rad": 0.1}
    bare, fed = (moved(tracking(**gains, **more), 1.0).cycles * TURN - SPEED for more in ({}, table))
    assert abs(fed) < 1.0e-3 * abs(bare)


@pytest.mark.filterwarnings("ignore:.*the crank swings")
@pytest.mark.parametrize(("clearances", "off"), [((), 1.0e-8), (("B",), 1.0e-4)])
def test_the_work_of_the_drive_is_in_the_energy(clearances: tuple[str, ...], off: float) -> None:
    """With a limit that is reached, so that the torque is not that of a spring and a damper."""
    limited = tracking(kp_nm_per_rad=8.0, kd_nm_s_per_rad=1.0, feed_forward_nm=0.1, max_torque_nm=0.2)
    found = moved(limited, 0.5, clearances)
    assert found.drive_torque_nm.max == pytest.approx(0.2, rel=1.0e-12)
    assert abs(found.energy_j.residual) < off * abs(found.energy_j.work_in)


def test_a_simulation_counts_the_turns_it_made() -> None:
    """At a slow pace and with a stiff controller these are those asked for, but for the little it lags."""
    stiff = tracking(kp_nm_per_rad=300.0, kd_nm_s_per_rad=30.0)
    found = lw.simulate(stiff, clearances=(), cycles=2.0, trace=8)
    assert found.model == "full"
    assert found.cycles == pytest.approx(2.0, abs=1.0e-3)
    assert found.speed_rpm == pytest.approx(60.0 * SPEED / TURN, rel=1.0e-3)
    assert abs(found.energy_j.residual) < 1.0e-6
    assert len(found.trace.crank_angle_rad) == 16
    faster = lw.simulate(stiff, clearances=(), cycles=1.0, speed_rpm=90.0)
    assert faster.speed_rpm == pytest.approx(90.0, rel=1.0e-3)


def test_the_clearance_model_says_what_it_needs() -> None:
    message = r"leg.yaml: drive.track: the clearance model needs drive.speed; try --model full$"
    with pytest.raises(lw.ConfigError, match=message):
        lw.simulate(tracking(kp_nm_per_rad=1.0), model="clearance")


@pytest.mark.parametrize(
    ("track", "fault"),
    [
        ({"speed_radps": 0.0}, r"drive.track.speed_radps: 0.0 rad/s does not turn the crank"),
        ({"kp_nm_per_rad": -1.0}, r"drive.track.kp_nm_per_rad: -1.0 is not at least 0 N m/rad"),
        ({"max_torque_nm": 0.0}, r"drive.track.max_torque_nm: 0.0 is not above 0 N m"),
        ({"kp": 1.0}, r"drive.track.kp: unknown key"),
        ({"feed_forward_nm": "much"}, r"drive.track.feed_forward_nm: 'much' is not a number"),
        (
            {"feed_forward_nm": [1.0, 2.0]},
            r"drive.track.feed_forward_nm: has 2 torques for 1 phases. Expected one each",
        ),
        (
            {"feed_forward_nm": [1.0, 2.0], "feed_forward_phase": [0.5, 0.5]},
            r"drive.track.feed_forward_phase: \[0.5, 0.5\] does not increase",
        ),
    ],
)
def test_a_controller_that_cannot_be_is_refused(track: dict, fault: str) -> None:
    with pytest.raises(lw.ConfigError, match=fault):
        rotor(**track)


def test_one_kind_of_drive_at_a_time() -> None:
    with pytest.raises(lw.ConfigError, match=r"drive: has torque and track. Expected one of speed .*, track"):
        four_bar(track={"speed_radps": SPEED}, torque=1.0)
