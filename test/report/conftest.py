"""Pages of studies small enough for tests."""

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest
from matplotlib import pyplot

import leg_wear_monitor as lw
from leg_wear_monitor.studies.execution import parse_settings, run_study
from leg_wear_monitor.studies.results import StudyResults, load_results

ENSEMBLE = {"runs": 2, "cycles": 2, "skip_cycles": 1, "traced_cycles": 1}
DIAGRAM = {"clearances_m": [2.0e-4, 3.0e-4], "speeds_rpm": [20, 60], "cycles": 4, "skip_cycles": 1}

TINY = {
    "size": {"joints": ["G"], "clearances_m": [1.0e-4, 2.0e-4, 3.0e-4, 4.0e-4]},
    "speed": {"joints": ["G"], "speeds_rpm": [45, 60]},
    "location": {"sets": [["A", "B"], ["G"]]},
    "multi": {"sets": [["G"], ["I", "J"]]},
    "laws": {
        "joints": ["G"], "normal_laws": ["hertz", "flores"], "friction_laws": ["none"],
        "friction_coefficients": [0.1],
    },
    "load": {
        "joints": ["G"], "loads_n": [0, 300],
        "life": {"opens_m": 5.0e-6, "jump_m": 1.0e-5, "cycles": 2, "runs": 2},
        "exponent": {"runs": 2, "cycles": 10, "renewals": 16},
    },
    "legs": {"legs": 1, "draw_seed": 3},
    "wear": {
        "sets": [["I", "J"]],
        "life": {"opens_m": 5.0e-6, "jump_m": 1.0e-5, "cycles": 2, "runs": 2},
    },
    "chaos": {
        "joints": ["A", "B"], "others": [["G"]], "section_cycles": 6,
        "exponent": {"runs": 2, "cycles": 10, "renewals": 16}, "bifurcation": DIAGRAM,
    },
}  # fmt: skip


@pytest.fixture(scope="session")
def study(tmp_path_factory) -> Callable[[str], StudyResults]:
    """Results of a tiny study, by its name; computed when first asked for."""

    def results(name: str) -> StudyResults:
        out: Path = tmp_path_factory.mktemp(name)
        run_study(name, parse_settings(name, {"ensemble": ENSEMBLE, **TINY[name]}, name), out)
        return load_results(out)

    return cache(results)


@pytest.fixture
def closed() -> Iterator[None]:
    """Pyplot keeps its figures until they are closed."""
    yield
    pyplot.close("all")


@pytest.fixture(scope="session")
def knocking() -> lw.ReplayResult:
    """Replay of a leg whose knee breaks out."""
    bag = lw.share_directory() / "bags" / "knocking"
    return lw.replay(f"{bag}.mcap", f"{bag}.yaml")
