"""Layouts for other tools are whole: every panel has its place, and they are installed."""

import json
import re
import subprocess
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

from ruamel.yaml import YAML

from leg_wear_monitor import share_directory

FOXGLOVE, RVIZ, PLOTJUGGLER = "foxglove/leg.json", "rviz/leg.rviz", "plotjuggler/leg.xml"

# Okabe and Ito's, which colour-blind people can tell apart
COLOURS = {"#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00"}


def foxglove() -> dict[str, Any]:
    return json.loads((share_directory() / FOXGLOVE).read_text(encoding="utf-8"))


def topics_of(layout: dict[str, Any]) -> Iterator[str]:
    """Topics that a layout of Foxglove names."""
    for name, panel in layout["configById"].items():
        kind = name.partition("!")[0]
        if kind == "3D":
            yield from panel["topics"]
        elif kind in ("DiagnosticStatusPanel", "DiagnosticSummary"):
            yield panel["topicToRender"]
        else:
            assert kind in ("Plot", "StateTransitions"), f"no rule for panel {name}"
            yield from (one["value"].partition(".")[0] for one in panel["paths"])


def leaves(node):
    if isinstance(node, str):
        return [node]
    assert node["direction"] in ("row", "column") and 0 < node["splitPercentage"] < 100
    return leaves(node["first"]) + leaves(node["second"])


def test_every_panel_of_foxglove_s_layout_has_a_place_and_a_title():
    layout = foxglove()
    assert set(layout) == {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"}
    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"])
    titles = {panel["foxglovePanelTitle"] for panel in layout["configById"].values()}
    assert len(titles) == len(layout["configById"])


def test_colours_of_curves_can_be_told_apart_and_every_curve_has_a_name():
    for name, panel in foxglove()["configById"].items():
        if name.startswith("Plot!"):
            assert {one["color"].lower() for one in panel["paths"]} <= COLOURS
            assert len({one["label"] for one in panel["paths"]}) == len(panel["paths"])
            drawn = [(one["color"], one.get("showLine", True)) for one in panel["paths"]]
            assert len({*drawn}) == len(drawn)
    text = (share_directory() / PLOTJUGGLER).read_text(encoding="utf-8")
    assert {*re.findall(r'color="(.*?)"', text)} <= COLOURS


def test_rviz_asks_for_the_quality_of_service_that_markers_have():
    text = (share_directory() / RVIZ).read_text(encoding="utf-8")
    (display,) = YAML(typ="safe", pure=True).load(text)["Visualization Manager"]["Displays"]
    policies = display["Topic"]["Reliability Policy"], display["Topic"]["Durability Policy"]
    assert policies == ("Reliable", "Volatile")  # the node publishes them with the default of ROS


def test_the_page_tells_how_a_layout_becomes_that_of_another_namespace(tmp_path):
    page = (share_directory() / "docs" / "howto" / "tools.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"hardware id `left`:\n\n```\n(.*?)```", page, re.DOTALL)
    for name in (FOXGLOVE, PLOTJUGGLER):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_bytes((share_directory() / name).read_bytes())
    subprocess.run(["sh", "-euc", script], cwd=tmp_path, check=True)
    layout = json.loads((tmp_path / "left.json").read_text(encoding="utf-8"))
    topics = set(topics_of(layout))
    assert len(topics) > 20
    reference = (share_directory() / "docs" / "reference" / "ros.md").read_text(encoding="utf-8")
    own = {topic.removeprefix("/left/leg_wear_monitor/").split("/")[0] for topic in topics - {"/diagnostics"}}
    assert {name for name in own if f"`~/{name}" not in reference} == set()
    assert all(topic.startswith("/left/leg_wear_monitor/") for topic in topics - {"/diagnostics"})
    verdict = layout["configById"]["DiagnosticStatusPanel!verdict"]
    names = verdict["selectedHardwareId"], verdict["selectedName"]
    assert names == ("left", "left/leg_wear_monitor: verdict")
    curves = re.findall(r'curve name="(.*?)"', (tmp_path / "left.xml").read_text(encoding="utf-8"))
    assert "/diagnostics/left/left/leg_wear_monitor: verdict/level" in curves
    root = ElementTree.parse(share_directory() / PLOTJUGGLER).getroot()
    assert len(curves) == len(list(root.iterfind(".//DockArea/plot/curve")))
    assert all(curve.startswith(("/left/leg_wear_monitor/", "/diagnostics/left/left/")) for curve in curves)
