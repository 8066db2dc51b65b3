"""Damaged configurations: parameters, mechanisms, studies and lives, read, and used where that is quick."""

import copy
import io
import json
import math
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from campaign.case import Case, Outcome

LONG = 1280
_ROOT = Path(__file__).parents[3]
_FILES = {
    "parameters": "config/monitor.yaml",
    "mechanism": "config/mechanisms/four_bar.yaml",
    "study": "config/studies/wear.yaml",
    "life": "",
}
_REFUSED, _ANY = True, False  # whether a damage has to be refused, or may be harmless

Document = dict[str, Any]
Damage = Callable[[np.random.Generator, Document], tuple[str, bool, str | bytes]]


def warm() -> None:
    """Import and compile all that reading and a short run need."""
    from leg_wear_monitor.dynamics.simulation import simulate

    for module in ("monitor.forecast.forecaster", "monitor.config.fitting", "studies.execution"):
        import_module(f"leg_wear_monitor.{module}")
    simulate("four_bar", cycles=1.0 / 64.0, skip_cycles=0.0)
    _life_text()


def case(seed: int) -> Case:
    """A file with one damage."""
    rng = np.random.default_rng(seed)
    kind = list(_FILES)[seed % len(_FILES)]
    name, damage = DAMAGES[seed // len(_FILES) % len(DAMAGES)]
    what, must_be_refused, content = damage(rng, _document(kind))
    file = "x.json" if kind == "life" else "x.yaml"
    blob = content.encode("utf-8", "surrogatepass") if isinstance(content, str) else content
    return Case(
        description=f"{kind}, {name}: {what}",
        prepare=lambda directory: (directory / file).write_bytes(blob),
        run=lambda directory: _used(kind, directory / file, must_be_refused),
    )


def _used(kind: str, path: Path, must_be_refused: bool) -> tuple[Outcome, str]:
    """Read a file and use it, as the command line would; its error is one line."""
    from leg_wear_monitor.errors import LegWearError

    try:
        fault = {"parameters": _parameters, "mechanism": _mechanism, "study": _study, "life": _life}[kind](
            path
        )
    except LegWearError as error:
        if "\n" in str(error) or not str(error).isprintable():
            return Outcome.CRASH, f"not a printable line: {str(error)!r}"
        return Outcome.REFUSED, str(error)
    if (path.parent / "pwned").exists():
        return Outcome.SILENT, "code in the file was executed"
    if fault:
        return Outcome.SILENT, fault
    return (Outcome.SILENT, "it was taken") if must_be_refused else (Outcome.SOUND, "")


def _parameters(path: Path) -> str:
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.config.fitting import fitted, parameter_doubts, twin_settings
    from leg_wear_monitor.monitor.config.parameters import PARAMETERS, load_config, values_of
    from leg_wear_monitor.monitor.forecast.wear_coefficients import (
        ClearanceAtWear,
        estimate_coefficient,
        usual_prior,
    )

    config = load_config(path)
    leg = fitted(load_mechanism(config.mechanism), config)
    settings = twin_settings(config)
    parameter_doubts(config, leg)
    prior = usual_prior(config.forecast, leg.clearances[leg.clearance_joints[0]])
    observations = [ClearanceAtWear(3.5e-4, 1e-5, 4e-5)]
    coefficient_estimate = estimate_coefficient(config.forecast, 3e-4, observations, prior)
    numbers = [
        settings.tracker.lag,
        settings.tracker.largest_speed,
        coefficient_estimate.mean,
        coefficient_estimate.sigma,
    ]
    numbers += [config.forecast.duty_hours_per_day**-1, 1.0 / config.crank.gear_ratio]
    if not all(map(math.isfinite, numbers)):
        return f"what follows from it is not finite: {numbers}"
    wrong = [name for name, value in values_of(config).items() if not _within(PARAMETERS[name], value)]
    return f"beyond its own bounds: {wrong}" if wrong else ""


def _within(parameter: Any, value: Any) -> bool:
    numbers = value if isinstance(value, tuple) else (value,)
    if parameter.type not in ("double", "double_array", "integer"):
        return True
    return all(
        math.isfinite(number)
        and (parameter.above is None or number > parameter.above)
        and (parameter.at_least is None or number >= parameter.at_least)
        and (parameter.at_most is None or number <= parameter.at_most)
        for number in numbers
    )


def _mechanism(path: Path) -> str:
    from leg_wear_monitor.dynamics.simulation import simulate
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.mechanism.spec import SpeedDrive

    leg = load_mechanism(path)
    span = (
        {"cycles": 1.0 / 64.0, "skip_cycles": 0.0}
        if isinstance(leg.drive, SpeedDrive)
        else {"duration_s": 1e-4}
    )
    result = simulate(leg, **span).to_dict()
    return "" if _finite(result) else f"a result is not finite: {result['drive_torque_nm']}"


def _study(path: Path) -> str:
    from leg_wear_monitor.studies.execution import load_settings

    points = load_settings("wear", path).points()
    wrong = [point.label for point in points if not (math.isfinite(point.cost) and point.cost > 0.0)]
    return f"points without a cost: {wrong}" if wrong or not points else ""


def _life(path: Path) -> str:
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.forecast.forecaster import law_of

    law = law_of(load_mechanism("four_bar"), str(path), 0.4)
    known = bool(np.isfinite(law.coupling).all() and np.isfinite(law.sigma).all())
    return "" if known else "the law of growth is not finite"


def _finite(value: Any) -> bool:
    if isinstance(value, dict):
        return all(map(_finite, value.values()))
    if isinstance(value, list | tuple):
        return all(map(_finite, value))
    return not isinstance(value, float) or math.isfinite(value)


# --- whole files ---


def _document(kind: str) -> Document:
    if kind == "life":
        return json.loads(_life_text())
    return YAML(typ="safe", pure=True).load((_ROOT / _FILES[kind]).read_text())


_LIFE: list[str] = []


def _life_text() -> str:
    """Five lives of the four-bar, made up, and bound to it."""
    if not _LIFE:
        from leg_wear_monitor.mechanism.loader import load_mechanism
        from leg_wear_monitor.monitor.ledger.entry import fingerprint

        leg = load_mechanism("four_bar")
        lives = []
        for i in range(5):
            growth = {joint: [1e-12 * (1.0 + 0.1 * p) for p in range(4)] for joint in leg.clearance_joints}
            lives.append(
                {
                    "wear_factor": {
                        joint: 1.0 + 0.2 * i * (k + 1) for k, joint in enumerate(leg.clearance_joints)
                    },
                    "cycles": [0.0, 1e8, 2e8, 3e8],
                    "joints": {
                        joint: {"clearance_m": [2e-4, 3e-4, 4e-4, 5e-4], "growth_m_per_cycle": growth[joint]}
                        for joint in leg.clearance_joints
                    },
                }
            )
        first, *further = lives
        _LIFE.append(
            json.dumps(
                {"mechanism": "four_bar", "fingerprint": fingerprint(leg), **first, "further": further}
            )
        )
    return _LIFE[0]


def _text(document: Any) -> str:
    """A document as its file has it: a life is JSON, all others are YAML."""
    if isinstance(document, dict) and "fingerprint" in document:
        return json.dumps(document)
    stream = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.dump(document, stream)
    return stream.getvalue()


def _leaves(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[tuple[Any, ...], Any]]:
    parts = (
        value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
    )
    if parts is None:
        return [(path, value)]
    return [leaf for key, part in parts for leaf in _leaves(part, (*path, key))]


def _numbers(document: Document) -> list[tuple[tuple[Any, ...], Any]]:
    return [
        leaf
        for leaf in _leaves(document)
        if isinstance(leaf[1], int | float) and not isinstance(leaf[1], bool)
    ]


def _with(document: Document, path: tuple[Any, ...], value: Any) -> Document:
    changed = copy.deepcopy(document)
    place: Any = changed
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return changed


def _pick(rng: np.random.Generator, of: list[Any]) -> Any:
    return of[int(rng.integers(len(of)))]


def _mapping_paths(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    if not isinstance(value, dict):
        return []
    return [path, *(found for key, part in value.items() for found in _mapping_paths(part, (*path, key)))]


def _at(document: Document, path: tuple[Any, ...]) -> Any:
    place: Any = document
    for key in path:
        place = place[key]
    return place


# --- damages ---


def _wrong_type(rng: np.random.Generator, document: Document) -> tuple[str, bool, str]:
    path, was = _pick(rng, _numbers(document))
    value = _pick(rng, ["heavy", True, {"a": 1}, [[1.0]], "3.5 mm"])
    return f"{path}: {was!r} > {value!r}", _REFUSED, _text(_with(document, path, value))


def _any_type(rng: np.random.Generator, document: Document) -> tuple[str, bool, str]:
    path, was = _pick(rng, _leaves(document))
    value = _pick(
        rng, [None, 7, -1.5, "", "x" * 5000, [], {}, [None], "a\nb", "\x1b[31mred", 10**400, "\ud800"]
    )
    return f"{path}: {was!r} > {str(value)[:40]!r}", _ANY, _text(_with(document, path, value))


def _not_finite(rng: np.random.Generator, document: Document) -> tuple[str, bool, str]:
    path, was = _pick(rng, _numbers(document))
    value = _pick(rng, [math.nan, math.inf, -math.inf])
    return f"{path}: {was!r} > {value!r}", _REFUSED, _text(_with(document, path, value))


def _extreme(rng: np.random.Generator, document: Document) -> tuple[str, bool, str]:
    path, was = _pick(rng, _numbers(document))
    value = _pick(
        rng, [5e-324, -5e-324, 1e-300, 1e300, 1.7e308, -0.0, 0.0, 1e-31, 1e-29, 1e29, 10**30, -(10**30)]
    )
    return f"{path}: {was!r} > {value!r}", _ANY, _text(_with(document, path, value))


def _scaled(rng: np.random.Generator, document: Document) -> tuple[str, bool, str]:
    path, was = _pick(rng, _numbers(document))
    factor = _pick(rng, [1e-9, 1e-3, 1e3, 1e9, -1.0, 57.29577951308232, 9.549, 0.5, 2.0])
    value = float(was) * factor
    return f"{path}: {was!r} > {value!r}", _ANY, _text(_with(document, path, value))


def _unknown(rng: np.random.Generator, document: Document) -> tuple[str, bool, str]:
    path = _pick(rng, _mapping_paths(document)[1:] or [()])
    changed = copy.deepcopy(document)
    _at(changed, path)["no_such_key"] = 1
    # what is not read of a life does no harm
    return f"{path}: an unknown key", "fingerprint" not in document, _text(changed)


def _missing(rng: np.random.Generator, document: Document) -> tuple[str, bool, str]:
    paths = [path for path in _mapping_paths(document) if _at(document, path)]
    path = _pick(rng, paths)
    changed = copy.deepcopy(document)
    key = _pick(rng, list(_at(changed, path)))
    del _at(changed, path)[key]
    return f"{path}: without {key!r}", _ANY, _text(changed)


def _twice(rng: np.random.Generator, document: Document) -> tuple[str, bool, str]:
    lines = _text(document).splitlines()
    at = _pick(
        rng, [i for i, line in enumerate(lines) if ": " in line and not line.lstrip().startswith("- ")]
    )
    return f"line {at + 1} twice: {lines[at]!r}", _REFUSED, "\n".join([*lines[: at + 1], *lines[at:]]) + "\n"


def _swapped(rng: np.random.Generator, document: Document) -> tuple[str, bool, str]:
    (one, a), (other, b) = _pick(rng, _leaves(document)), _pick(rng, _leaves(document))
    return f"{one} and {other} swapped", _ANY, _text(_with(_with(document, one, b), other, a))


def _trick(rng: np.random.Generator, document: Document) -> tuple[str, bool, str | bytes]:
    text = _text(document)
    laughs = "a0: &a0 {x: 1, y: 2}\n" + "".join(
        f"a{i + 1}: &a{i + 1} {{x: *a{i}, y: *a{i}, z: *a{i}}}\n" for i in range(30)
    )
    tricks: list[tuple[str, bool, str | bytes]] = [
        ("aliases of aliases", _REFUSED, text + laughs),
        ("holds itself", _REFUSED, "all: &x {a: *x}\n" + text),
        ("a document that holds itself", _REFUSED, "/**: &x {ros__parameters: *x}\n"),
        ("code as a tag", _REFUSED, text + "run: !!python/object/apply:os.system ['touch pwned']\n"),
        ("a tag of another type", _REFUSED, text + "t: !!int many\n"),
        ("a set", _REFUSED, text + "s: !!set {a, b}\n"),
        ("a merge of nothing", _REFUSED, text + "<<: *nothing\n"),
        ("a merge of a text", _REFUSED, text + "<<: text\n"),
        ("brackets", _REFUSED, text + "a: " + "[" * int(rng.integers(50, 20000))),
        ("closed brackets", _REFUSED, text + "a: " + "[" * 200 + "]" * 200 + "\n"),
        ("two documents", _REFUSED, text + "---\n" + text),
        ("byte order mark", _ANY, b"\xef\xbb\xbf" + text.encode()),
        ("utf-16", _REFUSED, text.encode("utf-16")),
        ("latin-1", _REFUSED, text.encode() + "\nname2: Bücher\n".encode("latin-1")),
        ("a NUL", _REFUSED, text.encode() + b"\x00"),
        ("random bytes", _REFUSED, rng.bytes(int(rng.integers(1, 4000)))),
        ("empty", _ANY, ""),
        ("a comment only", _ANY, "# nothing\n"),
        ("null", _REFUSED, "null\n"),
        ("a number", _REFUSED, "7\n"),
        ("a list", _REFUSED, "- 1\n- 2\n"),
        ("other line ends", _ANY, text.replace("\n", "\r\n")),
        ("tabs", _REFUSED, text.replace("\n", "\n\t")),
        ("a very long line", _REFUSED, text + "long: " + "x" * 2_000_000 + "\n"),
        ("a complex key", _REFUSED, text + "? [1, 2]\n: 3\n"),
        ("a date", _REFUSED, text + "d: 2001-13-45\n"),
        ("an old version", _ANY, "%YAML 1.1\n---\n" + text),
        ("an escape in a key", _REFUSED, text + '"\\e[31mred": 1\n'),
    ]
    name, refused, content = _pick(rng, tricks)
    return name, refused and "fingerprint" not in document, content


def _flipped(rng: np.random.Generator, document: Document) -> tuple[str, bool, bytes]:
    content = bytearray(_text(document).encode())
    many = int(rng.integers(1, 6))
    for _ in range(many):
        content[int(rng.integers(len(content)))] ^= 1 << int(rng.integers(8))
    return f"{many} bits flipped", _ANY, bytes(content)


def _cut(rng: np.random.Generator, document: Document) -> tuple[str, bool, bytes]:
    content = _text(document).encode()
    at = int(rng.integers(len(content)))
    return f"cut at byte {at}", _ANY, content[:at]


def _doubled_list(rng: np.random.Generator, document: Document) -> tuple[str, bool, str]:
    paths = sorted(
        {path[:-1] for path, _ in _leaves(document) if path and isinstance(path[-1], int)}, key=str
    )
    if not paths:
        return "no list", _ANY, _text(document)
    path = _pick(rng, paths)
    return f"{path}: its list twice", _ANY, _text(_with(document, path, 2 * _at(document, path)))


DAMAGES: list[tuple[str, Damage]] = [
    ("wrong type", _wrong_type),
    ("any type", _any_type),
    ("not finite", _not_finite),
    ("extreme", _extreme),
    ("extreme again", _extreme),
    ("scaled", _scaled),
    ("scaled again", _scaled),
    ("unknown key", _unknown),
    ("missing key", _missing),
    ("duplicate key", _twice),
    ("swapped", _swapped),
    ("trick", _trick),
    ("trick again", _trick),
    ("third trick", _trick),
    ("bits", _flipped),
    ("cut", _cut),
    ("list", _doubled_list),
]

SHORT = len(_FILES) * len(DAMAGES)
