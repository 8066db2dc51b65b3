"""The line of a recording in a leg's log."""

from leg_wear_monitor.fleet.chain.record import Outcome
from leg_wear_monitor.fleet.directory.leg_directory import Line


def words_of(line: Line) -> str:
    """What became of a recording, on one line."""
    is_counted = line["outcome"] == Outcome.COUNTED.value
    parts = [line["file"] + ": " + line["outcome"].replace("_", " ")]
    if is_counted:
        verdict = line["verdict"]
        parts[0] += f", {line['cycles']} gait cycles, verdict {verdict['state'].replace('_', ' ')}"
        parts[0] += f" ({verdict['fault_code']})"
    if line["is_late"]:
        parts.append("a later recording was counted before it")
    skipped = (line["lost"] or {}).get("already_counted", 0)
    if skipped and is_counted:
        parts.append(f"{skipped} samples of times in the ledger are not counted again")
    if line["is_partial"]:
        parts.append("parts of it are lost")
    return "; ".join([*parts, *line["findings"]])
