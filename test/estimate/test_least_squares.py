"""Laws of the solver: minima that are known, bounds, points that cannot be, and scatter."""

from collections.abc import Callable

import numpy as np
import pytest

from leg_wear_monitor.estimate.least_squares import Point, gauss_newton, jackknife, solved
from leg_wear_monitor.mechanism.arrays import Floats


def rosenbrock(x: Floats) -> Point:
    rest = np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])
    return Point(rest, lambda: np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]]))


def linear(matrix: Floats, values: Floats) -> Callable[[Floats], Point]:
    return lambda x: Point(matrix @ x - values, lambda: matrix)


def test_a_curved_valley_is_followed_to_its_end() -> None:
    found = gauss_newton(rosenbrock, np.array([-1.2, 1.0]))
    np.testing.assert_allclose(found.x, 1.0, atol=1e-9)


def test_a_linear_model_has_its_solution_and_covariance_after_one_step() -> None:
    random = np.random.default_rng(5)
    matrix, values = random.standard_normal((40, 3)) * [1.0, 1.0e3, 1.0e-3], random.standard_normal(40)
    found = gauss_newton(linear(matrix, values), np.zeros(3))
    np.testing.assert_allclose(found.x, np.linalg.lstsq(matrix, values, rcond=None)[0], rtol=1e-9)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(matrix.T @ matrix), rtol=1e-9)


def test_bounds_hold_and_a_bounded_step_is_shorter() -> None:
    at = linear(np.eye(2), np.array([5.0, -5.0]))
    assert gauss_newton(at, np.zeros(2), low=-1.0, high=2.0).x.tolist() == [2.0, -1.0]
    one = gauss_newton(at, np.zeros(2), longest=0.5, done=0.6)  # so the first step is the last
    assert one.x.tolist() == [0.5, -0.5]


@pytest.mark.parametrize("seed", range(20))
def test_the_least_square_in_a_box_is_found_where_columns_are_correlated(seed: int) -> None:
    """By its law: downhill is inside only where it is out of the box."""
    random = np.random.default_rng(seed)
    matrix = random.standard_normal((40, 4)) @ (np.eye(4) + 0.9)
    at = linear(matrix, matrix @ random.uniform(-2.0, 2.0, 4) + random.standard_normal(40))
    found = gauss_newton(at, np.zeros(4), low=-1.0, high=1.0)
    downhill = -matrix.T @ found.point.rest
    inside = np.abs(found.x) < 1.0
    np.testing.assert_allclose(downhill[inside], 0.0, atol=1e-5)
    assert (downhill * found.x)[~inside].min(initial=0.0) >= 0.0


def test_a_point_that_cannot_be_is_not_gone_to() -> None:
    def at(x: Floats) -> Point:
        return Point(np.array([x[0] - 3.0 if x[0] < 2.0 else np.inf]), lambda: np.eye(1))

    assert 1.8 < gauss_newton(at, np.zeros(1)).x[0] < 2.0


def test_columns_of_any_size_are_solved_for_several_values_at_once() -> None:
    random = np.random.default_rng(6)
    matrix = random.standard_normal((20, 3)) * [1.0e-4, 1.0, 1.0e4]
    true = random.standard_normal((3, 2))
    np.testing.assert_allclose(solved(matrix, matrix @ true), true, rtol=1e-6)
    np.testing.assert_allclose(solved(matrix, matrix @ true[:, 0]), true[:, 0], rtol=1e-6)


def test_leaving_out_parts_gives_the_scatter_of_a_mean() -> None:
    values = np.random.default_rng(7).standard_normal(600)
    (sigma,) = jackknife(lambda some: np.array([values[some].mean()]), len(values), 600)
    assert sigma == pytest.approx(values.std(ddof=1) / np.sqrt(len(values)), rel=1e-6)
