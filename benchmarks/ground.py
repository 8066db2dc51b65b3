"""Healthy and worn legs on the ground: names, sizes, the load, and the wear.

A leg in full coordinates, with masses 4 % off, walks under a force with a different shape than the template's
(a treadmill's). Its size and time differ from step to step by 10 % and by 2 % of the cycle. The leg has
commercial drives. `load.model` is ground: the force is estimated, and the references are simulated under it.
Healthy cycles, drawn in blocks of ten, make up some hours; joints open after 600 cycles, when the leg is
identified. The wear is the twin's wear under the estimated force, divided by the leg's wear, by the Archard
integral of 60 gait cycles. The last rows have it under a measured force, at 200 Hz with noise of 5 % of its
value or of its peak.
`python benchmarks/ground.py --keep DIRECTORY` takes half an hour of two cores, a minute with `--wear-only`.
"""

import argparse
import functools
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

from diagnosis import LEGS as DIAGNOSED  # first: it sets the threads of numpy
from diagnosis import NEW, RATE, kept

# isort: split
import attrs
import numpy as np
from drives import MASSES, Drive, cycles_of, drawn, summary, watched, when

from leg_wear_monitor import MonitorConfig, load_mechanism
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import ARCHARD, TORQUE, new_run_statistics, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.estimate.signature import TorqueSensor
from leg_wear_monitor.gait.config import GaitConfig, LoadConfig
from leg_wear_monitor.gait.leg import POINTS, Ground
from leg_wear_monitor.mechanism.person import upwards, with_toe_force
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.inputs import Load
from leg_wear_monitor.twin import CRANK, LOAD
from leg_wear_monitor.twin import TORQUE as TORQUE_KIND
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.sample import GROUND, MEASURED, NONE, WRENCH, TwinSettings, gait_samples

PEAKS_N = (100.0, 300.0, 600.0)
BEFORE, HEALTHY, WORN, COUNTED, FORCE_HZ = 600, 260, 40, 60, 200
MEASURED_LOAD = TwinSettings(load_model=MEASURED, load_source=WRENCH)
OPENINGS = (("G", 0.6), ("I", 0.6), ("J", 0.6), ("A", 0.45), ("B", 0.45))
DRIVES = {
    "none": Drive(),
    "35 Hz, 10 ms": Drive(hz=35.0, lag_s=0.01),
    "friction 0.2, 50 Hz, 5 ms": Drive(load_friction=0.2, hz=50.0, lag_s=0.005),
}


@attrs.frozen(eq=False)
class Walk:
    """Rows of time [s], crank angle [rad], impulse [N m s], torque [N m]; Archard integrals a cycle [J]."""

    rows: np.ndarray
    archard_j: np.ndarray


def walked_steps(
    leg: Mechanism, cycles: int, load: LoadConfig, seed: int
) -> Iterator[tuple[int, np.ndarray]]:
    """First row of each step of a walk, and its force (POINTS, 2) [N]."""
    ground = Ground(leg, GaitConfig(load=load, seed=seed))
    for i in sorted({0, *range(round(ground.swing * RATE) % RATE, cycles * RATE, RATE)}):
        yield i, ground.step(TURN)


def sensed(leg: Mechanism, cycles: int, load: LoadConfig, seed: int, of_value: float, of_peak: float):
    """Samples of a foot load sensor on a walk; the noise is a fraction of the value and of the peak."""
    up, random, place = upwards(leg), np.random.default_rng(seed), np.arange(POINTS) / POINTS
    steps = list(walked_steps(leg, cycles, load, seed))
    row = np.arange(0, cycles * RATE, RATE // FORCE_HZ)
    which = np.searchsorted([first for first, _ in steps], row, side="right") - 1
    force = np.array(
        [
            [np.interp(i / RATE, place, one, period=1.0) for one in steps[at][1].T]
            for i, at in zip(row, which, strict=True)
        ]
    )
    noise = random.standard_normal(force.shape)
    force += (of_value * np.abs(force) + of_peak * load.ground_n) * noise
    along = np.stack([force @ [up[1], -up[0]], force @ up], axis=1)
    return gait_samples(10**9 + np.round(1e9 * row / RATE).astype(np.int64), LOAD, foot_force_n=along)


def walked(leg: Mechanism, clearance: np.ndarray, cycles: int, load: LoadConfig, seed: int) -> Walk:
    """A leg that walks on the ground."""
    steps = dict(walked_steps(leg, cycles, load, seed))
    setup = prepare(with_toe_force(leg, np.zeros((POINTS, 2))))
    setup.contacts.clearance[:] = clearance
    run = FullRun(attrs.evolve(setup, speed=TURN), tolerance_m=1e-9)
    statistics, rows, archard = new_run_statistics(len(leg.joints)), np.empty((cycles * RATE, 4)), []
    for i in range(len(rows)):
        if i in steps:
            run.model.arrays.load_force[-1] = np.pad(steps[i], ((1, 1), (0, 0)), mode="wrap")
        before, t = i / RATE, (i + 1) / RATE
        begin, end = (SimpleNamespace(angle=TURN * at, speed=TURN, acceleration=0.0) for at in (before, t))
        run.polynomial[:] = quintic(before, begin, t - before, end)
        run.advance(t, statistics)
        rows[i] = t, TURN * t, statistics.drive_integral[TORQUE], run.sample().drive_torque
        if (i + 1) % RATE == 0:
            archard.append(statistics.integral[setup.contacts.joint, ARCHARD].copy())
    return Walk(rows, np.diff(np.array(archard), axis=0, prepend=0.0))


def worn(
    leg: Mechanism, walk: Walk, parameters: LegParameters | None, settings: TwinSettings, *more: np.ndarray
) -> np.ndarray:
    """Archard integral (k,) of a walk's twin, divided by the leg's; with samples of further sensors."""
    twin = DigitalTwin(leg, settings)
    if parameters is not None:
        twin.set_parameters(parameters)
    time, torque = walk.rows[:, 0], np.diff(walk.rows[:, 2], prepend=0.0) * RATE
    stamps = 10**9 + np.round(1e9 * time).astype(np.int64)
    samples = np.concatenate(
        [
            gait_samples(stamps, CRANK, crank_angle_rad=walk.rows[:, 1]),
            gait_samples(stamps, TORQUE_KIND, torque_nm=torque),
            *more,
        ]
    )
    samples = samples[np.argsort(samples["stamp_ns"], kind="stable")]
    cycles = [one.archard_j for block in np.array_split(samples, 50) for one in twin.update(block).cycles]
    return np.mean(cycles[20 : 20 + COUNTED], axis=0) / walk.archard_j[20 : 20 + COUNTED].mean(axis=0)


def masses_off(leg: Mechanism, lengths: dict[str, float] | None = None, friction: float = 1.0) -> Mechanism:
    """A leg with masses 4 % off, and other lengths or friction in its joints."""
    mass = np.array([MASSES.get(body, 1.0) for body in leg.bodies])
    length = np.array([(lengths or {}).get(body, 1.0) for body in leg.bodies])
    return LegParameters(mass, length, friction).applied(leg)


def with_law(leg: Mechanism, law: str) -> Mechanism:
    """A leg with masses 4 % off and a different law of contact in its joints."""
    clearances = {joint: attrs.evolve(one, normal_law=law) for joint, one in leg.clearances.items()}
    return masses_off(attrs.evolve(leg, clearances=clearances))


LEGS = {
    "masses": masses_off,
    "friction 0.5": functools.partial(masses_off, friction=0.5),
    "friction 2": functools.partial(masses_off, friction=2.0),
    "lengths": functools.partial(masses_off, lengths=DIAGNOSED["c"].lengths),  # drawn within 1 %
    "winkler": functools.partial(with_law, law="winkler"),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--hours", type=float, default=4.0)
    parser.add_argument("--peak", type=float, action="append")
    parser.add_argument("--shape", default="treadmill")
    parser.add_argument("--drive", action="append", choices=sorted(DRIVES))
    parser.add_argument("--wear-only", action="store_true", help="under a measured force, and no more")
    parser.add_argument("--leg", default="masses", choices=sorted(LEGS))
    options = parser.parse_args()
    leg = load_mechanism("bionic_leg")
    real = LEGS[options.leg](leg)
    size, config = torque_size(build_linkage(leg), TURN), MonitorConfig(load=Load(model=GROUND))
    sensor, other = TorqueSensor(0.005, 1.0, size), f" {options.leg}" if options.leg != "masses" else ""

    @functools.cache
    def walk(peak_n: float, joint: str = "", size_mm: float = 0.3) -> Walk:
        clearance = np.where(np.array(leg.clearance_joints) == joint, 1e-3 * size_mm, NEW)
        load = LoadConfig(ground_n=peak_n, shape=options.shape)
        file = (
            options.keep / f"{joint or 'new'} {size_mm:.2f} {peak_n:.0f} {options.shape}{other}.pkl"
            if options.keep
            else None
        )
        cycles = WORN if joint else HEALTHY
        return kept(file, lambda: walked(real, clearance, cycles + 3, load, round(1000 * size_mm)))

    def wear(peak_n: float, known: LegParameters | None, settings: TwinSettings, *more: np.ndarray) -> str:
        ratio = worn(leg, walk(peak_n), known, settings, *more)
        return ", ".join(f"{j} {r:.2f}" for j, r in zip(leg.clearance_joints, ratio, strict=True))

    for peak_n in options.peak or PEAKS_N:
        for name in () if options.wear_only else options.drive or DRIVES:
            drive = DRIVES[name]
            cycles = cycles_of(walk(peak_n).rows, drive, sensor, 5)[0]
            before = [cycles[i % len(cycles)] for i in range(BEFORE)]
            one, found = watched(leg, size, before, config=config, periods=4)
            state = one.state
            load, channel, off = state.load, state.sensor.channel, one.models.misfit(state)
            print(
                f"{peak_n:.0f} N, {name}: load {load.peak_n:.0f} ± {load.peak_sigma_n:.0f} N, stance "
                f"{load.heel_strike:.3f} to {load.toe_off:.3f}; channel "
                f"{1e3 * channel.delay_s:.1f} ms, {1e3 * channel.time_constant_s:.1f} ms, "
                f"{channel.load_friction:.2f}; misfit {off:.2f}; {summary(found) or 'nothing found'}",
                flush=True,
            )
            commissioned, parameters = attrs.evolve(one.state), one.parameters
            for joint, size_mm in OPENINGS:
                rows = list(cycles_of(walk(peak_n, joint, size_mm).rows, drive, sensor, 6)[0])
                one.go_on_from(commissioned)
                one, found = watched(leg, size, rows, one, BEFORE)
                seen, k = one.diagnosis, leg.clearance_joints.index(joint)
                value = (
                    f"{1e3 * seen.clearance_m[k]:.2f} ± {1e3 * seen.sigma_m[k]:.2f}"
                    if seen.clearance_m
                    else "-"
                )
                print(f"  {joint} {size_mm:g}: {when(found, BEFORE)}; {value}", flush=True)
            one.go_on_from(commissioned)
            rows = drawn(cycles, round(3600 * options.hours))
            one, found = watched(leg, size, rows, one, BEFORE)
            print(f"  healthy, {options.hours:g} h: {summary(found) or 'none'}", flush=True)
            if name == "none":
                for what, known, model in (
                    ("none", None, NONE),
                    ("ground, before the fit", None, GROUND),
                    ("ground", parameters, GROUND),
                ):
                    ratios = wear(peak_n, known, TwinSettings(load_model=model))
                    print(f"  wear, load.model {what}: {ratios}", flush=True)
        load = LoadConfig(ground_n=peak_n, shape=options.shape)
        for of_value, of_peak in ((0.0, 0.0), (0.05, 0.0), (0.0, 0.05)):
            force = sensed(real, HEALTHY + 3, load, 300, of_value, of_peak)
            ratios = wear(peak_n, None, MEASURED_LOAD, force)
            print(f"{peak_n:.0f} N measured, noise {of_value:g}, {of_peak:g}: wear {ratios}", flush=True)


if __name__ == "__main__":
    main()
