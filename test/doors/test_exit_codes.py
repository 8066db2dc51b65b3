"""Exit codes: 0 done, 1 done with findings, 2 could not; what could not be is one line that names it."""

from pathlib import Path

import pytest

import leg_wear_monitor as lw

BAGS = lw.share_directory() / "bags"
FOUR_BAR = (lw.share_directory() / "config" / "mechanisms" / "four_bar.yaml").read_text()
LEDGER = "/**: {ros__parameters: {ledger: {path: wear.ledger}}}\n"


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A current directory with files that are sound, doubtful and wrong."""
    monkeypatch.chdir(tmp_path)
    whole = (BAGS / "healthy.mcap").read_bytes()
    for name, content in {
        "good.yaml": FOUR_BAR,
        "doubtful.yaml": FOUR_BAR.replace("2.07e11", "207"),
        "wrong.yaml": FOUR_BAR.replace("mass: 0.40", "mass: 0"),
        "open.yaml": FOUR_BAR.replace("C: [0.200, 0.0]", "C: [0.500, 0.0]"),
        "monitor.yaml": LEDGER,
        "study.yaml": "title: a\nquestion: b?\nclearances: [G]\nsweeps: []\nruns: 2\n",
        "fleet.yaml": "legs:\n  - {id: a, recordings: '*.mcap', colour: red}\n",
        "trash.mcap": "no recording\n",
    }.items():
        Path(name).write_text(content)
    Path("half.mcap").write_bytes(whole[: len(whole) * 7 // 8])


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize(
    ("code", "line"),
    [
        (0, "check good.yaml"),
        (0, "draw good.yaml"),
        (0, "materials du-on-steel-dry"),
        (0, "drives ak80-9"),
        (0, "simulate --mechanism good.yaml --clearances none --cycles 1"),
        (0, "replay {bags}/knocking.mcap"),
        (1, "check doubtful.yaml"),
        (1, "draw open.yaml"),
        (1, "replay {bags}/knocking.mcap --fail-on torque_mismatch"),
        (1, "replay half.mcap"),
        (0, "replay half.mcap --allow-partial"),
    ],
)
def test_what_is_done_and_what_is_found(run, code: int, line: str) -> None:
    done = run(*line.format(bags=BAGS).split())
    assert (done.code, [text for text in done.lines if text.startswith("error")]) == (code, [])
    assert done.out


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("", "no command"),
        ("simulat", "did you mean simulate?"),
        ("simulate --cycles many", "--cycles"),
        ("check wrong.yaml", "wrong.yaml: bodies.crank.mass: 0.0 is not above 0 kg"),
        ("check no.yaml", "no.yaml"),
        ("draw no.yaml", "no.yaml"),
        ("simulate --mechanism open.yaml", "open.yaml"),
        ("materials unobtainium", "unobtainium"),
        ("drives perpetual", "perpetual"),
        ("replay trash.mcap", "trash.mcap"),
        ("replay half.mcap --out trash.mcap", "--out: trash.mcap"),
        ("commission trash.mcap", "trash.mcap"),
        ("reference --cadence 0 --out leg.npz", "--cadence"),
        ("life --limit-m -1", "--limit-m"),
        ("measure Q 0.4 --sigma 0.01 --config monitor.yaml", "'Q'"),
        ("acknowledge --ledger no.ledger", "no.ledger"),
        ("reset G --ledger no.ledger", "no.ledger"),
        ("study study.yaml --out study", "study.yaml: runs"),
        ("report .", "."),
        ("fleet update fleet.yaml", "fleet.yaml: legs.a.colour"),
        ("fleet report nowhere", "nowhere"),
        ("dashboard --port 99999999", "--port"),
    ],
)
def test_what_could_not_be_is_one_line_that_names_it(run, line: str, said: str) -> None:
    before = sorted(Path().iterdir())
    done = run(*line.split())
    assert (done.code, done.out) == (2, "")
    (fault,) = done.lines
    assert fault.startswith("error: ") and said in fault
    assert sorted(Path().iterdir()) == before
