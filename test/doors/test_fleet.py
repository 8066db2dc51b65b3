"""A fleet of three legs, those of the sample recordings: what it counts, says and writes."""

import json
from pathlib import Path

import pytest

import leg_wear_monitor as lw

pytest.importorskip("pyarrow", reason="the extra 'fleet' is not installed")

LEGS = {"healthy": "healthy", "knocking": "stop", "bad_input": "not_monitored"}


@pytest.fixture(scope="module")
def fleet(run, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Description and directory of the fleet, updated once."""
    home, bags = tmp_path_factory.mktemp("fleet"), lw.share_directory() / "bags"
    entries = [
        f"  - {{id: {leg}, recordings: {bags}/{leg}.mcap, config: {bags}/{leg}.yaml}}\n" for leg in LEGS
    ]
    (home / "fleet.yaml").write_text(f"legs:\n{''.join(entries)}")
    done = run("fleet", "update", home / "fleet.yaml", "--out", home / "fleet", "--workers", 1)
    assert done.code == 0, done.lines
    return home / "fleet.yaml", home / "fleet"


def overview(fleet: tuple[Path, Path]) -> dict:
    return json.loads((fleet[1] / "fleet.json").read_text())


@pytest.mark.chaotic
def test_each_leg_has_the_verdict_of_its_recording(fleet) -> None:
    found = overview(fleet)
    assert {leg["id"]: leg["verdict"]["state"] for leg in found["legs"]} == LEGS
    assert found["counts"] | dict.fromkeys(LEGS.values(), 0) == dict.fromkeys(found["counts"], 0)
    assert found["first"][0] == "knocking"
    assert lw.Fleet(fleet[0]).overview.to_dict() == found


def test_its_documents_have_no_fields_but_those_that_are_kept(fleet, unknown) -> None:
    assert unknown("fleet", overview(fleet)) == set()
    for leg in LEGS:
        assert unknown("replay", json.loads((fleet[1] / f"legs/{leg}/summary.json").read_text())) == set()


def test_a_leg_counts_what_a_replay_of_its_recording_counts(fleet, tmp_path) -> None:
    bag = lw.share_directory() / "bags" / "healthy.mcap"
    alone = lw.replay(bag, bag.with_suffix(".yaml"), ledger=tmp_path / "ledger").summary()
    (leg,) = (leg for leg in overview(fleet)["legs"] if leg["id"] == "healthy")
    assert {joint: leg["clearances"][joint]["counted_m"] for joint in leg["clearances"]} == {
        joint: each.counted_m for joint, each in alone.clearances.items()
    }
    assert lw.Fleet(fleet[1]).recordings().set_index("leg").cycles["healthy"] == alone.cycles == 10


def test_a_second_update_counts_nothing_and_changes_no_file(fleet, run) -> None:
    def contents() -> dict[str, bytes]:
        return {str(path): path.read_bytes() for path in fleet[1].rglob("*") if path.is_file()}

    before = contents()
    assert run("fleet", "update", fleet[0], "--out", fleet[1]).code == 0
    assert contents() == before


def test_pages_and_tables_are_written(fleet, run, tmp_path) -> None:
    pytest.importorskip("pandas")
    assert run("fleet", "report", fleet[0], "--out", fleet[1], "--workers", 1).code == 0
    page = (fleet[1] / "report.html").read_text()
    assert all(leg in page for leg in LEGS)
    assert run("fleet", "export", fleet[1], "--out", tmp_path).code == 0
    tables = {
        f"{name}.{kind}"
        for name in ("cycles", "verdicts", "recordings", "lives")
        for kind in ("csv", "parquet")
    }
    assert {path.name for path in tmp_path.iterdir()} == tables
    assert sorted(set(lw.Fleet(fleet[1]).cycles().leg)) == sorted(LEGS)
