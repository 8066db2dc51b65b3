"""The claims of the paper's sections 6 and 7 that statistics of a leg can test, in our words.

The text of the paper was not at hand: the claims are as others who read it handed them on.
"""

from collections.abc import Callable
from itertools import pairwise, product
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.studies.kinds import ALL, FOOT, HIP, KNEE, PLACES, RIGID_KNEE, SETS
from leg_wear_monitor.studies.plan import ERRORS, Arrays, Names

# Effects: how far a claim is from its limit in one leg, with the standard error of that.


_TINY = 1.0e-300  # in place of a mean of 0, such as of impacts that do not occur


@attrs.frozen
class Effect:
    """The measure of a claim, above 0 where the claim holds.

    Attributes
    ----------
    value : float
        Logarithm of a ratio, or a difference of fractions.
    error : float
        Its standard error, from the scatter over runs.
    """

    value: float
    error: float

    @property
    def score(self) -> float:
        """The value in standard errors."""
        if self.error > 0.0:
            return self.value / self.error
        return float(np.copysign(np.inf, self.value)) if self.value else 0.0


class Measured(NamedTuple):
    """A statistic of a leg: its name in the data, the clearance joints of the runs, and a joint of them."""

    name: str
    where: Names
    joint: str = ""

    def of(self, leg: Arrays) -> Floats:
        """Its value (r,) in every run."""
        values = leg[f"set{SETS.index(self.where)}_{self.name}"]
        return np.asarray(values[:, self.where.index(self.joint)] if self.joint else values, dtype=float)


def log_ratio(x: Floats, y: Floats, paired: bool) -> Effect:
    """Logarithm of mean x over mean y, (r,) each; ``paired`` if they are of the same runs."""
    mean_x, mean_y = max(x.mean(), _TINY), max(y.mean(), _TINY)
    return Effect(float(np.log(mean_x / mean_y)), _error(x / mean_x, y / mean_y, paired))


def difference(x: Floats, y: Floats, paired: bool) -> Effect:
    """Mean x minus mean y."""
    return Effect(float(x.mean() - y.mean()), _error(x, y, paired))


def _error(x: Floats, y: Floats, paired: bool) -> float:
    """Standard error of the difference of the means."""
    variance = np.var(x - y, ddof=1) if paired else np.var(x, ddof=1) + np.var(y, ddof=1)
    return float(np.sqrt(variance / len(x)))


def least(effects: list[Effect]) -> Effect:
    """The effect of a claim with several conditions: that of the condition that holds by least."""
    return min(effects, key=lambda effect: effect.value)


def greatest(effects: list[Effect]) -> Effect:
    """The effect of a claim with alternatives: that of the one that holds by most."""
    return max(effects, key=lambda effect: effect.value)


Measure = Callable[[Arrays], Effect]

_SUM_WITHIN = 0.1  # deviation up to which the effect of all at once counts as the sum, as on a study's page
_REGULAR = 0.5  # fraction of a force's variance from which on it counts as regular: most of it repeats
_TITLES = dict(
    zip(ERRORS, ("toe displacement", "toe velocity", "toe acceleration", "drive torque"), strict=True)
)


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
        Its `Effect` in a leg.
    """

    key: str
    place: str
    text: str
    measure: Measure


def _ratio(over: Measured, under: Measured) -> Measure:
    return lambda leg: log_ratio(over.of(leg), under.of(leg), over.where == under.where)


def _each(*measures: Measure) -> Measure:
    return lambda leg: least([measure(leg) for measure in measures])


def _depth(where: Names, joint: str) -> Measured:
    return Measured("wear_depth_m_per_cycle", where, joint)


def _repeats(where: Names, more: str, less: str) -> Measure:
    """Forces of the joints ``more`` repeat more than those of ``less``, on the mean of each group."""

    def mean(leg: Arrays, joints: str) -> Floats:
        each = [Measured("repeats_contact_force", where, joint).of(leg) for joint in joints]
        return np.asarray(np.mean(each, axis=0))

    return lambda leg: difference(mean(leg, more), mean(leg, less), True)


def _regular(leg: Arrays) -> Effect:
    repeats = Measured("repeats_contact_force", KNEE, "G").of(leg)
    return difference(repeats, np.full_like(repeats, _REGULAR), True)


def _by_derivative(leg: Arrays) -> Effect:
    """Errors as fractions of the ideal curve's range: displacement < velocity < acceleration, in all sets."""

    def fraction(where: Names, name: str) -> Floats:
        reach = leg[f"set{SETS.index(where)}_ideal_range_{name}"]
        return Measured(f"error_{name}", where).of(leg) / reach

    pairs = product(SETS, pairwise(ERRORS[:3]))
    return least([log_ratio(fraction(s, after), fraction(s, before), True) for s, (before, after) in pairs])


def _apart_from_sum(leg: Arrays) -> Effect:
    """How far errors of all at once are from the sum of the places, in the quantity where it is farthest."""
    effects = []
    for name in ERRORS:
        total = np.sum([Measured(f"error_{name}", place).of(leg) for place in PLACES], axis=0)
        ratio = log_ratio(Measured(f"error_{name}", ALL).of(leg), total, False)
        effects.append(Effect(abs(ratio.value) - np.log1p(_SUM_WITHIN), ratio.error))
    return greatest(effects)


def _ranked(name: str) -> Claim:
    hip, knee, foot = (Measured(f"error_{name}", place) for place in PLACES)
    text = f"the hip disturbs the {_TITLES[name]} most, the foot least"
    return Claim(f"hip_most_{name}", "one place", text, _each(_ratio(hip, knee), _ratio(knee, foot)))


def _more_than_alone(name: str) -> Claim:
    whole = Measured(f"error_{name}", ALL)
    measures = [_ratio(whole, Measured(f"error_{name}", place)) for place in PLACES]
    text = f"the {_TITLES[name]} is disturbed more than by any place alone"
    return Claim(f"all_more_{name}", "all five", text, _each(*measures))


def _zone(where: Names, joint: str) -> Measured:
    return Measured("zone_deg", where, joint)


def _apart(where: Names, joint: str, other_where: Names, other: str, leg: Arrays) -> tuple[Floats, Floats]:
    """How far the middles of two zones are from each other, and half of their widths together [turns]."""
    middles = (
        Measured("zone_centre_deg", where, joint).of(leg),
        Measured("zone_centre_deg", other_where, other).of(leg),
    )
    between = np.abs((middles[0] - middles[1] + 180.0) % 360.0 - 180.0)
    reach = 0.5 * (_zone(where, joint).of(leg) + _zone(other_where, other).of(leg))
    return between / 360.0, reach / 360.0


def _stays(leg: Arrays) -> Effect:
    """B's zones, alone and with all five, lie over each other: their middles are nearer than half widths."""
    between, reach = _apart(HIP, "B", ALL, "B", leg)
    return difference(reach, between, True)


def _differ(leg: Arrays) -> Effect:
    """The zones of I and J, both in the frame of the foot, have nothing in common."""
    between, reach = _apart(FOOT, "I", FOOT, "J", leg)
    return difference(between, reach, True)


def _harder(key: str, joints: str, place: Names) -> Claim:
    """Forces with all five above those with the place alone, at each of these joints."""
    pairs = [(Measured("p99_force_n", where, joint) for where in (ALL, place)) for joint in joints]
    measures = [_ratio(*pair) for pair in pairs]
    are, names = "are" if len(joints) > 1 else "is", " and ".join(joints)
    alone = {HIP: "hip", KNEE: "knee", FOOT: "foot"}[place]
    return Claim(key, "all five", f"{names} {are} hit harder than with the {alone} alone", _each(*measures))


def _buffered(name: str, joint: str = "") -> Measure:
    """A statistic is less with a clearance at G than with a rigid knee, hip and foot alike."""
    return _ratio(Measured(name, RIGID_KNEE, joint), Measured(name, ALL, joint))


CLAIMS: tuple[Claim, ...] = (
    Claim("a_shallow", "hip", "A wears less deep than B", _ratio(_depth(HIP, "B"), _depth(HIP, "A"))),
    Claim(
        "a_denser",
        "hip",
        "impacts are denser at A than at B",
        _ratio(Measured("impacts", HIP, "A"), Measured("impacts", HIP, "B")),
    ),
    Claim(
        "b_zone",
        "hip",
        "half of B's wear lies in a narrower zone than that of A",
        _ratio(Measured("zone_deg", HIP, "A"), Measured("zone_deg", HIP, "B")),
    ),
    Claim("b_chaotic", "hip", "B's force repeats less than A's", _repeats(HIP, "A", "B")),
    Claim("g_regular", "knee", "most of the variance of G's force repeats", _regular),
    Claim("j_deeper", "foot", "J wears deeper than I", _ratio(_depth(FOOT, "J"), _depth(FOOT, "I"))),
    Claim(
        "j_harder",
        "foot",
        "J is hit harder than I",
        _ratio(Measured("peak_force_n", FOOT, "J"), Measured("peak_force_n", FOOT, "I")),
    ),
    *(_ranked(name) for name in ERRORS),
    Claim(
        "by_derivative",
        "each",
        "velocity is disturbed more than displacement, acceleration more than velocity",
        _by_derivative,
    ),
    *(_more_than_alone(name) for name in (ERRORS[0], ERRORS[3])),
    Claim("not_the_sum", "all five", "the effect is not the sum of the places alone", _apart_from_sum),
    Claim(
        "a_worst",
        "all five",
        "A wears deepest",
        _each(*(_ratio(_depth(ALL, "A"), _depth(ALL, joint)) for joint in "BGIJ")),
    ),
    Claim(
        "a_worse",
        "all five",
        "A wears deeper than with the hip alone",
        _ratio(_depth(ALL, "A"), _depth(HIP, "A")),
    ),
    Claim(
        "j_mildest",
        "all five",
        "J wears least deep",
        _each(*(_ratio(_depth(ALL, joint), _depth(ALL, "J")) for joint in "ABGI")),
    ),
    Claim(
        "j_falls",
        "all five",
        "J wears less deep than with the foot alone",
        _ratio(_depth(FOOT, "J"), _depth(ALL, "J")),
    ),
    Claim(
        "g_between",
        "all five",
        "G wears less deep than A and B, deeper than I and J",
        _each(
            *(_ratio(_depth(ALL, joint), _depth(ALL, "G")) for joint in HIP),
            *(_ratio(_depth(ALL, "G"), _depth(ALL, joint)) for joint in FOOT),
        ),
    ),
    Claim(
        "disorder",
        "all five",
        "the forces of I and J repeat less than those of A, B and G, on the mean",
        _repeats(ALL, "ABG", "IJ"),
    ),
    Claim(
        "zones_widen",
        "each",
        "half of B's wear lies in a narrower zone than that of G, half of G's than that of I",
        _each(_ratio(_zone(KNEE, "G"), _zone(HIP, "B")), _ratio(_zone(FOOT, "I"), _zone(KNEE, "G"))),
    ),
    Claim("b_stays", "all five", "B's zone stays where it is with the hip alone", _stays),
    Claim("i_j_differ", "foot", "the zones of I and J have nothing in common", _differ),
    Claim(
        "a_wide",
        "all five",
        "half of A's wear lies in a wider zone than that of B",
        _ratio(_zone(ALL, "A"), _zone(ALL, "B")),
    ),
    _harder("a_harder", "A", HIP),
    _harder("b_harder", "B", HIP),
    _harder("g_harder", "G", KNEE),
    _harder("foot_harder", "IJ", FOOT),
    Claim(
        "g_buffers_foot",
        "all five",
        "I and J are hit less hard than with a rigid knee",
        _each(*(_buffered("p99_force_n", joint) for joint in FOOT)),
    ),
    Claim(
        "g_buffers_drive",
        "all five",
        "the drive torque is disturbed less than with a rigid knee",
        _buffered(f"error_{ERRORS[3]}"),
    ),
)
