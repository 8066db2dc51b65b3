"""Bushings for a leg that is being designed: how long each joint lasts with pairs and sizes that one can buy.

The leg is simulated for a few gait cycles with several clearances under each part of its duty, once for all
candidates. A bushing of another size has the same forces and turns by the same angles, so its sliding work is
proportional to its radius, and its mean clearance grows by the worn volume over its surface:

    dc/dt = (k_bushing + k_journal) w(c) / (2 pi b)

with w the integral of F_N |v_t| over the time, per radius and hour, and b the width. The diameter is not in
it: it changes the pressure, and with it whether the makers' limits hold. What this supposes, that stiffness
and friction of another pair leave the forces as they are, a whole life (`leg_wear_monitor.simulate_life`) of
the chosen bushings does not.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from leg_wear_monitor.configuration import described, quantity
from leg_wear_monitor.configuration.strict import read_document, structure
from leg_wear_monitor.dynamics.batch import Leg, simulate_batch
from leg_wear_monitor.dynamics.result import SimulationResult
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.files import json_text
from leg_wear_monitor.life.result import Duty, rating_hours
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.materials import (
    USUAL_SPREAD,
    Bushing,
    BushingLoad,
    lacks_wear,
    load_material,
    settings_of,
    spread_of,
)
from leg_wear_monitor.mechanism.person import on_the_ground
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Clearance, Mechanism, SpeedDrive

if TYPE_CHECKING:
    import pandas as pd

SCHEMA_VERSION = 1
"""Of the JSON; counts up when a field is renamed, removed or means something else."""

_P90 = 1.2815515655446004  # standard deviations from the median to the 90th percentile
_GRID = 4  # clearances that are simulated, from the smallest one to the limit
_STARTS = 3  # of each: the motion is chaotic, and their scatter is in the interval
_CYCLES = 4.0
_OF_A_PAIR = ("wear_coefficient", "youngs_modulus", "poissons_ratio")
_STEPS = 64  # of a life's integral over the clearance
_MORE = 1.1  # factor on load and cadence for the sensitivities

# What a leg has to do.


@attrs.frozen(kw_only=True)
class DutyPart:
    """Hours a day at one load and cadence, as a duty file has it."""

    load_n: float = quantity(
        "N", "largest vertical force of the ground on the toe, 0 in the air", at_least=0.0, at_most=1.0e4
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
    outcomes = simulate_batch(legs, cycles=_CYCLES, workers=workers, progress=progress)
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


# Candidates: a pair in a size, at a joint.


@attrs.frozen(kw_only=True)
class Candidate:
    """A bushing and its pin at a joint, and how long they last under the duty.

    Attributes
    ----------
    joint, material : str
    diameter_m, width_m, clearance_m : float
        Diameter of the pin, width, and radial clearance when new.
    load : BushingLoad
        Pressure and sliding speed with the pair's limits.
    peak_pressure_pa : float
        Under the largest force of an impact.
    wear_h : tuple of three floats, or None
        Hours until the clearance reaches its limit, as 10th, 50th and 90th percentile; None where the pair
        gives no wear coefficient.
    rating_h : float or None
        Life by the formula of the pair's maker, all factors 1; None without one, or beyond its range.
    limited_by : str
        ``p``, ``v``, ``p v``, ``impact`` if a limit of the maker is exceeded, so that no life holds; else
        ``wear``, ``rating life``, or ``unknown`` where the pair gives neither.
    """

    joint: str
    material: str
    diameter_m: float = attrs.field(metadata={"unit": "m"})
    width_m: float = attrs.field(metadata={"unit": "m"})
    clearance_m: float = attrs.field(metadata={"unit": "m"})
    load: BushingLoad
    peak_pressure_pa: float = attrs.field(metadata={"unit": "Pa"})
    wear_h: tuple[float, float, float] | None
    rating_h: float | None
    limited_by: str

    @property
    def sure_h(self) -> float:
        """Hours that nine of ten last (of a rating life: its hours); 0 beyond a limit or if not known."""
        if self.limited_by == "wear" and self.wear_h:
            return self.wear_h[0]
        return self.rating_h or 0.0 if self.limited_by == "rating life" else 0.0

    @property
    def words(self) -> str:
        """Pair and sizes."""
        mm = f"pin {1e3 * self.diameter_m:g} mm, width {1e3 * self.width_m:g} mm"
        return f"{self.material or 'no pair named'}, {mm}, clearance {1e6 * self.clearance_m:g} µm"

    @property
    def life_words(self) -> str:
        """Its life, and what ends it."""
        if self.limited_by == "wear" and self.wear_h:
            p10, p50, p90 = self.wear_h
            return f"{_hours(p50)} h by wear ({_hours(p10)} to {_hours(p90)})"
        if self.limited_by == "rating life":
            return f"{_hours(self.rating_h or 0.0)} h by its maker's formula"
        if self.limited_by == "unknown":
            return "life not known: the pair gives no wear coefficient and no formula"
        impact = f"impacts of {1e-6 * self.peak_pressure_pa:.3g} MPa above the limit at rest"
        return f"not valid, {self.load.outside_limits or impact}"

    def row(self) -> dict[str, Any]:
        """Plain values of a table's row."""
        p10, p50, p90 = self.wear_h or (None, None, None)
        return {
            "joint": self.joint,
            "material": self.material,
            "diameter_m": self.diameter_m,
            "width_m": self.width_m,
            "clearance_m": self.clearance_m,
            "wear_p10_h": _finite(p10),
            "wear_p50_h": _finite(p50),
            "wear_p90_h": _finite(p90),
            "rating_h": self.rating_h,
            "limited_by": self.limited_by,
            "p99_pressure_pa": self.load.p99_pressure_pa,
            "peak_pressure_pa": self.peak_pressure_pa,
            "mean_sliding_speed_mps": self.load.mean_sliding_speed_mps,
            "mean_pressure_speed_pa_mps": self.load.mean_pressure_speed_pa_mps,
        }


def _hours(value: float) -> str:
    """Three digits, without a power of ten where people write none."""
    return f"{float(f'{value:.3g}'):.0f}" if 100.0 <= value < 1.0e7 else f"{value:.3g}"


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def candidate(
    mechanism: Mechanism, loads: JointLoads, k: int, bushing: Clearance, limit_m: float
) -> Candidate:
    """How long joint k lasts with a bushing.

    Parameters
    ----------
    mechanism : Mechanism
    loads : JointLoads
    k : int
        Joint, in the order of the loads.
    bushing : Clearance
    limit_m : float
        Mean clearance at which its life ends.
    """
    joint = loads.joints[k]
    is_swinging = mechanism.drive.body not in mechanism.sides(joint)
    area = 2.0 * bushing.bushing_radius * bushing.width
    speed = float(loads.turning_radps[k]) * bushing.bushing_radius
    mean_force = float(loads.mean_force_n[k])
    load = Bushing.of(bushing, is_swinging=is_swinging).load(
        mean_force, float(loads.p99_force_n[k]), mean_force * speed
    )
    peak_pressure = float(loads.peak_force_n[k]) / area
    wear_h, rating_h = None, rating_hours(bushing, load.mean_pressure_speed_pa_mps)
    if not lacks_wear(bushing):
        growth = sum(bushing.wear_coefficient) / (TURN * bushing.width)
        hours, error = loads.hours(k, float(growth), bushing.radial_clearance, limit_m)
        away = math.exp(_P90 * math.hypot(spread_of(bushing, USUAL_SPREAD) or USUAL_SPREAD, error))
        wear_h = hours / away, hours, hours * away
    rating_h = None if rating_h is None or math.isnan(rating_h) else rating_h
    return Candidate(
        joint=joint,
        material=bushing.material,
        diameter_m=2.0 * bushing.bushing_radius,
        width_m=bushing.width,
        clearance_m=bushing.radial_clearance,
        load=load,
        peak_pressure_pa=peak_pressure,
        wear_h=wear_h,
        rating_h=rating_h,
        limited_by=_limited_by(bushing, load, peak_pressure, wear_h, rating_h),
    )


def _limited_by(
    bushing: Clearance,
    load: BushingLoad,
    peak_pressure_pa: float,
    wear_h: tuple[float, float, float] | None,
    rating_h: float | None,
) -> str:
    """What ends the life of a bushing, or keeps a life from being known."""
    if load.excesses:
        return max(load.excesses, key=lambda one: one.value / one.limit).name
    limits = load_material(bushing.material).limits if bushing.material else None
    if limits and limits.static_pressure and peak_pressure_pa > limits.static_pressure.si:
        return "impact"
    if wear_h:
        return "wear"
    return "unknown" if rating_h is None else "rating life"


# The design of a leg.


@attrs.frozen(kw_only=True)
class Sensitivity:
    """How a joint's life with its present bushing changes, in percent.

    Attributes
    ----------
    joint : str
    load, cadence : float
        With ten percent more load, and ten percent more gait cycles an hour.
    clearance : float
        With half the clearance when new.
    width : float
        With a bushing that is ten percent wider.
    """

    joint: str
    load: float
    cadence: float
    clearance: float
    width: float


@attrs.frozen(kw_only=True, eq=False)
class Design:
    """Lives of a leg's joints, as they are and with candidates.

    Attributes
    ----------
    mechanism : str
    duty : tuple of DutyPart
    hours : float
        Hours of walking that each joint should last.
    limit_m : float
        Mean clearance at which a joint's life ends.
    loads : JointLoads
    own : tuple of Candidate
        The joints with their present bushings.
    pairs : tuple of Candidate
        All pairs in the present sizes, joint by joint.
    candidates : tuple of Candidate
        All pairs and sizes, joint by joint.
    sensitivities : tuple of Sensitivity
        Of joints whose present bushing has a life by wear.
    """

    mechanism: str
    duty: tuple[DutyPart, ...]
    hours: float
    limit_m: float
    loads: JointLoads
    own: tuple[Candidate, ...]
    pairs: tuple[Candidate, ...]
    candidates: tuple[Candidate, ...]
    sensitivities: tuple[Sensitivity, ...]

    def of(self, joint: str) -> tuple[Candidate, ...]:
        """Candidates of a joint that last the hours, the smallest first, then those that last longest."""
        found = [one for one in self.candidates if one.joint == joint and one.sure_h >= self.hours]
        return tuple(sorted(found, key=lambda one: (one.diameter_m * one.width_m, -one.sure_h)))

    @property
    def order(self) -> tuple[Candidate, ...]:
        """The joints with their present bushings, the one that ends first at the head; unknown ones last."""
        return tuple(sorted(self.own, key=lambda one: one.sure_h if one.sure_h else math.inf))

    @property
    def asked(self) -> str:
        """The duty, and how long each joint should last."""
        duty = ", ".join(
            f"{part.hours_per_day:g} h a day at {part.load_n:g} N"
            + (f" and {part.speed_rpm:g} rpm" if part.speed_rpm else "")
            for part in self.duty
        )
        return (
            f"{duty}; each joint should last {self.hours:g} h of walking, up to a clearance of "
            f"{1e6 * self.limit_m:g} µm"
        )

    @property
    def first(self) -> str:
        """Which joint to make better first."""
        head, *others = self.order
        if not head.sure_h:
            return "no joint's life is known with its present bushing"
        more = next((one for one in others if one.sure_h), None)
        then = f"; then {more.joint}, {_hours(more.sure_h)} h" if more else ""
        return f"make {head.joint} better first: nine of ten last {_hours(head.sure_h)} h{then}"

    def to_dict(self) -> dict[str, Any]:
        """Plain object for JSON."""
        return {
            "schema_version": SCHEMA_VERSION,
            "mechanism": self.mechanism,
            "duty": [attrs.asdict(part) for part in self.duty],
            "hours": self.hours,
            "limit_m": self.limit_m,
            "own": [one.row() for one in self.own],
            "chosen": {joint: [one.row() for one in self.of(joint)[:1]] for joint in self.loads.joints},
            "sensitivities": [attrs.asdict(one) for one in self.sensitivities],
            "loads": {
                joint: {
                    "mean_force_n": float(self.loads.mean_force_n[k]),
                    "p99_force_n": float(self.loads.p99_force_n[k]),
                    "peak_force_n": float(self.loads.peak_force_n[k]),
                    "work_j_per_m_h": self.loads.work_j_per_m_h[:, k].tolist(),
                }
                for k, joint in enumerate(self.loads.joints)
            },
            "clearance_m": self.loads.clearance_m.tolist(),
        }

    def to_json(self) -> str:
        """JSON text."""
        return json_text(self.to_dict())

    def to_pandas(self) -> "pd.DataFrame":
        """All candidates, a row each; needs pandas."""
        import pandas as pd

        return pd.DataFrame([one.row() for one in self.candidates])


@attrs.frozen(kw_only=True)
class BushingChoices:
    """Which bushings are tried.

    Attributes
    ----------
    materials : tuple of str
        Pairs by name.
    diameters_m, widths_m, clearances_m : tuples of float
        Diameters of the pin, widths, and radial clearances when new.
    """

    materials: tuple[str, ...]
    diameters_m: tuple[float, ...]
    widths_m: tuple[float, ...]
    clearances_m: tuple[float, ...]

    def bushings(self, own: Clearance) -> Iterator[Clearance]:
        """The present bushing of a joint in all pairs and sizes.

        Raises
        ------
        ConfigError
            For an unknown pair.
        """
        for name in self.materials:
            # a wear coefficient that stood beside the present pair is not that of another one
            pair: dict[str, Any] = settings_of(load_material(name))
            known: dict[str, Any] = {key: tuple(value) for key, value in pair.items() if key in _OF_A_PAIR}
            for diameter in self.diameters_m:
                for width in self.widths_m:
                    for clearance in self.clearances_m:
                        yield attrs.evolve(
                            own,
                            material=name,
                            bushing_radius=0.5 * diameter,
                            width=width,
                            radial_clearance=clearance,
                            film=None,
                            **known,
                        )


def design(
    mechanism: Mechanism,
    duty: Sequence[DutyPart],
    choices: BushingChoices,
    *,
    hours: float = 1000.0,
    limit_m: float = 6.0e-4,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Design:
    """Lives of a leg's clearance joints under a duty, as they are and with other bushings.

    Parameters
    ----------
    mechanism : Mechanism
    duty : sequence of DutyPart
    choices : BushingChoices
    hours : float
        Hours of walking that each joint should last.
    limit_m : float
        Mean clearance at which a joint's life ends [m].
    workers : int, optional
        Number of threads.
    progress : callable, optional
        Called with the completed fraction.

    Raises
    ------
    ConfigError, AssemblyError, SimulationError
    """
    joints = mechanism.clearance_joints
    if not joints:
        raise ConfigError(mechanism.source, "clearances.joints", "no joint has clearance, nothing can wear")
    own = [mechanism.clearances[joint] for joint in joints]
    # half the present clearances, too, for the sensitivities
    smallest = min(*choices.clearances_m, *(0.5 * one.radial_clearance for one in own))
    largest = max(*choices.clearances_m, *(one.radial_clearance for one in own))
    if not largest < limit_m:
        fault = f"{limit_m:g} m is not above the largest clearance when new, {largest:g} m"
        raise ConfigError("limit-m", "", fault)
    # evenly spaced ratios: forces change most at small clearances
    grid = np.geomspace(smallest, limit_m, _GRID)

    def part(k: int) -> Callable[[float], None] | None:
        return (lambda done: progress((k + done) / 3.0)) if progress else None

    loads = joint_loads(mechanism, duty, grid, workers=workers, progress=part(0))
    more_load = joint_loads(mechanism, duty, grid, load_factor=_MORE, workers=workers, progress=part(1))
    faster = joint_loads(mechanism, duty, grid, speed_factor=_MORE, workers=workers, progress=part(2))
    found, pairs, tried, sensitivities = [], [], [], []
    for k, bushing in enumerate(own):
        now = candidate(mechanism, loads, k, bushing, limit_m)
        found.append(now)
        present = BushingChoices(
            materials=choices.materials,
            diameters_m=(2.0 * bushing.bushing_radius,),
            widths_m=(bushing.width,),
            clearances_m=(bushing.radial_clearance,),
        )
        pairs += [candidate(mechanism, loads, k, one, limit_m) for one in present.bushings(bushing)]
        tried += [candidate(mechanism, loads, k, one, limit_m) for one in choices.bushings(bushing)]
        if now.wear_h and math.isfinite(now.wear_h[1]):
            tighter = attrs.evolve(bushing, radial_clearance=0.5 * bushing.radial_clearance)
            others = {
                "load": candidate(mechanism, more_load, k, bushing, limit_m),
                "cadence": candidate(mechanism, faster, k, bushing, limit_m),
                "clearance": candidate(mechanism, loads, k, tighter, limit_m),
            }
            changed = {
                name: 100.0 * (one.wear_h[1] / now.wear_h[1] - 1.0)
                for name, one in others.items()
                if one.wear_h
            }
            sensitivities.append(Sensitivity(joint=joints[k], width=100.0 * (_MORE - 1.0), **changed))
    return Design(
        mechanism=mechanism.name,
        duty=tuple(duty),
        hours=hours,
        limit_m=limit_m,
        loads=loads,
        own=tuple(found),
        pairs=tuple(pairs),
        candidates=tuple(tried),
        sensitivities=tuple(sensitivities),
    )
