"""A result of a simulation that nobody ran."""

import numpy as np
import pytest

from leg_wear_monitor import Impact, JointResult, SimulationResult, TorqueResult, Trace
from leg_wear_monitor.dynamics.result import ClearanceResult, WearDepth


@pytest.fixture
def result():
    """Joint A without clearance, B with; its second contact still lasts."""
    worn = JointResult(
        *(2.0, 3.0, 5.0, 7.0), 0.9, 0.1, 0.2, WearDepth(4e-9, 3e-9, 2e-9, 1e-9), (10.0, 90.0),
        ClearanceResult(3e-4, 3.1e-4),
    )  # fmt: skip
    return SimulationResult(
        mechanism="two",
        model="full",
        speed_rpm=60.0,
        cycles=1.0,
        simulated_s=1.0,
        drive_torque_nm=TorqueResult(*np.arange(7.0)),
        energy_j=None,
        toe=None,
        joints={"A": JointResult(1.0, 1.0, 1.0, 1.0), "B": worn},
        impacts={"B": (Impact(0.1, 0.01, 0.2, 30.0), Impact(0.5, 0.02, None, 40.0))},
        trace=Trace(np.arange(3.0), None, None, np.arange(3.0), {"A": np.ones(3), "B": np.zeros(3)}),
        clearance_joints=("B",),
    )
