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
