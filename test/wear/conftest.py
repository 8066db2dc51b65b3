"""One bushing for all tests of wear: radius 10 mm, clearance 0.3 mm, 15 mm wide."""

from collections.abc import Callable

import attrs
import pytest

from leg_wear_monitor import Mechanism
from leg_wear_monitor.contact.arrays import ContactArrays, compile_contacts


@pytest.fixture(scope="session")
def bushing(leg: Mechanism) -> Callable[[tuple[float, float]], ContactArrays]:
    """One clearance joint, by the wear coefficients of its bushing and its journal [1/Pa]."""
    size = {"bushing_radius": 0.010, "radial_clearance": 3.0e-4, "width": 0.015}

    def clearance_joints(wear_coefficient: tuple[float, float]) -> ContactArrays:
        settings = attrs.evolve(leg.clearances["G"], **size, wear_coefficient=wear_coefficient)
        return compile_contacts(leg, ["G"], [settings])

    return clearance_joints
