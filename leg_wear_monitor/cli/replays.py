"""Results of replays on the command line: which files are written, and which exit code they give."""

from pathlib import Path
from typing import TYPE_CHECKING

from leg_wear_monitor.cli import common
from leg_wear_monitor.files import package_version
from leg_wear_monitor.monitor.alarm_specs import INPUT_KINDS

if TYPE_CHECKING:
    from leg_wear_monitor.playback.summary import ReplayResult


def is_failed(result: "ReplayResult", allow_partial: bool, fail_on: tuple[str, ...]) -> bool:
    """Whether the exit code tells of findings."""
    return (
        (result.is_partial and not allow_partial)
        or is_raised(result, fail_on)
        or result.is_unusable
        or result.monitor.is_all_counted
        or ("verdict" in fail_on and asks_to_act(result))
    )


def asks_to_act(result: "ReplayResult") -> bool:
    """Whether the verdict at the end asks a person to do something, or cannot be given."""
    from leg_wear_monitor.state import State

    return result.monitor.verdict.verdict.state in (State.NOT_MONITORED, State.INSPECT, State.STOP)


def is_raised(result: "ReplayResult", fail_on: tuple[str, ...]) -> bool:
    """Whether an alarm asked for was raised at any time."""
    from leg_wear_monitor.state import Level

    worst = result.history.worst
    highest = max(worst.values(), default=Level.OK)
    if ("alarm" in fail_on and highest is Level.ERROR) or ("warning" in fail_on and highest > Level.OK):
        return True
    asked = {*fail_on, *(INPUT_KINDS if "input" in fail_on else ())}
    return any(level is Level.ERROR and kind in asked for kind, level in worst.items())


def write_replay(
    result: "ReplayResult", wall_s: float, out: Path | None, json_file: Path | None
) -> list[Path]:
    """Write what was asked for, and give the files."""
    if out is None and json_file is None:
        return []
    from leg_wear_monitor.playback.replay import REPORTS_FILE

    summary = result.summary(wall_s, made_with={"leg_wear_monitor": package_version()})
    text = summary.to_json()
    written: list[Path] = []
    if out is not None and not (result.monitor.is_all_counted and (out / common.SUMMARY).exists()):
        files = {common.SUMMARY: text.encode(), common.PAGE: common.page_of(summary)}
        written = [out / REPORTS_FILE, *common.write_directory(out, files)]
    return written + common.write_json(json_file, text)
