"""The line of a recording in a leg's log."""

from leg_wear_monitor.fleet.chain.record import Outcome
from leg_wear_monitor.fleet.directory.leg_directory import Line


def words_of(line: Line) -> str:
    """What became of a recording, on one line."""
    parts = [line["file"] + ": " + line["outcome"].replace("_", " ")]
    if line["outcome"] == Outcome.COUNTED.value:
        verdict = line["verdict"]
        parts[0] += f", {line['cycles']} gait cycles, verdict {verdict['state'].replace('_', ' ')}"
        parts[0] += f" ({verdict['fault_code']})"
    if line["is_late"]:
        parts.append("a later recording was counted before it")
    if line["is_partial"]:
        parts.append("parts of it are lost")
    return "; ".join([*parts, *line["findings"]])
