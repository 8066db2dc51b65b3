"""What setup.cfg cannot say: the version, which package.xml holds, and the files below share/."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import setup

FRACTION = "share/leg_wear_monitor"
# What builds the pages below docs/ is no page, and what the site's build writes there comes and goes.
SITE = ("docs/conf.py", "docs/_", "docs/lessons/")
TOPS = ("bags", "config", "docs", "examples", "launch", "rviz", "security")


def share_files() -> list[tuple[str, list[str]]]:
    """Every file below the top-level data directories, with the directory it is installed to."""
    found: dict[str, list[str]] = {}
    for top in TOPS:
        for path in sorted(Path(top).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts and not path.as_posix().startswith(SITE):
                found.setdefault(f"{FRACTION}/{path.parent.as_posix()}", []).append(path.as_posix())
    return list(found.items())


setup(
    version=ElementTree.parse("package.xml").findtext("version"),
    # In setup.cfg this would become an object that colcon, which reads the repr of all this, cannot read.
    python_requires=">=3.11",
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/leg_wear_monitor"]),
        # These pages name files below docs/, and each other.
        (
            FRACTION,
            [
                "CODE_OF_CONDUCT.md",
                "CONTRIBUTING.md",
                "LICENSE",
                "QUALITY_DECLARATION.md",
                "README.md",
                "SECURITY.md",
                "package.xml",
            ],
        ),
        *share_files(),
    ],
)
