"""What each joint of a leg carries under a duty, over its clearance."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import attrs
import numpy as np

from leg_wear_monitor.configuration import described, quantity
from leg_wear_monitor.configuration.strict import read_document, structure
from leg_wear_monitor.dynamics.batch import Leg, simulate_batch
from leg_wear_monitor.dynamics.clearance.stepper import STATISTICS_INTERVALS
from leg_wear_monitor.dynamics.result import SimulationResult
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.life.result import Duty
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.person import on_the_ground
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism, SpeedDrive

_STARTS = 3  # runs at each clearance: the motion is chaotic, and their scatter is in the interval
_CYCLES = 4.0
_STEPS = 64  # of a life's integral over the clearance

# What a leg has to do.


@attrs.frozen(kw_only=True)
class DutyPart:
    """Hours a day at one load and cadence, as a duty file has it."""

    load_n: float = quantity(
        "N", "largest vertical force of the ground on the toe, 0 in the air", within=(0.0, 1.0e4)
    )
    hours_per_day: float = quantity("h", "hours a day", above=0.0, at_most=24.0)
    speed_rpm: float | None = quantity(
        "rpm", "cadence; that of the mechanism without", above=0.0, at_most=1000.0, default=None
    )


@attrs.frozen
class DutyFile:
    """A duty file: hours a day at loads and cadences."""

    duty: tuple[DutyPart, ...] = described(
        "parts of a day", check=lambda parts: None if parts else "is empty, expected at least one part"
    )


def read_duty(text: str) -> tuple[DutyPart, ...]:
    """Parts of a duty: of a YAML file, or of a text such as ``0:2,300:5`` (peak [N] and hours a day).

    Raises
    ------
    ConfigError
    """
    if text.endswith((".yaml", ".yml")):
        try:
            document = read_document(Path(text), text)
        except FileNotFoundError as error:
            raise ConfigError("duty", text, "no such file") from error
        file: DutyFile = structure(document, DutyFile, text, "")
        return file.duty
    hours = Duty.parse(text).hours_by_peak
    return tuple(DutyPart(load_n=peak, hours_per_day=each) for peak, each in hours.items())


# Forces and sliding of each joint under a duty, over the clearance.


@attrs.frozen(kw_only=True, eq=False)
class JointLoads:
    """What the joints carry under a duty, at n clearances common to all k joints.

    Attributes
    ----------
    joints : tuple of str
    clearance_m : (n,) array
    work_j_per_m_h : (n, k) array
        Integral of ``F_N |v_t| dt`` over an hour of the duty, per metre of the bushing's radius [J/(m h)].
    work_error : (n, k) array
        Its standard error by the scatter of the starts, relative.
    mean_force_n, p99_force_n, peak_force_n : (k,) arrays
        At the smallest clearance: mean over the duty, and the largest of its parts.
    turning_radps : (k,) array
        Mean sliding speed under load over the radius [rad/s].
    """

    joints: tuple[str, ...]
    clearance_m: Floats
    work_j_per_m_h: Floats
    work_error: Floats
    mean_force_n: Floats
    p99_force_n: Floats
    peak_force_n: Floats
    turning_radps: Floats

    def hours(self, k: int, growth_per_work: float, fresh_m: float, limit_m: float) -> tuple[float, float]:
        """Hours until the mean clearance of joint k reaches a limit, and their relative standard error.

        Parameters
        ----------
        k : int
        growth_per_work : float
            Growth of the clearance by the work of `work_j_per_m_h` [m / (J/m)].
        fresh_m, limit_m : float
        """
        if growth_per_work <= 0.0:
            return math.inf, 0.0
        clearance = np.linspace(fresh_m, limit_m, _STEPS)
        work = np.interp(clearance, self.clearance_m, self.work_j_per_m_h[:, k])
        error = np.interp(clearance, self.clearance_m, self.work_error[:, k])
        slowness = 1.0 / (growth_per_work * work)
        slowness[[0, -1]] *= 0.5  # trapezoids
        step = float(clearance[1] - clearance[0])
        hours = step * float(slowness.sum())
        return hours, step * float(slowness @ error) / hours


def joint_loads(
    mechanism: Mechanism,
    duty: Sequence[DutyPart],
    clearance_m: Floats,
    *,
    load_factor: float = 1.0,
    speed_factor: float = 1.0,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> JointLoads:
    """Simulate what the clearance joints of a mechanism carry under a duty.

    Parameters
    ----------
    mechanism : Mechanism
    duty : sequence of DutyPart
    clearance_m : (n,) array
        Clearances, ascending; all joints have the same one in a run.
    load_factor, speed_factor : float
        On the duty's loads and cadences.
    workers : int, optional
        Number of threads.
    progress : callable, optional
        Called with the completed fraction.

    Raises
    ------
    ConfigError, AssemblyError, SimulationError
    """
    if not isinstance(mechanism.drive, SpeedDrive):
        raise ConfigError(mechanism.source, "drive", "has no speed, expected a drive of a given speed")
    own_rpm = 60.0 * mechanism.drive.speed / TURN
    speeds = [
        speed_factor * (own_rpm if part.speed_rpm is None else math.copysign(part.speed_rpm, own_rpm))
        for part in duty
    ]
    legs = [
        Leg(
            mechanism=on_the_ground(mechanism, load_factor * part.load_n),
            clearances=mechanism.clearance_joints,
            clearance_m=float(clearance),
            speed_rpm=speed,
            perturb_m=0.5 * float(clearance),
            seed=start,
        )
        for clearance in clearance_m
        for part, speed in zip(duty, speeds, strict=True)
        for start in range(_STARTS)
    ]
    outcomes = simulate_batch(
        legs, cycles=_CYCLES, intervals=STATISTICS_INTERVALS, workers=workers, progress=progress
    )
    results = [_result(one) for one in outcomes]
    joints = mechanism.clearance_joints
    radius = np.array([mechanism.clearances[joint].bushing_radius for joint in joints])

    def of(name: str) -> Floats:
        found = [[getattr(one.joints[joint], name) for joint in joints] for one in results]
        return np.array(found, dtype=float).reshape(len(clearance_m), len(duty), _STARTS, len(joints))

    shares = np.array([part.hours_per_day for part in duty])
    shares = (shares / shares.sum())[:, None, None]
    per_hour = 60.0 * np.abs(np.array(speeds))[:, None, None]
    work = (shares * per_hour * of("archard_integral_j_per_cycle") / radius).sum(axis=1)
    mean = work.mean(axis=1)
    force = (shares * of("mean_force_n")).sum(axis=1).mean(axis=1)[0]
    return JointLoads(
        joints=joints,
        clearance_m=np.asarray(clearance_m, dtype=float),
        work_j_per_m_h=mean,
        work_error=work.std(axis=1, ddof=1) / math.sqrt(_STARTS) / mean,
        mean_force_n=force,
        p99_force_n=of("p99_force_n")[0].mean(axis=1).max(axis=0),
        peak_force_n=of("max_force_n")[0].mean(axis=1).max(axis=0),
        turning_radps=mean[0] / 3600.0 / force,
    )


def _result(outcome: SimulationResult | LegWearError) -> SimulationResult:
    if isinstance(outcome, LegWearError):
        raise outcome
    return outcome
