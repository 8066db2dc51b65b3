"""docs/reference/json.md lists the fields that the classes declare; this file as a script renews it."""

import json
import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))  # as a script

from json_fields import Row, descriptions, is_of, leaves, rows_of, unit_of
from made_up_summary import made_up_state, made_up_summary

import leg_wear_monitor as lw
from leg_wear_monitor.commissioning.result import JointDetection
from leg_wear_monitor.fleet.overview import LegOverview, overview_of
from leg_wear_monitor.life.life import lives_document
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.state import LegState

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "json.md"
TABLE = re.compile(r"(<!-- fields of (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
VERSION = ("schema_version", "whole number", "", "Version of these fields; see above.")


def simulation() -> Iterator[Row]:
    clock = {
        "wall_s": ("number", "Wall-clock duration of the run; the command line writes it."),
        "real_time_factor": ("number", "Simulated time as a multiple of that."),
    }
    yield VERSION
    yield from ((name, kind, unit_of(name), text) for name, (kind, text) in clock.items())
    yield from rows_of(lw.SimulationResult, left_out=("clearance_joints", "surfaces"))


def state() -> Iterator[Row]:
    yield VERSION
    yield from rows_of(LegState)


def replay() -> Iterator[Row]:
    yield VERSION
    yield from rows_of(lw.ReplaySummary)


_LOAD = "number", "Pa m/s", "Mean of pressure times sliding speed when new."


def life() -> Iterator[Row]:
    texts = descriptions(Life)
    yield "mechanism", "text", "", "Name of the mechanism."
    yield "fingerprint", "text", "", "Checksum of the mechanism; a forecast refuses the lives of another leg."
    yield "validity.<joint>.holds_for", "text", "", "Material pair and regime that its life holds for."
    counted = "Whether its wear is counted; false for a pair without wear coefficient, whose clearance stays."
    yield "validity.<joint>.is_counted", "true or false", "", counted
    rating = (
        "Life by the formula of the pair's maker when new, all factors 1; null without one, or beyond it."
    )
    yield "validity.<joint>.rating_life_h", "number or null", "h", rating
    yield "validity.<joint>.mean_pressure_speed_pa_mps", *_LOAD
    beyond = "What of it is beyond the limits of the joint's material; None within them."
    yield "validity.<joint>.outside_limits", "text or null", "", beyond
    beyond = "Why its normal law does not hold for the contact arc when new; None if it does."
    yield "validity.<joint>.outside_contact_law", "text or null", "", beyond
    yield VERSION
    for name in ("cycles", "error_m"):
        yield name, "list of numbers", unit_of(name), texts[name]
    further = ("clearance_m", "growth_m_per_cycle")
    for name in (*further, "clearance_max_m", "worst_sector_deg", "peak_force_n"):
        yield f"joints.<joint>.{name}", "list of numbers", unit_of(name), texts[name]
    name = "part_growth_m_per_cycle"
    words = f"{texts[name].removesuffix('.')}, load by load; with a duty only."
    yield f"joints.<joint>.{name}", "list of lists of numbers", unit_of(name), words
    yield "duty", "object", "", "Hours a day under each load, of `--duty`; missing without one."
    yield "duty.peak_n", "list of numbers", "N", "Largest vertical force of the ground on the toe."
    yield "duty.hours_per_day", "list of numbers", "h", "Hours a day under each of them."
    yield "duty.limit_m", "number", "m", "Mean radial clearance at which a joint's life ends."
    for name, unit, words in (
        ("cycles", "gait cycles", "When each joint, and the `leg`, reaches the limit; null if never."),
        ("hours", "h", "The same in hours of walking."),
        ("days", "d", "The same in days of this duty."),
    ):
        yield f"duty.end.<joint>.{name}", "number or null", unit, words
    yield "wear_factor.<joint>", "number", "", "Factor on the wear coefficients of this life."
    yield "further[]", "object", "", "Lives with other wear coefficients, in short."
    yield "further[].wear_factor.<joint>", "number", "", "As above."
    yield "further[].cycles", "list of numbers", unit_of("cycles"), texts["cycles"]
    for name in further:
        yield f"further[].joints.<joint>.{name}", "list of numbers", unit_of(name), texts[name]


def commissioning() -> Iterator[Row]:
    texts = descriptions(lw.CommissioningResult)
    yield VERSION
    yield "turns", "number", "", texts["turns"]
    yield "is_sure", "true or false", "", lw.CommissioningResult.is_sure.__doc__ or ""
    yield "items[]", "object", "", texts["items"]
    yield from rows_of(lw.CommissioningItem, "items[].")
    yield "not_enough_to_tell[]", "text", "", texts["not_told"]
    yield "findings[]", "text", "", texts["findings"]
    yield "notes[]", "text", "", texts["notes"]
    yield "joints[]", "object", "", texts["joints"]
    yield from rows_of(JointDetection, "joints[].")
    yield "judgement", "text", "", lw.CommissioningResult.judgement.__doc__ or ""
    yield "reference_used", "text", "", texts["reference_used"]


def fleet() -> Iterator[Row]:
    yield VERSION
    yield from rows_of(lw.FleetOverview)


DOCUMENTS = {
    "simulation": simulation,
    "state": state,
    "replay": replay,
    "life": life,
    "commissioning": commissioning,
    "fleet": fleet,
}


STATE_IN = {"replay": "", "fleet": "legs[].state."}  # documents that contain the state of a leg, and its path


def renewed(page: str) -> str:
    state_rows = set(state())
    listed: dict[tuple[Row, ...], str] = {}  # parts whose fields the page has, by these fields

    def rows(name: str) -> Iterator[Row]:
        """Rows of a document without the fields that the page lists before."""
        prefix = STATE_IN.get(name)
        documented = list(DOCUMENTS[name]())
        left_out = ""
        for path, kind, unit, text in documented:
            if prefix is not None and (path.removeprefix(prefix), kind, unit, text) in state_rows:
                continue
            if left_out and path.startswith(left_out):
                continue
            below = f"{path}."
            parts = tuple(
                (row[0].removeprefix(below), row[1], "", row[3])
                for row in documented
                if row[0].startswith(below)
            )
            first = listed.setdefault(parts, path)
            if len(parts) > 1 and first != path:
                left_out = below
                yield path, kind, unit, f"{text.removesuffix('.')}; fields as in `{first}`."
            else:
                yield path, kind, unit, text

    def table(name: str) -> str:
        lines = ["| field | type, unit | meaning |", "|---|---|---|"]
        for path, kind, unit, text in rows(name):
            words = re.sub(r"\bNone\b", "null", text.replace("``", "`")).replace("|", r"\|")
            quantity = f"{kind}, {unit}" if unit else kind
            lines.append(f"| `{path}` | {quantity} | {words} |")
        return "\n".join([*lines, ""])

    return TABLE.sub(lambda found: found[1] + table(found[2]) + found[3], page)


def example(name: str) -> Any:
    if name == "simulation":
        return lw.simulate("four_bar", cycles=0.5, skip_cycles=0.0, trace=8).to_dict(wall_s=1.0)
    if name == "state":
        return made_up_state().to_dict()
    if name == "replay":
        return made_up_summary().to_dict()
    if name == "life":
        shipped = json.loads((ROOT / "config" / "lives" / "bionic_leg.json").read_text())
        few = lw.LifeSettings(legs=1, cycles=2, settle_cycles=0)
        run = lw.LifeRun(lw.load_mechanism(), few, clearances=["A"], duty=lw.Duty({0.0: 1.0, 300.0: 1.0}))
        return shipped | lives_document([(np.ones(1), run.life)] * 2, limit_m=6.0e-4)
    if name == "fleet":
        leg = LegOverview(
            id="a", state=made_up_state(), last_recording="a.mcap", faults=("b.mcap: unreadable",)
        )
        return overview_of([leg]).to_dict()
    item = lw.CommissioningItem(name="crank.sign", value=1)
    reasons = {"not_told": ("lag",), "findings": ("load",), "notes": ("note",)}
    cycles = {"clearances_m": (6.0e-4,), "cycles": (2.0,), "named_cycles": (math.nan,)}
    joint = JointDetection(joint="J", is_good=False, runner_up="", **cycles)
    return lw.CommissioningResult(items=(item,), config=None, turns=1.0, joints=(joint,), **reasons).to_dict()


def test_the_page_lists_every_field_as_the_classes_declare_it() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert {found[1] for found in TABLE.findall(page)} == set(DOCUMENTS)
    assert renewed(page) == page, "make tables renews it"


@pytest.mark.parametrize("name", DOCUMENTS)
def test_every_field_is_described(name: str) -> None:
    assert [path for path, _, _, text in DOCUMENTS[name]() if not text] == []


@pytest.mark.parametrize("name", DOCUMENTS)
def test_the_page_has_the_fields_of_a_document_and_no_others(name: str) -> None:
    documented = [(path.removesuffix("[]"), kind) for path, kind, _, _ in DOCUMENTS[name]()]
    written = set(leaves(example(name)))
    assert [leaf for leaf in written if not any(is_of(path, leaf) for path, _ in documented)] == []
    plain = [path for path, kind in documented if not kind.startswith("object")]
    assert [path for path in plain if not any(is_of(path, leaf) for leaf in written)] == []


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
