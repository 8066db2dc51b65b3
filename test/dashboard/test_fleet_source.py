"""A fleet is shown as it was updated last; its legs' pages by their exact names, and no other file."""

import pytest
from made_up_fleet import made_up_fleet, made_up_leg, written_fleet
from made_up_summary import made_up_summary

from leg_wear_monitor.dashboard.fleet_source import FleetSource
from leg_wear_monitor.errors import ConfigError

pytestmark = pytest.mark.plain

NAMES = ["b", "c", "", ".", "..", "../..", "a/../..", "a\0", "/etc", "a.", "A", "%61"]


@pytest.fixture
def fleet(tmp_path):
    """Two updated legs, one with its summary; something beside them that is nobody's business."""
    written_fleet(tmp_path, "ab", made_up_leg("a"), made_up_leg("b"))
    (tmp_path / "out" / "summary.json").write_text(made_up_summary().to_json())
    return tmp_path


def write(directory, *legs):
    (directory / "out" / "fleet.json").write_text(made_up_fleet(legs).to_json())


def source_of(fleet):
    return FleetSource(fleet / "fleet.yaml", lambda: 1.8e9, {})


def test_it_is_renewed_when_it_was_updated(fleet):
    source = source_of(fleet)
    before = source.content()
    assert "legs/a/report.html" in before.html and "legs/b/report.html" not in before.html
    assert not source.renew()
    write(fleet, made_up_leg("a", used={"G": 1.2}), made_up_leg("b"), made_up_leg("gone"))
    assert source.renew()
    after = source.content()
    assert after.page != before.page
    assert "gone" not in after.html  # it is not in the description
    assert source.content().page == after.page


def test_a_broken_overview_is_said_and_the_page_stays(fleet):
    source = source_of(fleet)
    before = source.content()
    (fleet / "out" / "fleet.json").write_text("{")
    assert not source.renew()
    assert "is not JSON" in source.freshness().silence and source.freshness().age_s is None
    assert source.content().page == before.page
    with pytest.raises(ConfigError, match=r"is not JSON"):
        source_of(fleet)


@pytest.mark.parametrize("name", NAMES)
def test_only_the_exact_name_of_a_leg_leads_to_a_page(fleet, name):
    assert source_of(fleet).leg_page(name) is None


def test_the_pages_are_served(fleet, served):
    dashboard = served(source_of(fleet))
    code, headers, html = dashboard.ask("/")
    assert code == 200 and "connect-src 'self'" in headers["Content-Security-Policy"]
    assert "data-live=" in html
    code, headers, html = dashboard.ask("/legs/a/report.html")
    assert code == 200 and "Content-Security-Policy" in html
    for path in ("/legs/../summary.json", "/legs/%2e%2e/report.html", "/legs/a/summary.json", "/fleet.json",
                 "/legs/a%2f..%2fa/report.html", "/legs/b/report.html"):  # fmt: skip
        assert dashboard.ask(path)[0] == 404, path


def test_who_looks_learns_that_there_is_another_page(fleet, served):
    dashboard = served(source_of(fleet))
    with dashboard.events() as states:
        first = next(states)
        write(fleet, made_up_leg("a", used={"G": 1.2}), made_up_leg("b"))
        assert next(state for state in states if state["page"] != first["page"])["regions"] == {}
