"""docs/reference/codes.md has every fault code and its guide; this file as a script renews it."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.alarms import CODES_OF_GUIDES, FAULT_CODES, FOLDER, guide_of
from leg_wear_monitor.monitor.verdict.rules import RULES

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "codes.md"
PART = re.compile(r"(<!-- codes -->\n).*?(<!-- end -->)", re.DOTALL)
OF_A_JOINT = {*alarm_specs.JOINT, *alarm_specs.ENCODERS}
ALARMS = (
    *alarm_specs.JOINT,
    *alarm_specs.ENCODERS,
    *alarm_specs.TORQUE,
    *alarm_specs.GAIT,
    *alarm_specs.INPUT,
    alarm_specs.SOURCES,
    *alarm_specs.OF_FOOT_LOAD,
)

pytestmark = pytest.mark.plain


def plain(text: str) -> str:
    """A rule's text; what it fills in is in italics."""
    text = re.sub(r"\{(past|causes|doubt|next)\}", "", text)
    text = re.sub(r"`[^`]*`", lambda code: re.sub(r"\{(\w+)\}", lambda word: word[1].upper(), code[0]), text)
    return re.sub(r"\{(\w+)\}", r"*\1*", text)


def meanings() -> Iterator[tuple[str, str]]:
    """Each code with a line for each place that reports it."""
    for rule in RULES:
        yield rule.code, f"- Verdict *{rule.state.words}*: {plain(rule.why)}."
        if rule.not_valid:
            yield rule.code, f"- Not valid meanwhile: {', '.join(each.words for each in rule.not_valid)}."
        yield rule.code, f"- To do: {plain(rule.do)}."
    for spec in ALARMS:
        code = spec.name("").strip().upper().replace(" ", "_")
        whose = f"`{spec.name('<joint>')}`" if spec in OF_A_JOINT else f"`{spec.name('')}`"
        yield code, f"- Alarm {whose}: {spec.meaning}. Limit: {spec.limit_words}."
    for code, meaning in FAULT_CODES.items():
        yield code, f"- Status: {meaning}."


def guide(code: str) -> str:
    """A line with a link to the code's guide."""
    path = guide_of(code)
    title = (ROOT / path).read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ")
    return f"- Guide: [{title}](../{path.removeprefix('docs/')})."


def renewed(page: str) -> str:
    told: dict[str, list[str]] = {}
    for code, line in meanings():
        told.setdefault(code, []).append(line)
    for code, lines in told.items():
        lines.append(guide(code))
    parts = ["\n".join([f"## {code}", "", *told[code], ""]) for code in sorted(told)]
    return PART.sub(lambda found: found[1] + "\n".join(parts) + found[2], page)


def test_the_page_has_every_code() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert "<!-- codes -->" in page
    assert renewed(page) == page


def test_every_code_has_one_guide_that_names_it() -> None:
    told = [code for codes in CODES_OF_GUIDES.values() for code in codes]
    assert sorted(told) == sorted({code for code, _ in meanings()})
    for name, codes in CODES_OF_GUIDES.items():
        page = (ROOT / FOLDER / f"{name}.md").read_text(encoding="utf-8")
        missing = [code for code in codes if f"](../../reference/codes.md#{code.lower()})" not in page]
        assert missing == [], name


def test_there_is_no_guide_without_a_code() -> None:
    assert {path.stem for path in (ROOT / FOLDER).glob("*.md")} == set(CODES_OF_GUIDES)


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
