"""What all tests share: a search for counterexamples that repeats itself, and mechanisms made ready."""

from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from ruamel.yaml import YAML

from leg_wear_monitor import Mechanism, load_mechanism
from leg_wear_monitor.mechanism.position import Linkage, build_linkage
from leg_wear_monitor.share import share_directory

if find_spec("mcap") and find_spec("rosbags"):
    pytest_plugins = ["recordings"]
else:  # the extra `bags` is not installed
    collect_ignore_glob = ["bags/*", "messages/*", "playback/*"]

# the first example may wait for a compilation, so there is no deadline
settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def leg() -> Mechanism:
    """The default leg."""
    return load_mechanism("bionic_leg")


@pytest.fixture(scope="session")
def linkage_of() -> Callable[[str], Linkage]:
    """Linkage of a mechanism that comes with the package, by its name."""
    return cache(lambda name: build_linkage(load_mechanism(name)))


@pytest.fixture(scope="session")
def document() -> Callable[[str], Any]:
    """The plain mapping in the file of a mechanism that comes with the package, free to be changed."""

    def read(name: str) -> Any:
        return YAML(typ="safe", pure=True).load(share_directory() / "config" / "mechanisms" / f"{name}.yaml")

    return read


@pytest.fixture(scope="session")
def data() -> Path:
    """Directory of the reference data."""
    return Path(__file__).parent / "data"
