"""Joints on worn walls, eight at once: the same as one by one."""

import numpy as np
import pytest

from leg_wear_monitor.compiled.kernel import entry
from leg_wear_monitor.compiled.vectors import WIDTH, padded, put_vector, vector_at
from leg_wear_monitor.dynamics.clearance.contact import FRESH_COEFFICIENT, take_directions, touch_worn_walls
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
from leg_wear_monitor.dynamics.joint import coefficient_at, penetration
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.position import TURN

pytestmark = pytest.mark.plain


@entry
def together(model, surfaces, now, turned, e, out):
    """Rows of out (6, room): what `touch_worn_walls` returns."""
    for k in range(0, out.shape[1], WIDTH):
        found = touch_worn_walls(model, surfaces, now, turned, k, vector_at(e, (0, k)), vector_at(e, (1, k)))
        put_vector(out, (0, k), found[0])
        put_vector(out, (1, k), found[1])
        put_vector(out, (2, k), found[2])
        put_vector(out, (3, k), found[3])
        put_vector(out, (4, k), found[4])
        put_vector(out, (5, k), found[5])


@entry
def one_by_one(model, surfaces, now, turned, e, directions, fresh, out):
    """The same columns of out (6, k), with directions [rad] of the eccentricities."""
    for k in range(directions.shape[0]):
        turn_b, turn_j = now.turn[k, 0], now.turn[k, 1]
        angle_b, angle_j = now.angle[k, 0] + turn_b * turned, now.angle[k, 1] + turn_j * turned
        delta, nx, ny, bushing, journal, cam_b, cam_j = penetration(
            model.contacts, surfaces, k, e[0, k], e[1, k], directions[k], angle_b, angle_j
        )
        out[0, k], out[1, k], out[2, k] = delta, nx, ny
        out[3, k], out[4, k] = cam_b * turn_b + cam_j * turn_j, bushing - journal
        out[5, k] = coefficient_at(model.contacts, k, bushing, journal) if delta > 0.0 else fresh[k]


@pytest.mark.parametrize("law", ["hu-guo", "winkler"])
@pytest.mark.parametrize("joints", ["B", "ABCDEFGHIJ"])
def test_eight_at_once_are_eight_one_by_one(leg, law, joints):
    """Walls worn at random, journals inside and outside; directions from the reference and by arc tangent."""
    random, k = np.random.default_rng(len(joints)), len(joints)
    setup = prepare(leg, clearances=tuple(joints), wear=True, normal_law=law)
    stepper = ClearanceStepper(setup)
    setup.surfaces.depth[:] = 1.0e-5 * random.random(setup.surfaces.depth.shape)
    now, turned = stepper.work.now, 0.003
    now.angle[:], now.turn[:] = random.normal(size=(2, k, 2))
    directions = random.uniform(-0.5 * TURN, 0.5 * TURN, k)
    size = setup.contacts.clearance + np.where(np.arange(k) % 2 == 0, 4.0e-5, -1.0e-5)
    e = np.zeros((2, padded(k)))
    e[:, :k] = size * np.cos(directions), size * np.sin(directions)
    found, wanted = np.zeros((6, padded(k))), np.zeros((6, k))
    fresh = stepper.model.law[FRESH_COEFFICIENT]
    one_by_one(stepper.model, setup.surfaces, now, turned, e, directions, fresh, wanted)
    assert (wanted[0, ::2] > 0.0).all() and not (wanted[0, 1::2] > 0.0).any()
    scale = np.abs(wanted).max(axis=1, keepdims=True) + 1.0e-30
    for off in (0.05, 2.0):  # rad, from where the journals were before: near it, and far away
        before = size * [np.cos(directions + off), np.sin(directions + off)]
        take_directions(before.T.ravel(), now.toward)
        together(stepper.model, setup.surfaces, now, turned, e, found)
        np.testing.assert_allclose(found[:, :k] / scale, wanted / scale, atol=1.0e-6)
        assert np.isfinite(found).all()  # joints that are not there neither
