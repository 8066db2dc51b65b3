"""A result's JSON: its version, its fields, and the clock's values where they belong."""

import json

import pytest

pytestmark = pytest.mark.plain

HEAD = ["schema_version", "mechanism", "model", "speed_rpm", "cycles"]


def test_text_has_the_fields_of_the_object(result):
    record = json.loads(result.to_json())
    assert list(record)[:6] == [*HEAD, "simulated_s"]
    assert record["schema_version"] == 1
    assert record["joints"]["B"]["wear_zone_deg"] == [10.0, 90.0]
    assert record["impacts"]["B"][1]["end_s"] is None
    assert result.to_json().endswith("}\n")


def test_a_duration_adds_the_values_of_the_clock(result):
    record = json.loads(result.to_json(wall_s=0.5))
    assert list(record)[:8] == [*HEAD, "wall_s", "simulated_s", "real_time_factor"]
    assert (record.pop("wall_s"), record.pop("real_time_factor")) == (0.5, 2.0)
    assert record == json.loads(result.to_json())
