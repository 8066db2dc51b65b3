"""A configuration of the monitor by the names of its parameters, read from a file as a user writes it."""

import json
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any

import leg_wear_monitor as lw


def config_of(values: Mapping[str, Any] = MappingProxyType({})) -> lw.MonitorConfig:
    """Read these parameters; the others have their defaults."""
    with TemporaryDirectory() as home:
        path = Path(home) / "leg.yaml"
        text = json.dumps({"/**": {"ros__parameters": dict(values)}})
        path.write_text(text.replace("NaN", ".nan"))
        return lw.load_config(path)
