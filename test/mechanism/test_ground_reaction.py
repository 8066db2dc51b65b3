"""The ground under the toe: a template of stance, and when a leg stands."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.person import (
    FORE_AFT,
    nominal_stance,
    stance_template,
    upwards,
    with_toe_force,
)
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle, point_motion
from leg_wear_monitor.mechanism.spec import SpeedDrive, Track, TrackDrive

POINTS = 1024


def test_template_has_the_two_peaks_and_the_valley_of_walking():
    s = np.linspace(0.0, 1.0, 1001)
    vertical, along = stance_template(s)
    assert vertical.max() == pytest.approx(1.0, abs=1e-5)
    assert vertical[[0, -1]] == pytest.approx(0.0, abs=1e-12)
    rising = np.flatnonzero((np.diff(vertical)[:-1] > 0.0) & (np.diff(vertical)[1:] <= 0.0))
    assert len(rising) >= 2
    assert vertical[450:550].min() < 0.8
    assert np.mean(along) == pytest.approx(0.0, abs=1e-12)
    assert stance_template(np.array([1.01]))[0] == 0.0


@pytest.mark.parametrize("name", ["bionic_leg", "jansen_leg", "klann_leg"])
def test_the_foot_brakes_then_pushes_while_the_toe_moves_backwards(name):
    linkage = build_linkage(load_mechanism(name))
    stance = nominal_stance(linkage)
    force = stance.force(points=POINTS)
    position, velocity, _ = point_motion(one_cycle(linkage, POINTS, 1.0), linkage, *linkage.mechanism.toe)
    vertical, along = force @ stance.up, force @ stance.back
    in_stance = vertical > 0.0
    assert (velocity[in_stance] @ stance.back > 0.0).all()
    assert in_stance[(position @ stance.up).argmin()]
    assert vertical.max() == pytest.approx(1.0, abs=1e-3)
    assert along.max() == pytest.approx(FORE_AFT, rel=1e-2)
    soon = round(stance.heel_strike * POINTS) + np.arange(1, POINTS // 10)
    assert (along[soon % POINTS] > 0.0).all()


@pytest.mark.parametrize(
    "drive",
    [
        SpeedDrive(body="crank", speed=-TURN),
        TrackDrive(body="crank", track=Track(speed_radps=-TURN, kp_nm_per_rad=4000.0)),
    ],
)
def test_reversed_the_leg_walks_the_other_way(drive):
    mechanism = load_mechanism("bionic_leg")
    back = attrs.evolve(mechanism, drive=drive)
    there, other = (nominal_stance(build_linkage(one)) for one in (mechanism, back))
    assert (other.heel_strike, other.toe_off) == (there.toe_off, there.heel_strike)
    assert other.back == pytest.approx(-there.back)


def test_a_toe_force_adds_a_load_once():
    mechanism = load_mechanism("bionic_leg")
    force = np.outer(np.ones(4), upwards(mechanism))
    once = with_toe_force(mechanism, force)
    assert with_toe_force(once, 2.0 * force).loads.keys() == once.loads.keys()
    with pytest.raises(ConfigError, match="toe"):
        with_toe_force(load_mechanism("slider_crank"), force)
