"""Fields of the JSON documents: those that are kept; this file as a script renews them from the page.

python test/doors/test_fields.py
"""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import leg_wear_monitor as lw

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "json.md"
KEPT = Path(__file__).parent / "kept" / "fields.txt"


def fields() -> Iterator[str]:
    """A line a field of the page: document, path, type, unit."""
    for document in re.finditer(r"<!-- fields of (\w+) -->\n(.*?)<!-- end -->", PAGE.read_text(), re.DOTALL):
        for row in document[2].splitlines()[2:]:
            path, kind, unit, _ = re.split(r"(?<!\\)\|", row.strip("|"), maxsplit=3)
            yield f"{document[1]}: {path.strip(' `')}: {kind.strip()} {unit.strip()}".rstrip()


def test_fields_their_types_and_units_are_those_that_are_kept() -> None:
    assert list(fields()) == KEPT.read_text().splitlines(), "if it is meant: python test/doors/test_fields.py"


@pytest.mark.parametrize("model", ["full", "clearance"])
def test_a_simulation_has_these_fields_and_no_others(run, unknown, model: str) -> None:
    short = ("--mechanism", "four_bar", "--model", model, "--cycles", 1, "--trace", 4)
    done = run("simulate", *short, "--json", "-")
    assert done.code == 0
    written = json.loads(done.out)
    assert unknown("simulation", written) == set()
    assert written.pop("wall_s") * written.pop("real_time_factor") == pytest.approx(written["simulated_s"])
    assert written == json.loads(lw.simulate("four_bar", model=model, cycles=1, trace=4).to_json())


if __name__ == "__main__":
    KEPT.write_text("\n".join([*fields(), ""]))
