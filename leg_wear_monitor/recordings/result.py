"""The result of a replay as classes, which give JSON and tables."""

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from typing import TYPE_CHECKING, Any, get_args

import attrs

from leg_wear_monitor.configuration.strict import structure_of_version
from leg_wear_monitor.files import data_frame, finite_or_none
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.materials import BushingLoad
from leg_wear_monitor.monitor.config.settings import Limits
from leg_wear_monitor.monitor.forecast.forecast import JointForecast, LegForecast
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.monitor.reports import ClearanceObservation, Lost
from leg_wear_monitor.recordings.findings import Finding
from leg_wear_monitor.state import SCHEMA_VERSION, JointClearance, LegState, Level

if TYPE_CHECKING:
    import pandas as pd


# The leg that was replayed, as a picture needs it: shapes at crank angle 0, joints with their labels.


Place = tuple[float, float]


@attrs.frozen(kw_only=True)
class LegJoint:
    """A joint.

    Attributes
    ----------
    label : str
        Name for operators, such as ``knee``; empty if the mechanism file has no label.
    place_m : tuple of float
        Its place at crank angle 0.
    is_on_ground : bool
        True if it joins a body to the ground.
    """

    label: str
    place_m: Place
    is_on_ground: bool


@attrs.frozen(kw_only=True)
class ReplayLeg:
    """The mechanism in its plane [m], x to the right and y up.

    Attributes
    ----------
    bodies_m : dict of str to tuple of tuples
        Corners of each moving body.
    joints : dict of str to LegJoint
        All joints, those without clearance too.
    """

    bodies_m: dict[str, tuple[Place, ...]] = attrs.Factory(dict)
    joints: dict[str, LegJoint] = attrs.Factory(dict)

    def joint_words(self, joint: str) -> str:
        """A joint by its name and its label, such as ``G (knee)``."""
        label = self.joints[joint].label if joint in self.joints else ""
        return f"{joint} ({label})" if label else joint


# The leg after a replay: joints, remaining life, alarms, status. SI units; None for unknown values.


def _known_values(values: Mapping[str, float | None]) -> dict[str, float | None]:
    return {name: finite_or_none(value) for name, value in values.items()}


def _perhaps() -> Any:
    """Attrs field for a number that may not be known: NaN and infinity become None."""
    return attrs.field(converter=finite_or_none)


@attrs.frozen(kw_only=True)
class EncoderEvidence:
    """Evidence of further encoders about a clearance; see `monitor.reports.ClearanceEstimate`.

    Attributes
    ----------
    observation : ClearanceObservation
        State of the observation: whether the encoders show the clearance, and the reason if not.
    departure_m : float or None
        Clearance estimated from the encoders, minus the modelled clearance.
    sigma_m : float or None
        Its standard deviation.
    believed : bool
        True if the forecast uses it.
    is_other : bool
        True if the difference is significant.
    """

    observation: ClearanceObservation
    departure_m: float | None = _perhaps()
    sigma_m: float | None = _perhaps()
    believed: bool
    is_other: bool


@attrs.frozen(kw_only=True)
class ReplayJoint:
    """Growth, forces and forecast of a clearance joint; its clearance is in ``clearances``.

    Attributes
    ----------
    opened_m : float or None
        Growth of the modelled clearance from the first to the last gait cycle of the replay.
    growth_m_per_cycle : float or None
        Growth of the modelled clearance in a gait cycle; None while there is not enough data.
    growth_error_m_per_cycle : float or None
        Standard deviation of its error.
    growth_mps : float or None
        Growth of the modelled clearance per second of walking.
    forecast : JointForecast or None
        Remaining life; None before the first forecast.
    peak_force_n : float or None
        Largest contact force.
    mean_force_n : float or None
        Mean contact force over all gait cycles.
    encoders : EncoderEvidence or None
        Evidence of further encoders about the clearance; None without such encoders.
    impacts : int
        Number of impacts.
    load : BushingLoad or None
        Pressure and sliding speed in the last gait cycle, and the limits of the joint's material; None if
        they are not known.
    """

    opened_m: float | None = _perhaps()
    growth_m_per_cycle: float | None = _perhaps()
    growth_error_m_per_cycle: float | None = _perhaps()
    growth_mps: float | None = _perhaps()
    forecast: JointForecast | None
    peak_force_n: float | None = _perhaps()
    mean_force_n: float | None = _perhaps()
    encoders: EncoderEvidence | None = None
    impacts: int
    load: BushingLoad | None = None


@attrs.frozen(kw_only=True)
class ReplayStatus:
    """A line of /diagnostics at the end.

    Attributes
    ----------
    name : str
        Name of the status, such as ``joint A``.
    level : Level
        Level of the status.
    message : str
        The status in words.
    values : dict of str to float or None
        Values of the status; each key ends in its unit.
    fault_code : str
        Stable name of the fault; empty in a file of an older version.
    """

    name: str
    level: Level
    message: str
    values: dict[str, float | None] = attrs.field(converter=_known_values)
    fault_code: str = ""


@attrs.frozen(eq=False)
class WornDepth:
    """Wear depth (N,) [m] around both surfaces of a joint, by sector.

    Attributes
    ----------
    bushing : (N,) array
        Wear depth by sector of the bushing's frame; the first sector starts at angle 0.
    journal : (N,) array
        Wear depth by sector of the journal's frame.
    """

    bushing: Floats
    journal: Floats


# Input of a replay: the recording, the settings of the monitor, and whether both fit together.


@attrs.frozen(kw_only=True)
class ReplayRecording:
    """The recording that the replay read.

    Attributes
    ----------
    files : tuple of str
        Files that were read.
    topics : dict of str to str
        Topic that was read, by its relative name in the node.
    time : str
        Source of the stamps: ``header`` or ``log``.
    is_partial : bool
        True if recorded data are lost or may be wrong.
    findings : tuple of Finding
        Faults of the recording.
    crank_samples : int
        Number of samples of the crank.
    torque_samples : int
        Number of samples of the drive torque.
    begin_ns : int
        First stamp [ns]; 0 without samples.
    end_ns : int
        Last stamp [ns]; 0 without samples.
    duration_s : float
        Time between the two [s].
    """

    files: tuple[str, ...]
    topics: dict[str, str]
    time: str
    is_partial: bool
    findings: tuple[Finding, ...]
    crank_samples: int
    torque_samples: int
    begin_ns: int
    end_ns: int
    duration_s: float


@attrs.frozen(kw_only=True)
class ReplayMonitor:
    """Settings of the monitor that the results depend on.

    Attributes
    ----------
    mechanism : str
        Name of the mechanism.
    hardware_id : str
        Which leg this is.
    clearance_joints : tuple of str
        Joints with modelled wear.
    commanded_rpm : float
        Cadence that the gait should have.
    wear_acceleration : float
        Factor on all wear.
    bushing_radius_m : dict of str to float
        Radius of the bushing.
    limits : Limits
        Limits of the alarms.
    """

    mechanism: str
    hardware_id: str
    clearance_joints: tuple[str, ...]
    commanded_rpm: float
    wear_acceleration: float
    bushing_radius_m: dict[str, float]
    limits: Limits


@attrs.frozen(kw_only=True)
class ReplayGait:
    """Result of the check that the motion was a gait of this leg.

    Attributes
    ----------
    believable_cycles : int
        Gait cycles that fit this leg.
    doubtful_cycles : int
        Gait cycles that do not.
    missing : str
        Why none fits; empty if one does.
    is_counted : bool
        True if all of the recording was in the ledger already.
    """

    believable_cycles: int
    doubtful_cycles: int
    missing: str
    is_counted: bool


# A replay over time: gait cycles as columns, thinned where they are many.


@attrs.frozen(kw_only=True, eq=False)
class ReplayHistory:
    """Columns over n groups of gait cycles: last value of each; maximum of peaks, sum of impacts.

    A value is NaN if it is not known. Values per joint are arrays, keyed by the joint's name.

    Attributes
    ----------
    stamp_ns : (n,) array
        End of the last gait cycle [ns].
    cycle : (n,) array
        Number of that gait cycle over the whole life in the ledger.
    cadence_rpm : (n,) array
        Mean crank speed while moving.
    moving_s : (n,) array
        Time in motion.
    bridged_s : (n,) array
        Part of the moving time that bridges gaps.
    measured_torque_rms_nm : (n,) array
        RMS of the measured drive torque.
    predicted_torque_rms_nm : (n,) array
        RMS of the predicted drive torque.
    torque_mismatch : (n,) array
        Fraction of the predicted RMS that load, friction and lag do not explain.
    load_n : (n,) array
        Foot load, as estimated, up positive.
    friction_nm : (n,) array
        Friction of the drive, as estimated.
    modelled_m : dict of str to (n,) array
        Modelled mean radial clearance around the bushing.
    modelled_max_m : dict of str to (n,) array
        Modelled largest radial clearance around the bushing.
    growth_m_per_cycle : dict of str to (n,) array
        Growth of the mean clearance in a gait cycle.
    peak_force_n : dict of str to (n,) array
        Largest contact force.
    p99_force_n : dict of str to (n,) array
        Contact force that is not exceeded 99 % of the time.
    mean_force_n : dict of str to (n,) array
        Mean contact force.
    impacts : dict of str to (n,) array
        Number of impacts.
    estimated_m : dict of str to (n,) array
        Mean radial clearance estimated from the encoders or the drive torque, by the more certain
        source; empty in a file of an older version.
    estimated_sigma_m : dict of str to (n,) array
        Its standard deviation; empty in a file of an older version.
    """

    stamp_ns: Ints
    cycle: Floats
    cadence_rpm: Floats
    moving_s: Floats
    bridged_s: Floats
    measured_torque_rms_nm: Floats
    predicted_torque_rms_nm: Floats
    torque_mismatch: Floats
    load_n: Floats
    friction_nm: Floats
    modelled_m: dict[str, Floats]
    modelled_max_m: dict[str, Floats]
    growth_m_per_cycle: dict[str, Floats]
    peak_force_n: dict[str, Floats]
    p99_force_n: dict[str, Floats]
    mean_force_n: dict[str, Floats]
    impacts: dict[str, Floats]
    estimated_m: dict[str, Floats] = attrs.Factory(dict)
    estimated_sigma_m: dict[str, Floats] = attrs.Factory(dict)

    def columns(self) -> dict[str, Floats | Ints]:
        """Columns of a table over time; a joint's value after a dot: ``modelled_m.A``."""
        columns: dict[str, Floats | Ints] = {}
        for name, value in attrs.asdict(self, recurse=False).items():
            if isinstance(value, dict):
                columns |= {f"{name}.{joint}": column for joint, column in value.items()}
            else:
                columns[name] = value
        return columns

    def to_pandas(self) -> "pd.DataFrame":
        """Table of `columns` by stamp [ns]; requires pandas.

        Raises
        ------
        LegWearError
            If pandas is not installed.
        """
        return data_frame(self.columns(), index="stamp_ns")


# Results of a replay as columns of tables: a value's name is its path, parts after a dot.


_Path = tuple[str, ...]


def columns_of(kind: type, parts: Sequence[Any]) -> dict[str, list[Any]]:
    """One row per part of a class; None for a value that is unknown or absent."""
    return {".".join(path): [_value(part, path) for part in parts] for path in _paths(kind)}


def _paths(kind: type) -> Iterator[_Path]:
    """Paths of all plain values below a class of parts."""
    for field in attrs.fields(attrs.resolve_types(kind)):
        part = next((each for each in (field.type, *get_args(field.type)) if attrs.has(each)), None)
        if part is None:
            yield (field.name,)
        else:
            yield from ((field.name, *inner) for inner in _paths(part))


def _value(part: Any, path: _Path) -> Any:
    for name in path:
        part = None if part is None else getattr(part, name)
    if isinstance(part, tuple):
        return ", ".join(part)
    return part.value if isinstance(part, Enum) else part


# Results of a replay, their JSON and tables, and their reading from a file.


@attrs.frozen(kw_only=True, eq=False)
class ReplaySummary(LegState):
    """The state of the leg after a replay, and the issues of the recording; its page contains nothing else.

    Attributes
    ----------
    recording : ReplayRecording
        The recording that was read.
    monitor : ReplayMonitor
        Settings of the monitor.
    leg : ReplayLeg
        The mechanism as a picture needs it; empty in a file of an older version.
    wall_s : float or None
        Wall-clock duration of the replay [s]; None if it was not measured.
    real_time_factor : float or None
        Duration of the recording divided by the wall-clock duration.
    cycles : int
        Gait cycles.
    gait : ReplayGait
        Result of the check that the motion was a gait of this leg.
    joints : dict of str to ReplayJoint
        Clearance joints; empty without one gait cycle that fits this leg, like ``clearances`` and ``life``.
    forecast : LegForecast or None
        Remaining life of the leg.
    measurements : tuple of Measurement
        Clearances measured by hand, from the ledger.
    status : tuple of ReplayStatus
        Lines of /diagnostics at the end. After a measurement or a repair in the ledger of a fleet's leg: the
        verdict's lines, and the lines of the recording that are still valid.
    lost : Lost
        Samples and time that were not used.
    history : ReplayHistory
        The gait cycles over time.
    wear_depth_m : dict of str to WornDepth
        Wear around the surfaces of each joint since the start of the ledger, or of the replay without one.
    advice : str
        Limits of the results: the absence of an alarm does not mean the joints are healthy.
    made_with : dict of str to str
        Versions of the programs that made it.
    """

    recording: ReplayRecording
    monitor: ReplayMonitor
    leg: ReplayLeg = attrs.Factory(ReplayLeg)
    wall_s: float | None = None
    real_time_factor: float | None = None
    cycles: int
    gait: ReplayGait
    joints: dict[str, ReplayJoint]
    forecast: LegForecast | None
    measurements: tuple[Measurement, ...]
    status: tuple[ReplayStatus, ...]
    lost: Lost
    history: ReplayHistory
    wear_depth_m: dict[str, WornDepth]
    advice: str
    made_with: dict[str, str] = attrs.Factory(dict)

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
        columns = {
            "joint": list(self.joints),
            **columns_of(JointClearance, [self.clearances[joint] for joint in self.joints]),
            **columns_of(ReplayJoint, list(self.joints.values())),
            "not_valid": [kinds] * len(self.joints),
        }
        return data_frame(columns, index="joint")


def summary_of(record: Any, source: str) -> ReplaySummary:
    """The summary of a plain object, as `ReplaySummary.to_dict` gives it.

    Parameters
    ----------
    record : object
        Contents of a JSON file.
    source : str
        Name of the file, for messages.

    Raises
    ------
    ConfigError
        If the object has a different version, or is not a summary; the message names the key at fault.
    """
    again = "replay the recording again"
    return structure_of_version(record, ReplaySummary, SCHEMA_VERSION, source, again, missing=1)
