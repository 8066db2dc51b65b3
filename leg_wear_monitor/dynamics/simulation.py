"""Offline simulation of one leg with clearances, or of many in parallel threads."""

import math
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.configuration.strict import shown
from leg_wear_monitor.contact.arrays import clearance_settings, compile_contacts
from leg_wear_monitor.dynamics.clearance.stepper import (
    INTERVALS,
    ClearanceRun,
    ClearanceStepper,
    check_is_for_clearances,
)
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.result import JointResult, SimulationResult, ToeResult, TorqueResult, Trace
from leg_wear_monitor.dynamics.run import Run, RunStatistics, Sample, Setup, new_run_statistics
from leg_wear_monitor.dynamics.statistics import (
    CycleScatter,
    drive_torque,
    energy_balance,
    first_impacts,
    joint_statistics,
    open_balance,
    toe_errors,
    toe_parts,
    trace_of,
)
from leg_wear_monitor.errors import AssemblyError, ConfigError, ConfigWarning, SimulationError, did_you_mean
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.loader import load_mechanism, suspects
from leg_wear_monitor.mechanism.materials import bushing_of
from leg_wear_monitor.mechanism.position import (
    TURN,
    IdealMotion,
    build_linkage,
    check_cycle,
    one_cycle,
    point_motion,
)
from leg_wear_monitor.mechanism.spec import Mechanism, SpeedDrive, TorqueDrive
from leg_wear_monitor.wear import fresh_surfaces

# Checks of the arguments of library functions; an invalid argument raises a one-line error.


_KINDS: dict[str, tuple[Any, str]] = {
    "trace": (Integral, "a whole number"),
    "intervals": (Integral, "a whole number"),
    "wear": (bool, "true or false"),
}


def given_mechanism(mechanism: Mechanism | str | Path) -> Mechanism:
    """The given mechanism, or the mechanism with a name or in a file.

    Raises
    ------
    ConfigError
        If the argument has a wrong type, or the file is invalid.
    """
    if isinstance(mechanism, Mechanism):
        return mechanism
    if isinstance(mechanism, str | Path):
        return load_mechanism(mechanism)
    raise ConfigError("mechanism", "", f"{shown(mechanism)} is not a Mechanism, a name or a file")


def given_joints(names: Sequence[str], mechanism: Mechanism) -> tuple[str, ...]:
    """Names of the clearance joints as a tuple, checked.

    Raises
    ------
    ConfigError
        If a name is unknown or occurs twice, or for a text in place of a list: ``"AB"`` would be two joints.
    """
    if isinstance(names, str):
        raise ConfigError("clearances", "", f"{shown(names)} is a text. Expected a list of names")
    try:
        clearance_joints = tuple(names)
    except TypeError as error:
        raise ConfigError("clearances", "", f"{shown(names)} is not a list of names") from error
    for name in clearance_joints:
        if not isinstance(name, str):
            raise ConfigError("clearances", "", f"{shown(name)} is not the name of a joint")
        if name not in mechanism.clearances:
            ready = ", ".join(mechanism.clearances) or "none"
            raise ConfigError(
                "clearances",
                "",
                f"{name!r} has no clearance settings in {mechanism.source}. Expected some of: {ready}"
                + did_you_mean(name, mechanism.clearances),
            )
    if len(set(clearance_joints)) < len(clearance_joints):
        raise ConfigError("clearances", "", f"{','.join(clearance_joints)!r} names a joint twice")
    return clearance_joints


def check_kinds(**values: object) -> None:
    """Check the types: ``trace`` and ``intervals`` are integers, ``wear`` is a bool, all others are numbers.

    None is allowed except for ``cycles``; it selects the default.

    Raises
    ------
    ConfigError
        Names the argument as the command line does.
    """
    for name, value in values.items():
        kinds, what = _KINDS.get(name, (Real, "a number"))
        is_flag = isinstance(value, bool | np.bool_)
        if value is None and name != "cycles":
            continue
        if not (is_flag if name == "wear" else isinstance(value, kinds) and not is_flag):
            option = name.removesuffix("_s").replace("_", "-")
            raise ConfigError(option, "", f"{shown(value)} is not {what}")


# Simulation result of an ideal linkage.


_POINTS = 1440
_MOST_WHOLE = 100  # whole cycles up to which a partial cycle is included; beyond, its effect is negligible


def ideal_result(setup: Setup, cycles: float, trace: int, begin: float = 0.0) -> SimulationResult:
    """Result of the ideal motion over a number of cycles from a crank angle on, in turns."""
    mechanism = setup.linkage.mechanism
    motion = one_cycle(setup.linkage, _POINTS, setup.speed)
    is_whole = max(1, round(cycles * _POINTS)) % _POINTS == 0  # all cycles are equal
    length = 1.0 if is_whole else cycles % 1.0 + min(cycles // 1.0, _MOST_WHOLE)
    counted = _passed(length, begin, setup.speed, _POINTS) % _POINTS
    torque = motion.drive_torque[counted]
    force = np.linalg.norm(motion.joint_force, axis=2)[counted]
    return SimulationResult(
        mechanism=mechanism.name,
        model="ideal",
        speed_rpm=setup.speed * 60.0 / TURN,
        cycles=cycles,
        simulated_s=cycles * TURN / abs(setup.speed),
        drive_torque_nm=TorqueResult(
            mean=float(torque.mean()),
            rms=float(np.sqrt(np.mean(torque**2))),
            min=float(torque.min()),
            max=float(torque.max()),
            p99=float(np.percentile(torque, 99.0)),
            max_abs=float(np.abs(torque).max()),
            max_error=0.0,
        ),
        energy_j=None,
        toe=None if mechanism.toe is None else ToeResult(0.0, 0.0, 0.0),
        joints={
            name: JointResult(
                mean_force_n=float(force[:, i].mean()),
                rms_force_n=float(np.sqrt(np.mean(force[:, i] ** 2))),
                p99_force_n=float(np.percentile(force[:, i], 99.0)),
                max_force_n=float(force[:, i].max()),
            )
            for i, name in enumerate(mechanism.joints)
        },
        trace=_trace(setup, one_cycle(setup.linkage, trace, setup.speed), cycles, begin) if trace else None,
    )


def _passed(cycles: float, begin: float, speed: float, points: int) -> Ints:
    """Points of a turn that the crank passes from an angle on, in a number of cycles [turns, continuous]."""
    passed = np.arange(max(1, round(cycles * points)))
    return np.asarray(round(begin * points) % points + (passed if speed > 0.0 else -passed))


def _trace(setup: Setup, motion: IdealMotion, cycles: float, begin: float) -> Trace:
    """Trace of all cycles, from the samples of one cycle in the crank's direction of rotation."""
    mechanism = setup.linkage.mechanism
    points = len(motion.crank_angle)
    turns = _passed(cycles, begin, setup.speed, points)
    pick = turns % points
    force = np.linalg.norm(motion.joint_force, axis=2)[pick]
    toe: dict[str, Any] = {}
    if mechanism.toe is not None:
        path = np.stack(point_motion(motion, setup.linkage, *mechanism.toe), axis=1)[pick]
        toe = toe_parts(path, np.zeros_like(path))
    return Trace(
        crank_angle_rad=np.asarray(turns * (TURN / points), float),
        drive_torque_nm=motion.drive_torque[pick],
        force_n={name: force[:, i] for i, name in enumerate(mechanism.joints)},
        **toe,
    )


MODELS: dict[str, Callable[[Setup], Run]] = {"clearance": ClearanceRun, "full": FullRun}

LEAST_RPM = 0.01  # least crank speed: below it a gait cycle takes hours

# intervals per gait cycle: fewer change mean forces, more than there are table points add nothing
LEAST_INTERVALS, MOST_INTERVALS = 1024, 65536

_REPORTS_A_CYCLE = 20

# Ratio of a crank's path to its net turn above which it swings (a turning crank may step back); and turns
# that may be rounding.
_MOST_PATH, _ROUNDING = 1.1, 1.0e-9


def default_model(mechanism: Mechanism) -> str:
    """Default formulation: ``full`` for a drive by torque or controller, or for dampers."""
    is_damped = any(spring.damping > 0.0 for spring in mechanism.springs.values())
    return "clearance" if isinstance(mechanism.drive, SpeedDrive) and not is_damped else "full"


def prepare(
    mechanism: Mechanism,
    *,
    clearances: Sequence[str] | None = None,
    speed_rpm: float | None = None,
    wear: bool = False,
    **of_contacts: float | str | None,
) -> Setup:
    """Check that a mechanism can move, and prepare it for a run.

    Parameters are as in `simulate`; ``of_contacts`` are options of `clearance_settings`.

    Returns
    -------
    Setup

    Raises
    ------
    ConfigError
        If a value is invalid.
    AssemblyError
        If the linkage does not close or has a dead point.
    """
    numbers = ("clearance_m", "restitution", "friction_coefficient")
    check_kinds(speed_rpm=speed_rpm, **{name: of_contacts.get(name) for name in numbers})
    clearance_joints = (
        mechanism.clearance_joints if clearances is None else given_joints(clearances, mechanism)
    )
    linkage = build_linkage(mechanism)
    try:
        check_cycle(linkage)
    except AssemblyError as error:
        raise AssemblyError(f"{error}{suspects(mechanism)}") from error
    settings = clearance_settings(mechanism, clearance_joints, **of_contacts)
    contacts = compile_contacts(mechanism, clearance_joints, settings)
    return Setup(
        linkage,
        clearance_joints,
        contacts,
        tuple(bushing_of(mechanism, joint) for joint in clearance_joints),
        fresh_surfaces(contacts, wear),
        _speed(mechanism, speed_rpm),
    )


def simulate(
    mechanism: Mechanism | str | Path,
    *,
    clearances: Sequence[str] | None = None,
    clearance_m: float | None = None,
    speed_rpm: float | None = None,
    cycles: float = 5.0,
    duration_s: float | None = None,
    skip_cycles: float | None = None,
    model: str | None = None,
    wear: bool = False,
    normal_law: str | None = None,
    restitution: float | None = None,
    friction: str | None = None,
    friction_coefficient: float | None = None,
    toe: str | None = None,
    trace: int = 0,
    intervals: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> SimulationResult:
    """Simulate a leg: forces, drive torque and toe motion, impacts and wear of its clearance joints.

    Parameters
    ----------
    mechanism : Mechanism, str or pathlib.Path
        A mechanism, the name of a shipped mechanism, or a file.
    clearances : sequence of str, optional
        Names of the clearance joints, empty for the ideal leg; default: the mechanism's clearance joints.
    clearance_m : float, optional
        Radial clearance of all clearance joints [m]; default: the mechanism's clearances.
    speed_rpm : float, optional
        Crank speed, negative for clockwise; default: the mechanism's speed.
    cycles, duration_s : float
        Counted length of the run, in gait cycles or as time [s].
    skip_cycles : float, optional
        Gait cycles simulated before counting starts; default: 1, or 0 with ``duration_s``.
    model : str, optional
        A key of `MODELS`; default: ``full`` for a drive by torque or controller, or for springs with a
        damper, else ``clearance``.
    wear : bool
        True if wear widens the clearances during the run; it is counted in any case.
    normal_law : str, optional
        Normal contact law of all clearance joints.
    restitution : float, optional
        Coefficient of restitution of all clearance joints.
    friction : str, optional
        Friction law of all clearance joints.
    friction_coefficient : float, optional
        Friction coefficient of all clearance joints.
    toe : str, optional
        Point whose motion is reported, with its body, such as ``shank.G``; default: the point called ``toe``.
    trace : int
        Stored samples per cycle; 0 for none. The first is where counting starts: at crank angle 0 after whole
        ``skip_cycles``, and of the ideal leg. In model ``clearance`` they are taken at the end of an interval
        and do not change the run; in model ``full``, each sample ends a step.
    intervals : int, optional
        Resolution of model ``clearance``: intervals of time per gait cycle, `LEAST_INTERVALS` or more;
        default: 2048. Inside them, steps adapt to a local error. 1024 take a tenth less time, and change mean
        forces and wear by less than they scatter.
    progress : callable, optional
        Called with the completed fraction of the run.

    Returns
    -------
    SimulationResult
        ``joints["A"]`` is a `JointResult`: forces, contact, Archard integral, wear and clearance of joint A.
        ``drive_torque_nm``, ``energy_j``, ``toe``, ``impacts["A"]`` and ``trace`` contain the rest;
        ``to_json()`` gives the text that ``simulate --json`` writes, ``to_pandas()`` tables.

    Raises
    ------
    ConfigError
        If a value is invalid.
    AssemblyError
        If the linkage does not close or has a dead point.
    SimulationError
        If the motion diverges; names joint, time and a remedy.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> result = lw.simulate("four_bar", cycles=0.25, skip_cycles=0.0)
    >>> joint = result.joints["B"]
    >>> joint.mean_force_n < joint.max_force_n and joint.archard_integral_j_per_cycle > 0.0
    True
    """
    mechanism = given_mechanism(mechanism)
    mechanism = mechanism if toe is None else mechanism.with_toe(toe)
    check_kinds(cycles=cycles, duration_s=duration_s, skip_cycles=skip_cycles, trace=trace, wear=wear)
    check_kinds(intervals=intervals)
    of_contacts: dict[str, float | str | None] = {
        "clearance_m": clearance_m, "normal_law": normal_law, "restitution": restitution,
        "friction": friction, "friction_coefficient": friction_coefficient,
    }  # fmt: skip
    setup = prepare(mechanism, clearances=clearances, speed_rpm=speed_rpm, wear=wear, **of_contacts)
    if not setup.clearance_joints:
        of_joints = of_contacts | {"wear": wear or None}
        is_ideal = isinstance(mechanism.drive, SpeedDrive)
        _refuse(of_joints | ({"model": model, "intervals": intervals} if is_ideal else {}))
    model = model or default_model(mechanism)
    if not isinstance(model, str) or model not in MODELS:
        raise ConfigError("model", "", f"{shown(model)} is not one of {', '.join(MODELS)}")
    _check_intervals(intervals, model, trace if setup.clearance_joints else 0)
    skipped, counted = _spans(setup, cycles, duration_s, skip_cycles, trace)
    if not setup.clearance_joints and isinstance(mechanism.drive, SpeedDrive):
        return ideal_result(setup, counted * abs(setup.speed) / TURN, trace, skipped * setup.speed / TURN)
    try:
        run = ClearanceRun(setup, intervals) if intervals else MODELS[model](setup)
        result = _run(setup, run, model, skipped, counted, trace, progress)
    except SimulationError as error:
        raise SimulationError(f"{error}{suspects(mechanism)}") from error
    if fault := open_balance(result):
        warnings.warn(f"{mechanism.source}: {fault}", ConfigWarning, stacklevel=2)
    return result


def _refuse(options: Mapping[str, object]) -> None:
    """Refuse options that a leg without clearance joints would ignore."""
    for name, value in options.items():
        if value is not None:
            raise ConfigError(
                name.replace("_", "-"), "", "is for clearance joints, and no joint has clearance"
            )


def _check_intervals(intervals: int | None, model: str, trace: int) -> None:
    if model == "clearance" and trace > (intervals or INTERVALS):
        fault = (
            f"{trace} points per cycle are more than the {intervals or INTERVALS} intervals. Expected fewer"
        )
        raise ConfigError("trace", "", f"{fault}, or more intervals")
    if intervals is None:
        return
    if model != "clearance":
        raise ConfigError("intervals", "", f"{intervals} is for model clearance only, not for model {model}")
    if not LEAST_INTERVALS <= intervals <= MOST_INTERVALS:
        expected = f"Expected {LEAST_INTERVALS} to {MOST_INTERVALS} per gait cycle"
        raise ConfigError("intervals", "", f"{intervals} is out of bounds. {expected}")


def _speed(mechanism: Mechanism, speed_rpm: float | None) -> float:
    """Initial crank speed [rad/s]."""
    drive = mechanism.drive
    if isinstance(drive, TorqueDrive):
        if speed_rpm is not None:
            raise ConfigError("speed-rpm", "", f"{speed_rpm:g} rpm: {mechanism.source} is driven by a torque")
        return drive.initial_speed
    if speed_rpm is None:
        return drive.speed
    if not (math.isfinite(speed_rpm) and abs(speed_rpm) >= LEAST_RPM):
        expected = f"Expected at least {LEAST_RPM:g} rpm in either direction"
        raise ConfigError("speed-rpm", "", f"{speed_rpm} rpm does not turn the crank. {expected}")
    return speed_rpm * TURN / 60.0


def _spans(
    setup: Setup, cycles: float, duration_s: float | None, skip_cycles: float | None, trace: int
) -> tuple[float, float]:
    """Skipped time and evaluated time [s]."""
    if trace < 0:
        raise ConfigError("trace", "", f"{trace} is below 0 points per cycle")
    skip = skip_cycles if skip_cycles is not None else (1.0 if duration_s is None else 0.0)
    if not (math.isfinite(skip) and skip >= 0.0):
        raise ConfigError("skip-cycles", "", f"{skip:g} is not a finite number of cycles from 0 up")
    constant = isinstance(setup.linkage.mechanism.drive, TorqueDrive)
    if constant and (duration_s is None or skip > 0.0 or trace):
        raise ConfigError(
            setup.linkage.mechanism.source,
            "drive.torque",
            "has no constant cycle time. Expected --duration, and neither --skip-cycles nor --trace",
        )
    period = TURN / abs(setup.speed) if setup.speed else math.inf
    counted = cycles * period if duration_s is None else duration_s
    if not (math.isfinite(counted) and counted > 0.0):
        name, value, unit = ("cycles", cycles, "") if duration_s is None else ("duration", duration_s, " s")
        raise ConfigError(name, "", f"{value:g}{unit} is not a finite number above 0{unit}")
    return (skip * period if skip else 0.0), counted


def _run(
    setup: Setup,
    run: Run,
    model: str,
    skipped: float,
    counted: float,
    trace: int,
    progress: Callable[[float], None] | None,
) -> SimulationResult:
    mechanism = setup.linkage.mechanism
    joints = len(mechanism.joints)
    period = TURN / abs(setup.speed) if setup.speed else counted
    report = progress or (lambda _fraction: None)
    for t in _instants(0.0, skipped, period / _REPORTS_A_CYCLE):
        run.advance(t, new_run_statistics(joints))
        report(t / (skipped + counted))
    statistics = new_run_statistics(joints)
    samples: list[Sample] = []
    count = max(1, math.ceil(trace * counted / period - _ROUNDING)) if trace else 0
    instants = skipped + np.arange(count) * (period / max(trace, 1))
    is_steady, angles = isinstance(mechanism.drive, SpeedDrive), [run.sample().crank_angle]
    stored, depth = run.stored_energy, setup.surfaces.depth.copy()
    scatter = CycleScatter(setup, statistics, stored)
    for i, t in enumerate(_instants(skipped, skipped + counted, period / _REPORTS_A_CYCLE), start=1):
        while len(samples) < len(instants) and instants[len(samples)] < t - _ROUNDING * period:
            run.advance(float(instants[len(samples)]), statistics)
            samples.append(run.sample())
        run.advance(t, statistics)
        if not is_steady:
            angles.append(run.sample().crank_angle)
        if i % _REPORTS_A_CYCLE == 0:
            scatter.end_cycle(statistics, run.stored_energy)
        report(t / (skipped + counted))
    if not statistics.time[0] > 0.0:
        raise ConfigError(
            "duration", "", f"{counted:g} s is too short for this model. Expected more, or model full"
        )
    turned = math.copysign(counted / period, setup.speed)
    if not is_steady:
        turned = _turned(mechanism.source, np.array(angles) / TURN)
    counted_cycles = abs(turned)
    return SimulationResult(
        mechanism=mechanism.name,
        model=model,
        speed_rpm=60.0 * counted_cycles / counted * math.copysign(1.0, turned),
        cycles=counted_cycles,
        simulated_s=skipped + counted,
        drive_torque_nm=drive_torque(statistics),
        energy_j=energy_balance(statistics, stored, run.stored_energy),
        toe=toe_errors(statistics) if mechanism.toe and is_steady else None,
        joints=joint_statistics(setup, statistics, setup.surfaces.depth - depth, counted_cycles),
        impacts=first_impacts(setup, statistics),
        trace=trace_of(setup, samples, model) if trace else None,
        standard_error=scatter.standard_errors(counted_cycles),
        clearance_joints=setup.clearance_joints,
        surfaces=setup.surfaces,
    )


def _turned(source: str, angles: Floats) -> float:
    """Net turns of a crank from its angles (n,) [turns]; warns if the crank swings."""
    turned, path = float(angles[-1] - angles[0]), float(np.abs(np.diff(angles)).sum())
    if path > _MOST_PATH * abs(turned) + _ROUNDING:
        fault = (
            f"the crank swings back and forth: {path:.3g} turns of motion give {abs(turned):.3g} net turns"
        )
        text = f"{source}: {fault}; values per gait cycle have no meaning"
        warnings.warn(text, ConfigWarning, stacklevel=4)
    return turned


def _instants(start: float, end: float, step: float) -> Iterator[float]:
    """Times [s] from start (excluded) to end (included) at equal steps; the last step may be shorter."""
    count = max(1, math.ceil((end - start) / step - 1.0e-9)) if end > start else 0
    return (min(end, start + (i + 1) * step) if i + 1 < count else end for i in range(count))


# Many independent legs in parallel threads, for lives and studies.
#
# Every leg has its own state and run statistics, and the compiled code releases the interpreter's lock.
# Threads therefore run in parallel and share the tables; results do not depend on the number of threads.


@attrs.frozen(kw_only=True, eq=False)
class Leg:
    """One leg of a batch; fields in common with the parameters of `simulate` have the same meaning.

    Attributes
    ----------
    mechanism : Mechanism
    clearances : sequence of str, optional
    clearance_m, speed_rpm : float, optional
    normal_law : str, optional
    wear : bool
    crank_angle_rad : float
        Initial crank angle; cycles are counted from there.
    perturb_m : float
        Largest initial eccentricity; initial positions of the journals are uniform over this disc.
    seed : int
        Seed of the initial positions.
    """

    mechanism: Mechanism
    clearances: Sequence[str] | None = None
    clearance_m: float | None = None
    speed_rpm: float | None = None
    normal_law: str | None = None
    wear: bool = False
    crank_angle_rad: float = 0.0
    perturb_m: float = 0.0
    seed: int = 0

    def prepare(self) -> Setup:
        """Setup of the leg.

        Raises
        ------
        ConfigError
            If a value is invalid.
        AssemblyError
            If the linkage does not close or has a dead point.
        """
        setup = prepare(
            self.mechanism,
            clearances=self.clearances,
            clearance_m=self.clearance_m,
            speed_rpm=self.speed_rpm,
            wear=self.wear,
            normal_law=self.normal_law,
        )
        check_is_for_clearances(self.mechanism)
        smallest = setup.contacts.clearance.min(initial=math.inf)
        if not 0.0 <= self.perturb_m <= smallest:
            raise ConfigError(
                "perturb_m", "", f"{self.perturb_m} m is not from 0 to the smallest clearance, {smallest:g} m"
            )
        return setup

    def start(self, stepper: ClearanceStepper) -> None:
        """Set a stepper of this leg to the leg's initial state."""
        stepper.init(self.crank_angle_rad, stepper.speed)
        chance = np.random.default_rng(self.seed)
        joints = len(stepper.state.approach)
        away = self.perturb_m * np.sqrt(chance.random(joints))
        direction = TURN * chance.random(joints)
        stepper.set_eccentricities(np.stack([away * np.cos(direction), away * np.sin(direction)], axis=1))


def prepare_legs(legs: Sequence[Leg]) -> list[Setup]:
    """Setups of the legs.

    Legs that differ only in their initial state are prepared once; each setup has its own surfaces.

    Raises
    ------
    ConfigError
        If a value is invalid.
    AssemblyError
        If a linkage does not close or has a dead point.
    """
    known: dict[str, Setup] = {}
    setups = []
    for leg in legs:
        # The key is a dict, because the text of a mechanism leaves out materials and labels that results
        # name.
        key = repr(attrs.asdict(attrs.evolve(leg, crank_angle_rad=0.0, seed=0)))
        if key not in known:
            known[key] = leg.prepare()
        setup = known[key]
        setups.append(attrs.evolve(setup, surfaces=fresh_surfaces(setup.contacts, leg.wear)))
    return setups


def advance_batch(
    steppers: Sequence[ClearanceStepper],
    polynomials: Sequence[Floats],
    t_end: ArrayLike,
    statistics_of_all: Sequence[RunStatistics],
    workers: int | None = None,
) -> list[tuple[int, int]]:
    """Advance many steppers, each to its own time, and add to their run statistics.

    Parameters
    ----------
    steppers : sequence of n ClearanceStepper
        Each with its own setup, because steppers of one setup share their surfaces.
    polynomials : sequence of n arrays (7,)
        Motions of the cranks, as in `ClearanceStepper.advance`.
    t_end : float or (n,) array, s
    statistics_of_all : sequence of n RunStatistics
    workers : int, optional
        Number of threads; default: the number of cores.

    Returns
    -------
    list of (status, k)
        Status of each stepper, as in `ClearanceStepper.advance`; a failed stepper does not stop the rest.

    Raises
    ------
    ValueError
        If the lengths differ, or a state or run statistics occur twice.
    """
    for what in (
        [stepper.state.depth for stepper in steppers],
        [statistics.time for statistics in statistics_of_all],
    ):
        if len({id(array) for array in what}) < len(what):
            raise ValueError("two legs of a batch share their surfaces or their run statistics")
    times = np.broadcast_to(np.asarray(t_end, dtype=float), len(steppers)).tolist()
    jobs = list(zip(steppers, polynomials, times, statistics_of_all, strict=True))
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        return list(pool.map(lambda job: job[0].advance(*job[1:]), jobs))
