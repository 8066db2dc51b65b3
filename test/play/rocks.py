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
