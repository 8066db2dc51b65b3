"""Wear is drawn with its unit, the zone that holds nine tenths of it, and the factor of exaggeration."""

import re

import numpy as np
import pytest

from leg_wear_monitor.report.figure import worn_bushings
from leg_wear_monitor.wear import BUSHING, JOURNAL, Surfaces

pytestmark = pytest.mark.plain

N, RADIUS_M = 720, 0.010
POWERS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹", "0123456789")


@pytest.fixture
def surfaces():
    """Two joints: one worn over sectors 100 to 199, a tenth as deep on the journal; one not at all."""
    depth = np.zeros((2, 2, N))
    depth[0, BUSHING, 100:200] = 4.0e-9
    depth[0, JOURNAL, 300:400] = 4.0e-10
    return Surfaces(depth, 0)


def draw(surfaces):
    return worn_bushings(surfaces, ("A", "B"), (RADIUS_M, RADIUS_M), 6.0)


def by_title(figure, start):
    return next(axes for axes in figure.axes if axes.get_title().startswith(start))


def test_the_factor_stated_is_the_one_drawn(surfaces):
    section = by_title(draw(surfaces), "A")
    stated = re.search(r"depth × ([\d.]+)·10([⁰¹²³⁴⁵⁶⁷⁸⁹]+)", section.get_title())
    factor = float(stated[1]) * 10.0 ** int(stated[2].translate(POWERS))
    bushing, journal = (line.get_ydata() for line in section.lines[:2])
    # radii are drawn in units of the bushing's
    assert np.ptp(bushing) * RADIUS_M == pytest.approx(factor * 4.0e-9, rel=0.05)
    assert np.ptp(journal) * RADIUS_M == pytest.approx(factor * 4.0e-10, rel=0.05)
    assert bushing.max() > bushing[0]
    assert journal.min() < journal[0]


def test_depth_is_unrolled_over_the_angle_in_a_fitting_unit(surfaces):
    unrolled = next(axes for axes in draw(surfaces).axes if axes.get_ylabel().startswith("depth"))
    assert unrolled.get_ylabel() == "depth [nm]"
    angle, depth = unrolled.lines[0].get_data()
    assert depth.max() == pytest.approx(4.0)
    worn = angle[(depth > 0.0) & (angle > 0.0) & (angle < 360.0)]  # three turns are drawn, one is shown
    assert unrolled.get_xlim() == (0.0, 360.0)
    assert (worn[0], worn[-1]) == pytest.approx((50.25, 99.75))


def test_the_zone_holds_nine_tenths(surfaces):
    arc = by_title(draw(surfaces), "A").lines[2].get_xdata()
    assert np.rad2deg(arc[-1] - arc[0]) == pytest.approx(0.9 * 50.0, abs=360.0 / N)


def test_a_zone_across_zero_is_shaded_on_both_sides():
    depth = np.zeros((1, 2, N))
    depth[0, BUSHING, [*range(20), *range(N - 20, N)]] = 1.0e-9
    figure = worn_bushings(Surfaces(depth, 0), ("A",), (RADIUS_M,), 1.0)
    unrolled = next(axes for axes in figure.axes if axes.get_ylabel().startswith("depth"))
    assert len(unrolled.patches) == 2


def test_a_joint_without_wear_says_so(surfaces):
    figure = draw(surfaces)
    assert by_title(figure, "B").get_title() == "B\nno wear"
    assert "Wear after 6 gait cycles" in [text.get_text() for text in figure.texts]
