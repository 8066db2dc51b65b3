"""The layout of RViz fits the topic that it names."""

from ruamel.yaml import YAML

from leg_wear_monitor import share_directory


def test_rviz_asks_for_the_quality_of_service_that_markers_have():
    text = (share_directory() / "rviz" / "leg.rviz").read_text(encoding="utf-8")
    (display,) = YAML(typ="safe", pure=True).load(text)["Visualization Manager"]["Displays"]
    policies = display["Topic"]["Reliability Policy"], display["Topic"]["Durability Policy"]
    assert policies == ("Reliable", "Volatile")  # the node publishes them with the default of ROS
