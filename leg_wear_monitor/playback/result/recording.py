"""What was replayed: the recording, the settings of the monitor, and whether both fit together."""

import attrs

from leg_wear_monitor.bags.findings import Severity
from leg_wear_monitor.monitor.config.settings import Limits


@attrs.frozen(kw_only=True)
class ReplayFinding:
    """A fault of the recording.

    Attributes
    ----------
    file : str
        File in which it was found.
    text : str
        What was found, on one line.
    weight : Severity
        Effect on the result: ``loss`` if data are lost or may be wrong.
    """

    file: str
    text: str
    weight: Severity


@attrs.frozen(kw_only=True)
class ReplayRecording:
    """What was read.

    Attributes
    ----------
    files : tuple of str
        Files that were read.
    topics : dict of str to str
        Topic that was read, by its relative name in the node.
    time : str
        Source of the stamps: ``header``, ``log`` or ``publish``.
    is_partial : bool
        Whether recorded data are lost or may be wrong.
    findings : tuple of ReplayFinding
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
    findings: tuple[ReplayFinding, ...]
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
        Joints whose wear is counted.
    commanded_rpm : float
        Cadence that the gait should have.
    wear_acceleration : float
        Factor on all wear.
    bushing_radius_m : dict of str to float
        Radius of the bushing.
    limits : Limits
        Limits of the alarms.
    duty_hours_per_day : float
        Usual walking a day.
    """

    mechanism: str
    hardware_id: str
    clearance_joints: tuple[str, ...]
    commanded_rpm: float
    wear_acceleration: float
    bushing_radius_m: dict[str, float]
    limits: Limits
    duty_hours_per_day: float


@attrs.frozen(kw_only=True)
class ReplaySampling:
    """How much of the gait was followed in a sampled replay.

    Attributes
    ----------
    fraction : float
        Fraction of the gait cycles that was asked for.
    followed_cycles : int
        Gait cycles that were followed and counted.
    estimated_cycles : float
        Gait cycles that were tracked only: their wear is estimated, their forces are not known.
    blocks : int
        Blocks of followed gait cycles with one cadence and load.
    """

    fraction: float
    followed_cycles: int
    estimated_cycles: float
    blocks: int


@attrs.frozen(kw_only=True)
class ReplayGait:
    """Whether the motion was a gait of this leg.

    Attributes
    ----------
    believable_cycles : int
        Gait cycles that fit this leg.
    doubtful_cycles : int
        Gait cycles that do not.
    missing : str
        Why none fits; empty if one does.
    is_counted : bool
        Whether all of the recording was in the ledger already.
    """

    believable_cycles: int
    doubtful_cycles: int
    missing: str
    is_counted: bool
