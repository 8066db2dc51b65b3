"""An error says the same on either side of a process."""

import pickle

import pytest

from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.errors import AssemblyError, ConfigError, LegWearError, SimulationError

pytestmark = pytest.mark.plain


@pytest.mark.parametrize(
    "error",
    [
        ConfigError("leg.yaml", "joints.A", "found 2, expected 1"),
        ConfigError("leg.yaml", "", "is empty"),
        RecordingError("walk.mcap", "", "is cut off"),
        AssemblyError("dead point"),
        SimulationError("pushed through"),
        LegWearError("disk full"),
    ],
    ids=str,
)
def test_an_error_survives_the_way_from_a_worker(error):
    arrived = pickle.loads(pickle.dumps(error))
    assert type(arrived) is type(error)
    assert (str(arrived), vars(arrived)) == (str(error), vars(error))
