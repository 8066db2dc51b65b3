"""The claims of the paper's sections 6 and 7 that statistics of a leg can test, in our words.

The text of the paper was not at hand: the claims are as others who read it handed them on.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise, product

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.studies.kinds import ALL, FOOT, HIP, KNEE, PLACES, RIGID_KNEE, SETS
from leg_wear_monitor.studies.plan import DEPTH, ERRORS, TITLES, Arrays, Estimate, Names

# The measure of a claim in one leg, above 0 where the claim holds: the logarithm of a ratio, or a difference
# of fractions.


_TINY = 1.0e-300  # in place of a mean of 0, such as of impacts that do not occur


_OF_WEAR = (DEPTH, "zone_deg", "zone_centre_deg")


def of_runs(leg: Arrays, name: str, where: Names, joint: str = "") -> Floats:
    """A statistic (r,) of a leg in every run with clearance there; of a joint, if it has one.

    NaN of wear that is not counted, as without a wear coefficient.
    """
    values = leg[f"set{SETS.index(where)}_{name}"]
    found = np.asarray(values[:, where.index(joint)] if joint else values, dtype=float)
    if name in _OF_WEAR and not leg[f"set{SETS.index(where)}_{DEPTH}"][:, where.index(joint)].any():
        return np.full_like(found, np.nan)
    return found


def log_ratio(x: Floats, y: Floats, paired: bool) -> Estimate:
    """Logarithm of mean x over mean y, (r,) each; ``paired`` if they are of the same runs."""
    mean_x, mean_y = np.maximum(x.mean(), _TINY), np.maximum(y.mean(), _TINY)
    return _measured(float(np.log(mean_x / mean_y)), _error(x / mean_x, y / mean_y, paired))


def difference(x: Floats, y: Floats, paired: bool) -> Estimate:
    """Mean x minus mean y."""
    return _measured(float(x.mean() - y.mean()), _error(x, y, paired))


def _measured(value: float, error: float) -> Estimate:
    """A measure; 0, which decides nothing, where the value is not known."""
    return Estimate(value, error) if np.isfinite(value) else Estimate(0.0, 0.0)


def _error(x: Floats, y: Floats, paired: bool) -> float:
    """Standard error of the difference of the means."""
    variance = np.var(x - y, ddof=1) if paired else np.var(x, ddof=1) + np.var(y, ddof=1)
    return float(np.sqrt(variance / len(x)))


def least(effects: list[Estimate]) -> Estimate:
    """The measure of a claim with several conditions: that of the condition that holds by least."""
    return min(effects, key=lambda effect: effect.value)


def greatest(effects: list[Estimate]) -> Estimate:
    """The measure of a claim with alternatives: that of the one that holds by most."""
    return max(effects, key=lambda effect: effect.value)


Measure = Callable[[Arrays], Estimate]

_SUM_WITHIN = 0.1  # deviation up to which the effect of all at once counts as the sum, as on a study's page
_REGULAR = 0.5  # fraction of a force's variance from which on it counts as regular: most of it repeats
_TITLES = dict(zip(ERRORS, TITLES, strict=True))


@attrs.frozen
class Claim:
    """A claim.

    Attributes
    ----------
    key : str
        Name in the data.
    place : str
        Where the clearances are.
    text : str
    measure : callable
        Its measure in a leg.
    """

    key: str
    place: str
    text: str
    measure: Measure


_Pair = tuple[Names, str, Names, str]  # clearance joints and joint that are above, and those below


def _above(name: str, *pairs: _Pair) -> Measure:
    """A statistic is greater in the first place than in the second one, in each pair."""

    def measure(leg: Arrays) -> Estimate:
        effects = []
        for over, above, under, below in pairs:
            values = of_runs(leg, name, over, above), of_runs(leg, name, under, below)
            effects.append(log_ratio(*values, over == under))
        return least(effects)

    return measure


def _repeats(where: Names, more: str, less: str) -> Measure:
    """Forces of the joints ``more`` repeat more than those of ``less``, on the mean of each group."""

    def mean(leg: Arrays, joints: str) -> Floats:
        each = [of_runs(leg, "repeats_contact_force", where, joint) for joint in joints]
        return np.asarray(np.mean(each, axis=0))

    return lambda leg: difference(mean(leg, more), mean(leg, less), True)


def _regular(leg: Arrays) -> Estimate:
    repeats = of_runs(leg, "repeats_contact_force", KNEE, "G")
    return difference(repeats, np.full_like(repeats, _REGULAR), True)


def _by_derivative(leg: Arrays) -> Estimate:
    """Errors as fractions of the ideal curve's range: displacement < velocity < acceleration, in all sets."""

    def fraction(where: Names, name: str) -> Floats:
        reach = leg[f"set{SETS.index(where)}_ideal_range_{name}"]
        return of_runs(leg, f"error_{name}", where) / reach

    pairs = product(SETS, pairwise(ERRORS[:3]))
    return least([log_ratio(fraction(s, after), fraction(s, before), True) for s, (before, after) in pairs])


def _apart_from_sum(leg: Arrays) -> Estimate:
    """How far errors of all at once are from the sum of the places, in the quantity where it is farthest."""
    effects = []
    for name in ERRORS:
        total = np.sum([of_runs(leg, f"error_{name}", place) for place in PLACES], axis=0)
        ratio = log_ratio(of_runs(leg, f"error_{name}", ALL), total, False)
        effects.append(Estimate(abs(ratio.value) - np.log1p(_SUM_WITHIN), ratio.error))
    return greatest(effects)


def _zones(leg: Arrays, one: tuple[Names, str], other: tuple[Names, str]) -> tuple[Floats, Floats]:
    """How far the middles of two zones are from each other, and half of their widths together [turns]."""
    middles = of_runs(leg, "zone_centre_deg", *one), of_runs(leg, "zone_centre_deg", *other)
    between = np.abs((middles[0] - middles[1] + 180.0) % 360.0 - 180.0)
    reach = 0.5 * (of_runs(leg, "zone_deg", *one) + of_runs(leg, "zone_deg", *other))
    return between / 360.0, reach / 360.0


def _stays(leg: Arrays) -> Estimate:
    """B's zones, alone and with all five, lie over each other: their middles are nearer than half widths."""
    between, reach = _zones(leg, (HIP, "B"), (ALL, "B"))
    return difference(reach, between, True)


def _differ(leg: Arrays) -> Estimate:
    """The zones of I and J, both in the frame of the foot, have nothing in common."""
    between, reach = _zones(leg, (FOOT, "I"), (FOOT, "J"))
    return difference(between, reach, True)


def _ranked(name: str) -> Claim:
    text = f"the hip disturbs the {_TITLES[name]} most, the foot least"
    measure = _above(f"error_{name}", (HIP, "", KNEE, ""), (KNEE, "", FOOT, ""))
    return Claim(f"hip_most_{name}", "one place", text, measure)


def _more_than_alone(name: str) -> Claim:
    text = f"the {_TITLES[name]} is disturbed more than by any place alone"
    measure = _above(f"error_{name}", *((ALL, "", place, "") for place in PLACES))
    return Claim(f"all_more_{name}", "all five", text, measure)


def _harder(key: str, joints: str, place: Names) -> Claim:
    """Forces with all five above those with the place alone, at each of these joints."""
    are, names = "are" if len(joints) > 1 else "is", " and ".join(joints)
    alone = {HIP: "hip", KNEE: "knee", FOOT: "foot"}[place]
    measure = _above("p99_force_n", *((ALL, joint, place, joint) for joint in joints))
    return Claim(key, "all five", f"{names} {are} hit harder than with the {alone} alone", measure)


def _claims() -> Iterator[Claim]:
    """All claims, in the order of the paper's places: each place alone, then all five at once."""
    yield Claim("a_shallow", "hip", "A wears less deep than B", _above(DEPTH, (HIP, "B", HIP, "A")))
    text = "impacts are denser at A than at B"
    yield Claim("a_denser", "hip", text, _above("impacts", (HIP, "A", HIP, "B")))
    text = "half of B's wear lies in a narrower zone than that of A"
    yield Claim("b_zone", "hip", text, _above("zone_deg", (HIP, "A", HIP, "B")))
    yield Claim("b_chaotic", "hip", "B's force repeats less than A's", _repeats(HIP, "A", "B"))
    yield Claim("g_regular", "knee", "most of the variance of G's force repeats", _regular)
    yield Claim("j_deeper", "foot", "J wears deeper than I", _above(DEPTH, (FOOT, "J", FOOT, "I")))
    yield Claim("j_harder", "foot", "J is hit harder than I", _above("peak_force_n", (FOOT, "J", FOOT, "I")))
    yield from map(_ranked, ERRORS)
    text = "velocity is disturbed more than displacement, acceleration more than velocity"
    yield Claim("by_derivative", "each", text, _by_derivative)
    yield from map(_more_than_alone, (ERRORS[0], ERRORS[3]))
    yield Claim("not_the_sum", "all five", "the effect is not the sum of the places alone", _apart_from_sum)
    deepest = _above(DEPTH, *((ALL, "A", ALL, joint) for joint in "BGIJ"))
    yield Claim("a_worst", "all five", "A wears deepest", deepest)
    text = "A wears deeper than with the hip alone"
    yield Claim("a_worse", "all five", text, _above(DEPTH, (ALL, "A", HIP, "A")))
    mildest = _above(DEPTH, *((ALL, joint, ALL, "J") for joint in "ABGI"))
    yield Claim("j_mildest", "all five", "J wears least deep", mildest)
    text = "J wears less deep than with the foot alone"
    yield Claim("j_falls", "all five", text, _above(DEPTH, (FOOT, "J", ALL, "J")))
    text = "G wears less deep than A and B, deeper than I and J"
    orders = [(joint, "G") for joint in HIP] + [("G", joint) for joint in FOOT]
    between = _above(DEPTH, *((ALL, above, ALL, below) for above, below in orders))
    yield Claim("g_between", "all five", text, between)
    text = "the forces of I and J repeat less than those of A, B and G, on the mean"
    yield Claim("disorder", "all five", text, _repeats(ALL, "ABG", "IJ"))
    text = "half of B's wear lies in a narrower zone than that of G, half of G's than that of I"
    widen = _above("zone_deg", (KNEE, "G", HIP, "B"), (FOOT, "I", KNEE, "G"))
    yield Claim("zones_widen", "each", text, widen)
    yield Claim("b_stays", "all five", "B's zone stays where it is with the hip alone", _stays)
    yield Claim("i_j_differ", "foot", "the zones of I and J have nothing in common", _differ)
    text = "half of A's wear lies in a wider zone than that of B"
    yield Claim("a_wide", "all five", text, _above("zone_deg", (ALL, "A", ALL, "B")))
    yield _harder("a_harder", "A", HIP)
    yield _harder("b_harder", "B", HIP)
    yield _harder("g_harder", "G", KNEE)
    yield _harder("foot_harder", "IJ", FOOT)
    text = "I and J are hit less hard than with a rigid knee"
    buffered = _above("p99_force_n", *((RIGID_KNEE, joint, ALL, joint) for joint in FOOT))
    yield Claim("g_buffers_foot", "all five", text, buffered)
    text = "the drive torque is disturbed less than with a rigid knee"
    yield Claim("g_buffers_drive", "all five", text, _above(f"error_{ERRORS[3]}", (RIGID_KNEE, "", ALL, "")))


CLAIMS = tuple(_claims())
