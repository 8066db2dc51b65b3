"""In what fraction of the drawn legs each claim holds, and which lengths and masses decide it."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.studies.claims.effect import Effect
from leg_wear_monitor.studies.claims.paper import CLAIMS, Claim
from leg_wear_monitor.studies.point import Arrays, Point

SCHEMA_VERSION = 1
CONFIDENCE = 0.95  # of a decision in one leg, of a fraction's interval, and of all correlations together
HOLDS, FAILS, UNDECIDED = "holds", "fails", "undecided"
MOST_INFLUENCES = 3  # named for a claim


@attrs.frozen
class Influence:
    """A length or mass that decides a claim: Spearman's correlation with its effect, and the corrected p."""

    factor: str
    rank_correlation: float
    p: float


@attrs.frozen(kw_only=True)
class ClaimResult:
    """What became of a claim.

    Attributes
    ----------
    claim : Claim
    effects : tuple of Effect
        Of every drawn leg, in the order of `LegClaims.factors`.
    states : tuple of str
        `HOLDS`, `FAILS` or `UNDECIDED`, of every drawn leg.
    file_leg : Effect or None
        Of the leg of the file.
    file_state : str
        Its state; empty without that leg.
    interval : tuple of float
        Interval of the fraction (Wilson); 0 to 1 if no leg is decided.
    influences : tuple of Influence
        Significant ones, the strongest first, at most `MOST_INFLUENCES`.
    """

    claim: Claim
    effects: tuple[Effect, ...]
    states: tuple[str, ...]
    file_leg: Effect | None
    file_state: str
    interval: tuple[float, float]
    influences: tuple[Influence, ...]

    def count(self, state: str) -> int:
        """Number of legs in a state."""
        return self.states.count(state)

    @property
    def fraction(self) -> float | None:
        """Fraction of the decided legs in which the claim holds; None if none is decided."""
        decided = self.count(HOLDS) + self.count(FAILS)
        return self.count(HOLDS) / decided if decided else None

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "claim": self.claim.key,
            "place": self.claim.place,
            "text": self.claim.text,
            **{state: self.count(state) for state in (HOLDS, FAILS, UNDECIDED)},
            "fraction": self.fraction,
            "fraction_interval": list(self.interval),
            "median_effect": float(np.median(_values(self.effects))) if self.effects else None,
            "file_leg": None
            if self.file_leg is None
            else {**attrs.asdict(self.file_leg), "state": self.file_state},
            "decided_by": [attrs.asdict(influence) for influence in self.influences],
        }


@attrs.frozen(kw_only=True)
class LegClaims:
    """The claims against the drawn legs.

    Attributes
    ----------
    rejected : dict of str to int
        Number of drawn legs that do not walk, by reason.
    factors : dict of str to (legs,) array
        Factors on lengths and masses of the legs that walk.
    claims : tuple of ClaimResult
    """

    rejected: dict[str, int]
    factors: dict[str, Floats] = attrs.field(eq=False)
    claims: tuple[ClaimResult, ...]

    @property
    def legs(self) -> int:
        """Number of drawn legs that walk."""
        return len(next(iter(self.factors.values()), ()))

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "schema_version": SCHEMA_VERSION,
            "confidence": CONFIDENCE,
            "legs": self.legs,
            "rejected": self.rejected,
            "claims": [result.to_dict() for result in self.claims],
        }


def evaluate(found: Sequence[tuple[Point, Arrays]]) -> LegClaims:
    """Evaluate the claims on the results of a study ``legs``; requires scipy."""
    rejected = Counter(str(arrays["rejected"]) for _, arrays in found if str(arrays["rejected"]))
    walking = [(point, arrays) for point, arrays in found if not str(arrays["rejected"])]
    drawn = [arrays for point, arrays in walking if point.settings["leg"]]
    of_file = next((arrays for point, arrays in walking if not point.settings["leg"]), None)
    factors = _factors(drawn)
    effects = [tuple(claim.measure(leg) for leg in drawn) for claim in CLAIMS]
    influences = _influences(factors, effects)
    runs = min((point.settings["runs"] for point, _ in walking), default=2)
    results = []
    for claim, each, decided_by in zip(CLAIMS, effects, influences, strict=True):
        states = tuple(decide(effect, runs) for effect in each)
        own = None if of_file is None else claim.measure(of_file)
        results.append(ClaimResult(
            claim=claim, effects=each, states=states, influences=decided_by, interval=_interval(states),
            file_leg=own, file_state="" if own is None else decide(own, runs),
        ))  # fmt: skip
    return LegClaims(rejected=dict(sorted(rejected.items())), factors=factors, claims=tuple(results))


def decide(effect: Effect, runs: int) -> str:
    """Whether a claim holds, or fails, or is within the scatter of its runs (Student's t, both sides)."""
    from scipy.stats import t

    if abs(effect.score) < t.ppf(0.5 + 0.5 * CONFIDENCE, runs - 1):
        return UNDECIDED
    return HOLDS if effect.value > 0.0 else FAILS


def _interval(states: Sequence[str]) -> tuple[float, float]:
    from scipy.stats import binomtest

    holds, fails = states.count(HOLDS), states.count(FAILS)
    if not holds + fails:
        return 0.0, 1.0
    interval = binomtest(holds, holds + fails).proportion_ci(CONFIDENCE, method="wilson")
    return float(interval.low), float(interval.high)


def _factors(drawn: Sequence[Arrays]) -> dict[str, Floats]:
    """Factors of the legs, by what they multiply."""
    if not drawn:
        return {}
    bodies = [str(name) for name in drawn[0]["bodies"]]
    length = np.array([leg["length_factor"] for leg in drawn])
    mass = np.array([leg["mass_factor"] for leg in drawn])
    return {f"length of {name}": length[:, i] for i, name in enumerate(bodies)} | {
        f"mass of {name}": mass[:, i] for i, name in enumerate(bodies[1:])
    }


def _influences(
    factors: dict[str, Floats], effects: Sequence[tuple[Effect, ...]]
) -> list[tuple[Influence, ...]]:
    """For every claim the factors whose rank correlation with its effect is significant among all of them."""
    from scipy.stats import spearmanr

    pairs = [[_rank(spearmanr, factor, each) for factor in factors.values()] for each in effects]
    p = holm(np.array([[pair[1] for pair in row] for row in pairs]))
    chosen = []
    for row, adjusted in zip(pairs, p, strict=True):
        known = [
            Influence(name, rho, float(q))
            for name, (rho, _), q in zip(factors, row, adjusted, strict=True)
            if q < 1.0 - CONFIDENCE
        ]
        chosen.append(tuple(sorted(known, key=lambda one: -abs(one.rank_correlation))[:MOST_INFLUENCES]))
    return chosen


def _rank(spearmanr: Any, factor: Floats, effects: tuple[Effect, ...]) -> tuple[float, float]:
    """Correlation and p; 0 and 1 where one of them does not vary, or there are less than three legs."""
    values = _values(effects)
    if len(values) < 3 or np.ptp(values) == 0.0 or np.ptp(factor) == 0.0:
        return 0.0, 1.0
    found = spearmanr(factor, values)
    return float(found.statistic), float(found.pvalue)


def holm(p: Floats) -> Floats:
    """Probabilities corrected for their number (Holm 1979), of the same shape."""
    flat = p.ravel()
    order = np.argsort(flat, kind="stable")
    steps = (len(flat) - np.arange(len(flat))) * flat[order]
    adjusted = np.empty_like(flat)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1.0) if len(flat) else steps
    return adjusted.reshape(p.shape)


def _values(effects: Sequence[Effect]) -> Floats:
    return np.array([effect.value for effect in effects])
