"""Studies small enough for tests."""

from collections.abc import Callable
from typing import Any

import pytest

from leg_wear_monitor.studies.execution import parse_settings
from leg_wear_monitor.studies.plan import Study

ENSEMBLE = {"runs": 2, "cycles": 2, "skip_cycles": 1, "traced_cycles": 1}


@pytest.fixture(scope="session")
def tiny() -> Callable[..., Study]:
    """Settings of a study with a tiny ensemble."""

    def make(study: str, **keys: Any) -> Study:
        return parse_settings(study, {"ensemble": ENSEMBLE, **keys}, f"{study}.yaml")

    return make


@pytest.fixture(scope="session")
def sweep(tiny: Callable[..., Study]) -> Study:
    """Three points that take a moment."""
    return tiny("size", joints=["G"], clearances_m=[1.0e-4, 2.0e-4, 3.0e-4])
