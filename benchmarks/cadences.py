"""An hour of walking at 45, 60 and 75 rpm, with a start each minute and ramps, through the whole monitor.

The leg walks in full coordinates, with other masses than the mechanism file and a ripple of the crank. Each
minute begins with a start and ends with a stop; one in ten is a ramp from 45 to 75 rpm, in another one the
cadence changes from 45 to 75 rpm without a stop. After the hour one joint opens at one cadence, and each
joint at each cadence is a walk of its own. `python benchmarks/cadences.py` takes half an hour of one core;
with `--keep DIRECTORY` the leg walks once.
"""

import argparse
import copy
import functools
import resource
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import one_core  # noqa: F401, before numpy

# isort: split
import attrs
import numpy as np
from diagnosis import LEGS, NEW, kept, truth

from leg_wear_monitor import MonitorConfig, WearMonitor, load_mechanism, twin
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import TORQUE, new_run_statistics, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.estimate.cause import Cause, Change
from leg_wear_monitor.gait.config import PaceConfig
from leg_wear_monitor.gait.leg import Pace
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.inputs import Cadence
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis, DiagnosisState
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.state import Verdict
from leg_wear_monitor.twin.sample import gait_samples

NOISE_RAD, NOISE_NM = 1.0e-3, 0.5
PERIOD_NS = 5_010_500  # between samples: they drift through the gait cycle
MINUTES = 60
CADENCES = 60.0, 45.0, 75.0
TOLERANCE_RPM = 20.0  # from 0.8 of it on, the alarm of the cadence warns
STANDING_S, RAMP_S = 2.0, 1.0
OPENED_M = 4.5e-4
BLOCK_S = 1.0  # between two looks at the monitor


def minute(number: int) -> list[tuple[float, float]]:
    """Times since its begin [s] and speeds [rpm] of a minute."""
    if number % 10 == 9:  # a ramp, in pieces that have no jerk between them
        rise = [(STANDING_S + i, 45.0 + 30.0 * i / 54.0) for i in range(55)]
        return [*rise, (59.0, 0.0)]
    if number % 10 == 4:
        return [(STANDING_S, 45.0), (30.0, 75.0), (59.0, 0.0)]
    return [(STANDING_S, CADENCES[number % 3]), (59.0, 0.0)]


def pace(ripple: float, last: Sequence[float] = ()) -> Pace:
    """The crank's motion: the hour, and then minutes at some speeds [rpm]."""
    speeds = [(0.0, 0.0)]
    for number in range(MINUTES):
        speeds += [(60.0 * number + t, rpm) for t, rpm in minute(number)]
    for i, rpm in enumerate(last):
        begin = 60.0 * (MINUTES + i)
        speeds += [(begin + STANDING_S, rpm), (begin + 59.0, 0.0)]
    times, rpm = zip(*speeds, strict=True)
    return Pace(PaceConfig(times_s=times, speeds_rpm=rpm, ramp_s=RAMP_S, ripple=ripple))


class Walk(NamedTuple):
    """Crank angles [rad] and mean drive torques [N m] of samples from a number on."""

    first: int
    angle: np.ndarray
    torque: np.ndarray


class Walker:
    """A leg in full coordinates that walks on."""

    def __init__(self, leg: Mechanism, ripple: float) -> None:
        self.setup, self.pace, self.count = prepare(leg, wear=True), pace(ripple), 0
        self.setup.contacts.clearance[:] = NEW
        self.run = FullRun(attrs.evolve(self.setup, speed=0.0), tolerance_m=1e-9)

    def walk(self, until_s: float) -> Walk:
        """Samples until a time."""
        run, angles, torques, first = self.run, [], [], self.count
        joints = len(self.setup.linkage.mechanism.joints)
        while 1e-9 * PERIOD_NS * (self.count + 1) <= until_s:
            before, t = run.time, 1e-9 * PERIOD_NS * (self.count + 1)
            statistics = new_run_statistics(joints)
            run.polynomial[:] = quintic(before, self.pace.at(before), t - before, self.pace.at(t))
            run.advance(t, statistics)
            angles.append(self.pace.at(t).angle)
            torques.append(float(statistics.drive_integral[TORQUE]) / (t - before))
            self.count += 1
        return Walk(first, np.array(angles), np.array(torques))


def walks(leg: Mechanism, ripple: float) -> dict[str, Walk]:
    """The hour, each joint opened at each cadence, and one joint opened that walks on at all of them."""
    walker = Walker(leg, ripple)
    found = {"hour": walker.walk(60.0 * MINUTES)}
    print("walked an hour", flush=True)
    cases = [(joint, (rpm,)) for joint in leg.clearance_joints for rpm in CADENCES]
    for joint, last in (*cases, ("G", CADENCES * 3)):
        one = copy.deepcopy(walker)
        one.pace = pace(ripple, last)
        one.setup.contacts.clearance[leg.clearance_joints.index(joint)] = OPENED_M
        rpm = f"{last[0]:g}" if len(last) == 1 else "all"
        found[f"{joint} {rpm}"] = one.walk(60.0 * (MINUTES + len(last)))
        print("walked", joint, rpm, flush=True)
    return found


def samples_of(walk: Walk, random: np.random.Generator) -> np.ndarray:
    """Samples of a crank encoder and a torque sensor."""
    count = len(walk.angle)
    stamps = 10**9 + (walk.first + np.arange(count) + 1) * PERIOD_NS
    angle = walk.angle + NOISE_RAD * random.standard_normal(count)
    torque = walk.torque + NOISE_NM * random.standard_normal(count)
    crank = gait_samples(stamps, twin.CRANK, crank_angle_rad=angle)
    return np.stack([crank, gait_samples(stamps, twin.TORQUE, torque_nm=torque)], axis=1).ravel()


class Look(NamedTuple):
    """What the monitor reports at a time of the walk, and gait cycles that ended since the one before."""

    at_s: float
    found: Diagnosis
    verdict: Verdict
    cycles: tuple[CycleReport, ...]


def looked(monitor: WearMonitor, samples: np.ndarray) -> Iterator[Look]:
    """What the monitor reports after each second of samples."""
    block = 2 * round(BLOCK_S * 1e9 / PERIOD_NS)
    for i in range(0, len(samples), block):
        piece = samples[i : i + block]
        cycles = monitor.update(piece).cycles
        at_s = piece["stamp_ns"][-1] * 1e-9 - 1.0
        yield Look(at_s, monitor.diagnosis, monitor.verdict.verdict, cycles)


def words(change: Change) -> str:
    """A change in a few words."""
    value = f" {1e3 * change.value:.2f} ± {1e3 * change.sigma:.2f}" if change.cause is Cause.CLEARANCE else ""
    sure = "" if change.is_sure else "?"
    corrected = " (corrected)" if change.is_corrected else ""
    return f"{change.subject or change.cause.value}{value}{sure}{corrected}"


def is_diagnosed(look: Look) -> bool:
    """Whether clearances are compared now, without a doubt."""
    return look.found.state is not DiagnosisState.WAITING and not look.found.reason


def kind(second: int) -> str:
    """What the leg does in a second of the hour."""
    number, at = divmod(second, 60)
    if at < STANDING_S + 3.0 or at >= 59:
        return "stop, standstill, start"
    if number % 10 == 9:
        return "ramp"
    speeds = [rpm for t, rpm in minute(number) if t + RAMP_S <= at]
    return f"{speeds[-1]:g} rpm"


def show(looks: Sequence[Look]) -> None:
    """Print what was reported in the hour: from when on, how often, and which verdicts."""
    for begin in (0, 10, 20):
        print(f"\nfrom minute {begin} on: seconds, of them diagnosed, with a change named; verdicts")
        by_kind: dict[str, list[Look]] = {}
        for one in looks:
            if one.at_s >= 60.0 * begin:
                by_kind.setdefault(kind(int(one.at_s)), []).append(one)
        for what, some in sorted(by_kind.items()):
            codes = Counter(one.verdict.fault_code for one in some).most_common()
            diagnosed, named = (
                sum(map(f, some)) for f in (is_diagnosed, lambda one: bool(one.found.changes))
            )
            row = what, len(some), diagnosed, named, ", ".join(f"{code} {n}" for code, n in codes)
            print(f"| {' | '.join(map(str, row))} |")
    print("gait cycles not used:", dict(looks[-1].found.cycles_not_used))
    cycles = [one for look in looks for one in look.cycles]
    print("\n| cadence | gait cycles | mismatch: median, 99 %, largest | peak force of a joint: same [N] |")
    for rpm in CADENCES:
        at_this = [one for one in cycles if abs(one.cadence_rpm / rpm - 1.0) < 0.01]
        mismatch = np.nanpercentile([one.torque_mismatch for one in at_this], [50, 99, 100])
        peak = np.percentile(
            [max(joint.peak_force_n for joint in one.joints) for one in at_this], [50, 99, 100]
        )
        columns = f"{rpm:g} rpm", len(at_this), ", ".join(f"{x:.3f}" for x in mismatch)
        print(f"| {' | '.join(map(str, columns))} | {', '.join(f'{x:.0f}' for x in peak)} |")


def opened(monitor: WearMonitor, walk: Walk, random: np.random.Generator) -> str:
    """When a change is named after a joint opened, and what is named in the end, without what came before."""
    before, first = monitor.diagnosis.changes, "nothing"
    for one in looked(monitor, samples_of(walk, random)):
        new = [change for change in one.found.changes if change not in before]
        if new and first == "nothing":
            first = f"{words(new[-1])} after {one.at_s - 60.0 * MINUTES - STANDING_S:.0f} s"
    return f"{first} | {', '.join(map(words, one.found.changes)) or 'nothing'} | {one.verdict.fault_code}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--leg", choices=list(LEGS), default="a")
    options = parser.parse_args()
    leg = truth(load_mechanism("bionic_leg"), options.leg)
    file = options.keep / f"{options.leg}.pkl" if options.keep else None
    known = kept(file, functools.partial(walks, leg, LEGS[options.leg].ripple))
    config = MonitorConfig(cadence=Cadence(tolerance_rpm=TOLERANCE_RPM))
    monitor, random = WearMonitor(load_mechanism("bionic_leg"), config), np.random.default_rng(1)
    monitor.warm_up()
    begin = time.process_time()
    looks = list(looked(monitor, samples_of(known["hour"], random)))
    memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"leg {options.leg}: {time.process_time() - begin:.0f} s of processor, {memory_mb:.0f} MB")
    show(looks)
    then = monitor.snapshot()
    print("\n| joint at 0.45 mm, cadence | first named | in the end | verdict |")
    for case, walk in known.items():
        if case != "hour":
            monitor.restore(then)
            print(f"| {case} | {opened(monitor, walk, random)} |", flush=True)


if __name__ == "__main__":
    main()
