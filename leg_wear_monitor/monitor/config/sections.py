"""Sections of the parameters: drive, forecast."""

import attrs

from leg_wear_monitor.configuration import USUAL, described, quantity
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.estimate.drive import DriveFigures
from leg_wear_monitor.mechanism.sourced import LIBRARY, Drive, load_drive

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

    load_sigma: float = 0.1  # for future wear per cycle, because load and pace vary
    model_sigma: float = 0.4  # for the growth without simulated lives, and beyond them (forecast.md)
    # for a new joint's clearance, as a fraction of it: the limits of a running fit are 20 % about its mean
    new_clearance_sigma: float = 0.1
    duty_hours_per_day: float = quantity("h", "walking per day", within=(0.01, 24.0), default=8.0)
    duty_sigma: float = 0.2  # for the walking per day
    window_cycles: int = 2000  # over which growth is averaged, because single gait cycles scatter
    growth_law_file: str = described(
        "file that `leg-wear-monitor life --ensemble-size 16 --json` wrote for this leg: how growth changes "
        "as all clearances open. Empty: use the file that the package has for this leg",
        default="",
    )
