"""A ROS parameter file of what differs from the defaults, as `config/monitor.yaml` is one of the defaults."""

from collections.abc import Sequence
from io import StringIO
from typing import Any

from ruamel.yaml import YAML

from leg_wear_monitor.errors import printable
from leg_wear_monitor.monitor.config.parameter_file import MARK
from leg_wear_monitor.monitor.config.parameters import PARAMETERS, values_of
from leg_wear_monitor.monitor.config.settings import MonitorConfig

_HEAD = (
    "Parameters of the monitor, proposed by `leg-wear-monitor commission`; others have their defaults.",
    "crank angle = sign * position / gear_ratio + offset_rad",
    "torque on the crank = sign * scale * gear_ratio * value",
)
_ALWAYS = ("mechanism", "crank_joint", "crank.", "drive_torque.", "cadence.")


def parameter_text(config: MonitorConfig, remarks: Sequence[str]) -> str:
    """Text of a parameter file, with remarks as comments at its head."""
    head = "".join(f"# {printable(line)}\n" for line in (*_HEAD, *remarks))
    tree: dict[str, Any] = {}
    for name, value in values_of(config).items():
        if value == () or (value == PARAMETERS[name].default and not name.startswith(_ALWAYS)):
            continue
        *sections, last = name.split(".")
        place = tree
        for section in sections:
            place = place.setdefault(section, {})
        place[last] = list(value) if isinstance(value, tuple) else value
    stream = StringIO()
    yaml: Any = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False
    yaml.dump({"/**": {MARK: tree}}, stream)
    return head + stream.getvalue()
