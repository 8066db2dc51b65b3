"""Fields of the JSON documents: those that are kept; this file as a script renews them.

python test/doors/test_fields.py
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))  # as a script

from json_documents import DOCUMENTS

import leg_wear_monitor as lw

KEPT = Path(__file__).parent / "kept" / "fields.txt"


def fields() -> Iterator[str]:
    """A line a field: document, path, type, unit."""
    for name, rows in DOCUMENTS.items():
        for path, kind, unit, _ in rows():
            yield f"{name}: {path}: {kind} {unit}".rstrip()


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
