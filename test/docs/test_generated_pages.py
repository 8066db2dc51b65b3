"""Parts of documents that follow from the source, between ``<!-- NAME -->`` and ``<!-- end -->``.

``python test/test_generated_pages.py`` renews them.
"""

import inspect
import re
import sqlite3
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any, get_args

import attrs
import pytest

from leg_wear_monitor.fleet import description
from leg_wear_monitor.mechanism import materials, spec
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.alarms import guide_of
from leg_wear_monitor.monitor.config.parameters import PARAMETERS
from leg_wear_monitor.monitor.ledger.file import FORMAT, TABLES, create_tables
from leg_wear_monitor.monitor.verdict.verdict import rules
from leg_wear_monitor.monitor.verdict.verdict import table as verdict_table
from leg_wear_monitor.studies.study import Study, Sweep

ROOT = Path(__file__).parents[2]
PART = re.compile(r"(<!-- (\S[\w ]*) -->\n).*?(<!-- end -->)", re.DOTALL)
OF_A_JOINT = (*alarm_specs.JOINT, *alarm_specs.ENCODERS)
OF_THE_LEG = (*alarm_specs.TORQUE, *alarm_specs.GAIT, *alarm_specs.OF_INPUT, *alarm_specs.OF_FOOT_LOAD)
WORDS = {"above": "above", "at_least": "at least", "at_most": "at most"}
SIGNS = {"above": ">", "at_least": "≥", "at_most": "≤"}
FIGURES = ("lag", "bandwidth", "load_friction", "coulomb", "viscous", "stiffness", "torque_constant")


def table(head: str, rows: Iterable[Iterable[Any]]) -> str:
    """A table in Markdown; columns of the head are separated by ``|``."""
    lines = [f"| {' | '.join(map(str, row))} |" for row in rows]
    return "\n".join([f"| {head} |", f"|{'---|' * (head.count('|') + 1)}", *lines, ""])


def fields_of(kind: type, prefix: str = "") -> Iterator[tuple[str, "attrs.Attribute[Any]"]]:
    """Fields of a class and of the classes in it, by their paths."""
    for field in attrs.fields(kind):
        if attrs.has(field.type):
            yield from fields_of(field.type, f"{prefix}{field.name}.")
        else:
            yield f"{prefix}{field.name}", field


def bounds(metadata: Any, words: dict[str, str]) -> str:
    return ", ".join(
        f"{word} {metadata[key]:g}" for key, word in words.items() if metadata.get(key) is not None
    )


def value(of: Any) -> str:
    """A default as YAML has it."""
    if isinstance(of, bool):
        return str(of).lower()
    return repr(list(of)) if isinstance(of, tuple) else str(of)


def study_keys(_name: str) -> str:
    def row(key: str, field: "attrs.Attribute[Any]") -> Iterator[str]:
        default, metadata = field.default, field.metadata
        yield from (f"`{key}`", metadata["unit"])
        if default is attrs.NOTHING:
            yield "required"
        else:
            yield ", ".join(map(str, default)) if isinstance(default, tuple) else str(default)
        yield from (bounds(metadata, WORDS), metadata["doc"])

    fields = [one for one in fields_of(Study) if one[0] != "sweeps"] + list(fields_of(Sweep, "sweeps[]."))
    return table("key | unit | default | bounds | meaning", (row(*one) for one in fields))


def monitor_parameters(_name: str) -> str:
    def default(of: Any) -> str:
        return (repr(of) if of else "none") if isinstance(of, str) else value(of)

    rows = (
        (
            f"`{one.name}`", one.type, one.unit, default(one.default), one.bounds,
            "" if one.read_only else "yes", one.description,
        )
        for one in PARAMETERS.values()
    )  # fmt: skip
    return table("name | type | unit | default | bounds | live | meaning", rows)


def mechanism_keys(name: str) -> str:
    def default(field: "attrs.Attribute[Any]") -> str:
        if field.default is attrs.NOTHING:
            return "required"
        if attrs.has(type(field.default)):
            return "those below"
        is_plain = isinstance(field.default, str | float | tuple) and field.default not in ((), "")
        return f"`{value(field.default)}`" if is_plain else "none"

    def row(field: "attrs.Attribute[Any]") -> Iterator[str]:
        metadata = field.metadata
        names = ", ".join(f"`{name}`" for name in metadata.get("names", ()))
        yield from (f"`{field.name}`", metadata["unit"].replace("^2", "²"))
        yield from (names or bounds(metadata, SIGNS), default(field), metadata["doc"])

    fields = attrs.fields(getattr(spec, name.removeprefix("keys of ")))
    keys = [field for field in fields if "doc" in field.metadata and not field.metadata.get("flat")]
    return table("key | unit | bounds | default | meaning", map(row, keys))


def fleet_keys(name: str) -> str:
    def default(of: Any) -> str:
        return "required" if of is attrs.NOTHING else f"`{of}`" if isinstance(of, str) and of else "none"

    fields = attrs.fields(getattr(description, name.removeprefix("keys of ")))
    rows = ((f"`{field.name}`", default(field.default), field.metadata["doc"]) for field in fields)
    return table("key | default | meaning", rows)


def sourced_keys(kind: Any) -> str:
    """Keys of a file whose values have sources."""
    rows = (
        (
            f"`{field.name}`", field.metadata.get("dimension", ""),
            "yes" if field.default is attrs.NOTHING else "", field.metadata["doc"],
        )
        for field in attrs.fields(kind)
    )  # fmt: skip
    return table("key | measures | required | meaning", rows)


def units(of_drives: bool) -> str:
    """Units of the files of drives, or of those of materials; both may have a number."""
    dimensions = {field.metadata.get("dimension") for field in attrs.fields(materials.Drive)}
    rows = (
        (f"`{name}`", measures, f"{factor:.6g}")
        for name, (measures, factor) in materials.UNITS.items()
        if (measures in dimensions) is of_drives or measures == "number"
    )
    return table("unit | measures | factor to SI", rows)


def of_materials(name: str) -> str:
    if name == "units":
        return units(of_drives=False)
    if name != "pairs":
        kind = name.removeprefix("keys of ")
        return sourced_keys(getattr(materials, kind))

    def row(name: str) -> Iterator[str]:
        pair = materials.load_material(name)
        wear, limits = pair.wear_coefficients, pair.limits
        yield from (f"`{name}`", pair.title, pair.regime)
        yield "none" if wear is None else f"{wear[0]:.2g}, {wear[1]:.2g}"
        pressure = limits.dynamic_pressure or limits.static_pressure
        for given in (pair.friction, pressure, limits.sliding_speed, limits.pressure_speed):
            yield "" if given is None else f"{given.si:.3g}"

    head = "name | pair | regime | wear [1/Pa] | friction | p [Pa] | v [m/s] | p v [Pa m/s]"
    return table(head, map(row, materials.materials()))


def of_drives(name: str) -> str:
    if name == "units":
        return units(of_drives=True)
    if name == "keys of Drive":
        return sourced_keys(materials.Drive)

    def row(name: str) -> tuple[str, ...]:
        drive = materials.load_drive(name)
        known = {key: value.text for key, value in drive.values()}
        return (f"`{name}`", drive.title, *(known.get(key, "") for key in FIGURES))

    head = " | ".join(("name", "drive", *(figure.replace("_", " ") for figure in FIGURES)))
    return table(head, map(row, materials.drives()))


PLAIN_TABLES = {
    "binding": "The leg and the parameters that the wear belongs to.",
    "entry": "The last entry: joints, alarms and totals are of this stamp, spans are in the row of its run. "
    "The checksum is the CRC-32 of all of them.",
    "total": "Counters over all runs, and values in force, such as the limit of each clearance.",
}


def ledger_tables(_name: str) -> str:
    words = {name: inspect.getdoc(kind).splitlines()[0] for kind, name in TABLES.items()} | PLAIN_TABLES
    lines = [f"The format is {FORMAT} (`PRAGMA user_version`)."]
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        create_tables(db)
        for one in sorted(words):
            found = db.execute(f"PRAGMA table_info({one})")
            columns = [f"`{name}` {kind}{' (key)' if key else ''}" for _, name, kind, _, _, key in found]
            lines += ["", f"## {one}", "", words[one], "", f"Columns: {', '.join(columns)}."]
    return "\n".join([*lines, ""])


def in_words(text: str) -> str:
    """A rule's text; what it fills in is in italics, and in capitals in a command."""
    text = re.sub(r"\{(past|acts|causes|then)\}", "", text)
    text = re.sub(r"`[^`]*`", lambda code: re.sub(r"\{(\w+)\}", lambda word: word[1].upper(), code[0]), text)
    return re.sub(r"\{(\w+)\}", r"*\1*", text)


def of_monitor(name: str) -> str:
    if name == "alarms":
        names = (
            *((spec.name("<joint>"), spec) for spec in OF_A_JOINT),
            *((spec.name(), spec) for spec in OF_THE_LEG),
        )
        rows = ((f"`{name}`", spec.meaning, spec.limit_words) for name, spec in names)
        return table("alarm | value | limit", rows)
    rows = (
        (f"`{code}`", rule.state.value, ", ".join(figure.value for figure in rule.not_valid))
        for code, rule in rules().items()
    )
    return table("`fault_code` | state | values that are not valid", rows)


def certainty(_name: str) -> str:
    def row(one: Any) -> tuple[str, ...]:
        source = one.source.replace("docs/explanation/", "").replace("docs/", "../")
        return one.counted, one.words, one.where, one.date, f"[results]({source})"

    return table("right | what | measured on | date |", map(row, verdict_table().measured.values()))


def meanings() -> Iterator[tuple[str, str]]:
    """Each code with a line for each place that reports it."""
    for rule_code, rule in rules().items():
        yield rule_code, f"- Verdict *{rule.state.words}*: {in_words(rule.why)}."
    with_a_rule = set(rules())
    for alarm in (*OF_A_JOINT, *OF_THE_LEG):
        code = alarm.name("").strip().upper().replace(" ", "_")
        if code in with_a_rule:
            continue
        name = alarm.name("<joint>") if alarm in OF_A_JOINT else alarm.name()
        yield code, f"- Alarm `{name}`: [value and limit](monitor.md#alarms)."
    for code, meaning in verdict_table().codes.items():
        yield code, f"- Status: {meaning}."


def codes(_name: str) -> str:
    by_code: dict[str, list[str]] = {}
    for code, line in meanings():
        by_code.setdefault(code, []).append(line)
    for code, lines in by_code.items():
        path = guide_of(code)
        lines.append(f"- Guide: [{Path(path).stem}](../{path.removeprefix('docs/')}).")
    return "\n".join("\n".join([f"## {code}", "", *by_code[code], ""]) for code in sorted(by_code))


PAGES: dict[str, Callable[[str], str]] = {
    "appendix/study.md": study_keys,
    "explanation/validity.md": certainty,
    "reference/codes.md": codes,
    "reference/drives.md": of_drives,
    "reference/fleet_file.md": fleet_keys,
    "reference/ledger.md": ledger_tables,
    "reference/materials.md": of_materials,
    "reference/mechanism_file.md": mechanism_keys,
    "reference/monitor.md": of_monitor,
    "reference/parameters.md": monitor_parameters,
}


def written(name: str) -> str:
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def renewed(name: str) -> str:
    """A page with its parts as the source has them."""

    def part(found: re.Match[str]) -> str:
        return found[1] + PAGES[name](found[2]) + found[3]

    return PART.sub(part, written(name))


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_as_the_source_has_it(name: str) -> None:
    assert "<!-- end -->" in written(name)
    assert renewed(name) == written(name), "make tables renews it"


def classes_in(kind: Any) -> set[str]:
    """A class of a file and, in turn, those of its keys; what a key of values is made of."""
    found = {kind.__name__}
    for field in attrs.fields(attrs.resolve_types(kind)):
        parts = {field.type, *get_args(field.type)}
        found |= {name for part in parts if attrs.has(part) for name in classes_in(part)}
    return found


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("drives", {"drives", "units", "keys of Drive"}),
        ("fleet_file", {f"keys of {name}" for name in ("FleetFile", "Defaults", "LegEntry")}),
        ("materials", {"pairs", "units", *(f"keys of {name}" for name in classes_in(materials.Material))}),
        ("mechanism_file", {f"keys of {kind.__name__}" for kind in vars(spec).values() if attrs.has(kind)}),
        ("monitor", {"alarms", "verdicts"}),
    ],
)
def test_no_part_of_a_page_is_missing(name: str, parts: set[str]) -> None:
    assert {found[2] for found in PART.finditer(written(f"reference/{name}.md"))} == parts


if __name__ == "__main__":
    for page in PAGES:
        (ROOT / "docs" / page).write_text(renewed(page), encoding="utf-8")
