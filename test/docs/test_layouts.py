"""Layouts for other tools are whole: every panel has its place, and they are installed."""

import json
import re
import subprocess

import layouts

from leg_wear_monitor import share_directory

# Okabe and Ito's, which colour-blind people can tell apart
COLOURS = {"#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00"}


def leaves(node):
    if isinstance(node, str):
        return [node]
    assert node["direction"] in ("row", "column") and 0 < node["splitPercentage"] < 100
    return leaves(node["first"]) + leaves(node["second"])


def test_every_panel_of_foxglove_s_layout_has_a_place_and_a_title():
    layout = layouts.foxglove()
    assert set(layout) == {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"}
    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"])
    titles = {panel["foxglovePanelTitle"] for panel in layout["configById"].values()}
    assert len(titles) == len(layout["configById"])


def test_colours_of_curves_can_be_told_apart_and_every_curve_has_a_name():
    for name, panel in layouts.foxglove()["configById"].items():
        if name.startswith("Plot!"):
            assert {one["color"].lower() for one in panel["paths"]} <= COLOURS
            assert len({one["label"] for one in panel["paths"]}) == len(panel["paths"])
            drawn = [(one["color"], one.get("showLine", True)) for one in panel["paths"]]
            assert len({*drawn}) == len(drawn)
    text = (share_directory() / layouts.PLOTJUGGLER).read_text(encoding="utf-8")
    assert {*re.findall(r'color="(.*?)"', text)} <= COLOURS


def test_rviz_asks_for_the_quality_of_service_that_markers_have():
    (display,) = layouts.rviz()["Displays"]
    policies = display["Topic"]["Reliability Policy"], display["Topic"]["Durability Policy"]
    assert policies == ("Reliable", "Volatile")  # the node publishes them with the default of ROS


def test_the_page_tells_how_a_layout_becomes_that_of_another_namespace(tmp_path):
    page = (share_directory() / "docs" / "howto" / "tools.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"hardware id `left`:\n\n```\n(.*?)```", page, re.DOTALL)
    for name in (layouts.FOXGLOVE, layouts.PLOTJUGGLER):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_bytes((share_directory() / name).read_bytes())
    subprocess.run(["sh", "-euc", script], cwd=tmp_path, check=True)
    layout = json.loads((tmp_path / "left.json").read_text(encoding="utf-8"))
    topics = {one.topic for one in layouts.references_of(layout)}
    assert len(topics) > 20
    assert all(topic.startswith("/left/leg_wear_monitor/") for topic in topics - {"/diagnostics"})
    verdict = layout["configById"]["DiagnosticStatusPanel!verdict"]
    names = verdict["selectedHardwareId"], verdict["selectedName"]
    assert names == ("left", "left/leg_wear_monitor: verdict")
    curves = re.findall(r'curve name="(.*?)"', (tmp_path / "left.xml").read_text(encoding="utf-8"))
    assert "/diagnostics/left/left/leg_wear_monitor: verdict/level" in curves
    assert len(curves) == len(layouts.plotjuggler_curves())
    assert all(curve.startswith(("/left/leg_wear_monitor/", "/diagnostics/left/left/")) for curve in curves)
