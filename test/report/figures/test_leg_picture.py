"""The leg is drawn to scale, with all its joints, and its loose ones marked."""

import subprocess
import sys

import numpy as np
import pytest
from matplotlib.patches import Polygon

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.mechanism.position import build_linkage, ideal_motion, point_motion
from leg_wear_monitor.report.figure import VERMILION, png
from leg_wear_monitor.report.leg_picture import leg_picture

pytestmark = pytest.mark.plain


def letters(axes):
    """Texts beside the joints, with their colours."""
    return {text.get_text(): text.get_color() for text in axes.texts}


@pytest.mark.parametrize("name", ["bionic_leg", "klann_leg", "four_bar", "slider_crank", "andrews"])
def test_every_joint_is_lettered_and_the_loose_ones_in_their_colour(name):
    mechanism = load_mechanism(name)
    still, moving, _key = leg_picture(mechanism).axes
    marked = letters(still)
    assert set(marked) - {"toe"} == set(mechanism.joints)
    assert {joint for joint in mechanism.joints if marked[joint] == VERMILION} == set(
        mechanism.clearance_joints
    )
    for axes in (still, moving):
        assert axes.get_aspect() == 1.0


def test_the_caller_says_which_joints_are_loose():
    still = leg_picture(load_mechanism("bionic_leg"), clearance_joints=["C"]).axes[0]
    assert [joint for joint, colour in letters(still).items() if colour == VERMILION] == ["C"]


def test_bodies_stand_where_the_ideal_motion_has_them():
    leg, angle = load_mechanism("bionic_leg"), 0.0
    linkage = build_linkage(leg)
    motion = ideal_motion(linkage, [angle], 1.0)
    expected = {
        body: {
            tuple(point_motion(motion, linkage, body, point)[0][0].round(6)) for point in leg.points_of(body)
        }
        for body in leg.bodies
    }
    still = leg_picture(leg).axes[0]
    drawn = [
        {tuple(corner) for corner in patch.get_xy().round(6)}
        for patch in still.patches
        if isinstance(patch, Polygon)
    ]
    for corners in expected.values():
        assert corners in drawn


def test_the_toe_s_path_is_closed_and_within_the_picture():
    moving = leg_picture(load_mechanism("bionic_leg")).axes[1]
    path = max((line.get_xydata() for line in moving.lines), key=len)
    assert len(path) > 300
    assert np.array_equal(path[0], path[-1])
    low, high = np.array([moving.get_xlim(), moving.get_ylim()]).T
    assert (path > low).all()
    assert (path < high).all()


def test_the_same_picture_gives_the_same_bytes():
    first, second = (png(leg_picture(load_mechanism("four_bar"))) for _ in range(2))
    assert first == second
    assert first.startswith(b"\x89PNG")


def test_no_picture_needs_pyplot():
    code = (
        "import sys; import leg_wear_monitor.report.leg_picture; "
        "print([name for name in ('matplotlib.pyplot', 'tkinter') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
