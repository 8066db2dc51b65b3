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
from itertools import product
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.files import data_frame, finite_or_none, json_text
from leg_wear_monitor.life.joint_loads import DutyPart, JointLoads, joint_loads
from leg_wear_monitor.life.result import rating_hours
from leg_wear_monitor.mechanism.materials import (
    USUAL_SPREAD,
    Bushing,
    BushingLoad,
    lacks_wear,
    load_material,
    settings_of,
    spread_of,
)
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Clearance, Mechanism

if TYPE_CHECKING:
    import pandas as pd

SCHEMA_VERSION = 1
"""Of the JSON; counts up when a field is renamed, removed or means something else."""

_P90 = 1.2815515655446004  # standard deviations from the median to the 90th percentile
_GRID = 4  # clearances that are simulated, from the smallest one to the limit
_OF_A_PAIR = ("wear_coefficient", "youngs_modulus", "poissons_ratio")
_MORE = 1.1  # factor on load and cadence for the sensitivities

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
    def excess(self) -> str:
        """What is beyond a limit of the maker, so that no life holds; empty within the limits."""
        if self.limited_by in ("wear", "rating life", "unknown"):
            return ""
        impact = f"impacts of {1e-6 * self.peak_pressure_pa:.3g} MPa above the limit at rest"
        return self.load.outside_limits or impact

    @property
    def life_words(self) -> str:
        """Its life, and what ends it."""
        if self.excess:
            return f"not valid, {self.excess}"
        if self.limited_by == "wear" and self.wear_h:
            p10, p50, p90 = self.wear_h
            if math.isinf(p50):
                return "does not wear: its wear coefficient is 0"
            return f"{_hours(p50)} h by wear ({_hours(p10)} to {_hours(p90)})"
        if self.limited_by == "rating life":
            return f"{_hours(self.rating_h or 0.0)} h by its maker's formula"
        return "life not known: the pair gives no wear coefficient and no formula"

    def row(self) -> dict[str, Any]:
        """Plain values of a table's row."""
        p10, p50, p90 = self.wear_h or (None, None, None)
        sizes = ("joint", "material", "diameter_m", "width_m", "clearance_m")
        return {
            **{name: getattr(self, name) for name in sizes},
            "wear_p10_h": finite_or_none(p10),
            "wear_p50_h": finite_or_none(p50),
            "wear_p90_h": finite_or_none(p90),
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
        """The joints with their present bushings: those beyond a limit, by their lives, unknown ones last."""
        return tuple(sorted(self.own, key=lambda one: (one.limited_by == "unknown", one.sure_h)))

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
        known = [one for one in self.order if one.limited_by != "unknown"]
        if not known:
            return "no joint's life is known with its present bushing"
        head, *more = known
        if math.isinf(head.sure_h):
            return "no joint whose life is known wears with its present bushing"
        more = [one for one in more if math.isfinite(one.sure_h)]
        then = f"; then {more[0].joint}, {more[0].excess or f'{_hours(more[0].sure_h)} h'}" if more else ""
        why = head.excess or f"nine of ten last {_hours(head.sure_h)} h"
        return f"make {head.joint} better first: {why}{then}"

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
        """All candidates, a row each; requires pandas.

        Raises
        ------
        LegWearError
            If pandas is not installed.
        """
        rows = [one.row() for one in self.candidates]
        return data_frame({name: [row[name] for row in rows] for name in rows[0]})


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
            for diameter, width, clearance in product(self.diameters_m, self.widths_m, self.clearances_m):
                yield attrs.evolve(
                    own,
                    material=name,
                    bushing_radius=0.5 * diameter,
                    width=width,
                    radial_clearance=clearance,
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
    radius = min(*(0.5 * one for one in choices.diameters_m), *(one.bushing_radius for one in own))
    if not limit_m < radius:
        fault = f"{limit_m:g} m is not below the smallest radius of a bushing, {radius:g} m"
        raise ConfigError("limit-m", "", fault)
    # evenly spaced ratios: forces change most at small clearances
    grid = np.geomspace(smallest, limit_m, _GRID)

    def simulated(k: int, **factors: float) -> JointLoads:
        report = (lambda done: progress((k + done) / 3.0)) if progress else None
        return joint_loads(mechanism, duty, grid, workers=workers, progress=report, **factors)

    loads, more_load, faster = simulated(0), simulated(1, load_factor=_MORE), simulated(2, speed_factor=_MORE)
    found, pairs, tried, sensitivities = [], [], [], []
    for k, bushing in enumerate(own):
        now = candidate(mechanism, loads, k, bushing, limit_m)
        found.append(now)
        present = attrs.evolve(
            choices,
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
