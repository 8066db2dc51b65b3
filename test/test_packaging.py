"""What is installed: files below share/, dependencies for ROS, a lock that fits the constraints."""

import configparser
import re
import runpy
from pathlib import Path
from xml.etree import ElementTree

import pytest
import setuptools

ROOT = Path(__file__).parents[1]
EXTRAS = ("ros", "bags", "test", "lint", "dask", "dashboard")  # that `make` installs


def normal(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def pins(path):
    """Versions that a file of requirements pins, by name, with the number of hashes."""
    found = {}
    for line in path.read_text().splitlines():
        if match := re.match(r"([A-Za-z0-9._-]+)==(\S+)", line):
            name = normal(match[1])
            found[name] = [match[2], 0]
        elif "--hash=sha256:" in line:
            found[name][1] += 1
    return found


@pytest.fixture
def installed(monkeypatch):
    """Arguments of setup()."""
    arguments = {}
    monkeypatch.setattr(setuptools, "setup", lambda **given: arguments.update(given))
    monkeypatch.chdir(ROOT)
    runpy.run_path("setup.py")
    return arguments


def test_the_docs_that_help_names_are_installed(installed):
    files = {f"{place}/{Path(name).name}" for place, names in installed["data_files"] for name in names}
    fraction = "share/leg_wear_monitor"
    docs = f"{fraction}/docs"
    assert {f"{docs}/reference/parameters.md", f"{docs}/decisions/0001-packaging.md"} <= files
    assert f"{fraction}/rviz/leg.rviz" in files
    assert {
        f"{fraction}/LICENSE",
        f"{fraction}/SECURITY.md",
        f"{fraction}/README.md",
        f"{fraction}/launch/demo.launch.xml",
    } <= files


def test_the_citation_has_the_version_of_the_package():
    version = ElementTree.parse(ROOT / "package.xml").findtext("version")
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()


def test_ros2_launch_is_among_the_dependencies():
    package = ElementTree.parse(ROOT / "package.xml")
    needed = {element.text for element in package.findall("exec_depend")}
    assert {"launch", "launch_ros", "launch_xml", "ros2launch"} <= needed


@pytest.mark.parametrize("lock", ["requirements.lock", "requirements-build.lock", "requirements-docs.lock"])
def test_a_lock_pins_what_the_constraints_pin_and_by_hash(lock):
    constraints, locked = pins(ROOT / "constraints.txt"), pins(ROOT / lock)
    assert {name: pin[0] for name, pin in locked.items() if name in constraints} == {
        name: pin[0] for name, pin in constraints.items() if name in locked
    }
    assert all(hashes for _, hashes in locked.values())


def test_the_lock_has_all_that_make_installs():
    setup = configparser.ConfigParser()
    setup.read(ROOT / "setup.cfg")
    texts = [
        setup["options"]["install_requires"],
        *(setup["options.extras_require"][each] for each in EXTRAS),
    ]
    asked = [line for text in texts for line in text.splitlines() if line and not line.startswith("#")]
    names = {normal(re.match(r"[A-Za-z0-9._-]+", line)[0]) for line in asked}
    assert names <= set(pins(ROOT / "requirements.lock"))


def test_the_lock_of_the_site_has_what_it_is_built_with():
    asked = re.findall(r"^([a-z][a-z-]*)>=", (ROOT / "requirements-docs.in").read_text(), re.MULTILINE)
    assert asked and set(asked) <= set(pins(ROOT / "requirements-docs.lock"))


@pytest.mark.parametrize("lock", sorted(ROOT.glob("requirements*.lock")), ids=lambda path: path.name)
def test_a_lock_names_no_host(lock):
    assert not re.search(r"://|--(extra-)?index-url|--find-links|@ file", lock.read_text())
