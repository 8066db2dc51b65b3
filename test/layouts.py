"""What the layouts for other tools name, and whether messages have it.

Foxglove's message paths, PlotJuggler's names of series (its plug-in ParserROS) and RViz's displays, as those
tools read them.
"""

import json
import re
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import attrs
from ruamel.yaml import YAML

from leg_wear_monitor import share_directory

FOXGLOVE, RVIZ, PLOTJUGGLER = "foxglove/leg.json", "rviz/leg.rviz", "plotjuggler/leg.xml"

DIAGNOSTICS, MARKERS = "diagnostic_msgs/msg/DiagnosticArray", "visualization_msgs/msg/MarkerArray"

_PART = re.compile(r"""\.(?P<name>\w+)|\[(?P<index>\d+|:)\]|\{(?P<key>\w+)=="(?P<value>[^"]*)"\}""")


@attrs.frozen
class Reference:
    """A topic that a layout names, the path in its messages, and the type that a panel needs, if only one."""

    panel: str
    topic: str
    path: str = ""
    type: str = ""


def foxglove() -> dict[str, Any]:
    return json.loads((share_directory() / FOXGLOVE).read_text(encoding="utf-8"))


def references_of(layout: dict[str, Any]) -> Iterator[Reference]:
    """What a layout of Foxglove names."""
    for name, panel in layout["configById"].items():
        kind = name.partition("!")[0]
        if kind == "3D":
            yield from (Reference(name, topic, type=MARKERS) for topic in panel["topics"])
        elif kind in ("DiagnosticStatusPanel", "DiagnosticSummary"):
            yield Reference(name, panel["topicToRender"], type=DIAGNOSTICS)
            if wanted := panel.get("selectedName"):
                yield Reference(name, panel["topicToRender"], f'.status[:]{{name=="{wanted}"}}.level')
                wanted = panel["selectedHardwareId"]
                yield Reference(name, panel["topicToRender"], f'.status[:]{{hardware_id=="{wanted}"}}.level')
        elif kind in ("Plot", "StateTransitions"):
            for one in panel["paths"]:
                topic, dot, path = one["value"].partition(".")
                yield Reference(name, topic, dot + path)
                if one["timestampMethod"] == "headerStamp":
                    yield Reference(name, topic, ".header.stamp.sec")
        else:
            raise AssertionError(f"no rule for panel {name}")


def values_at(message: Any, path: str) -> list[Any]:
    """Values at a message path; empty where a filter or an index finds nothing."""
    found, end = [message], 0
    for part in _PART.finditer(path):
        assert part.start() == end, path
        end = part.end()
        if part["name"]:
            found = [getattr(one, part["name"]) for one in found]
        elif part["index"] == ":":
            found = [element for one in found for element in one]
        elif part["index"]:
            found = [one[int(part["index"])] for one in found if int(part["index"]) < len(one)]
        else:
            found = [one for one in found if getattr(one, part["key"]) == part["value"]]
    assert end == len(path), path
    return found


def rviz() -> dict[str, Any]:
    text = (share_directory() / RVIZ).read_text(encoding="utf-8")
    return YAML(typ="safe", pure=True).load(text)["Visualization Manager"]


def rviz_references() -> Iterator[Reference]:
    for display in rviz()["Displays"]:
        assert display["Class"] == "rviz_default_plugins/MarkerArray", "no rule for this display"
        yield Reference(display["Name"], display["Topic"]["Value"], type=MARKERS)


def plotjuggler_curves() -> list[str]:
    root = ElementTree.parse(share_directory() / PLOTJUGGLER).getroot()
    curves = [curve.get("name", "") for curve in root.iterfind(".//DockArea/plot/curve")]
    assert len(curves) == sum(1 for _ in root.iter("curve"))
    return curves


def series_of(topic: str, message: Any) -> Iterator[str]:
    """Names of the numeric series that PlotJuggler makes of a message."""
    if hasattr(message, "effort"):
        for values in ("position", "velocity", "effort"):
            pairs = zip(message.name, getattr(message, values), strict=False)
            yield from (f"{topic}/{name}/{values}" for name, _ in pairs)
    elif hasattr(message, "status"):
        for one in message.status:
            place = "/".join(filter(None, (topic, one.hardware_id, one.name)))
            yield f"{place}/level"
            yield from (f"{place}/{value.key}" for value in one.values if value.key != "fault_code")
    elif hasattr(message, "wrench"):
        yield from (f"{topic}/wrench/{part}/{axis}" for part in ("force", "torque") for axis in "xyz")
    elif hasattr(message, "data"):
        yield f"{topic}/data"
