"""fleet.yaml is checked like every other file: one clear line for each fault."""

import pytest

from leg_wear_monitor.errors import ConfigError, ConfigWarning
from leg_wear_monitor.fleet.description import fleet_directory, load_fleet

pytestmark = pytest.mark.plain


@pytest.fixture
def written(tmp_path):
    """Write a description beside three empty recordings."""
    for name in ("a/1.mcap", "a/2.mcap", "b/1.mcap", "b/notes.txt"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()

    def write(text):
        (tmp_path / "fleet.yaml").write_text(text)
        return tmp_path / "fleet.yaml"

    return write


LEG = '{id: a, recordings: "a/*"}'


def test_paths_are_relative_to_the_file(written, tmp_path, monkeypatch):
    (tmp_path / "m.yaml").write_text("/**:\n  ros__parameters:\n    hardware_id: left\n")
    text = """
defaults: {config: m.yaml}
legs:
  - {id: a-07, recordings: "a/*.mcap", lot: "2026-03"}
  - {id: b, recordings: [b/1.mcap, "b/*"]}
"""
    monkeypatch.chdir("/")
    fleet = load_fleet(written(text))
    assert [(leg.id, leg.lot, leg.config.hardware_id) for leg in fleet.legs] == [
        ("a-07", "2026-03", "left"),
        ("b", "", "left"),
    ]
    assert [leg.recordings for leg in fleet.legs] == [
        (tmp_path / "a/1.mcap", tmp_path / "a/2.mcap"),
        (tmp_path / "b/1.mcap",),
    ]
    assert fleet.out == tmp_path / "fleet"


def test_without_a_hardware_id_a_leg_is_called_by_its_id(written):
    assert load_fleet(written(f"legs: [{LEG}]")).legs[0].config.hardware == "a"


def test_a_bag_directory_is_one_recording_a_folder_of_them_is_none(written, tmp_path):
    for name in ("c/run/metadata.yaml", "c/run/run_0.mcap", "c/killed/killed_0.mcap", "c/day/x.mcap"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    fleet = load_fleet(written('legs: [{id: c, recordings: "c/**"}]'))
    names = [str(path.relative_to(tmp_path)) for path in fleet.legs[0].recordings]
    assert names == ["c/day/x.mcap", "c/killed", "c/run"]


def test_links_that_lead_back_end_and_each_directory_counts_once(written, tmp_path):
    """Forty levels of two links each are 2^40 directories."""
    for name in ("a/b/c", "elsewhere", ".hidden"):
        (tmp_path / "c" / name).mkdir(parents=True)
        (tmp_path / "c" / name / "x.mcap").touch()
        for link in ("back", "again"):
            (tmp_path / "c" / name / link).symlink_to(tmp_path / "c")
    (tmp_path / "c/0").symlink_to("a")
    (tmp_path / "c/itself").symlink_to("itself")
    (tmp_path / "c/b").symlink_to(tmp_path / "b")  # what is elsewhere is followed

    def found(pattern):
        (leg,) = load_fleet(written(f'legs: [{{id: c, recordings: "{pattern}"}}]')).legs
        return [str(path.relative_to(tmp_path)) for path in leg.recordings]

    every = ["c/a/b/c/x.mcap", "c/b/1.mcap", "c/elsewhere/x.mcap"]
    assert found("c/**") == every
    assert found(f"{tmp_path}/c/**") == every
    assert found("**/c/*.mcap") == ["c/a/b/c/x.mcap"]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (f"legs: [{LEG}]\nlegz: 1", "legz: unknown key, did you mean legs?"),
        ("legs: [{id: a, recording: x}]", "legs.a.recording: unknown key, did you mean recordings?"),
        ("legs: [{id: a}]", "legs.a.recordings: is missing"),
        ("legs: []", "legs: is empty, expected at least one leg"),
        ("legs: [{id: a/b, recordings: x}]", "legs.a/b.id: 'a/b' is no name for a directory"),
        ("legs: [{id: .., recordings: x}]", "legs....id: '..' is no name for a directory"),
        ("legs: [{id: 7, recordings: x}]", "legs.1.id: 7 is not a text on one line"),
        ("legs: [{id: a, recordings: []}]", "legs.a.recordings: has an empty pattern"),
        ("legs: [{id: a, recordings: 5}]", "legs.a.recordings: 5 is not a text on one line"),
        (f"row: hour\nlegs: [{LEG}]", "row: 'hour' is not one of minute, cycle"),
        (f'legs: [{LEG}, {{id: A, recordings: "b/*"}}]', "legs: the id A is given twice, first as a"),
        (
            f'legs: [{LEG}, {{id: b, recordings: "*/2.mcap"}}]',
            "legs.b.recordings: a/2.mcap is a recording of the leg a already",
        ),
        (f"defaults: {{config: none.yaml}}\nlegs: [{LEG}]", "none.yaml: cannot be read: No such file"),
    ],
)
def test_a_fault_is_one_clear_line(written, text, fault):
    path = written(text)
    with pytest.raises(ConfigError) as found:
        load_fleet(path)
    assert fault in str(found.value)
    assert len(str(found.value).splitlines()) == 1


def test_accelerated_wear_is_said(written, tmp_path):
    (tmp_path / "m.yaml").write_text("/**:\n  ros__parameters:\n    wear_acceleration: 10.0\n")
    with pytest.warns(
        ConfigWarning, match=r"m.yaml: wear_acceleration: .* by 10: .*; legs with it are not ranked"
    ):
        load_fleet(written(f"defaults: {{config: m.yaml}}\nlegs: [{LEG}]"))


def test_two_legs_in_one_recording_have_a_topic_each(written):
    legs = ", ".join(f'{{id: {s}, recordings: "a/*", joint_states: /{s}/joint_states}}' for s in "lr")
    assert [leg.joint_states for leg in load_fleet(written(f"legs: [{legs}]")).legs] == [
        "/l/joint_states",
        "/r/joint_states",
    ]


def test_a_pattern_that_matches_nothing_is_said(written):
    path = written('legs: [{id: a, recordings: ["a/*", "c/*", "c/d.mcap"]}]')
    with pytest.warns(ConfigWarning) as found:
        load_fleet(path)
    assert [str(each.message).split(": ", 1)[1] for each in found] == [
        "legs.a.recordings: c/* matches no recording",
        "legs.a.recordings: c/d.mcap matches no recording",
    ]


def test_the_directory_of_a_fleet_is_given_by_itself_or_by_its_description(written, tmp_path):
    assert fleet_directory(tmp_path) == tmp_path
    assert fleet_directory(written(f"out: x/y\nlegs: [{LEG}]")) == tmp_path / "x/y"
