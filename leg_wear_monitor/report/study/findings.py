"""Conclusions of a study as sentences computed from its results, for the page of the study.

A function returns the sentences of one question on the points with their results. Values are means of an
ensemble with their spread.
"""

from collections.abc import Callable, Sequence

import numpy as np

from leg_wear_monitor.mechanism import NORMAL_LAWS
from leg_wear_monitor.report.study.text import (
    END,
    MILLIONTH,
    NEW,
    PICO,
    fraction_text,
    joined,
    number,
    percent,
    quantities,
    with_spread,
    zone_text,
)
from leg_wear_monitor.studies.leg_tasks import DEAD_POINT, OPEN, STEP, TRANSMISSION
from leg_wear_monitor.studies.plan import (
    ARCHARD,
    DEPTH,
    Arrays,
    Found,
    Spread,
    clearance_joints_of,
    fraction_of_range,
    largest_error,
    of_joint,
    power_law,
    spread,
    worst_zone,
)
from leg_wear_monitor.studies.results import UNDECIDED, LegClaims
from leg_wear_monitor.wear import BUSHING

# relative deviation up to which the combined effect counts as the sum of the single ones
_LARGEST_SUM_DEVIATION = 0.1
# standard error of a power law's exponent above which the power law is not reported
_LARGEST_EXPONENT_ERROR = 0.1
_REPEATS = "repeats_contact_force"


def disturbance(found: Found) -> list[str]:
    """Largest errors of displacement, velocity and acceleration relative to the range of the ideal curves."""
    toe = [quantity for quantity in quantities(found) if quantity.name.startswith("toe")]
    if len(toe) < 3:  # displacement, velocity, acceleration
        return []
    fractions = {each.title: [fraction_of_range(arrays, each.name) for _, arrays in found] for each in toe}
    texts = [
        f"{percent(min(each))} to {percent(max(each))}" if min(each) < max(each) else percent(each[0])
        for each in fractions.values()
    ]
    rises = all(a < b < c for a, b, c in zip(*fractions.values(), strict=True))
    conclusion = (
        "the higher the derivative, the more it is disturbed"
        if rises
        else "the order displacement, velocity, acceleration does not hold everywhere"
    )
    parts = [f"{title} {text}" for title, text in zip(fractions, texts, strict=True)]
    return [f"Largest errors in a cycle, of the ideal curve's range: {joined(parts)}; {conclusion}."]


def growth(values: Sequence[float], found: Found, what: str) -> list[str]:
    """Growth of errors, peak forces and wear with a parameter.

    Parameters
    ----------
    values : sequence of float
        Value of the parameter at each point.
    found : sequence of (point, arrays)
    what : str
        Name of the parameter.
    """

    def grows(spreads: Sequence[Spread], unit: str, factor: float = 1.0) -> str:
        ends = f"from {with_spread(spreads[0], factor)} to {with_spread(spreads[-1], factor)} {unit}"
        return ends + _power_law(values, spreads, what)

    sentences = []
    for each in quantities(found):
        errors = [largest_error(arrays, each.name) for _, arrays in found]
        sentences.append(f"The largest {each.title} error goes {grows(errors, each.unit, each.factor)}.")
    for joint in clearance_joints_of(found[0][1]):
        forces = [of_joint(arrays, "peak_force_n", joint) for _, arrays in found]
        wear = [of_joint(arrays, DEPTH, joint) for _, arrays in found]
        sentences.append(
            f"Joint {joint}: the largest contact force in a cycle goes {grows(forces, 'N')}; the greatest "
            f"wear depth {grows(wear, 'pm a cycle', PICO)}."
        )
    return sentences


def _power_law(values: Sequence[float], spreads: Sequence[Spread], what: str) -> str:
    """Power law of means over the parameter, as the end of a sentence; empty if there is no clear one."""
    means = np.array([each.mean for each in spreads])
    if len(values) < 4 or min(values) <= 0.0 or not (means > 0.0).all():
        return ""
    power, error = power_law(values, means)
    if error > _LARGEST_EXPONENT_ERROR:
        return ""
    return f", about as {what} to the power {with_spread(Spread(power, error, power, power))}"


def _of_each_joint(found: Found, head: str, texts: Callable[[Arrays, str], str]) -> list[str]:
    """A sentence for each joint, with a text for each point."""
    return [
        f"Joint {joint}, {head}: "
        f"{'; '.join(f'{point.label} {texts(arrays, joint)}' for point, arrays in found)}."
        for joint in clearance_joints_of(found[0][1])
    ]


def regular_where(found: Found) -> list[str]:
    """Periodicity of each joint's contact force over the varied parameter."""
    head = "fraction of the contact force's variance that repeats from cycle to cycle [%] (100 is periodic)"
    return _of_each_joint(
        found, head, lambda arrays, joint: f"{100.0 * of_joint(arrays, _REPEATS, joint).mean:.0f}"
    )


def places(found: Found) -> list[str]:
    """Ranking of the clearance joints by errors, forces, wear, impacts and periodicity."""
    sentences = []
    for each in quantities(found):
        errors = [(point.label, largest_error(arrays, each.name)) for point, arrays in found]
        head = f"Largest {each.title} error in a cycle [{each.unit}], the greatest first"
        sentences.append(f"{head}: {_ranked(errors, each.factor)}.")
    head = "Largest contact force in a cycle [N], the greatest first"
    sentences.append(_ranking(found, head, "peak_force_n"))
    return [*sentences, *wear(found), *impacts(found), *regularity(found), *zones(found)]


def _joints_of(found: Found) -> list[tuple[str, str, Arrays]]:
    """Every clearance joint of every point: a unique name, the joint, and the results of the point."""
    several = len(found) > 1
    return [
        (f"{joint} of {{{point.label}}}" if several and point.label != joint else joint, joint, arrays)
        for point, arrays in found
        for joint in clearance_joints_of(arrays)
    ]


def _ranked(values: Sequence[tuple[str, Spread]], factor: float) -> str:
    """Names with their values, times a factor for the unit, the largest mean first."""
    ranked = sorted(values, key=lambda item: -item[1].mean)
    return "; ".join(f"{name} {with_spread(value, factor)}" for name, value in ranked)


def _ranking(found: Found, head: str, name: str, factor: float = 1.0) -> str:
    """Sentence that ranks all joints by a statistic."""
    values = [(unique, of_joint(arrays, name, joint)) for unique, joint, arrays in _joints_of(found)]
    return f"{head}: {_ranked(values, factor)}."


def wear(found: Found) -> list[str]:
    """Ranking of the joints by wear depth."""
    return [_ranking(found, "Greatest wear depth [pm a cycle], the greatest first", DEPTH, PICO)]


def impacts(found: Found) -> list[str]:
    """Ranking of the joints by impacts per cycle."""
    return [_ranking(found, "Impacts a cycle, the most first", "impacts")]


def regularity(found: Found) -> list[str]:
    """Ranking of the joints by the periodicity of their contact force."""
    head = (
        "Fraction of the contact force's variance that repeats from cycle to cycle [%] (100 is periodic), "
        "the most regular first"
    )
    return [_ranking(found, head, _REPEATS, 100.0)]


def zones(found: Found) -> list[str]:
    """Ranking of the joints by the width of the zone that contains 50 % and 90 % of the bushing's wear."""
    sentences = []
    for fraction in (0.5, 0.9):
        known = [
            (name, zone)
            for name, joint, arrays in _joints_of(found)
            if (zone := worst_zone(arrays, joint, fraction))
        ]
        ranked = sorted(known, key=lambda item: item[1][1] - item[1][0])
        texts = "; ".join(f"{name} {zone_text(zone)}" for name, zone in ranked)
        if texts:
            head = f"Zone that holds {percent(fraction)} of the bushing's wear"
            sentences.append(f"{head}, the narrowest first: {texts}.")
    return sentences


def several_at_once(alone: Found, whole: Arrays) -> list[str]:
    """The worst joint with all clearances at once, and these against the sum of the places alone."""
    volume, depth = _order(whole, ARCHARD), _order(whole, DEPTH)
    return [
        f"With clearance in all of them, worn volume falls in the order {' > '.join(volume)}, "
        f"greatest depth in the order {' > '.join(depth)}: {volume[0]} wears most, {volume[-1]} least.",
        superposition(alone, whole),
        *(_joint_against_alone(joint, arrays, whole) for _, joint, arrays in _joints_of(alone)),
    ]


def _order(arrays: Arrays, name: str) -> list[str]:
    """The joints by a statistic, the largest mean first."""
    return sorted(clearance_joints_of(arrays), key=lambda joint: -of_joint(arrays, name, joint).mean)


def superposition(alone: Found, whole: Arrays) -> str:
    """Whether the errors of all clearances at once are the sums of those of the places alone."""
    ratios, texts = [], []
    for each in quantities(alone):
        together = largest_error(whole, each.name)
        total = sum(largest_error(arrays, each.name).mean for _, arrays in alone)
        ratios.append(together.mean / total)
        summed = f"{number(each.factor * total)} {each.unit}"
        texts.append(f"{each.title} {with_spread(together, each.factor)} against {summed}")
    verdict = "is" if all(abs(ratio - 1.0) < _LARGEST_SUM_DEVIATION for ratio in ratios) else "is not"
    fractions = joined([percent(ratio) for ratio in ratios])
    return (
        f"All at once {verdict} the sum of the places alone: largest errors are {fractions} of the sum "
        f"({joined(texts)})."
    )


def _times(before: float, after: float) -> str:
    """How many times a statistic is what it was; a dash where it was 0, as without a wear coefficient."""
    return f"× {number(after / before) if before > 0.0 else '–'}"


def _joint_times(before: Arrays, after: Arrays, name: str, joint: str) -> str:
    """How many times a joint's statistic is what it was."""
    return _times(of_joint(before, name, joint).mean, of_joint(after, name, joint).mean)


def _joint_against_alone(joint: str, alone: Arrays, whole: Arrays) -> str:
    force, volume, depth = (
        _joint_times(alone, whole, name, joint) for name in ("peak_force_n", ARCHARD, DEPTH)
    )
    return (
        f"Joint {joint}, all at once against its place alone: largest contact force {force}, "
        f"worn volume {volume}, greatest depth {depth}."
    )


def laws(found: Found) -> list[str]:
    """Sensitivity of errors and wear to the normal law and to the friction law."""
    # a point is labelled with its normal law, or with "friction" and a friction law or coefficient
    normal = [one for one in found if one[0].label in NORMAL_LAWS]
    dissipative = [one for one in normal if one[0].label != "hertz"]  # Hertz is elastic
    friction = [one for one in found if one[0].label not in NORMAL_LAWS]
    groups = (("The normal laws", normal), ("The dissipative ones", dissipative), ("Friction", friction))
    sentences = [_law_sentence(what, group) for what, group in groups if len(group) > 1]
    for joint in clearance_joints_of(found[0][1]):
        volumes = [(of_joint(arrays, ARCHARD, joint), point.label) for point, arrays in found]
        low, high = min(volumes), max(volumes)
        sentences.append(
            f"Wear of {joint}, ∫ F |v| dt [J a cycle]: from {with_spread(low[0])} ({low[1]}) "
            f"to {with_spread(high[0])} ({high[1]})."
        )
    return sentences


def _law_sentence(what: str, group: Found) -> str:
    """Sentence on the relative range of the means within a group of laws."""
    values = {
        each.title: [largest_error(arrays, each.name) for _, arrays in group] for each in quantities(group)
    }
    for joint in clearance_joints_of(group[0][1]):
        values[f"wear of {joint}"] = [of_joint(arrays, ARCHARD, joint) for _, arrays in group]
    texts = []
    for name, spreads in values.items():
        means = np.array([each.mean for each in spreads])
        texts.append(f"{name} {percent(float(np.ptp(means) / means.mean()))}")
    names = joined([point.label.removeprefix("friction ") for point, _ in group])
    return f"{what} ({names}): largest minus smallest mean, relative to the mean: {', '.join(texts)}."


def load(found: Found) -> list[str]:
    """Order of the joints by wear under each load, their forces, wear and zones under the largest one."""
    texts = [f"{point.label}: {' > '.join(_order(arrays, DEPTH))}" for point, arrays in found]
    sentences = [f"Joints by the greatest wear depth of a cycle, at {'; '.join(texts)}."]
    (first, before), (last, after) = found[0], found[-1]
    for joint in clearance_joints_of(before):
        force, depth = (
            [with_spread(of_joint(each, name, joint), factor) for each in (before, after)]
            for name, factor in (("mean_force_n", 1.0), (DEPTH, PICO))
        )
        sentences.append(
            f"Joint {joint}, from {first.label} to {last.label}: mean force {' to '.join(force)} N "
            f"({_joint_times(before, after, 'mean_force_n', joint)}), worn volume "
            f"{_joint_times(before, after, ARCHARD, joint)}, greatest depth {' to '.join(depth)} pm a cycle "
            f"({_joint_times(before, after, DEPTH, joint)})."
        )
    head = "zone that holds half of the bushing's wear"
    return sentences + _of_each_joint(
        found, head, lambda arrays, joint: zone_text(worst_zone(arrays, joint, 0.5))
    )


def lives(found: Found) -> list[str]:
    """Length of each life, the opened joints, the change of the wear rate, and the toe's error."""
    sentences = []
    for point, arrays in found:
        names, mean, toe = clearance_joints_of(arrays), arrays["clearance_mean_m"], arrays["toe_position_m"]
        opened = 1.0e3 * (mean[:, -1] - mean[:, 0]).mean(axis=0)
        rates = arrays["rate_m_per_cycle"][:, :, :, BUSHING].mean(axis=(0, 3), dtype=float)
        opens = [f"{joint} {number(each)} mm" for joint, each in zip(names, opened, strict=True)]
        faster = [f"{joint} {_times(rates[NEW, k], rates[END, k])}" for k, joint in enumerate(names)]
        sets = f"{point.label}: " if len(found) > 1 else ""
        cycles = with_spread(spread(arrays["cycles"][:, -1]), MILLIONTH)
        sentences.append(
            f"{sets}{names[int(opened.argmax())]} opens first, after {cycles} million cycles; opened "
            f"by then, on the mean: {', '.join(opens)}. Wear of a cycle at the end against new: "
            f"{', '.join(faster)}; largest toe error {number(1.0e3 * toe[:, 0].mean())} mm when new, "
            f"{number(1.0e3 * toe[:, -1].mean())} mm at the end."
        )
    return sentences


# In what fraction of drawn legs each claim of the paper holds.


# a claim whose fraction of legs is surely above the first or below the second hardly depends on the leg
_IN_MOST, _IN_FEW = 0.9, 0.1
_REASONS = {
    OPEN: "no assembly near that of the file",
    DEAD_POINT: "dead point",
    TRANSMISSION: "transmission near a dead point",
    STEP: "step of another size",
}


def claims(found: LegClaims) -> list[str]:
    """How many legs walk, and which claims hold in most of them, in few, or in some."""
    rejected = ", ".join(f"{_REASONS[reason]} {count}" for reason, count in found.rejected.items())
    drawn = found.legs + sum(found.rejected.values())
    sentences = [f"Of {drawn} drawn legs {found.legs} walk{rejected and f'; rejected: {rejected}'}."]
    known = [result for result in found.claims if result.fraction is not None]
    most = [one.claim.text for one in known if one.interval[0] > _IN_MOST]
    few = [one.claim.text for one in known if one.interval[1] < _IN_FEW]
    between = [
        f"{one.claim.text} ({fraction_text(one)})"
        for one in known
        if one.interval[0] <= _IN_MOST and one.interval[1] >= _IN_FEW
    ]
    for head, texts in (
        ("Hold in more than 90 % of legs", most),
        ("Hold in less than 10 % of legs", few),
        ("Depend on lengths and masses, or are not sure", between),
    ):
        if texts:
            sentences.append(f"{head}: {'; '.join(texts)}.")
    if found.legs:
        undecided = sum(result.count(UNDECIDED) for result in found.claims)
        part = percent(undecided / (found.legs * len(found.claims)))
        sentences.append(f"Within the scatter over runs, and so undecided: {part} of all claims in all legs.")
    return sentences
