"""A trace is drawn as it is: every sample, over the turns of the crank."""

import numpy as np
import pytest

from leg_wear_monitor import Trace
from leg_wear_monitor.report.figure import force_traces

pytestmark = pytest.mark.plain


def test_every_panel_shows_its_samples_over_the_turns():
    turns = np.linspace(0.0, 2.0, 9)
    trace = Trace(
        crank_angle_rad=2.0 * np.pi * turns,
        toe_x_m=None,
        toe_y_m=None,
        drive_torque_nm=np.arange(9.0),
        force_n={"A": np.full(9, 10.0), "B": np.array([0.0, 5.0] * 4 + [0.0])},
    )
    torque, free, flying = force_traces(trace, ["A", "B"]).axes
    assert [axes.get_ylabel() for axes in (torque, free, flying)] == ["drive\n[N m]", "A\n[N]", "B\n[N]"]
    assert torque.lines[0].get_xdata() == pytest.approx(turns)
    assert list(torque.lines[0].get_ydata()) == list(range(9))
    assert list(free.lines[0].get_ydata()) == [10.0] * 9
    # a journal in flight stands at the axis' foot, and not at minus infinity
    assert list(flying.lines[0].get_ydata()) == [0.1, 5.0] * 4 + [0.1]
