"""Reads fleet.json."""

import json
import reprlib
from pathlib import Path
from typing import Any

from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.fleet.overview.parts import SCHEMA_VERSION, FleetOverview

FILE = "fleet.json"


def load_overview(path: str | Path) -> FleetOverview:
    """Read the overview of a fleet.

    Parameters
    ----------
    path : str or pathlib.Path
        ``fleet.json``, or the directory of the fleet.

    Raises
    ------
    ConfigError
        If there is none, or it has another version; it names the key at fault.
    """
    place = Path(path) / FILE if Path(path).is_dir() else Path(path)
    try:
        record = json.loads(place.read_bytes())
    except OSError as error:
        raise ConfigError(str(place), "", f"cannot be read: {error.strerror}; run fleet update") from error
    except ValueError as error:
        raise ConfigError(str(place), "", "is not JSON; run fleet update again") from error
    return overview_of(record, str(place))


def overview_of(record: Any, source: str) -> FleetOverview:
    """The overview of a plain object, as `FleetOverview.to_dict` gives it."""
    record = structure(record, dict[str, Any], source, "")
    version = record.get("schema_version")
    if version != SCHEMA_VERSION:
        fault = f"{reprlib.repr(version)} is not {SCHEMA_VERSION}, the version that this command reads"
        raise ConfigError(source, "schema_version", f"{fault}; run fleet update again")
    parts = {name: part for name, part in record.items() if name != "schema_version"}
    overview: FleetOverview = structure(parts, FleetOverview, source, "")
    return overview
