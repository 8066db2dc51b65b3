"""Clearances from the drive torque alone, of legs in full coordinates with different masses.

Each leg walks with the clearances when new, and with one joint or two opened; its crank has a ripple. Torques
are means over a sample, with noise. Times to detection, names and clearances come out of the code that the
monitor runs. `python benchmarks/diagnosis.py` takes about an hour, most of it for the legs; with
`--keep DIRECTORY` those are walked once. `--first` runs the observer of the monitor on a new leg until its
names of joints are sure, then on each opened one; a walk is repeated where it is too short.
"""

import argparse
import functools
import os
import pickle
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

# numpy reads this once, when it is imported; on a busy machine its threads take six times as long
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# isort: split
import attrs
import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import TORQUE, new_run_statistics, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.estimate.cause import Cause
from leg_wear_monitor.estimate.clearance_fit import ChangeDetector, best_fit
from leg_wear_monitor.estimate.explanations import Explainer
from leg_wear_monitor.estimate.leg_model import (
    FAR_FROM_FILE,
    WORTH_IDENTIFYING,
    explainer_of,
    identified_leg,
    leg_of_ideal_torque,
    misfit,
)
from leg_wear_monitor.estimate.signature import (
    CommissionedTorque,
    TorqueSensor,
    mean_signatures,
    signatures,
    with_noise_of,
)
from leg_wear_monitor.gait.config import PaceConfig
from leg_wear_monitor.gait.leg import Pace
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.observer import TorqueObserver
from leg_wear_monitor.monitor.diagnosis.references import ROUNDS, LegModels
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis, DiagnosisState
from leg_wear_monitor.twin import CRANK
from leg_wear_monitor.twin import TORQUE as TORQUE_SAMPLE
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import (
    CrankProfile,
    LegParameters,
    LegSimulation,
    cycle_profile,
    mean_profile,
)
from leg_wear_monitor.twin.references import TorqueReference, TorqueReferenceRun
from leg_wear_monitor.twin.sample import gait_samples
from leg_wear_monitor.wear import SECTORS

RATE = 1000  # steps of a gait cycle at which a walk is kept
COMMISSIONING, AFTER, HEALTHY = 60, 60, 160
NEW_M = 3.0e-4
NEW = np.full(5, NEW_M)  # of the default leg
SIZES = (3.6e-4, 4.5e-4, 6.0e-4, 1.0e-3)
MONTH = 8.64e5  # gait cycles: eight hours a day at 60 rpm
CLOCK = 1.0021  # true over nominal period of the sensor: its samples drift through the gait cycle
UNWORN = np.zeros((5, 2, SECTORS))  # of the default leg
STARTS = 5  # gait cycles between two starts of a test

HEAD = """
| case | cycles to detection: median, worst | named rightly in 5 cycles | in 10 | mean clearances | sigma |
|---|---|---|---|---|---|"""

FIRST_HEAD = """
| leg | gait cycles to an estimate | to sure names | processor [s] | misfits | rounds | named (after) |
|---|---|---|---|---|---|---|"""
LONGEST = 480  # gait cycles to a first diagnosis
PERIODS = 4  # evaluations in a gait cycle


class Leg(NamedTuple):
    """Factors on masses and lengths of a leg, the ripple of its crank, sizes of joints [m], and its file."""

    masses: dict[str, float]
    lengths: dict[str, float]
    ripple: float
    sizes: tuple[float, ...]
    mechanism: str = "bionic_leg"


BODIES = ("crank", "thigh", "coupler", "rocker", "shank", "foot", "tendon")
LEGS = {
    "a": Leg({"thigh": 1.04, "shank": 0.97, "foot": 1.03}, {}, 0.03, SIZES),
    "b": Leg({"thigh": 0.96, "shank": 1.05, "foot": 0.95, "coupler": 1.05, "rocker": 0.95}, {}, 0.02, SIZES),
    # drawn evenly, within 5 % and 1 %
    "c": Leg(
        dict(zip(BODIES, (0.963, 1.0, 1.01, 0.953, 0.965, 1.043, 0.957), strict=True)),
        dict(zip(BODIES, (0.9926, 1.009, 1.0024, 0.9974, 1.0002, 1.0033, 0.9955), strict=True)),
        0.025,
        (3.6e-4, 1.0e-3),
    ),
    # within 5 % and 0.2 %; nothing in the package was chosen by it
    "d": Leg(
        dict(zip(BODIES, (1.0365, 1.0355, 1.0311, 0.9761, 0.9577, 1.0446, 1.0114), strict=True)),
        dict(zip(BODIES, (0.998, 1.0016, 1.0019, 0.9991, 1.0013, 0.9983, 0.9998), strict=True)),
        0.03,
        (3.6e-4, 1.0e-3),
    ),
    # other linkages; nothing in the package was chosen by them
    "e": Leg(
        {"rod": 1.04, "lower_rocker": 0.96, "upper_rocker": 1.05, "leg": 0.97},
        {},
        0.03,
        (3.6e-4, 1.0e-3),
        "klann_leg",
    ),
    "f": Leg(
        {"thigh": 1.04, "drive_rod": 0.95, "shank": 0.97, "foot": 1.03},
        {},
        0.03,
        (3.6e-4, 1.0e-3),
        "jansen_leg",
    ),
}
SEVERAL_UM = {  # further clearances of joints that are wider together
    "A 0.45 G 0.45": {"A": 150.0, "G": 150.0},
    "B 0.60 J 0.60": {"B": 300.0, "J": 300.0},
    "a life": {"A": 150.0, "B": 50.0, "G": 45.0, "I": 15.0, "J": 10.0},
}


def truth(leg: Mechanism, name: str) -> Mechanism:
    """The mechanism with the masses and lengths of a leg."""
    masses, lengths = (
        [part.get(body, 1.0) for body in leg.bodies] for part in (LEGS[name].masses, LEGS[name].lengths)
    )
    return LegParameters(np.array(masses), np.array(lengths)).applied(leg)


def walked(
    leg: Mechanism, clearance: np.ndarray, cycles: int, ripple: float, loads: Sequence[float] = ()
) -> np.ndarray:
    """Time [s], crank angle [rad], impulse [N m s] and instants [N m] of the drive torque (cycles RATE, 4).

    The loads of the leg are multiplied in each gait cycle by one of the factors ``loads``, if there are any.
    """
    setup, pace = prepare(leg), Pace(PaceConfig(ripple=ripple))
    setup.contacts.clearance[:] = clearance
    run = FullRun(attrs.evolve(setup, speed=pace.at(0.0).speed), tolerance_m=1e-9)
    forces = run.model.arrays.load_force.copy()
    statistics, before = new_run_statistics(len(leg.joints)), 0.0
    walk = np.empty((cycles * RATE, 4))
    for i in range(len(walk)):
        if loads and i % RATE == 0:
            run.model.arrays.load_force[:] = loads[i // RATE % len(loads)] * forces
        t = (i + 1) / RATE
        run.polynomial[:] = quintic(before, pace.at(before), t - before, pace.at(t))
        run.advance(t, statistics)
        walk[i] = t, pace.at(t).angle, statistics.drive_integral[TORQUE], run.sample().drive_torque
        before = t
    return walk


def cases(joints: tuple[str, ...], sizes: tuple[float, ...]) -> Iterator[tuple[str, np.ndarray, int]]:
    """Name, clearances and gait cycles of each walk."""
    yield "new", np.full(len(joints), NEW_M), HEALTHY
    for joint in joints:
        for size in sizes:
            yield f"{joint} {1e3 * size:.2f}", np.where(np.array(joints) == joint, size, NEW_M), AFTER
    for case, wider in SEVERAL_UM.items():
        if set(wider) <= set(joints):
            yield case, NEW_M + 1e-6 * np.array([wider.get(joint, 0.0) for joint in joints]), AFTER


def kept(file: Path | None, make):
    """Contents of a file; made and stored if it is not there."""
    if file and file.exists():
        return pickle.loads(file.read_bytes())
    made = make()
    if file:
        file.write_bytes(pickle.dumps(made))
    return made


def profile_of(walk: np.ndarray, cycles: int = 20) -> CrankProfile:
    """How the crank turns, from noisy angles at 200 Hz."""
    random, profiles = np.random.default_rng(1), []
    for k in range(1, cycles + 1):
        begin, end = np.interp([k * TURN, (k + 1) * TURN], walk[:, 1], walk[:, 0])
        inside = walk[(walk[:, 0] >= begin) & (walk[:, 0] < end)][::5]
        angle = inside[:, 1] + 1e-3 * random.standard_normal(len(inside))
        profiles.append(cycle_profile(inside[:, 0] - begin, angle, end - begin))
    return mean_profile(profiles)


def new(leg: Mechanism) -> tuple[np.ndarray, np.ndarray]:
    """Clearances and wear depths of a new leg."""
    joints = len(leg.clearance_joints)
    return np.full(joints, NEW_M), np.zeros((joints, 2, SECTORS))


def referred(leg: Mechanism, profile: CrankProfile, bodies: LegParameters) -> TorqueReference:
    """A reference of a leg with given bodies."""
    run = TorqueReferenceRun(leg)
    run.begin(*new(leg), profile, bodies)
    return simulated(run)


def bodies_of(leg: Mechanism, explainer: Explainer, known: CommissionedTorque, reference) -> LegParameters:
    """The bodies that explain the torque of a commissioned leg."""
    run, start = TorqueReferenceRun(leg), reference.parameters
    is_far = misfit(explainer.model, explainer.nuisances, known) >= FAR_FROM_FILE
    if is_far and not start.compliance:  # the ideal leg's torque knows no coupling
        start = leg_of_ideal_torque(leg, explainer.model, known, reference.profile.speed, start.load)
    run.begin_identification(*new(leg), reference.profile, start)
    varied, model = simulated(run), explainer.model
    expected = mean_signatures(varied, model.sensor)[0]
    return identified_leg(varied.parameters, expected, varied, model, explainer.nuisances, known)


def simulated(run: TorqueReferenceRun) -> TorqueReference:
    """Reference that a run simulates."""
    found = run.finish()
    if found is None:
        raise SystemExit("the leg could not be simulated")
    return found


def measured(walk: np.ndarray, sensor: TorqueSensor, noise_nm: float, random) -> np.ndarray:
    """Signatures (cycles, F) of whole gait cycles, the first two left out."""
    between = sensor.period_s * CLOCK
    time = np.arange(between, walk[-1, 0], between)
    angle, impulse = (np.interp(time, walk[:, 0], column) for column in walk[:, 1:3].T)
    torque = np.diff(impulse, prepend=0.0) / between
    if sensor.is_instant:
        taken = walk[np.searchsorted(walk[:, 0], time)]  # of those that are kept
        angle, torque = taken[:, 1], taken[:, 3]
    torque += noise_nm * random.standard_normal(len(torque))
    cycle = np.floor(angle / TURN - 1e-9).astype(np.int64)
    # Average over this many samples, from the first sample of each gait cycle on.
    since = np.arange(len(cycle)) - np.searchsorted(cycle, cycle)
    ends = np.flatnonzero(since % sensor.together == sensor.together - 1)
    torque = torque[ends[:, None] - np.arange(sensor.together)].mean(axis=1)
    step = np.where(since[ends] < sensor.together, np.nan, np.diff(torque, prepend=np.nan))
    return signatures(cycle[ends], angle[ends], torque, step, sensor)[2:-1]


def explained(
    leg, reference, walk, sensor, noise_nm, random, commissioned=True
) -> tuple[Explainer, CommissionedTorque | None, np.ndarray]:
    """The explainer of a leg, commissioned on its first cycles or not, and its further signatures."""
    healthy = measured(walk, sensor, noise_nm, random)
    mean = healthy[:COMMISSIONING].mean(axis=0)
    known = CommissionedTorque(0, new(leg)[0], healthy[:COMMISSIONING]) if commissioned else None
    own = with_noise_of(reference, sensor, mean)
    if known is not None:
        own = LegModels(leg).channel(reference, sensor, known)
    explainer = explainer_of(leg, reference, own, known)
    return explainer, known, healthy[COMMISSIONING:]


def detected(detector: ChangeDetector, cycles: np.ndarray) -> int | None:
    """Gait cycles until a change is detected; None if it is not."""
    state = detector.fresh()
    for i, signature in enumerate(cycles):
        state = detector.with_cycle(state, signature, i + 1)
        if detector.detected_ns(state):
            return i + 1
    return None


def largest_sum(detector: ChangeDetector, cycles: np.ndarray) -> float:
    """Largest sum of any test over a leg that is as modelled."""
    state, most = detector.fresh(), 0.0
    for i, signature in enumerate(cycles):
        state = detector.with_cycle(state, signature, i + 1)
        most = max(most, float(state.sums.max()))
    return most


def counted(explainer: Explainer) -> np.ndarray:
    """Modelled clearances."""
    return np.full(len(explainer.joints), NEW_M)


def named(explainer: Explainer, mean: np.ndarray, cycles: int) -> set[str]:
    """The joints of the best cause, or the cause in words."""
    best = explainer.explanations(mean, cycles, counted(explainer))[0]
    if best.cause in (Cause.CLEARANCE, Cause.SEVERAL):
        return {one.subject for one in best.joints or (best,)}
    return {best.cause.value}


def fitted(explainer: Explainer, mean: np.ndarray, cycles: int):
    """All clearances, from starts at each single cause."""
    known = counted(explainer)
    starts = [known]
    for one in explainer.explanations(mean, cycles, known):
        if one.cause is Cause.CLEARANCE:
            starts.append(np.where(np.array(explainer.joints) == one.subject, one.value, known))
    return best_fit(explainer, mean, cycles, known, starts)


def delays(detector: ChangeDetector, cycles: np.ndarray) -> str:
    """Median and worst number of cycles to detection from several starts, and how often it took over 30."""
    found = [detected(detector, cycles[i : i + 30]) for i in range(0, len(cycles) - 29, STARTS)]
    missed, late = found.count(None), [30 if delay is None else delay for delay in found]
    return f"{np.median(late):g}, {max(late)}" + (f" ({missed} of {len(found)} not in 30)" if missed else "")


def rightly(explainer: Explainer, cycles: np.ndarray, n: int, wide: list[str]) -> tuple[int, int]:
    """How many windows of n cycles name wide joints alone, and how many there are."""
    parts = [cycles[i : i + n].mean(axis=0) for i in range(0, len(cycles) - n + 1, n)]
    return sum(named(explainer, part, n) <= set(wide) for part in parts), len(parts)


def of(found: tuple[int, int]) -> str:
    """A fraction, in words."""
    return f"{found[0]} of {found[1]}"


def at(explainer: Explainer, cycles: np.ndarray) -> list[str]:
    """Mean of the clearances over windows of ten cycles, and of their standard deviations [mm]."""
    windows = [cycles[i : i + 10].mean(axis=0) for i in range(0, len(cycles) - 9, 10)]
    fits = [fitted(explainer, window, 10) for window in windows]
    means = (np.mean([getattr(fit, name) for fit in fits], axis=0) for name in ("clearance_m", "sigma_m"))
    return [" ".join(f"{1e3 * value:.3f}" for value in mean) for mean in means]


def received(walk: np.ndarray, cycles: int, first: int, options, random) -> np.ndarray:
    """Samples of crank and torque of gait cycles of a walk, repeated, with stamps from a gait cycle on."""
    walk = walk[2 * RATE :, :3] - walk[2 * RATE - 1, :3]  # a gait cycle is a second
    times = 1 + cycles * RATE // len(walk)
    walk = np.concatenate([walk + i * walk[-1] for i in range(times)])[: cycles * RATE]
    between = CLOCK / options.rate_hz
    stamps, crank = np.arange(between, cycles, between), np.arange(0.0, cycles, 1.0 / options.rate_hz)
    torque = np.diff(np.interp(stamps, walk[:, 0], walk[:, 2]), prepend=0.0) / between
    torque += options.noise_nm * random.standard_normal(len(stamps))
    angle = np.interp(crank, walk[:, 0], walk[:, 1]) + 1e-3 * random.standard_normal(len(crank))
    both = [
        gait_samples(np.round(1e9 * (first + crank)).astype(np.int64), CRANK, crank_angle_rad=angle),
        gait_samples(np.round(1e9 * (first + stamps)).astype(np.int64), TORQUE_SAMPLE, torque_nm=torque),
    ]
    block = np.concatenate(both)
    return block[np.argsort(block["stamp_ns"], kind="stable")]


def observed(
    observer: TorqueObserver, leg: Mechanism, samples: np.ndarray, first: int
) -> Iterator[Diagnosis]:
    """The diagnosis after each gait cycle of samples from a cycle on."""
    stamp = samples["stamp_ns"]
    for period in range(round(stamp[-1] * 1e-9 - first) * PERIODS):
        begin_ns, end_ns = ((first * PERIODS + period + i) * 10**9 // PERIODS for i in (0, 1))
        observer.add_samples(samples[slice(*np.searchsorted(stamp, [begin_ns, end_ns]))])
        is_end = not (period + 1) % PERIODS
        if is_end:
            ended = SimpleNamespace(
                is_steady=True, cadence_rpm=60.0, begin_ns=end_ns - 10**9, stamp_ns=end_ns
            )
            observer.ended(ended)
        observer.end_period(*new(leg))
        if is_end:
            yield observer.diagnosis


def first_diagnosis(name: str, walks: dict[str, np.ndarray], options, random) -> list[str]:
    """Gait cycles and processor seconds until joints are surely identified; then the identified joints."""
    leg = load_mechanism(LEGS[name].mechanism)
    size, known = torque_size(build_linkage(leg), TURN), new(leg)
    steady, own = CrankProfile.steady(TURN), LegParameters.none(leg)
    LegSimulation(leg).simulate(steady, own, *known, 0, 1)  # loads kernels
    samples, misfits = received(walks["new"], LONGEST, 0, options, random), []
    begin, estimate = time.process_time(), None
    observer = TorqueObserver(leg, MonitorConfig(), size, known[0])
    observer.warm_up()
    for cycle, found in enumerate(observed(observer, leg, samples, 0), 1):
        state, spent = observer.state, time.process_time() - begin
        if found.state is not DiagnosisState.WAITING and estimate is None:
            estimate = cycle
        if state.commissioned is None:
            continue
        off = f"{observer.models.misfit(state):.2f}"
        misfits += [] if off in misfits else [off]
        if not found.reason:
            break
    else:
        return [str(estimate), "never", f"{spent:.0f}", " → ".join(misfits), str(state.rounds), found.reason]
    row = [str(estimate), str(cycle), f"{spent:.0f}", " → ".join(misfits), str(state.rounds)]
    then, named = attrs.evolve(observer.state), []
    for case in walks:
        if case.partition(" ")[2] not in ("0.36", "1.00"):
            continue
        observer.go_on_from(then)
        samples, after = received(walks[case], AFTER, cycle, options, random), 0
        for found in observed(observer, leg, samples, cycle):
            after += 1
            if any(change.is_sure for change in found.changes):
                break
        change = found.changes[-1] if found.changes else None
        what = f"{change.subject or change.cause.value} {1e3 * change.value:.2f}" if change else "nothing"
        named.append(f"{case}: {what}{'' if change is None or change.is_sure else '?'} ({after})")
    return [*row, "; ".join(named)]


def walks_of(name: str, leg: Mechanism, keep: Path | None) -> dict[str, np.ndarray]:
    """Walks of a leg by case."""
    real, walks = truth(leg, name), {}
    for case, clearance, cycles in cases(leg.clearance_joints, LEGS[name].sizes):
        make = functools.partial(walked, real, clearance, cycles + 2, LEGS[name].ripple)
        walks[case] = kept(keep / f"{name} {case}.pkl" if keep else None, make)
    return walks


class Round(NamedTuple):
    """A leg's data in one round of identification; without a baseline there is no torque residual."""

    reference: TorqueReference
    explainer: Explainer
    known: CommissionedTorque | None
    healthy: np.ndarray
    misfit: float | None


def rounds_of(leg, reference, walk, sensor, noise_nm, draws, file, next_leg=bodies_of, commissioned=True):
    """Yield the rounds of a leg as the monitor does them: with its first reference, then identified again.

    `draws` makes the random numbers of a round; `file` gives the path of the stored data.
    """
    for number in range(1, ROUNDS + 2):
        explainer, known, healthy = explained(leg, reference, walk, sensor, noise_nm, draws(), commissioned)
        off = None if known is None else misfit(explainer.model, explainer.nuisances, known)
        yield Round(reference, explainer, known, healthy, off)
        if off is None or number > ROUNDS or off < WORTH_IDENTIFYING:
            return

        def identify(reference=reference, explainer=explainer, known=known) -> TorqueReference:
            return referred(leg, reference.profile, next_leg(leg, explainer, known, reference))

        reference = kept(file(f"identified {number}"), identify)


def best_of(rounds: Iterator[Round], name: str) -> Round:
    """The last round that is not worse than the round before it, as in the monitor."""
    best = None
    for one in rounds:
        if best is not None and one.misfit > best.misfit:
            print(f"{name}: misfit {one.misfit:.2f} after another round, refused", flush=True)
            break
        best = one
        if one.misfit is None:
            break
        parameters = one.reference.parameters
        masses, lengths = (np.round(100.0 * (each - 1.0), 1) for each in (parameters.mass, parameters.length))
        print(f"{name}: misfit {one.misfit:.2f}, masses {masses} and lengths {lengths} % off", flush=True)
    return best


def known_leg(name, leg, walk, profile, sensor, random, options) -> tuple[Explainer, np.ndarray]:
    """The explainer of a leg, identified unless otherwise required, and its signatures when healthy."""
    file = (lambda what: options.keep / f"{name} {what}.pkl") if options.keep else (lambda what: None)
    reference = kept(file("of file"), lambda: referred(leg, profile, LegParameters.none(leg)))
    how = {"commissioned": not options.uncommissioned}
    rounds = rounds_of(leg, reference, walk, sensor, options.noise_nm, lambda: random, file, **how)
    best = next(rounds) if options.as_of_file else best_of(rounds, f"leg {name}")
    return best.explainer, best.healthy


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--noise-nm", type=float, default=0.5)
    parser.add_argument("--rate-hz", type=float, default=200.0)
    parser.add_argument("--uncommissioned", action="store_true")
    parser.add_argument("--as-of-file", action="store_true", help="do not identify the leg")
    parser.add_argument("--first", action="store_true", help="only the times until the first diagnosis")
    parser.add_argument("--legs", nargs="+", default=list(LEGS))
    options = parser.parse_args()
    random, rights = np.random.default_rng(5), {}
    print(f"noise {options.noise_nm} N m, {options.rate_hz:g} Hz")
    if options.first:
        print(FIRST_HEAD)
        for name in options.legs:
            walks = walks_of(name, load_mechanism(LEGS[name].mechanism), options.keep)
            print(f"| {name} | {' | '.join(first_diagnosis(name, walks, options, random))} |", flush=True)
        return
    for name in options.legs:
        leg = load_mechanism(LEGS[name].mechanism)
        size = torque_size(build_linkage(leg), TURN)
        walks = walks_of(name, leg, options.keep)
        profile = profile_of(walks["new"])
        sensor = TorqueSensor(1.0 / options.rate_hz, TURN / abs(profile.speed), size)
        explainer, healthy = known_leg(name, leg, walks["new"], profile, sensor, random, options)
        detector = ChangeDetector(explainer, counted(explainer), MONTH)
        most = largest_sum(detector, healthy)
        print(
            f"leg {name}: RMS of the torque {size:.1f} N m, noise found "
            f"{explainer.model.sensor.noise_nm:.3f} N m, threshold "
            f"{detector.threshold:.1f}, largest sum in {len(healthy)} healthy cycles {most:.1f}"
        )
        print(HEAD)
        for case, clearance, _ in cases(leg.clearance_joints, LEGS[name].sizes):
            cycles = measured(walks[case], sensor, options.noise_nm, random)
            wide = [joint for joint, c in zip(leg.clearance_joints, clearance, strict=True) if c > 3.3e-4]
            right = {n: rightly(explainer, cycles, n, wide) for n in (5, 10)}
            for n, found in right.items():
                key = ("none" if not wide else case.split()[-1] if len(wide) == 1 else "several", n)
                rights[key] = tuple(np.add(rights.get(key, (0, 0)), found))
            row = [case, delays(detector, cycles), *map(of, right.values()), *at(explainer, cycles)]
            print(f"| {' | '.join(row)} |", flush=True)
    for (size_mm, n), found in sorted(rights.items()):
        print(f"{size_mm}, {n} cycles: {of(found)} named rightly")


if __name__ == "__main__":
    main()
