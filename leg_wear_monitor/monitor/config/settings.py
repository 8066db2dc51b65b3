"""Every parameter of the monitor, declared once: name, default, unit, bounds, meaning.

The check of config/monitor.yaml, the descriptors of the ROS node and the table in parameters.md follow
from these classes. A section is a class, so `limits.clearance_m` is the parameter's name everywhere.
"""

import attrs

from leg_wear_monitor.configuration import USUAL, described, quantity
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.estimate.drive import DriveFigures
from leg_wear_monitor.mechanism.materials import LIBRARY, Drive, load_drive
from leg_wear_monitor.mechanism.spec import USUAL_WEAR, WEAR_SLIP
from leg_wear_monitor.monitor.config.inputs import (
    LIVE,
    MAX_LAG_S,
    Cadence,
    Crank,
    DriveTorque,
    Encoders,
    FootLoad,
    Load,
    filled,
    live_quantity,
)
from leg_wear_monitor.monitor.config.tables import TableInput

# Declared values of the drive: a file by name, and numbers that override it.


def _figure(
    unit: str, doc: str, most: float, usual: tuple[float, float], slip: str, otherwise: str = "an estimate"
) -> float:
    """Parameter for a declared value, 0 if it is not declared; ``slip`` is the unit that is likely meant.

    The usual range includes all drives of config/drives and measured drives, with a factor of ten and more:
    geared servos of 0.4 N m to harmonic drives of 100, belts, springs in series.
    """
    number: float = quantity(
        unit,
        f"{doc}; 0 takes the value of drive.type or {otherwise}",
        within=(0.0, most),
        usual=usual,
        doubt=f"{USUAL}. Is it in {slip}?" if slip else USUAL,
        default=0.0,
    )
    return number


@attrs.frozen(kw_only=True)
class DriveParameters:
    """Declared values of the drive; all others are estimated. The numbers are at the crank."""

    type: str = described(
        "drive: a name from `leg-wear-monitor drives`, or a file; empty if unknown", default=""
    )
    gear_ratio: float = quantity(
        "",
        "turns of the drive's output per turn of the crank, for the values of drive.type",
        within=(1.0e-4, 1.0e4),
        default=1.0,
    )
    lag_s: float = _figure("s", "delay of the measured torque", 1.0, (0.0, 0.1), "ms")
    bandwidth_hz: float = _figure(
        "Hz",
        "corner frequency of the low-pass between crank torque and measured torque",
        1.0e5,
        (1.0, 2.0e4),
        "kHz",
    )
    stiffness_nm_per_rad: float = _figure(
        "N m/rad",
        "stiffness between the measured angle and the crank, at the crank",
        1.0e12,
        (5.0, 1.0e7),
        "",
        otherwise="a rigid drive",
    )
    temperature_interface: str = described(
        "interface of the crank in dynamic_joint_states with the temperature of the drive [°C]; needs "
        "drive_torque.source interface; empty for none",
        default="",
    )

    @property
    def largest_lag_s(self) -> float:
        """Largest lag that a torque may have: the declared lag of the drive, and `MAX_LAG_S`."""
        return MAX_LAG_S + drive_figures(self).lateness_s


def drive_figures(parameters: DriveParameters, source: str = "parameters") -> DriveFigures:
    """Declared values of a drive at the crank: the values of its file, overridden by the numbers.

    Parameters
    ----------
    parameters : DriveParameters
    source : str
        Origin of the parameters, for messages.

    Raises
    ------
    ConfigError
        If there is no drive of this name, with the nearest name, or if its file has a fault.
    """
    figures = DriveFigures()
    if parameters.type:
        fault = LIBRARY.unknown(parameters.type)
        if fault:
            raise ConfigError(source, "drive.type", f"{parameters.type!r}: {fault}")
        figures = _of_file(load_drive(parameters.type), parameters.gear_ratio)
    given = {name: getattr(parameters, name) for name in ("lag_s", "bandwidth_hz", "stiffness_nm_per_rad")}
    return attrs.evolve(figures, **{name: value for name, value in given.items() if value})


def _of_file(drive: Drive, output_turns: float) -> DriveFigures:
    """Values of a file at a crank; the drive's output makes some turns for one turn of the crank."""
    turns = output_turns * drive.motor_turns
    factors = {
        "lag_s": (drive.lag, 1.0),
        "bandwidth_hz": (drive.bandwidth, 1.0),
        "load_friction": (drive.load_friction, 1.0),
        "coulomb_nm": (drive.coulomb, turns),
        "viscous_nms": (drive.viscous, turns**2),
        "stiffness_nm_per_rad": (drive.stiffness, turns**2),
    }
    return DriveFigures(**{name: value.si * by for name, (value, by) in factors.items() if value is not None})


# Parameters of the forecast: uncertain quantities and their standard deviations.


@attrs.frozen(kw_only=True)
class Forecasting:
    """Uncertainties of the forecast as standard deviations; for factors, of the natural logarithm.

    Values without a description are constants of the method, not parameters.
    """

    load_sigma: float = 0.1  # spread of future wear per cycle, because load and pace vary
    # departure of the growth until the limit from the rise that `cycles_to` assumes: simulated lives had less
    model_sigma: float = 0.4
    # spread of a new joint's clearance as a fraction of it: the limits of a running fit are ± 20 % of its
    # mean
    new_clearance_sigma: float = 0.1
    window_cycles: int = 2000  # over which growth is averaged, because single gait cycles scatter


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

    def of_joint_m(self, k: int) -> float:
        """Limit of the clearance of joint k [m]: its own if there are limits per joint, or the common one."""
        return self.joint_clearance_m[k] if self.joint_clearance_m else self.clearance_m

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
        check=filled,
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
    crank_joint: str = described("name of the crank in joint_states", default="crank", check=filled)
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
    publish_markers: bool = described("publish markers for RViz and Foxglove", default=False, metadata=LIVE)
    frame_id: str = described("frame of the pelvis, for wrenches and markers", default="pelvis", check=filled)

    @property
    def hardware(self) -> str:
        """Name of the leg: `hardware_id`, or ``leg``."""
        return self.hardware_id or "leg"

    def on_node(self, node: str) -> "MonitorConfig":
        """Parameters on a node such as ``/left/leg_wear_monitor``, whose namespace may name the leg."""
        namespace = node.strip("/").rpartition("/")[0]
        return attrs.evolve(self, hardware_id=self.hardware_id or namespace)
