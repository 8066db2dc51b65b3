"""The studies by name, and their settings from YAML files."""

from pathlib import Path
from typing import Any

from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.loader import read_yaml
from leg_wear_monitor.share import share_directory
from leg_wear_monitor.studies.plan.kinds.chaos import Chaos
from leg_wear_monitor.studies.plan.kinds.laws import Laws
from leg_wear_monitor.studies.plan.kinds.legs import Legs
from leg_wear_monitor.studies.plan.kinds.load import Load
from leg_wear_monitor.studies.plan.kinds.location import Location
from leg_wear_monitor.studies.plan.kinds.lubrication import Lubrication
from leg_wear_monitor.studies.plan.kinds.multi import Multi
from leg_wear_monitor.studies.plan.kinds.size import Size
from leg_wear_monitor.studies.plan.kinds.speed import Speed
from leg_wear_monitor.studies.plan.kinds.wear import Wear
from leg_wear_monitor.studies.plan.study import Study

STUDIES: dict[str, type[Study]] = {
    "size": Size,
    "speed": Speed,
    "location": Location,
    "wear": Wear,
    "multi": Multi,
    "chaos": Chaos,
    "laws": Laws,
    "lubrication": Lubrication,
    "load": Load,
    "legs": Legs,
}


def shipped_study(name: str) -> Path:
    """Description of a study that comes with the package."""
    return share_directory() / "config" / "studies" / f"{name}.yaml"


def load_settings(name: str, path: str | Path | None = None) -> Study:
    """Read the description of a study.

    Parameters
    ----------
    name : str
        A key of `STUDIES`.
    path : str or pathlib.Path, optional
        File of the description; default: the one shipped with the package.

    Raises
    ------
    ConfigError
        If a value is invalid; the message names file, key, value, unit and expectation.
    """
    if name not in STUDIES:
        raise ConfigError("study", "", f"{name!r} is not one of {', '.join(STUDIES)}")
    place = shipped_study(name) if path is None else Path(path)
    source = place.name if path is None else str(path)
    return parse_settings(name, read_yaml(place, source), source)


def parse_settings(name: str, document: Any, source: str) -> Study:
    """Convert the plain mapping of a study's file to typed settings; see `load_settings`."""
    settings: Study = structure(document, STUDIES[name], source, "")
    return settings
