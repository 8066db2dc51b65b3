"""A study's page says what its data say: numbers, conclusions, and what is missing."""

import re
from functools import cache

import attrs
import numpy as np
import pytest
from matplotlib.figure import Figure

from leg_wear_monitor.report.page import Sentences, Table
from leg_wear_monitor.report.study import findings
from leg_wear_monitor.report.study import page as pages
from leg_wear_monitor.report.study.page import study_page
from leg_wear_monitor.report.study.text import number, with_spread, zone_text
from leg_wear_monitor.studies.kinds import STUDIES
from leg_wear_monitor.studies.plan import DEPTH, Spread, power_law, spread


@pytest.fixture(scope="module", autouse=True)
def page_of(study):
    """The page of a study by its name; pictures are made but not painted."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda *_, **__: None)
        yield cache(lambda name: study_page(study(name)))


def parts(page, kind):
    return [part for section in page.sections for part in section.parts if isinstance(part, kind)]


def conclusions(page):
    return "\n".join(parts(page, Sentences)[0].sentences)


def slow_if(is_slow):
    return [pytest.mark.slow] if is_slow else []


# the points of these are computed as those of the study size are, and more of them
MORE = {"laws", "location", "speed"}


@pytest.mark.parametrize("name", [pytest.param(name, marks=slow_if(name in MORE)) for name in STUDIES])
def test_every_page_has_configuration_versions_conclusions_and_units(page_of, name):
    page = page_of(name)
    assert "mechanism: bionic_leg" in page.configuration
    assert {"leg_wear_monitor", "code", "seed"} <= set(page.versions)
    assert parts(page, Sentences)
    for table in parts(page, Table):
        assert any("[" in cell for cell in table.head), table.caption
        assert all(len(row) == len(table.head) for row in table.rows)
    assert "nan" not in "".join(cell for table in parts(page, Table) for row in table.rows for cell in row)


def test_conclusions_are_computed_from_the_data(study, page_of):
    """Doubling an error doubles what is said of it, whatever that is."""
    results = study("size")
    text = conclusions(page_of("size"))
    before = float(re.search(r"toe displacement error goes from ([\d.]+)", text).group(1))
    doubled = tuple(
        {**arrays, "error_toe_position_m": 2.0 * arrays["error_toe_position_m"]} for arrays in results.arrays
    )
    text = conclusions(study_page(attrs.evolve(results, arrays=doubled)))
    after = float(re.search(r"toe displacement error goes from ([\d.]+)", text).group(1))
    assert after == pytest.approx(2.0 * before, rel=0.02)


def test_a_superposition_is_called_one_only_where_it_is(study):
    *alone, (_, whole) = study("multi").of("response")
    summed = {
        **whole,
        **{
            name: sum(arrays[name] for _, arrays in alone)
            for name in whole
            if name.startswith("error_")
        },
    }  # fmt: skip
    assert findings.superposition(alone, summed).startswith("All at once is the sum of the places alone")
    halved = {**summed, "error_toe_velocity_mps": 0.5 * summed["error_toe_velocity_mps"]}
    assert findings.superposition(alone, halved).startswith("All at once is not the sum")


def test_wear_that_is_not_counted_is_not_reported_as_none(study):
    """Without wear coefficients depths are 0 while surfaces rub: a ratio of them is a dash."""
    responses = study("multi").of("response")
    unworn = [(point, {**arrays, DEPTH: 0.0 * arrays[DEPTH]}) for point, arrays in responses]
    *alone, (_, whole) = unworn
    text = "\n".join(findings.several_at_once(alone, whole))
    assert text.count("greatest depth × –") == 3
    (point, life), *_ = study("wear").of("life")
    held = {**life, "rate_m_per_cycle": life["rate_m_per_cycle"].copy()}
    held["rate_m_per_cycle"][:, :, 1] = 0.0
    assert ", J × –; largest" in findings.lives([(point, held)])[0]


def test_a_study_without_a_page_of_its_own_shows_its_points(study, page_of, monkeypatch):
    monkeypatch.delitem(pages._PAGES, "multi")
    found, own = study_page(study("multi")), page_of("multi")
    assert [section.title for section in found.sections] == [section.title for section in own.sections]


def test_points_that_failed_or_are_missing_come_first(study):
    results = study("size")
    arrays = ({"fault": np.array("pushed through")}, {}, *results.arrays[2:])
    page = study_page(attrs.evolve(results, arrays=arrays))
    assert page.sections[0].title == "Missing points"
    assert "0.1 mm: pushed through" in conclusions(page)
    assert "Not computed yet: 0.2 mm." in conclusions(page)
    nothing = study_page(attrs.evolve(results, arrays=({},) * len(results.arrays)))
    assert [section.title for section in nothing.sections] == ["Missing points"]


@pytest.mark.plain
@pytest.mark.parametrize(
    ("mean", "deviation", "text"),
    [
        (1.2345, 0.0567, "1.234 ± 0.057"),
        (1386.2, 93.7, "1386 ± 94"),
        (2.003533, 0.000008, "2.004 ± <0.001"),
        (0.0, 0.0, "0"),
        (5.0, 0.0, "5.00"),
    ],
)
def test_numbers_have_the_digits_their_spread_allows(mean, deviation, text):
    assert with_spread(Spread(mean, deviation, mean, mean)) == text


@pytest.mark.plain
def test_small_things_in_words():
    assert [number(value) for value in (0.0, 1.0 / 3.0, 12345.6, 1.0e-5)] == [
        "0",
        "0.333",
        "12346",
        "1.00e-05",
    ]
    assert zone_text((350.0, 370.0)) == "350° to 10° (20° wide)"
    assert spread([1.0, 2.0, 3.0]).mean == 2.0
    slope, error = power_law([1.0, 2.0, 4.0, 8.0], [3.0, 12.0, 48.0, 192.0])
    assert slope == pytest.approx(2.0)
    assert error < 1.0e-6
