"""What a replay found, how it goes out as JSON and as tables, and how it comes back from a file."""

import reprlib
from typing import TYPE_CHECKING, Any

import attrs

from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.data_frame import data_frame
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.json_text import json_text
from leg_wear_monitor.monitor.ledger.entry import Measurement, WalkedLoad
from leg_wear_monitor.monitor.reports import FootLoad, Lost
from leg_wear_monitor.monitor.verdict.verdict import Verdict
from leg_wear_monitor.playback.result.condition import JointClearance, LifeHours
from leg_wear_monitor.playback.result.document import alarms_document, joint_document, part_document
from leg_wear_monitor.playback.result.leg import ReplayLeg
from leg_wear_monitor.playback.result.parts import (
    LegLife,
    ReplayAlarms,
    ReplayJoint,
    ReplayStatus,
    WornDepth,
)
from leg_wear_monitor.playback.result.recording import (
    ReplayGait,
    ReplayMonitor,
    ReplayRecording,
    ReplaySampling,
)
from leg_wear_monitor.playback.result.replay_history import ReplayHistory
from leg_wear_monitor.playback.result.tables import joint_columns
from leg_wear_monitor.shown import Drawable

if TYPE_CHECKING:
    import pandas as pd

SCHEMA_VERSION = 2
"""Of the JSON; counts up when a field is renamed, removed or means something else."""


@attrs.frozen(kw_only=True, eq=False)
class ReplaySummary(Drawable):
    """Results of a replay; its page contains nothing else.

    Attributes
    ----------
    verdict : Verdict
        Conclusion of the monitor on the leg, at the end.
    recording : ReplayRecording
        What was read.
    monitor : ReplayMonitor
        Settings of the monitor.
    leg : ReplayLeg
        The mechanism as a picture needs it; empty in a file of an older version.
    wall_s : float or None
        Wall-clock duration of the replay [s]; None if nobody measured it.
    real_time_factor : float or None
        Duration of the recording, as a multiple of that.
    cycles : int
        Gait cycles.
    gait : ReplayGait
        Whether the motion was a gait of this leg.
    joints : dict of str to ReplayJoint
        Clearance joints; empty without one gait cycle that fits this leg, like the next two.
    clearances : dict of str to JointClearance
        Clearance of each joint, as counted and as measured.
    life : dict of str to LifeHours or None
        Remaining life of each joint, and of the ``leg``; None where it is not known or not
        valid.
    forecast : LegLife or None
        Remaining life of the leg.
    measurements : tuple of Measurement
        Clearances measured by hand, from the ledger.
    walked : tuple of WalkedLoad
        Walking since the start of the ledger, or of the replay without one, by the foot load that acted.
    alarms : ReplayAlarms
        Alarms at the end and their changes.
    status : tuple of ReplayStatus
        Lines of /diagnostics at the end.
    lost : Lost
        Samples and time that were not used.
    sampling : ReplaySampling or None
        How much of the gait was followed; None if all of it was.
    load : FootLoad
        Load at the foot over the last gait cycles.
    history : ReplayHistory
        The gait cycles over time.
    wear_depth_m : dict of str to WornDepth
        Wear around the surfaces of each joint since the start of the ledger, or of the replay without one.
    advice : str
        Limits of the results: the absence of an alarm does not mean the joints are healthy.
    made_with : dict of str to str
        Versions of the programs that made it.
    """

    verdict: Verdict
    recording: ReplayRecording
    monitor: ReplayMonitor
    leg: ReplayLeg = attrs.Factory(ReplayLeg)
    wall_s: float | None = None
    real_time_factor: float | None = None
    cycles: int
    gait: ReplayGait
    joints: dict[str, ReplayJoint]
    clearances: dict[str, JointClearance]
    life: dict[str, LifeHours | None]
    forecast: LegLife | None
    measurements: tuple[Measurement, ...]
    walked: tuple[WalkedLoad, ...] = ()
    alarms: ReplayAlarms
    status: tuple[ReplayStatus, ...]
    lost: Lost
    sampling: ReplaySampling | None = None
    load: FootLoad = FootLoad()
    history: ReplayHistory
    wear_depth_m: dict[str, WornDepth]
    advice: str
    made_with: dict[str, str] = attrs.Factory(dict)

    def to_dict(self) -> dict[str, Any]:
        """Plain object: what ``replay --json`` writes; null for what is not known."""
        record = {name: part_document(part) for name, part in attrs.asdict(self, recurse=False).items()}
        record["joints"] = {name: joint_document(joint) for name, joint in self.joints.items()}
        record["alarms"] = alarms_document(self.alarms)
        return {"schema_version": SCHEMA_VERSION, **record}

    def to_json(self) -> str:
        """Text of ``summary.json``."""
        return json_text(self.to_dict())

    def to_pandas(self) -> "pd.DataFrame":
        """Table with a row for each joint; requires pandas.

        Columns are named as the fields are, parts of a field after a dot: ``forecast.hours.p50``. The column
        ``not_valid`` names the kinds of values that the verdict says are not valid, separated by commas;
        empty if all are. The table over time is `ReplayHistory.to_pandas`, for which it holds as well.

        Raises
        ------
        LegWearError
            If pandas is not installed.
        """
        kinds = ", ".join(figure.value for figure in self.verdict.not_valid)
        columns = joint_columns(self.joints)
        return data_frame({**columns, "not_valid": [kinds] * len(self.joints)}, index="joint")


def summary_of(record: Any, source: str) -> ReplaySummary:
    """The summary of a plain object, as `ReplaySummary.to_dict` gives it.

    Parameters
    ----------
    record : object
        What a file of JSON contains.
    source : str
        Name of the file, for messages.

    Raises
    ------
    ConfigError
        If the object has another version, or is no summary; it names the key at fault.
    """
    record = structure(record, dict[str, Any], source, "")
    version = record.get("schema_version", 1)
    if version != SCHEMA_VERSION:
        fault = f"{reprlib.repr(version)} is not {SCHEMA_VERSION}, the version that this command reads"
        raise ConfigError(source, "schema_version", f"{fault}; replay the recording again")
    parts = {name: part for name, part in record.items() if name != "schema_version"}
    summary: ReplaySummary = structure(parts, ReplaySummary, source, "")
    return summary
