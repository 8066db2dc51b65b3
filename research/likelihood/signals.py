"""Drives and torque sensors on stored legs, and the signatures that they show.

A signature has 160 entries: the mean torque in 80 phases over the torque's size, and the logarithm of the
roughness over this size. `python signals.py LEGS FILE [--draws 10]` draws drives on all training legs.
"""

import argparse
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from legs import LEG

from leg_wear_monitor.estimate.drive import Channel
from leg_wear_monitor.estimate.signature import TorqueSensor, signatures
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import POINTS, CrankProfile

PHASES = 80
CLOCK = 1.0021  # true over nominal period of the sensor: its samples drift through the gait cycle
RATE_HZ = 200.0
LINKAGE = build_linkage(LEG)


@attrs.frozen(kw_only=True)
class Drive:
    """The drive between the leg's torque and its samples, and their sensor."""

    lag_s: float = 0.0
    hz: float = 0.0  # of a low-pass; 0 for none
    second_order: float = 0.0  # as of `Channel`
    load_friction: float = 0.0
    coulomb_nm: float = 0.0
    cogging: float = 0.0  # of the torque's size
    waves: float = 72.0  # of it in a turn of the crank
    scale: float = 1.0
    dead_nm: float = 0.0
    hysteresis_nm: float = 0.0
    noise_nm: float = 0.5
    quantum_nm: float = 0.0
    loss: float = 0.0
    is_stuck: bool = False

    def received(self, torque: np.ndarray, angle: np.ndarray, step_s: float, size_nm: float) -> np.ndarray:
        """Torque (n,) [N m] at equal steps, as the drive shows it; taken as periodic."""
        channel = Channel(
            delay_s=self.lag_s,
            time_constant_s=1.0 / (TURN * self.hz) if self.hz else 0.0,
            load_friction=self.load_friction,
            second_order=self.second_order,
        )
        cogging = self.cogging * size_nm * np.sqrt(2.0) * np.sin(self.waves * angle)
        torque = channel.received(torque + self.coulomb_nm + cogging, step_s, 1.0)
        if self.dead_nm:
            torque = np.sign(torque) * np.maximum(np.abs(torque) - self.dead_nm, 0.0)
        if self.hysteresis_nm:
            torque = _played(torque, self.hysteresis_nm)
        return np.asarray(self.scale * torque)


def _played(torque: np.ndarray, width_nm: float) -> np.ndarray:
    """A torque that has to turn by a width before its reading follows."""
    at, found = torque[0], np.empty_like(torque)
    for i, now in enumerate(torque.tolist()):
        at = min(max(at, now - width_nm), now + width_nm)
        found[i] = at
    return found


def drawn_drive(rng: np.random.Generator, size_nm: float) -> Drive:
    """A drive that a leg may have."""

    def perhaps(chance: float, low: float, high: float) -> float:
        return float(rng.uniform(low, high)) if rng.random() < chance else 0.0

    hz = float(np.exp(rng.uniform(np.log(17.0), np.log(120.0)))) if rng.random() < 0.6 else 0.0
    return Drive(
        lag_s=perhaps(0.6, -0.002, 0.03),
        hz=hz,
        second_order=float(rng.choice([0.0, 0.0, 0.25, 0.5])),
        load_friction=perhaps(0.6, 0.0, 0.35),
        coulomb_nm=perhaps(0.6, 0.0, 2.5),
        cogging=perhaps(0.4, 0.0, 0.04),
        waves=float(rng.uniform(20.0, 110.0)),
        dead_nm=perhaps(0.15, 0.0, 0.5),
        noise_nm=size_nm * float(np.exp(rng.uniform(np.log(0.003), np.log(0.08)))),
        quantum_nm=perhaps(0.3, 0.01, 0.2),
        loss=perhaps(0.3, 0.0, 0.04),
    )


def drifted(drive: Drive, rng: np.random.Generator, size_nm: float) -> Drive:
    """The same drive some time later: warmer, with a drifted sensor."""
    scale, offset, friction, late = np.clip(rng.standard_normal(4), -2.0, 2.0)
    return attrs.evolve(
        drive,
        scale=drive.scale * (1.0 + 0.05 * scale),
        coulomb_nm=drive.coulomb_nm + 0.03 * size_nm * offset,
        load_friction=max(0.0, drive.load_friction + 0.03 * friction),
        lag_s=drive.lag_s + 0.0005 * late,
    )


class Stored:
    """A stored leg.

    Attributes
    ----------
    truth : dict of arrays
        Contents of its file.
    profile : CrankProfile
    size_nm : float
        Torque's size by the leg's file, at the leg's cadence.
    context : (7,) array
        How its crank turns: cadence, and ripple of the first three harmonics.
    """

    def __init__(self, truth: dict[str, Any]) -> None:
        self.truth = truth
        speed = float(self.truth["speed"])
        self.profile = CrankProfile(speed, self.truth["cosine"], self.truth["sine"])
        self.size_nm = torque_size(LINKAGE, speed)
        self.context = context_of(self.profile)
        self.sensor = TorqueSensor(1.0 / RATE_HZ, TURN / speed, self.size_nm)
        self._even = np.linspace(0.0, TURN, POINTS, endpoint=False)
        self._ripple = self.profile.angles(self._even) - self._even

    @classmethod
    def read(cls, path: Path) -> "Stored":
        """The leg of a file."""
        with np.load(path) as file:
            return cls({name: file[name] for name in file.files})

    def angles(self, time_s: np.ndarray) -> np.ndarray:
        """Crank angles (n,) [rad] at some times."""
        even = self.profile.speed * time_s
        return np.asarray(even + np.interp(even, self._even, self._ripple, period=TURN))

    def torque(self, state: int) -> np.ndarray:
        """Torque (cycles, POINTS) of a state [N m]."""
        return np.asarray(self.truth["changed"][state - 1] if state else self.truth["new"], float)

    def samples(
        self, torque: np.ndarray, drive: Drive, rng: np.random.Generator, clock: float = CLOCK
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Times [s], crank angles [rad], torques and steps [N m] (n,) of a sensor behind a drive."""
        step_s, points = TURN / self.profile.speed / POINTS, torque.size
        grid = self.angles(step_s * (np.arange(points) + 0.5))
        received = drive.received(torque.ravel(), grid, step_s, self.size_nm)
        impulse = np.concatenate([[0.0], np.cumsum(received) * step_s])
        between = clock / RATE_HZ
        time_s = np.arange(between * (1.0 + rng.random()), points * step_s, between)
        ends = np.append(time_s[0] - between, time_s)
        value = np.diff(np.interp(ends, np.arange(points + 1) * step_s, impulse)) / between
        if drive.is_stuck:
            value = np.full_like(value, value[0])
        value = value + drive.noise_nm * rng.standard_normal(len(value)) * (not drive.is_stuck)
        if drive.quantum_nm:
            value = drive.quantum_nm * np.round(value / drive.quantum_nm)
        there = rng.random(len(value)) >= drive.loss
        step = np.where(np.roll(there, 1), np.diff(value, prepend=np.nan), np.nan)
        angle = self.angles(time_s)
        return time_s[there], angle[there], value[there], step[there]

    def signatures(self, state: int, drive: Drive, rng: np.random.Generator) -> np.ndarray:
        """Signatures (cycles, 160) of a state behind a drive."""
        torque = self.torque(state)
        _, angle, value, step = self.samples(torque, drive, rng)
        cycle = np.clip(np.floor(angle / TURN).astype(np.int64), 0, len(torque) - 1)
        return unified(signatures(cycle, angle, value, step, self.sensor), self.size_nm)


def context_of(profile: CrankProfile) -> np.ndarray:
    """How a crank turns (7,): cadence, and ripple of the first three harmonics; about 1 in size."""
    h = np.arange(1, 4)
    ripple = np.concatenate([h * profile.cosine[:3], h * profile.sine[:3]]) / 0.02
    return np.append((profile.cadence_rpm - 60.0) / 6.0, ripple)


def unified(rows: np.ndarray, size_nm: float) -> np.ndarray:
    """Signatures (cycles, F) with 80 phases, over the torque's size (cycles, 160); without NaN."""
    halves = rows.reshape(len(rows), 2, -1)
    halves = np.where(np.isfinite(halves), halves, np.nanmean(halves, axis=0))
    halves = halves.copy()
    halves[:, 0] /= size_nm
    halves[:, 1] -= np.log(size_nm)
    phases = halves.shape[2]
    if phases != PHASES:
        place, at = (np.arange(phases) + 0.5) / phases, (np.arange(PHASES) + 0.5) / PHASES
        flat = halves.reshape(-1, phases)
        halves = np.array([np.interp(at, place, row, period=1.0) for row in flat])
    return np.asarray(halves.reshape(len(rows), 2 * PHASES))


def changes_of(truth: dict[str, Any]) -> np.ndarray:
    """Change in each state (states, 14): logarithms of five clearances, seven masses, friction and load."""
    names = ("clearance_m", "state_mass", "state_friction", "state_load")
    logs = np.log(np.column_stack([truth[name] for name in names]))
    return np.asarray(logs - logs[0])


def examples(stored: Stored, draws: int, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Baselines, and presents of each state and of the unchanged leg, behind drawn drives."""
    change = changes_of(stored.truth)
    change = np.vstack([change[1:], change[:1]])
    base, present, counts, within = [], [], [], []
    for _ in range(draws):
        drive, first = drawn_drive(rng, stored.size_nm), int(rng.integers(6, 11))
        new = rng.permutation(len(stored.torque(0)))
        base.append(stored.signatures(0, drive, rng)[new[:first]].mean(axis=0))
        for state in [*range(1, len(change)), 0]:
            cycles = stored.signatures(state, drifted(drive, rng, stored.size_nm), rng)
            # of the unchanged leg, those that are not in the baseline
            there = rng.permutation(len(cycles)) if state else new[first:]
            n = int(rng.integers(1, len(there) + 1))
            present.append(cycles[there[:n]].mean(axis=0))
            counts.append((n, first))
        within.append(cycles[1] - cycles[0])
    found = {
        "base": base,
        "present": np.reshape(present, (draws, -1, 160)),
        "within": within,
        "change": change,
    }
    found |= {"counts": np.reshape(counts, (draws, -1, 2)), "context": stored.context}
    found["peak_n"] = stored.truth["peak_n"]
    return {name: np.asarray(one, np.float32) for name, one in found.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("legs", type=Path)
    parser.add_argument("file", type=Path)
    parser.add_argument("--draws", type=int, default=10)
    options = parser.parse_args()
    paths = sorted(options.legs.glob("[0-9]????.npz"))
    seeds = [int(path.stem) for path in paths]
    found = [
        examples(Stored.read(path), options.draws, np.random.default_rng([seed, 9]))
        for seed, path in zip(seeds, paths, strict=True)
    ]
    np.savez(options.file, seed=seeds, **{name: np.array([one[name] for one in found]) for name in found[0]})
    print(f"{len(seeds)} legs")


if __name__ == "__main__":
    main()
