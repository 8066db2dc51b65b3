"""Every parameter of the monitor, declared once: name, default, unit, bounds, meaning.

The check of config/monitor.yaml, the descriptors of the ROS node and the table in parameters.md follow
from these classes. A section is a class, so `limits.clearance_m` is the parameter's name everywhere.
"""

import attrs

from leg_wear_monitor.configuration import described, quantity
from leg_wear_monitor.mechanism.spec import USUAL_WEAR, WEAR_SLIP
from leg_wear_monitor.monitor.config.inputs import (
    LIVE,
    Cadence,
    Crank,
    DriveTorque,
    Encoders,
    FootLoad,
    Load,
    live_quantity,
)
from leg_wear_monitor.monitor.config.sections import DriveParameters, Forecasting
from leg_wear_monitor.monitor.config.tables import TableInput


def _filled(text: str) -> str | None:
    return None if text else "'' is empty. Expected a name"


@attrs.frozen(kw_only=True)
class Limits:
    """Limits of alarms: ERROR at the limit, WARN at a fraction of it."""

    impact_force_n: float = live_quantity(
        "N",
        "limit of the impact force in a joint (peak of a gait cycle)",
        above=0.0,
        at_most=1.0e7,
        usual=(10.0, 1.0e7),
        doubt="{value:g} N is less than a leg weighs. Is it in kN?",
        default=10000.0,
    )
    clearance_m: float = live_quantity(
        "m", "limit of a joint's mean radial clearance", above=0.0, at_most=0.1, default=0.0006
    )
    joint_clearance_m: tuple[float, ...] = live_quantity(
        "m",
        "clearance limit of each clearance joint, instead of the common one",
        above=0.0,
        at_most=0.1,
        default=(),
    )
    growth_m_per_hour: float = live_quantity(
        "m/h", "limit of the growth of a joint's mean clearance", above=0.0, at_most=1.0, default=1.0e-6
    )
    remaining_life_h: float = live_quantity(
        "h",
        "alarm threshold for a joint's remaining life (p10); 0 raises the alarm only at the end of life",
        within=(0.0, 1.0e6),
        default=0.0,
    )
    torque_mismatch: float = live_quantity(
        "",
        "limit of the torque that load, friction and lag do not explain, as a fraction of the predicted RMS",
        above=0.0,
        at_most=100.0,
        default=0.1,
    )

    def of_clearances(self, joints: int) -> tuple[str, tuple[float, ...]]:
        """The parameter that limits the clearances, and the limit of each of so many clearance joints [m]."""
        if self.joint_clearance_m:
            return "limits.joint_clearance_m", self.joint_clearance_m
        return "limits.clearance_m", (self.clearance_m,) * joints


@attrs.frozen(kw_only=True)
class Alarms:
    """When a level changes."""

    on_delay_cycles: int = live_quantity(
        "", "consecutive gait cycles beyond a limit before the level rises", within=(1, 1000), default=3
    )


@attrs.frozen(kw_only=True)
class LedgerFile:
    """File that stores the wear."""

    path: str = described("file of the ledger; if empty, the wear is lost when the monitor ends", default="")
    # longest time between two entries while the leg moves: a kill of the process loses this much at most
    checkpoint_s: float = 5.0
    skip_counted: bool = described("skip samples whose time is in the ledger already", default=True)


@attrs.frozen(kw_only=True)
class Record:
    """A recording of the messages that the node receives and publishes."""

    path: str = described("MCAP file to write; if empty, the node writes no recording", default="")
    stop_recording_dir: str = described(
        "directory for MCAP files of the 30 s before and 10 s after each stop verdict; if empty, none is "
        "written",
        default="",
    )


@attrs.frozen(kw_only=True)
class TorqueDiagnosis:
    """Clearances that the drive torque shows (docs/explanation/diagnosis.md)."""

    enabled: bool = described("estimate clearances from the drive torque", default=True)
    apply_corrections: bool = described(
        "replace the modelled clearance if the drive torque surely shows a different one",
        default=True,
    )
    reference: str = described(
        "file of torque references of this leg, written by `reference` or `commission`; empty for none",
        default="",
    )
    # mean time of walking between two false findings [h]: 30 days of 8 hours; longer finds changes later
    false_alarm_hours: float = 240.0


@attrs.frozen(kw_only=True)
class MonitorConfig:
    """All parameters; their dotted names are the same in the ROS node and in config/monitor.yaml."""

    mechanism: str = described(
        "mechanism of the leg: a name from the package, or a file",
        default="bionic_leg",
        check=_filled,
    )
    hardware_id: str = described(
        "name of this leg in diagnostics and the ledger; if empty, the namespace of the node, or leg",
        default="",
    )
    clearance_joints: tuple[str, ...] = described(
        "joints with clearance; if empty, the clearance joints of the mechanism file", default=()
    )
    clearances_m: tuple[float, ...] = quantity(
        "m",
        "radial clearances when new, one value for all joints or one per joint; if empty, from the mechanism "
        "file",
        within=(1.0e-6, 0.1),
        default=(),
    )
    wear_coefficients_per_pa: tuple[float, ...] = quantity(
        "1/Pa",
        "K/H of both surfaces, one value for all joints or one per joint; if empty, from the mechanism file",
        within=(0.0, 1.0e-6),
        usual=USUAL_WEAR,
        doubt=WEAR_SLIP,
        default=(),
    )
    wear_acceleration: float = quantity(
        "",
        "factor on all wear, for demonstrations only; values above 1000 cause a warning",
        within=(1.0e-9, 1.0e5),
        default=1.0,
    )
    crank_joint: str = described("name of the crank in joint_states", default="crank", check=_filled)
    crank: Crank = described("", factory=Crank)
    encoders: Encoders = described("", factory=Encoders)
    drive_torque: DriveTorque = described("", factory=DriveTorque)
    drive: DriveParameters = described("", factory=DriveParameters)
    foot_load: FootLoad = described("", factory=FootLoad)
    load: Load = described("", factory=Load)
    table: TableInput = described("", factory=TableInput)
    cadence: Cadence = described("", factory=Cadence)
    limits: Limits = described("", factory=Limits)
    alarms: Alarms = described("", factory=Alarms)
    forecast: Forecasting = described("", factory=Forecasting)
    diagnosis: TorqueDiagnosis = described("", factory=TorqueDiagnosis)
    ledger: LedgerFile = described("", factory=LedgerFile)
    record: Record = described("", factory=Record)
    publish_impact_forces: bool = described(
        "publish the contact forces of every sample", default=True, metadata=LIVE
    )
    publish_scalars: bool = described(
        "publish each value of a joint on its own topic, and the measured torque, for plots",
        default=False,
    )
    publish_markers: bool = described("publish markers for RViz and Foxglove", default=False, metadata=LIVE)
    frame_id: str = described(
        "frame of the pelvis, for wrenches and markers", default="pelvis", check=_filled
    )

    @property
    def hardware(self) -> str:
        """Name of the leg: `hardware_id`, or ``leg``."""
        return self.hardware_id or "leg"

    def on_node(self, node: str) -> "MonitorConfig":
        """Parameters on a node such as ``/left/leg_wear_monitor``, whose namespace may name the leg."""
        namespace = node.strip("/").rpartition("/")[0]
        return attrs.evolve(self, hardware_id=self.hardware_id or namespace)
