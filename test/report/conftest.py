"""Pages of studies small enough for tests."""

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest
from matplotlib import pyplot

import leg_wear_monitor as lw
from leg_wear_monitor.studies.run import StudyResults, load_results, run_study
from leg_wear_monitor.studies.study import parse_study

SMALL = {
    "ensemble": {"runs": 2, "cycles": 2, "skip_cycles": 1, "traced_cycles": 1},
    "exponent": {"runs": 2, "cycles": 10, "renewals": 16},
    "section": {"cycles": 4, "skip_cycles": 1},
    "portrait": {"cycles": 6, "skip_cycles": 1, "portrait_cycles": 2},
}
TINY = {
    "size": [{"clearance_m": [1.0e-4, 2.0e-4, 3.0e-4, 4.0e-4]}],
    "speed": [{"speed_rpm": [45, 60]}],
    "location": [{"clearances": [["A", "B"], ["G"]]}],
    "multi": [
        {"clearances": [["A", "B"], ["G"], ["I", "J"], ["A", "B", "I", "J"], ["A", "B", "G", "I", "J"]]}
    ],
    "laws": [{"normal_law": ["hertz", "flores"]}, {"friction": ["none"]}, {"friction_coefficient": [0.1]}],
    "load": [{"ground_n": [0, 300], "keep": ["response", "exponent"]}],
    "wear": [{"clearances": [["I", "J"]]}],
    "chaos": [
        {"keep": ["response", "portrait"]},
        {"clearances": [["A", "B"], ["G"]], "keep": ["exponent"]},
        {"clearance_m": [2.0e-4, 3.0e-4], "keep": ["section"]},
        {"speed_rpm": [20, 60], "keep": ["section"]},
    ],
}


@pytest.fixture(scope="session")
def study(tmp_path_factory) -> Callable[[str], StudyResults]:
    """Results of a tiny study, by its name; computed when first asked for."""

    def results(name: str) -> StudyResults:
        out: Path = tmp_path_factory.mktemp(name)
        document = {"title": name, "question": f"{name}?", "clearances": ["G"], "sweeps": TINY[name], **SMALL}
        run_study(parse_study(document, name), out)
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
