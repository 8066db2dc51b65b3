"""The claims of the paper's sections 6 and 7 that statistics of the leg can test, in our words.

We had no access to the paper; readers of the paper passed on its claims.
"""

from collections.abc import Callable, Mapping
from itertools import pairwise

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.studies.tables import DEPTH, TITLES, Estimate, Found, clearance_joints_of
from leg_wear_monitor.studies.tasks import ERRORS, Arrays
from leg_wear_monitor.wear import BUSHING, wear_zone

Names = tuple[str, ...]
HIP, KNEE, FOOT = ("A", "B"), ("G",), ("I", "J")
PLACES = (HIP, KNEE, FOOT)
ALL, RIGID_KNEE = HIP + KNEE + FOOT, HIP + FOOT
SETS = (*PLACES, RIGID_KNEE, ALL)

Responses = Mapping[Names, Arrays]
"""Response of the leg by the clearance joints, for each of `SETS`."""
Measure = Callable[[Responses], Estimate]
"""Measure of a claim, above 0 where the claim holds: the logarithm of a ratio, or a difference."""

HOLDS, FAILS, UNDECIDED = "holds", "fails", "undecided"
STANDARD_ERRORS = 3.0  # a measure below this number of standard errors decides nothing
_TINY = 1.0e-300  # replaces a mean of 0, for example if there are no impacts
_SUM_WITHIN = 0.1  # deviation up to which the combined effect counts as the sum
_REGULAR = 0.5  # fraction of a force's variance above which it counts as regular: most repeats


@attrs.frozen
class Claim:
    """A claim: the joints with clearance, its text, and its measure."""

    place: str
    text: str
    measure: Measure

    def state(self, responses: Responses) -> str:
        """State of the claim: it holds, it fails, or the scatter over runs leaves it undecided."""
        effect = self.measure(responses)
        if abs(effect.score) < STANDARD_ERRORS:
            return UNDECIDED
        return HOLDS if effect.value > 0.0 else FAILS


def responses_of(found: Found) -> Responses | None:
    """Responses of a study by clearance joints; None unless the study has all of `SETS`."""
    by_joints = {tuple(clearance_joints_of(arrays)): arrays for _, arrays in found}
    return by_joints if set(SETS) <= set(by_joints) else None


def of_runs(responses: Responses, name: str, where: Names, joint: str = "") -> Floats:
    """A statistic (r,) of the leg, or of a joint if one is given, in every run with these clearances.

    NaN for wear that is not modelled, for example without a wear coefficient.
    """
    arrays = responses[where]
    if not joint:
        return np.asarray(arrays[f"error_{name}"].mean(axis=1))
    k, every = where.index(joint), list(arrays["joints"]).index(joint)
    profiles = arrays[DEPTH][:, k, BUSHING]
    if name == DEPTH:
        return np.asarray(profiles.max(axis=1) if profiles.any() else np.full(len(profiles), np.nan))
    if name.startswith("zone"):
        zones = np.array([wear_zone(profile, 0.5) or (np.nan, np.nan) for profile in profiles])
        return np.asarray(zones[:, 1] - zones[:, 0] if name == "zone_deg" else zones.mean(axis=1))
    if name == "peak_force_n":
        return np.asarray(arrays[name][..., every].mean(axis=1))
    if name == "impacts":
        return np.asarray(arrays[name][..., k].mean(axis=1))
    if name == "p99_force_n":
        return np.asarray(arrays[name][:, every])
    return np.asarray(arrays[f"{name}_by_run"][:, k])


def log_ratio(x: Floats, y: Floats, paired: bool) -> Estimate:
    """Logarithm of mean x over mean y, (r,) each; ``paired`` if both are from the same runs."""
    mean_x, mean_y = np.maximum(x.mean(), _TINY), np.maximum(y.mean(), _TINY)
    return _measured(float(np.log(mean_x / mean_y)), x / mean_x, y / mean_y, paired)


def difference(x: Floats, y: Floats, paired: bool = True) -> Estimate:
    """Mean x minus mean y."""
    return _measured(float(x.mean() - y.mean()), x, y, paired)


def _measured(value: float, x: Floats, y: Floats, paired: bool) -> Estimate:
    """A measure with the standard error of a difference of means; unknown: 0, which decides nothing."""
    variance = np.var(x - y, ddof=1) if paired else np.var(x, ddof=1) + np.var(y, ddof=1)
    error = float(np.sqrt(variance / len(x)))
    return Estimate(value, error) if np.isfinite(value) else Estimate(0.0, 0.0)


def _weakest(effects: list[Estimate]) -> Estimate:
    """The condition with the smallest margin, because a claim needs all of its conditions."""
    return min(effects, key=lambda effect: effect.value)


_Pair = tuple[Names, str, Names, str]  # clearance joints and joint that are above, and those below


def _above(name: str, *pairs: _Pair) -> Measure:
    """A statistic is greater in the first place than in the second one, in each pair."""

    def measure(leg: Responses) -> Estimate:
        return _weakest([
            log_ratio(of_runs(leg, name, over, above), of_runs(leg, name, under, below), over == under)
            for over, above, under, below in pairs
        ])  # fmt: skip

    return measure


def _in_one(name: str, where: Names, *pairs: str) -> Measure:
    """Like `_above`, for pairs of joints such as ``AB`` with the same clearance joints."""
    return _above(name, *((where, pair[0], where, pair[1]) for pair in pairs))


def _with_all(name: str, joints: str, place: Names) -> Measure:
    """A statistic of these joints is greater with all five clearances than with their place alone."""
    return _above(name, *((ALL, joint, place, joint) for joint in joints))


def _repeats(where: Names, more: str, less: str) -> Measure:
    """Forces of the joints ``more`` repeat more than forces of ``less``, on the mean of each group."""

    def mean(leg: Responses, joints: str) -> Floats:
        each = [of_runs(leg, "repeats_contact_force", where, joint) for joint in joints]
        return np.asarray(np.mean(each, axis=0))

    return lambda leg: difference(mean(leg, more), mean(leg, less))


def _regular(leg: Responses) -> Estimate:
    repeats = of_runs(leg, "repeats_contact_force", KNEE, "G")
    return difference(repeats, np.full_like(repeats, _REGULAR))


def _by_derivative(leg: Responses) -> Estimate:
    """Errors as fractions of the ideal curve's range: displacement < velocity < acceleration, in all sets."""

    def fraction(where: Names, name: str) -> Floats:
        reach = float(np.ptp(leg[where][f"ideal_{name}"], axis=0).max())
        return of_runs(leg, name, where) / reach

    return _weakest([
        log_ratio(fraction(where, after), fraction(where, before), True)
        for where in SETS
        for before, after in pairwise(ERRORS[:3])
    ])  # fmt: skip


def _apart_from_sum(leg: Responses) -> Estimate:
    """Largest deviation of an error with all clearances from the sum over the places."""
    effects = []
    for name in ERRORS:
        total = np.sum([of_runs(leg, name, place) for place in PLACES], axis=0)
        ratio = log_ratio(of_runs(leg, name, ALL), total, False)
        effects.append(Estimate(abs(ratio.value) - np.log1p(_SUM_WITHIN), ratio.error))
    return max(effects, key=lambda effect: effect.value)


def _zones(leg: Responses, one: tuple[Names, str], other: tuple[Names, str]) -> tuple[Floats, Floats]:
    """Distance between the middles of two zones, and half of the sum of their widths [turns]."""
    middles = of_runs(leg, "zone_centre_deg", *one), of_runs(leg, "zone_centre_deg", *other)
    between = np.abs((middles[0] - middles[1] + 180.0) % 360.0 - 180.0)
    reach = 0.5 * (of_runs(leg, "zone_deg", *one) + of_runs(leg, "zone_deg", *other))
    return between / 360.0, reach / 360.0


def _stays(leg: Responses) -> Estimate:
    """B's zones, alone and with all five, overlap: their middles are closer than half of their widths."""
    between, reach = _zones(leg, (HIP, "B"), (ALL, "B"))
    return difference(reach, between)


def _differ(leg: Responses) -> Estimate:
    """The zones of I and J, both in the frame of the foot, have nothing in common."""
    between, reach = _zones(leg, (FOOT, "I"), (FOOT, "J"))
    return difference(between, reach)


def _places(name: str) -> Measure:
    return _above(name, (HIP, "", KNEE, ""), (KNEE, "", FOOT, ""))


def _more_than_alone(name: str) -> Measure:
    return _above(name, *((ALL, "", place, "") for place in PLACES))


_REPEATS_LESS = "the mean repetition of the forces is smaller for I and J than for A, B and G"
_ZONES_WIDEN = "the zone with half of the wear is narrower for B than for G, and narrower for G than for I"
_BY_DERIVATIVE = "velocity is disturbed more than displacement, acceleration more than velocity"
_P99 = "p99_force_n"

CLAIMS = (
    Claim("hip", "A wears less deeply than B", _in_one(DEPTH, HIP, "BA")),
    Claim("hip", "impacts are denser at A than at B", _in_one("impacts", HIP, "AB")),
    Claim(
        "hip", "the zone with half of the wear is narrower for B than for A", _in_one("zone_deg", HIP, "AB")
    ),
    Claim("hip", "B's force repeats less than A's", _repeats(HIP, "A", "B")),
    Claim("knee", "most of the variance of G's force repeats", _regular),
    Claim("foot", "J wears deeper than I", _in_one(DEPTH, FOOT, "JI")),
    Claim("foot", "J is hit harder than I", _in_one("peak_force_n", FOOT, "JI")),
    *(
        Claim("one place", f"the hip disturbs the {title} most, the foot least", _places(name))
        for name, title in zip(ERRORS, TITLES, strict=True)
    ),
    Claim("each", _BY_DERIVATIVE, _by_derivative),
    *(
        Claim("all five", f"the {title} is disturbed more than by any place alone", _more_than_alone(name))
        for name, title in zip(ERRORS, TITLES, strict=True)
        if name in ("toe_position_m", "drive_torque_nm")
    ),
    Claim("all five", "the effect is not the sum of the places alone", _apart_from_sum),
    Claim("all five", "A wears deepest", _in_one(DEPTH, ALL, "AB", "AG", "AI", "AJ")),
    Claim("all five", "A wears deeper than with the hip alone", _with_all(DEPTH, "A", HIP)),
    Claim("all five", "J wears least deep", _in_one(DEPTH, ALL, "AJ", "BJ", "GJ", "IJ")),
    Claim("all five", "J wears less deeply than with the foot alone", _above(DEPTH, (FOOT, "J", ALL, "J"))),
    Claim(
        "all five",
        "G wears less deeply than A and B, but deeper than I and J",
        _in_one(DEPTH, ALL, "AG", "BG", "GI", "GJ"),
    ),
    Claim("all five", _REPEATS_LESS, _repeats(ALL, "ABG", "IJ")),
    Claim("each", _ZONES_WIDEN, _above("zone_deg", (KNEE, "G", HIP, "B"), (FOOT, "I", KNEE, "G"))),
    Claim("all five", "B's zone stays where it is with the hip alone", _stays),
    Claim("foot", "the zones of I and J do not overlap", _differ),
    Claim(
        "all five", "the zone with half of the wear is wider for A than for B", _in_one("zone_deg", ALL, "AB")
    ),
    Claim("all five", "A is hit harder than with the hip alone", _with_all(_P99, "A", HIP)),
    Claim("all five", "B is hit harder than with the hip alone", _with_all(_P99, "B", HIP)),
    Claim("all five", "G is hit harder than with the knee alone", _with_all(_P99, "G", KNEE)),
    Claim("all five", "I and J are hit harder than with the foot alone", _with_all(_P99, "IJ", FOOT)),
    Claim(
        "all five",
        "I and J are hit less hard than with a rigid knee",
        _above(_P99, *((RIGID_KNEE, joint, ALL, joint) for joint in FOOT)),
    ),
    Claim(
        "all five",
        "the drive torque is disturbed less than with a rigid knee",
        _above("drive_torque_nm", (RIGID_KNEE, "", ALL, "")),
    ),
)
