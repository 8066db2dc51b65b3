"""docs/reference/json.md lists the fields that the classes declare; this file as a script renews it."""

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))  # as a script

from json_documents import DOCUMENTS, state
from json_fields import Row, is_of, leaves
from made_up_summary import made_up_state, made_up_summary

import leg_wear_monitor as lw
from leg_wear_monitor.fleet.overview import LegOverview, overview_of
from leg_wear_monitor.life.life import life_document
from leg_wear_monitor.life.result import validity

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "json.md"
TABLE = re.compile(r"(<!-- fields of (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


UNIT_IN_NAME = re.compile(
    r"_(?:m|s|h|n|nm|nms|j|pa|hz|rpm|deg|rad|mps|mps2|radps|ns|c)(?:_per_\w+)?(?=$|[.\[])"
)
SHORT = {"whole number": "integer", "true or false": "boolean", "list of numbers": "numbers", " or null": "?"}
LIMITS = "monitor.limits"  # the page of the parameters has these
STATE_IN = {"replay": "", "fleet": "legs[].state."}  # documents that contain the state of a leg, and its path


def renewed(page: str) -> str:
    state_rows = set(state())
    listed: dict[tuple[Row, ...], str] = {}  # parts whose fields the page has, by these fields

    def listed_parts(place: str) -> tuple[Row, ...]:
        return next(parts for parts, path in listed.items() if path == place)

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
            if path == LIMITS:
                left_out = f"{LIMITS}."
                yield path, kind, unit, f"{text.removesuffix('.')}: the parameters `limits.…`."
                continue
            below = f"{path}."
            parts = tuple(
                (row[0].removeprefix(below), row[1], "", row[3])
                for row in documented
                if row[0].startswith(below)
            )
            first = next((place for fields, place in listed.items() if set(fields) <= set(parts)), path)
            if len(parts) > 1:
                listed.setdefault(parts, path)
            if first != path:
                left_out = below
                further = [part[0] for part in parts if part not in listed_parts(first)]
                also = f", and {', '.join(f'`{one}`' for one in further)}" if further else ""
                yield path, kind, unit, f"{text.removesuffix('.')}; fields as in `{first}`{also}."
            else:
                yield path, kind, unit, text

    def table(name: str) -> str:
        lines = ["| field | type, unit | meaning |", "|---|---|---|"]
        for path, kind, unit, text in rows(name):
            words = re.sub(r"\bNone\b", "null", text.replace("``", "`")).replace("|", r"\|")
            quantity = f"{kind}, {unit}" if unit and not UNIT_IN_NAME.search(path) else kind
            quantity = re.sub(r"^one of `\S+ [^,]*`.*?(?= or null|$)", "text", quantity)  # sentences
            for long, short in SHORT.items():
                quantity = quantity.replace(long, short)
            words = re.sub(r" \[[^\]\d]+\](?=[.,:;)])", "", words)  # units that the name has
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
        few, leg = lw.LifeSettings(legs=1, cycles=2, settle_cycles=0), lw.load_mechanism()
        life = lw.LifeRun(leg, few, clearances=["A"], duty=lw.Duty({0.0: 1.0, 300.0: 1.0})).life
        about = {"mechanism": leg.name, "validity": validity(leg, life)}
        return about | life_document(life, limit_m=6.0e-4)
    if name == "fleet":
        leg = LegOverview(
            id="a", state=made_up_state(), last_recording="a.mcap", faults=("b.mcap: unreadable",)
        )
        return overview_of([leg]).to_dict()
    item = lw.CommissioningItem(name="crank.sign", value=1)
    reasons = {"not_told": ("lag",), "findings": ("load",), "notes": ("note",)}
    return lw.CommissioningResult(items=(item,), config=None, turns=1.0, **reasons).to_dict()


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
