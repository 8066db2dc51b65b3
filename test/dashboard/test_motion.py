"""The moving leg: frames for those who look, and for nobody else."""

import http.client
import json
import math

import pytest
from heard_leg import walk
from live_browser import wait_for

from leg_wear_monitor.messages.leg_motion import JointMotion, MotionFrame

pytestmark = pytest.mark.plain


def frame(angle_rad=1.0, place=(3.0e-4, 0.0), force_n=100.0):
    return MotionFrame(1, angle_rad, {"A": JointMotion(place, force_n, 250.0)}).to_json()


def test_nothing_is_kept_while_nobody_looks(leg):
    leg.take_motion(frame())
    assert leg.motion.after(0) == []


def test_a_frame_is_drawn_in_clearances_with_y_downwards(leg):
    walk(leg, 20)
    leg.motion.viewers = 1
    leg.take_motion(frame(math.pi / 2, (0.0, 3.0e-4)))
    ((_, text),) = leg.motion.after(0)
    shown = json.loads(text)
    assert shown["angle"] == 90.0
    joint = shown["joints"]["A"]
    assert joint["e"][0] == 0.0 and joint["e"][1] < 0.0
    assert joint["f"] == [0.0, 100.0]  # the bushing pushes the pin back
    assert joint["hit"] == 250.0 and 0.0 < joint["gap"] <= 0.85


def test_a_viewer_has_each_frame_once_and_begins_with_the_last(leg):
    leg.motion.viewers = 1
    for number in range(5):
        leg.take_motion(frame(0.1 * number))
    (last,) = leg.motion.after(0)
    assert json.loads(last[1])["angle"] == pytest.approx(22.9)
    leg.take_motion(frame(0.5))
    assert [number for number, _ in leg.motion.after(last[0])] == [last[0] + 1]


@pytest.mark.parametrize("text", ["", "{}", '{"stamp_ns":1}', frame().replace("A", "<script>")])
def test_what_is_no_frame_of_this_leg_is_not_shown(leg, text):
    leg.motion.viewers = 1
    leg.take_motion(text)
    assert all(json.loads(shown)["joints"] == {} for _, shown in leg.motion.after(0))


def test_frames_go_to_who_asks_and_the_viewer_is_forgotten(leg, served):
    dashboard = served(leg)
    connection = http.client.HTTPConnection("127.0.0.1", dashboard.port, timeout=30)
    connection.request("GET", "/motion")
    answer = connection.getresponse()
    assert answer.status == 200 and leg.motion.viewers == 1
    leg.take_motion(frame())
    lines = [answer.readline().decode().strip() for _ in range(2)]
    assert lines[0] == "event: frame" and json.loads(lines[1].removeprefix("data: "))["angle"] == 57.3
    answer.close()
    connection.close()
    leg.take_motion(frame(2.0))
    wait_for(lambda: leg.motion.viewers == 0, "nobody to look")


def test_the_page_has_the_leg_that_frames_move(leg):
    content = leg.content()
    assert 'id="leg-slider"' in content.regions["motion"]
    assert "No whole gait cycle since this page was opened." in content.regions["motion"]  # of its torque
    assert "<style" not in content.regions["motion"]  # the page's policy has its own style only
    assert "EventSource" in content.html and "prefers-reduced-motion" in content.html
