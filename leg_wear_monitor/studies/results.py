"""What a study found: its settings, and the result of each point, for pages and for Python users."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from leg_wear_monitor.files import data_frame
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.loader import parse_mechanism, read_yaml
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies import plan
from leg_wear_monitor.studies.execution import (
    MANIFEST,
    MECHANISM,
    StudyDirectory,
    parse_settings,
    read_manifest,
)
from leg_wear_monitor.studies.paper import CLAIMS, Claim

if TYPE_CHECKING:
    import pandas as pd


# In what fraction of the drawn legs each claim holds, and which lengths and masses decide it.


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
    effects : tuple of plan.Estimate
        Of every drawn leg, in the order of `LegClaims.factors`.
    states : tuple of str
        `HOLDS`, `FAILS` or `UNDECIDED`, of every drawn leg.
    file_leg : plan.Estimate or None
        Of the leg of the file.
    file_state : str
        Its state; empty without that leg.
    interval : tuple of float
        Interval of the fraction (Wilson); 0 to 1 if no leg is decided.
    influences : tuple of Influence
        Significant ones, the strongest first, at most `MOST_INFLUENCES`.
    """

    claim: Claim
    effects: tuple[plan.Estimate, ...]
    states: tuple[str, ...]
    file_leg: plan.Estimate | None
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
            "file_leg": self.file_leg and {**attrs.asdict(self.file_leg), "state": self.file_state},
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


def evaluate(found: Sequence[tuple[plan.Point, plan.Arrays]]) -> LegClaims:
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


def decide(effect: plan.Estimate, runs: int) -> str:
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


def _factors(drawn: Sequence[plan.Arrays]) -> dict[str, Floats]:
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
    factors: dict[str, Floats], effects: Sequence[tuple[plan.Estimate, ...]]
) -> list[tuple[Influence, ...]]:
    """For every claim the factors whose rank correlation with its effect is significant among all of them."""
    pairs = [[_rank(factor, _values(each)) for factor in factors.values()] for each in effects]
    adjusted = holm(np.array([[p for _, p in row] for row in pairs]))
    chosen = []
    for row, corrected in zip(pairs, adjusted, strict=True):
        all_of = zip(factors, row, corrected, strict=True)
        known = [Influence(name, rho, float(p)) for name, (rho, _), p in all_of if p < 1.0 - CONFIDENCE]
        chosen.append(tuple(sorted(known, key=lambda one: -abs(one.rank_correlation))[:MOST_INFLUENCES]))
    return chosen


def _rank(factor: Floats, values: Floats) -> tuple[float, float]:
    """Correlation and p; 0 and 1 where one of them does not vary, or there are less than three legs."""
    from scipy.stats import spearmanr

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


def _values(effects: Sequence[plan.Estimate]) -> Floats:
    return np.array([effect.value for effect in effects])


# Responses of a study's points as columns of tables; mean and deviation of a statistic after a dot.


Columns = dict[str, list[Any]]

_OF_JOINTS = (
    "peak_force_n",
    "mean_force_n",
    "rms_force_n",
    "p99_force_n",
    "impacts",
    "impact_speed_mps",
    "contact_fraction",
    "friction_work_j_per_cycle",
    plan.ARCHARD,
    plan.DEPTH,
)


def point_columns(found: plan.Found) -> Columns:
    """One row a point: largest errors of toe and drive in a cycle against the ideal leg, and the torque.

    None for the errors of a toe that the leg does not have.
    """
    columns: Columns = {
        "point": [point.label for point, _ in found],
        "clearance_joints": [", ".join(plan.clearance_joints_of(arrays)) for _, arrays in found],
        "clearance_m": [point.clearance_m for point, _ in found],
        "speed_rpm": [point.speed_rpm for point, _ in found],
    }
    for name in plan.ERRORS:
        is_known = f"ideal_{name}"
        errors = [plan.largest_error(arrays, name) if is_known in arrays else None for _, arrays in found]
        columns |= _means(name, errors)
    return columns | _means("rms_torque_nm", [plan.spread(arrays["rms_torque_nm"]) for _, arrays in found])


def joint_columns(found: plan.Found) -> Columns:
    """One row a point and clearance joint: forces, impacts, contact, and wear of the bushing."""
    rows = [(point, arrays, joint) for point, arrays in found for joint in plan.clearance_joints_of(arrays)]
    columns: Columns = {
        "point": [point.label for point, _, _ in rows],
        "joint": [joint for _, _, joint in rows],
        "clearance_m": [point.clearance_m for point, _, _ in rows],
        "speed_rpm": [point.speed_rpm for point, _, _ in rows],
    }
    for name in _OF_JOINTS:
        columns |= _means(name, [plan.of_joint(arrays, name, joint) for _, arrays, joint in rows])
    return columns


def _means(name: str, values: Sequence[plan.Spread | None]) -> Columns:
    return {
        f"{name}.mean": [None if value is None else value.mean for value in values],
        f"{name}.deviation": [None if value is None else value.deviation for value in values],
    }


@attrs.frozen(kw_only=True, eq=False)
class StudyResults:
    """Contents of a study's directory, for figures and tables.

    Attributes
    ----------
    study : str
    settings : Study
    mechanism : Mechanism
    points : tuple of Point
    arrays : tuple of dict
        Result of each point; empty for points without a result.
    versions : dict of str
    """

    study: str
    settings: plan.Study
    mechanism: Mechanism
    points: tuple[plan.Point, ...]
    arrays: tuple[plan.Arrays, ...]
    versions: dict[str, str]

    def of(self, task: str) -> list[tuple[plan.Point, plan.Arrays]]:
        """Points of a task that have a result, and their results."""
        whole = [(point, arrays) for point, arrays in self._pairs if arrays and "fault" not in arrays]
        return [(point, arrays) for point, arrays in whole if point.task == task]

    @property
    def faults(self) -> list[tuple[str, str]]:
        """Label and fault of the points whose motion diverged."""
        return [(point.label, str(arrays["fault"])) for point, arrays in self._pairs if "fault" in arrays]

    @property
    def missing(self) -> list[str]:
        """Labels of the points that have no result yet."""
        return [point.label for point, arrays in self._pairs if not arrays]

    @property
    def _pairs(self) -> plan.Found:
        return list(zip(self.points, self.arrays, strict=True))

    def claims(self) -> LegClaims:
        """The paper's claims against the legs of a study ``legs``; requires scipy."""
        return evaluate(self.of("leg"))

    def to_pandas(self) -> "dict[str, pd.DataFrame]":
        """Tables ``points`` and ``joints`` of the points with a response; requires pandas.

        A row a point, and a row a point and clearance joint. A statistic has its mean and its standard
        deviation over the ensemble, after a dot: ``toe_position_m.mean``, ``peak_force_n.deviation``.

        Raises
        ------
        LegWearError
            If pandas is not installed.
        """
        found = self.of("response")
        return {
            "points": data_frame(point_columns(found), index="point"),
            "joints": data_frame(joint_columns(found), index=["point", "joint"]),
        }


def load_results(path: Path) -> StudyResults:
    """Read a study's directory.

    Raises
    ------
    ConfigError
        If it is not a study's directory, or a part of it was altered, exchanged or damaged.
    """
    manifest, directory = read_manifest(path), StudyDirectory(path)
    source = str(path / MECHANISM)
    points, arrays = [], []
    for entry in manifest["points"]:
        key, task, settings = entry["key"], entry["task"], entry["settings"]
        points.append(plan.Point(label=entry["label"], task=task, settings=settings))
        arrays.append(directory.read(key, task, settings) if directory.has(key) else {})
    return StudyResults(
        study=manifest["study"],
        settings=parse_settings(manifest["study"], manifest["settings"], f"{path / MANIFEST}: settings"),
        mechanism=parse_mechanism(read_yaml(path / MECHANISM, source), source),
        points=tuple(points),
        arrays=tuple(arrays),
        versions=manifest["versions"],
    )
