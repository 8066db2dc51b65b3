"""The conditional likelihood in numpy: the probability of each cause of a change, given the baseline.

A network sees the baseline and how the crank turns, and a change of the leg (14 logarithms, as of
`signals.changes_of`). It gives the mean and the covariance of the signature's change:

    covariance = systematic + scatter of a gait cycle × (1 / n + 1 / n of the baseline) + usual drifts

The systematic part, a diagonal and a few columns, is the same in each cycle, so more cycles do not shrink it.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

JOINTS = ("A", "B", "G", "I", "J")
NONE, SEVERAL, MASS, FRICTION, LOAD, UNKNOWN = "none", "several", "mass", "friction", "load", "unknown"
NOT_OBSERVABLE, SOME = "not observable", "some joint"
# Priors: of a change at all within the window, and of each cause of one
CHANGED = 1.0e-4
CAUSES = {**dict.fromkeys(JOINTS, 0.15), SEVERAL: 0.05, MASS: 0.08, FRICTION: 0.07, LOAD: 0.05}
NAMED = 0.95  # posterior probability from which a cause is named
WIDTHS = 14
# usual drifts of a drive: its scale, its offset (over the torque's size), its lag [rad], its load friction
DRIFTS = (0.06, 0.04, 0.006, 0.03)
PHASES = 80
FREEDOM = 8.0  # degrees of freedom of the t distribution: some legs are predicted worse than others
OUTSIDE_FLOOR = 0.3  # variance of legs in components that show no known change, in that of a gait cycle


class Hypotheses(NamedTuple):
    """Changes (h, 14), numbers of their causes (h,) in ``names``, and logarithms of their priors (h,)."""

    names: tuple[str, ...]
    cause: np.ndarray
    change: np.ndarray
    log_prior: np.ndarray


def hypotheses(changed: float = CHANGED, causes: dict[str, float] | None = None) -> Hypotheses:
    """All hypotheses: no change first; sizes are evenly spread over their logarithm."""
    rng, causes = np.random.default_rng(7), causes or CAUSES
    sets: dict[str, np.ndarray] = {NONE: np.zeros((1, WIDTHS))}
    open_by = np.linspace(np.log(1.15), np.log(14.0), 32)
    for k, joint in enumerate(JOINTS):
        sets[joint] = open_by[:, None] * np.eye(WIDTHS)[k]
    wide = np.linspace(np.log(1.2), np.log(6.0), 6)
    pairs = [
        a * np.eye(WIDTHS)[i] + b * np.eye(WIDTHS)[j]
        for i in range(5)
        for j in range(i)
        for a in wide
        for b in wide
    ]
    more = np.zeros((200, WIDTHS))
    more[:, :5] = rng.uniform(0.0, 0.9, (200, 5))
    sets[SEVERAL] = np.vstack([pairs, more])
    masses = np.array([-0.3, -0.2, -0.1, 0.1, 0.2, 0.3, 0.4])
    sets[MASS] = np.vstack([one * np.eye(WIDTHS)[5 + body] for body in range(7) for one in masses])
    sets[FRICTION] = np.linspace(-0.7, 1.2, 12)[:, None] * np.eye(WIDTHS)[12]
    sets[LOAD] = np.array([-0.5, -0.3, -0.15, 0.15, 0.3, 0.4])[:, None] * np.eye(WIDTHS)[13]
    prior = {
        NONE: 1.0 - changed,
        **{name: changed * one / sum(causes.values()) for name, one in causes.items()},
    }
    names, sizes = tuple(sets), [len(one) for one in sets.values()]
    log_prior = [np.log(prior[name] / size) for name, size in zip(names, sizes, strict=True)]
    cause = np.repeat(np.arange(len(names)), sizes)
    return Hypotheses(names, cause, np.vstack(list(sets.values())), np.repeat(log_prior, sizes))


def cause_of(change: np.ndarray) -> str:
    """Name of the cause of a change (14,)."""
    opened, others = np.flatnonzero(change[:5] > 0.04), np.abs(change[5:]) > 0.01
    if len(opened):
        return JOINTS[opened[0]] if len(opened) == 1 else SEVERAL
    return LOAD if others[8] else FRICTION if others[7] else MASS if others.any() else NONE


def drift_columns(baseline: np.ndarray) -> np.ndarray:
    """Changes (..., 160, 4) of baselines (..., 160) by one usual drift each."""
    mean, rough = baseline[..., :PHASES], baseline[..., PHASES:]
    one, none = np.ones_like(mean), np.zeros_like(mean)
    slopes = [0.5 * (np.roll(x, -1, -1) - np.roll(x, 1, -1)) * PHASES / (2.0 * np.pi) for x in (mean, rough)]
    columns = [[mean, one], [one, none], slopes, [np.abs(mean), none]]
    parts = [size * np.concatenate(pair, axis=-1) for size, pair in zip(DRIFTS, columns, strict=True)]
    return np.stack(parts, axis=-1)


def features_of(change: np.ndarray) -> np.ndarray:
    """A change (..., 14) as the network sees it (..., 42)."""
    return np.concatenate([change, np.tanh(4.0 * change), np.square(change)], axis=-1)


class Network:
    """Weights of a trained network, and its answers.

    Parameters
    ----------
    file : Path
        As written by `train.py`.
    """

    def __init__(self, file: Path) -> None:
        with np.load(file) as stored:
            self.w: dict[str, np.ndarray] = {name: stored[name].astype(np.float64) for name in stored.files}
        self.basis = self.w["basis"]  # (160, K): from a signature to whitened components

    def _dense(self, name: str, x: np.ndarray) -> np.ndarray:
        return np.asarray(x @ self.w[f"{name}.weight"].T + self.w[f"{name}.bias"])

    def leg(self, baseline: np.ndarray, context: np.ndarray) -> np.ndarray:
        """Description of a leg by its baseline (160,) and how its crank turns (7,)."""
        x = np.concatenate([self.place(baseline), context])
        return self._dense("enc2", _silu(self._dense("enc1", x)))

    def place(self, baseline: np.ndarray) -> np.ndarray:
        """Components of a baseline, about 1 in size over the training legs."""
        return np.asarray(((baseline - self.w["mean"]) / self.w["std"]) @ self.w["near_basis"])

    def answers(self, leg: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, ...]:
        """Mean (h, K), systematic variance and columns (h, K, r), and scatter of changes (h, 14)."""
        change = np.vstack([change, np.zeros(WIDTHS)])
        x = np.hstack([np.tile(leg, (len(change), 1)), features_of(change)])
        x = _silu(self._dense("dec2", _silu(self._dense("dec1", x))))
        mean = self._dense("mean_head", x)
        mean -= mean[-1]
        columns = 0.3 * self._dense("columns", x).reshape(*mean.shape, -1)
        systematic, scatter = (np.exp(self._dense(name, x)) for name in ("systematic", "scatter"))
        each, together = np.exp(self.w["size_errors"])
        columns = np.concatenate([columns, together * mean[:, :, None]], axis=2)
        return mean[:-1], (systematic + each**2 * mean**2)[:-1], columns[:-1], scatter[:-1]

    def peak_n(self, leg: np.ndarray) -> float:
        """Largest vertical force of the ground [N], by the baseline."""
        return 100.0 * float(self._dense("peak", _silu(leg))[0])


def _silu(x: np.ndarray) -> np.ndarray:
    return np.asarray(x / (1.0 + np.exp(-np.clip(x, -60.0, 60.0))))


class Posterior(NamedTuple):
    """Probability of each cause, the most probable one in words, its size and the fit.

    ``log_opening`` and ``sigma`` belong to the most probable joint; ``square`` is the mean square of the best
    hypothesis's residual, ``outside`` the one of the part of the signature that no component shows.
    """

    probability: dict[str, float]
    found: str
    log_opening: float
    sigma: float
    square: float
    outside: float


class KnownLeg:
    """A leg with a baseline.

    Parameters
    ----------
    network : Network
    baseline : (160,) array
        Mean signature, as of `signals.unified`.
    cycles : int
        Gait cycles of the baseline.
    context : (7,) array
    """

    def __init__(
        self,
        network: Network,
        baseline: np.ndarray,
        cycles: int,
        context: np.ndarray,
        tried: Hypotheses | None = None,
    ) -> None:
        self.network, self.baseline, self.cycles = network, baseline, cycles
        self.tried = tried or hypotheses()
        w, leg = network.w, network.leg(baseline, context)
        self.mean, self._systematic, columns, self._scatter = network.answers(leg, self.tried.change)
        drifts = drift_columns(baseline).T @ network.basis
        self._columns = np.concatenate([columns, np.broadcast_to(drifts.T, (*self.mean.shape, 4))], axis=2)
        self.peak_n = network.peak_n(leg)
        # distance from the training legs, over the distance that one of a hundred held-out legs exceeds
        apart = np.sqrt(np.mean(np.square(w["near"] - network.place(baseline)), axis=1))
        near = np.sort(apart)[:3].mean()
        self.distance = float(near / w["far"])
        self._ready: dict[int, tuple[np.ndarray, ...]] = {}

    def _of_cycles(self, n: int) -> tuple[np.ndarray, ...]:
        """Inverse diagonal, columns in it, and logarithm of the determinant for a mean of n gait cycles."""
        if n not in self._ready:
            variance = self._systematic + self._scatter * (1.0 / n + 1.0 / self.cycles)
            within = self._columns / variance[:, :, None]
            capacity = np.eye(within.shape[2]) + np.einsum("hkr,hks->hrs", self._columns, within)
            lower = np.linalg.cholesky(capacity)
            solved = np.linalg.solve(lower, within.transpose(0, 2, 1))
            log_size = np.log(variance).sum(1) + 2.0 * np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(1)
            self._ready[n] = 1.0 / variance, solved, log_size
        return self._ready[n]

    def squares(self, present: np.ndarray, n: int, which: slice | np.ndarray = slice(None)) -> np.ndarray:
        """Squared distance (h,) of the mean signature (160,) of n gait cycles from each hypothesis."""
        inverse, solved, _ = self._of_cycles(n)
        rest = (present - self.baseline) @ self.network.basis - self.mean[which]
        explained = np.einsum("hrk,hk->hr", solved[which], rest)
        return np.asarray((inverse[which] * rest**2).sum(1) - (explained**2).sum(1))

    def weights(self, squares: np.ndarray, n: int) -> np.ndarray:
        """Probability (h,) of each hypothesis, up to a factor, by squares (h,) of n gait cycles."""
        log_size, inflation = self._of_cycles(n)[2], self.network.w["inflation"]
        known = FREEDOM + self.mean.shape[1]
        log_weight = self.tried.log_prior - 0.5 * (known * np.log1p(squares / inflation / FREEDOM) + log_size)
        return np.asarray(np.exp(log_weight - log_weight.max()))

    def posterior(self, present: np.ndarray, n: int) -> Posterior:
        """What changed, by the mean signature (160,) of n gait cycles."""
        w, tried = self.network.w, self.tried
        squares = self.squares(present, n)
        weight = self.weights(squares, n)
        each = np.bincount(tried.cause, weight, len(tried.names)) / weight.sum()
        probability = dict(zip(tried.names, each.tolist(), strict=True))
        joint = max(JOINTS, key=lambda name: probability[name])
        own = tried.cause == tried.names.index(joint)
        size = tried.change[own, JOINTS.index(joint)]
        part = weight[own] / max(weight[own].sum(), 1e-300)
        opening = float(part @ size)
        sigma = float(np.sqrt(part @ np.square(size - opening) + (size[1] - size[0]) ** 2 / 12.0))
        square = float(squares.min()) / len(self.network.basis[0])
        left = np.square((present - self.baseline) @ w["outside"])
        outside = float(np.mean(left)) / (OUTSIDE_FLOOR + 1.0 / n + 1.0 / self.cycles)
        found = max(probability, key=lambda name: probability[name])
        if self.distance > 1.0:
            found = NOT_OBSERVABLE
        elif square > w["square_limit"] or outside > w["outside_limit"]:
            found = UNKNOWN
        elif found in JOINTS and probability[found] < NAMED:
            found = SOME if probability[NONE] < 1.0 - NAMED else NONE
        return Posterior(probability, found, opening, sigma, square, outside)
