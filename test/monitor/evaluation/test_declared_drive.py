"""A torque that is late as its drive is declared to be is as predicted."""

import attrs
import pytest

from leg_wear_monitor.monitor.config.fitting import largest_lag_s
from leg_wear_monitor.monitor.config.sections import DriveParameters
from leg_wear_monitor.monitor.config.settings import MonitorConfig

pytestmark = pytest.mark.plain


def test_a_declared_lag_and_low_pass_are_no_fault():
    config = MonitorConfig()
    own = config.drive_torque.max_lag_s
    assert largest_lag_s(config) == own
    late = attrs.evolve(config, drive=DriveParameters(lag_s=0.02, bandwidth_hz=50.0))
    assert largest_lag_s(late) == pytest.approx(own + 0.02 + 0.003183, abs=1e-6)
