"""Synthetic rocks: a joint with play and stiction, pushed by hand, read by an encoder that drifts."""

import math

import attrs
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@attrs.frozen(eq=False)
class Rocks:
    """A recording, and the truth that it was made of."""

    time_s: Floats
    angle_rad: Floats
    load: Floats
    play_rad: float
    count_rad: float


def rocks(
    seed: int,
    *,
    bits: int | None = None,
    counts: float | None = None,
    pushes: int | None = None,
    noise: float | None = None,
    drift: float | None = None,
    stuck: float | None = None,
) -> Rocks:
    """Rocks of a seed; what is not given is drawn.

    Parameters
    ----------
    bits : int
        Of the encoder.
    counts : float
        Play in counts.
    pushes : int
        Pushes, half of them to each side.
    noise, drift : float
        Standard deviation of the angle, and its drift over the recording, in counts.
    stuck : float
        Fraction of pushes in which stiction stops the joint on its way, or holds it at once.
    """
    rng = np.random.default_rng(seed)
    bits = int(rng.integers(12, 17)) if bits is None else bits
    count = 2.0 * math.pi / 2**bits
    play = count * (10.0 ** rng.uniform(0.4, 2.0) if counts is None else counts)
    pushes = int(rng.integers(12, 41)) if pushes is None else pushes
    noise = count * (rng.choice([0.0, rng.uniform(0.0, 2.0)]) if noise is None else noise)
    drift = count * rng.uniform(-10.0, 10.0) if drift is None else count * drift
    stuck = float(rng.uniform(0.0, 0.15)) if stuck is None else stuck
    rate = float(rng.choice([50.0, 100.0, 200.0]))
    load, at = _pushed(rng, pushes, rate, stuck)
    time_s = np.arange(len(load)) / rate
    passed = time_s / time_s[-1]
    slow = drift * (passed + 0.3 * np.sin(2.0 * math.pi * passed * rng.uniform(0.2, 0.8)))
    angle = rng.uniform(-1.0, 1.0) + 0.5 * play * at + slow + noise * rng.standard_normal(len(at))
    force, offset = rng.uniform(2.0, 200.0), rng.uniform(-1.0, 1.0)
    measured = force * (load + 0.2 * offset + 0.03 * rng.standard_normal(len(load)))
    return Rocks(time_s, count * np.rint(angle / count), measured, play, count)


def _pushed(rng: np.random.Generator, pushes: int, rate: float, stuck: float) -> tuple[Floats, Floats]:
    """Load, about 1 at its ends, and the journal's place from -1 to 1 in its clearance."""
    load, at, now = [], [], -1.0
    for number in range(pushes):
        side = 1.0 if number % 2 else -1.0
        n = int(rate * rng.uniform(0.6, 2.0))
        rise = rng.uniform(0.1, 0.3)
        u = np.arange(n) / n
        strength = rng.uniform(0.8, 1.3)
        shape = np.minimum(1.0, np.minimum(u, 1.0 - u) / rise)
        load.append(side * strength * shape)
        to = side if rng.random() >= stuck else now + rng.uniform(0.0, 1.0) * (side - now)
        # breaks loose where the load exceeds the stiction, and slides to its end
        loose, slide = rise * rng.uniform(0.2, 0.9), rng.uniform(0.01, 0.1)
        at.append(now + (to - now) * np.clip((u - loose) / slide, 0.0, 1.0))
        now = to
    return np.concatenate(load), np.concatenate(at)


COUNTS_PER_TURN = 4096
SIGNALS = {  # of a servo's log: what it is called, and the columns
    "positions of two pull motors": ("pull a", "pull b"),
    "push of -1, 0, 1": ("push",),
    "push that keeps its value": ("latched",),
}


def servo(seed: int, *, counts: float, rate: float = 10.0, springs: float = 0.5) -> dict[str, Floats]:
    """Log of a servo in counts, which two motors pull to and fro by elastic bands for half a second each.

    The servo gives way under the pull, and springs back by a fraction of its loaded play when released. It
    moves by itself to another place and back after every third pull. Commands lead the pull by 0.3 s.

    Parameters
    ----------
    seed : int
    counts : float
        Play under the pull.
    rate : float
        Rows per second.
    springs : float
        Fraction of the play that is left when nobody pulls.
    """
    rng = np.random.default_rng(seed)
    pull, at, push, latched = [], [], [], []
    side, now = 1.0, 0.5 * counts * springs

    def add(duration_s: float, pulled: float, place: float, command: float, kept: float) -> None:
        nonlocal now
        n = round(rate * duration_s)
        u = np.minimum(1.0, (np.arange(n) + 1.0) / rate / 0.15)
        pull.append(np.full(n, pulled))
        at.append(now + u * (place - now))
        push.append(np.full(n, command))
        latched.append(np.full(n, kept))
        now = place

    for number in range(24):
        end = 0.5 * side * (counts + 0.3 * rng.standard_normal())
        add(0.3, 0.0, now, side, side)
        add(0.2, side, end, side, side)
        add(0.3, side, end, 0.0, side)
        add(rng.uniform(1.4, 3.0), 0.0, springs * end, 0.0, side)
        if number % 3 == 2:
            add(1.0, 0.0, 100.0 * side, 0.0, side)
            add(1.0, 0.0, springs * end, 0.0, side)
        side = -side
    total = np.concatenate(pull)
    bend = 400.0 * np.convolve(np.pad(total, 1, "edge"), np.ones(3) / 3.0, "valid")
    place = rng.uniform(2040.0, 2050.0) + np.concatenate(at)
    return {
        "time": np.arange(len(total)) / rate,
        "pos": np.rint(place),
        "pull a": np.rint(1747.0 + np.maximum(bend, 0.0)),
        "pull b": np.rint(2347.0 + np.minimum(bend, 0.0)),
        "push": np.concatenate(push),
        "latched": np.concatenate(latched),
    }
