"""Legs with commercial drives: the diagnosis of healthy and of worn legs.

The legs walk in the air, in full coordinates, with masses 4 % off the file. Their torque passes a drive:
friction that grows with the load, Coulomb and viscous friction, cogging, a low-pass of first or second order,
a mean over some time, a lag, a torque constant and friction that change over twenty minutes, steps of the
sensor, lost samples, a coupling between the measured angle and the crank. The first table is for healthy
legs: gait cycles drawn in blocks of ten make up the given time. The second table is for joints that open
after 690 gait cycles, when a leg is identified and a drive that warms up is half warm; J on three walks. With
`--as-of-file` no leg is identified, and names count as if the leg were exactly as in its file.
`python benchmarks/drives.py --keep DIRECTORY [--hours 100]`.
"""

import argparse
import functools
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

from diagnosis import (  # first: it sets the threads of numpy
    BODIES,
    CLOCK,
    NEW,
    RATE,
    UNWORN,
    kept,
    measured,
    walked,
)

# isort: split
import attrs
import numpy as np
from scipy import signal

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.estimate.signature import TorqueSensor, signatures
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.mechanism.spec import Mechanism, Track, TrackDrive
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis import observer, references
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references
from leg_wear_monitor.monitor.diagnosis.state import SignedCycle
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import COUPLING_DAMPING, LegParameters

MASSES = dict(zip(BODIES, (1.04, 0.96, 1.04, 0.96, 1.04, 0.96, 1.04), strict=True))
NOISE_NM, BLOCK, COMMISSIONED, HEALTHY, WORN = 0.5, 10, 90, 260, 40
OPENINGS = (  # joint, clearance [mm] and walk; each walk starts differently
    *((joint, 0.45, 0) for joint in "ABGI"), *(("J", 0.45, walk) for walk in range(3)),
    ("G", 0.6, 0), *(("J", 1.0, walk) for walk in range(3)),
)  # fmt: skip
WARM = 1200  # gait cycles until a drive is warm
LEVELS = 11  # levels of the drifting values, between cold and warm


@attrs.frozen(kw_only=True)
class Drive:
    """The drive between the leg's torque and its samples; drifts are the excess of a warm drive."""

    lag_s: float = 0.0
    hz: float = 0.0
    order: int = 1  # of the low-pass; those from 2 on are Butterworth's
    mean_s: float = 0.0  # over which a drive averages before it reports
    load_friction: float = 0.0
    coulomb_nm: float = 0.0
    viscous_nms: float = 0.0
    cogging: float = 0.0  # of the torque's RMS
    waves: float = 72.0  # of it in a turn of the crank
    quantum_nm: float = 0.0
    loss: float = 0.0
    scale_drift: float = 0.0
    coulomb_drift_nm: float = 0.0
    load_friction_drift: float = 0.0
    stiffness_nm_per_rad: float = 0.0  # rigid

    @property
    def drifts(self) -> bool:
        return bool(self.scale_drift or self.coulomb_drift_nm or self.load_friction_drift)

    def received(self, walk: np.ndarray, warm: float, size_nm: float) -> np.ndarray:
        """A walk as this drive reports it, cold (0) to warm (1)."""
        walk, step = walk.copy(), 1.0 / RATE
        torque = np.diff(walk[:, 2], prepend=0.0) / step
        torque = torque + (self.load_friction + warm * self.load_friction_drift) * np.abs(torque)
        torque += self.coulomb_nm + warm * self.coulomb_drift_nm + self.viscous_nms * TURN
        torque += self.cogging * size_nm * np.sqrt(2.0) * np.sin(self.waves * walk[:, 1])
        torque *= 1.0 + warm * self.scale_drift
        if self.mean_s:
            torque = signal.lfilter(np.ones(round(self.mean_s / step)) * step / self.mean_s, [1.0], torque)
        if self.hz and self.order > 1:
            torque = signal.lfilter(*signal.butter(self.order, self.hz, fs=RATE), torque)
        elif self.hz:
            part, value = 1.0 - np.exp(-TURN * self.hz * step), torque[0]
            for i, now in enumerate(torque):
                value += part * (now - value)
                torque[i] = value
        time = walk[:, 0]
        walk[:, 2] = np.interp(time - self.lag_s, time, np.cumsum(torque) * step, left=0.0)
        walk[:, 1] += TURN
        return walk


ALL = Drive(
    lag_s=0.01, hz=35.0, load_friction=0.2, coulomb_nm=1.0, viscous_nms=0.1, cogging=0.03, waves=72.3,
    quantum_nm=0.1, loss=0.02, scale_drift=-0.1, coulomb_drift_nm=-0.5, load_friction_drift=-0.05,
)  # fmt: skip
DRIVES = {
    "none": Drive(),
    **{f"lag {ms} ms": Drive(lag_s=1e-3 * ms) for ms in (5, 10, 13, 20, 30)},
    # the search for the channel begins at 20, 35 and 50 Hz, 5, 10, 20 and 30 ms: others lie between
    **{f"low-pass {hz:g} Hz": Drive(hz=hz) for hz in (17.0, 20.0, 22.4, 29.6, 35.0, 50.0)},
    **{f"load friction {eta:g}": Drive(load_friction=eta) for eta in (0.1, 0.2, 0.3)},
    "Coulomb 1 N m": Drive(coulomb_nm=1.0),
    "viscous 1.4 N m s": Drive(viscous_nms=1.4),
    "torque constant -10 % in 20 min": Drive(scale_drift=-0.1),
    "Coulomb 1 N m less in 20 min": Drive(coulomb_nm=2.0, coulomb_drift_nm=-1.0),
    "load friction 0.2, 0.1 warm": Drive(load_friction=0.2, load_friction_drift=-0.1),
    "cogging 3 %, 72 waves": Drive(cogging=0.03),
    "cogging 3 %, 100.3 waves": Drive(cogging=0.03, waves=100.3),
    "steps of 0.1 N m": Drive(quantum_nm=0.1),
    "2 % lost": Drive(loss=0.02),
    **{f"Butterworth {hz:g} Hz": Drive(hz=hz, order=2) for hz in (20.0, 35.0)},
    "Butterworth 20 Hz of third order": Drive(hz=20.0, order=3),
    **{f"mean over {ms} ms": Drive(mean_s=1e-3 * ms) for ms in (20, 40)},
    "mean over 20 ms, 20 Hz": Drive(mean_s=0.02, hz=20.0),
    "friction 0.2, 35 Hz, 5 ms": Drive(load_friction=0.2, hz=35.0, lag_s=0.005),
    "friction 0.2, 29.6 Hz, 7 ms": Drive(load_friction=0.2, hz=29.6, lag_s=0.007),
    "all": ALL,
    **{
        f"{name}, {stiffness:g} N m/rad": attrs.evolve(drive, stiffness_nm_per_rad=stiffness)
        for name, drive in (("none", Drive()), ("all", ALL))
        for stiffness in (1000.0, 200.0)
    },
}


def behind(leg: Mechanism, stiffness: float, damping_ratio: float = COUPLING_DAMPING) -> Mechanism:
    """The leg behind a coupling: a controller that turns steadily, with its stiffness and damping."""
    linkage = build_linkage(leg)
    inertia = one_cycle(linkage, 240, 0.0, 1.0).drive_torque - one_cycle(linkage, 240, 0.0).drive_torque
    damping = 2.0 * damping_ratio * float(np.sqrt(stiffness * inertia.mean()))
    track = Track(speed_radps=TURN, kp_nm_per_rad=stiffness, kd_nm_s_per_rad=damping)
    return attrs.evolve(leg, drive=TrackDrive(body=leg.drive.body, track=track))


def signed(
    walk: np.ndarray,
    sensor: TorqueSensor,
    seed: int,
    loss: float = 0.0,
    quantum_nm: float = 0.0,
):
    """Signatures (cycles, F) of a walk; with samples lost, and with the torque in steps."""
    random = np.random.default_rng(seed)
    if not (loss or quantum_nm):
        return measured(walk, sensor, NOISE_NM, random)[1:]
    between = sensor.period_s * CLOCK
    time = np.arange(between, walk[-1, 0], between)
    torque = np.diff(np.interp(time, walk[:, 0], walk[:, 2]), prepend=0.0) / between
    torque += NOISE_NM * random.standard_normal(len(time))
    if quantum_nm:
        torque = quantum_nm * np.round(torque / quantum_nm)
    angle = np.interp(time, walk[:, 0], walk[:, 1])
    there = random.random(len(time)) >= loss
    step = np.where(np.roll(there, 1), np.diff(torque, prepend=np.nan), np.nan)
    angle, torque, step = angle[there], torque[there], step[there]
    return signatures(np.floor(angle / TURN - 1e-9).astype(np.int64), angle, torque, step, sensor)[3:-1]


def watched(
    leg: Mechanism,
    size_nm: float,
    rows: list[np.ndarray],
    one: observer.TorqueObserver | None = None,
    first: int = 0,
    config: MonitorConfig | None = None,
    periods: int = 1,
    modelled_m: np.ndarray = NEW,
) -> tuple[observer.TorqueObserver, list[str]]:
    """The observer after gait cycles with given signatures; its diagnoses, corrections and stops, with times.

    The given observer may already have gait cycles, up to the one before number ``first``. If no reference is
    made, all evaluation periods of a gait cycle except one can be left out.
    """
    left, reference = iter(rows), shipped_references(leg)[0]
    one = one or observer.TorqueObserver(leg, config or MonitorConfig(), size_nm, NEW)
    counted, found = modelled_m.copy(), []
    joints, limit_m, second = leg.clearance_joints, MonitorConfig().limits.clearance_m, 10**9

    def next_cycle(state, begin_ns, end_ns):
        return SignedCycle(begin_ns, end_ns, next(left), reference.profile, 0.0)

    def find(state, *_):
        state.sensor = state.sensor or TorqueSensor(0.005, 1.0, size_nm)

    with mock.patch.multiple(observer, signed_cycle=next_cycle, find_sensor=find):
        for i in range(first, first + len(rows)):
            begin, end = (i + 1) * second, (i + 2) * second
            one.ended(SimpleNamespace(is_steady=True, cadence_rpm=60.0, begin_ns=begin, stamp_ns=end))
            correction = one.end_period(counted, UNWORN)
            for _ in range(periods - 1):
                one.end_period(counted, UNWORN)
            seen = one.diagnosis
            texts = [
                f"{change.cause.name} {change.subject}" for change in seen.changes if not change.is_corrected
            ]
            stops = zip(joints, seen.least_m, strict=False)
            texts += [f"stop {joint}" for joint, least_m in stops if least_m >= limit_m]
            if correction is not None:
                texts.append(f"corrected {correction.subject} {1e3 * correction.value:.3f} mm")
                counted = counted.copy()
                counted[joints.index(correction.subject)] = correction.value
                one.corrected(correction, counted)
            found += [f"{i}: {text}" for text in texts]
    return one, found


def drawn(cycles: np.ndarray, number: int, seed: int = 1) -> list[np.ndarray]:
    """Gait cycles drawn in blocks, after as many consecutive ones as commissioning takes."""
    random = np.random.default_rng(seed)
    begin, order = random.integers(len(cycles) - COMMISSIONED), []
    order += range(begin, begin + COMMISSIONED)
    while len(order) < number:
        begin = random.integers(len(cycles) - BLOCK)
        order += range(begin, begin + BLOCK)
    return [cycles[i] for i in order[:number]]


def cycles_of(walk: np.ndarray, drive: Drive, sensor: TorqueSensor, seed: int) -> np.ndarray:
    """Signatures (levels, cycles, F) of a walk, cold to warm; one level where nothing drifts."""
    levels = np.linspace(0.0, 1.0, LEVELS) if drive.drifts else np.zeros(1)
    return np.array(
        [
            signed(
                drive.received(walk, warm, sensor.size_nm),
                sensor,
                seed,
                loss=drive.loss,
                quantum_nm=drive.quantum_nm,
            )
            for warm in levels
        ]
    )


def warming(cycles: np.ndarray, order: list[int], begin: int = 0) -> list[np.ndarray]:
    """Signatures in a given order, of a drive that warms up from a gait cycle on."""
    last = len(cycles) - 1
    warm = np.minimum((begin + np.arange(len(order))) / WARM, 1.0)
    return [cycles[round(w * last), i] for w, i in zip(warm.tolist(), order, strict=True)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--drive", action="append", choices=sorted(DRIVES))
    parser.add_argument("--worn-only", action="store_true")
    parser.add_argument("--healthy-only", action="store_true")
    parser.add_argument("--as-of-file", action="store_true", help="do not identify, correct as if it were")
    options = parser.parse_args()
    if options.as_of_file:
        references.ROUNDS = 0
        references.CORRECTED_TO = references.NAMED_TO
    leg = load_mechanism("bionic_leg")
    mass = np.array([MASSES.get(body, 1.0) for body in leg.bodies])
    real = LegParameters(mass, np.ones(len(mass))).applied(leg)
    size = torque_size(build_linkage(leg), TURN)
    sensor = TorqueSensor(0.005, 1.0, size)

    @functools.cache
    def walk(stiffness: float, joint: str = "", size_mm: float = 0.3, number: int = 0) -> np.ndarray:
        clearance = np.where(np.array(leg.clearance_joints) == joint, 1e-3 * size_mm, NEW)
        clearance *= 1.0 + 1e-12 * number  # chaotic: a different draw
        name = " ".join(f"{one:g}" for one in (0, stiffness, number)[: 1 + 2 * bool(stiffness or number)])
        file = options.keep / f"{joint or 'new'} {size_mm:.2f} {name}.pkl" if options.keep else None
        driven, cycles = behind(real, stiffness) if stiffness else real, WORN if joint else HEALTHY
        return kept(file, lambda: walked(driven, clearance, cycles + 3, 0.0))

    names = options.drive or list(DRIVES)
    if not options.worn_only:
        print("| drive | lag, low-pass, load friction found | misfit | findings |\n|---|---|---|---|")
        for name in names:
            cycles = cycles_of(walk(DRIVES[name].stiffness_nm_per_rad), DRIVES[name], sensor, 5)
            order = drawn(np.arange(cycles.shape[1])[:, None], round(3600 * options.hours))
            rows = warming(cycles, [int(one[0]) for one in order])
            one, found = watched(leg, size, rows)
            own, off = one.state.sensor, one.models.misfit(one.state)
            own = own.channel
            channel = (
                f"{1e3 * own.delay_s:.2f} ms, {1e3 * own.time_constant_s:.2f} ms, {own.load_friction:.3f}"
            )
            drive = one.state.reference.parameters
            channel += f", {1.0 / drive.compliance:.0f} N m/rad" if drive.compliance else ""
            print(f"| {name} | {channel} | {off:.2f} | {summary(found) or 'none'} |", flush=True)
    if not options.healthy_only:
        heads = " | ".join(f"{joint} {size_mm:g}" for joint, size_mm, _ in OPENINGS)
        print(f"\n| drive | {heads} |\n|---{'|---' * len(OPENINGS)}|")
        for name in names:
            cells, stiffness = [], DRIVES[name].stiffness_nm_per_rad
            healthy = cycles_of(walk(stiffness), DRIVES[name], sensor, 5)
            before = COMMISSIONED + WARM // 2
            order = [i % healthy.shape[1] for i in range(before)]
            one, found = watched(leg, size, warming(healthy, order))
            commissioned = attrs.evolve(one.state)
            for joint, size_mm, number in OPENINGS:
                worn = cycles_of(walk(stiffness, joint, size_mm, number), DRIVES[name], sensor, 6)
                one.go_on_from(commissioned)
                rows = warming(worn, list(range(worn.shape[1])), before)
                one, found = watched(leg, size, rows, one, before)
                seen, k = one.diagnosis, leg.clearance_joints.index(joint)
                value = (
                    f"{1e3 * seen.clearance_m[k]:.2f} ± {1e3 * seen.sigma_m[k]:.2f}"
                    if seen.clearance_m
                    else "-"
                )
                cells.append(f"{when(found, before)} {value}")
            print(f"| {name} | {' | '.join(cells)} |", flush=True)


def summary(found: list[str]) -> str:
    """Findings, each once, with the gait cycle of the first and their number."""
    cycles_of: dict[str, list[int]] = {}
    for text in found:
        at, _, what = text.partition(": ")
        cycles_of.setdefault(what, []).append(int(at))
    return ", ".join(f"{what} ({at[0]}, {len(at)} cycles)" for what, at in cycles_of.items())


def when(found: list[str], since: int) -> str:
    """The diagnosis, and the gait cycle since a change that first gave it."""
    cycles_of = {text.partition(": ")[2]: int(text.partition(":")[0]) for text in reversed(found)}
    return ", ".join(f"{what} ({at - since + 1})" for what, at in reversed(cycles_of.items()))


if __name__ == "__main__":
    main()
