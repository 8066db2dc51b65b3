"""Conclusions of a study as sentences computed from its results, for the page of the study.

A function returns the sentences of one question; `labelled` are the results of the points of a study, each
with its label. Values are means of an ensemble with their spread.
"""

from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.mechanism import NORMAL_LAWS
from leg_wear_monitor.report.study.text import (
    PICO,
    QUANTITIES,
    Labelled,
    Quantity,
    joined,
    number,
    percent,
    with_spread,
    zone_text,
)
from leg_wear_monitor.studies.plan import (
    Arrays,
    Spread,
    clearance_joints_of,
    depth_per_cycle,
    fraction_of_range,
    largest_error,
    of_clearance_joints,
    peak_force,
    power_law,
    worst_zone,
)

# relative deviation up to which the combined effect counts as the sum of the single ones
_LARGEST_SUM_DEVIATION = 0.1
# standard error of a power law's exponent above which the power law is not reported
_LARGEST_EXPONENT_ERROR = 0.1


def _simulated_quantities(arrays: Arrays) -> list[Quantity]:
    """Quantities whose error against the ideal leg the results contain."""
    return [quantity for quantity in QUANTITIES if f"ideal_{quantity.name}" in arrays]


def disturbance(labelled: Labelled) -> list[str]:
    """Largest errors of displacement, velocity and acceleration relative to the range of the ideal curves."""
    toe = [quantity for quantity in _simulated_quantities(labelled[0][1]) if quantity.name.startswith("toe")]
    if len(toe) < 3:  # displacement, velocity, acceleration
        return []
    fractions = {each.title: [fraction_of_range(arrays, each.name) for _, arrays in labelled] for each in toe}
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


def growth(values: Sequence[float], labelled: Labelled, what: str) -> list[str]:
    """Growth of errors, peak forces and wear with a parameter.

    Parameters
    ----------
    values : sequence of float
        Value of the parameter at each point.
    labelled : sequence of (label, arrays)
        Results of the points.
    what : str
        Name of the parameter.
    """
    sentences = []
    for each in _simulated_quantities(labelled[0][1]):
        spreads = [largest_error(arrays, each.name) for _, arrays in labelled]
        sentences.append(
            f"The largest {each.title} error goes from {with_spread(spreads[0], each.factor)} to "
            f"{with_spread(spreads[-1], each.factor)} {each.unit}{_power_law(values, spreads, what)}."
        )
    for joint in clearance_joints_of(labelled[0][1]):
        forces = [peak_force(arrays, joint) for _, arrays in labelled]
        wear = [depth_per_cycle(arrays, joint) for _, arrays in labelled]
        sentences.append(
            f"Joint {joint}: the largest contact force in a cycle goes from {with_spread(forces[0])} to "
            f"{with_spread(forces[-1])} N{_power_law(values, forces, what)}; the greatest wear depth from "
            f"{with_spread(wear[0], PICO)} to {with_spread(wear[-1], PICO)} pm a cycle"
            f"{_power_law(values, wear, what)}."
        )
    return sentences


def regular_where(labelled: Labelled) -> list[str]:
    """Periodicity of each joint's contact force over the varied parameter."""
    sentences = []
    for joint in clearance_joints_of(labelled[0][1]):
        fractions = [
            of_clearance_joints(arrays, "repeats_contact_force", joint).mean for _, arrays in labelled
        ]
        parts = [
            f"{label} {100.0 * fraction:.0f}"
            for (label, _), fraction in zip(labelled, fractions, strict=True)
        ]
        sentences.append(
            f"Joint {joint}: fraction of the contact force's variance that repeats from cycle to cycle [%] "
            f"(100 is periodic): {'; '.join(parts)}."
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


def places(labelled: Labelled) -> list[str]:
    """Ranking of the clearance joints by errors, forces, wear, impacts and periodicity."""
    sentences = []
    for each in _simulated_quantities(labelled[0][1]):
        errors = [(label, largest_error(arrays, each.name)) for label, arrays in labelled]
        ranking = _ranking(errors, each.factor)
        sentences.append(
            f"Largest {each.title} error in a cycle [{each.unit}], the greatest first: {ranking}."
        )
    joints = _labelled_joints(labelled)
    forces = [(name, peak_force(arrays, joint)) for name, joint, arrays in joints]
    sentences.append(f"Largest contact force in a cycle [N], the greatest first: {_ranking(forces)}.")
    return [*sentences, *wear(labelled), *impacts(labelled), *regularity(labelled), *zones(labelled)]


def _labelled_joints(labelled: Labelled) -> list[tuple[str, str, Arrays]]:
    """Every clearance joint of every point: a unique name, the joint, and the results of the point."""
    several = len(labelled) > 1
    return [
        (f"{joint} of {{{label}}}" if several and label != joint else joint, joint, arrays)
        for label, arrays in labelled
        for joint in clearance_joints_of(arrays)
    ]


def _ranking(values: Sequence[tuple[str, Spread]], factor: float = 1.0) -> str:
    """Names with their values, times a factor for the unit, the largest mean first."""
    ranked = sorted(values, key=lambda item: -item[1].mean)
    return "; ".join(f"{name} {with_spread(value, factor)}" for name, value in ranked)


def wear(labelled: Labelled) -> list[str]:
    """Ranking of the joints by wear depth."""
    joints = _labelled_joints(labelled)
    depths = [(name, depth_per_cycle(arrays, joint)) for name, joint, arrays in joints]
    return [f"Greatest wear depth [pm a cycle], the greatest first: {_ranking(depths, PICO)}."]


def impacts(labelled: Labelled) -> list[str]:
    """Ranking of the joints by impacts per cycle."""
    counts = [
        (name, of_clearance_joints(arrays, "impacts", joint))
        for name, joint, arrays in _labelled_joints(labelled)
    ]
    return [f"Impacts a cycle, the most first: {_ranking(counts)}."]


def regularity(labelled: Labelled) -> list[str]:
    """Ranking of the joints by the periodicity of their contact force."""
    fractions = [
        (name, of_clearance_joints(arrays, "repeats_contact_force", joint))
        for name, joint, arrays in _labelled_joints(labelled)
    ]
    return [
        "Fraction of the contact force's variance that repeats from cycle to cycle [%] (100 is periodic), "
        f"the most regular first: {_ranking(fractions, 100.0)}."
    ]


def zones(labelled: Labelled) -> list[str]:
    """Ranking of the joints by the width of the zone that contains 50 % and 90 % of the bushing's wear."""
    sentences = []
    for fraction in (0.5, 0.9):
        known = [
            (name, zone)
            for name, joint, a in _labelled_joints(labelled)
            if (zone := worst_zone(a, joint, fraction))
        ]
        ranked = sorted(known, key=lambda item: item[1][1] - item[1][0])
        texts = "; ".join(f"{name} {zone_text(zone)}" for name, zone in ranked)
        if texts:
            head = f"Zone that holds {percent(fraction)} of the bushing's wear"
            sentences.append(f"{head}, the narrowest first: {texts}.")
    return sentences


def superposition(parts: Labelled, whole: Arrays) -> list[str]:
    """Comparison of all clearances at once with the sum of the effects of single clearance joints."""
    ratios, texts = [], []
    for each in _simulated_quantities(whole):
        together = largest_error(whole, each.name)
        total = sum(largest_error(arrays, each.name).mean for _, arrays in parts)
        ratios.append(together.mean / total)
        summed = f"{number(each.factor * total)} {each.unit}"
        texts.append(f"{each.title} {with_spread(together, each.factor)} against {summed}")
    verdict = "is" if all(abs(ratio - 1.0) < _LARGEST_SUM_DEVIATION for ratio in ratios) else "is not"
    fractions = joined([percent(ratio) for ratio in ratios])
    return [
        f"All at once {verdict} the sum of the places alone: largest errors are {fractions} of the sum "
        f"({joined(texts)}).",
        *(_joint_against_alone(joint, arrays, whole) for _, joint, arrays in _labelled_joints(parts)),
    ]


def _joint_against_alone(joint: str, alone: Arrays, whole: Arrays) -> str:
    """Sentence on a joint: with all clearances, relative to its clearance alone."""
    force = peak_force(whole, joint).mean / peak_force(alone, joint).mean
    depth = depth_per_cycle(whole, joint).mean / depth_per_cycle(alone, joint).mean
    volume = of_clearance_joints(whole, "archard_integral_j_per_cycle", joint).mean
    volume /= of_clearance_joints(alone, "archard_integral_j_per_cycle", joint).mean
    return (
        f"Joint {joint}, all at once against its place alone: largest contact force × {number(force)}, "
        f"worn volume × {number(volume)}, greatest depth × {number(depth)}."
    )


def worst_joint(whole: Arrays) -> list[str]:
    """Ranking of the joints by worn volume and by depth, with clearance in all of them."""
    names = clearance_joints_of(whole)
    depth = sorted(names, key=lambda joint: -depth_per_cycle(whole, joint).mean)
    volume = sorted(
        names, key=lambda joint: -of_clearance_joints(whole, "archard_integral_j_per_cycle", joint).mean
    )
    return [
        f"With clearance in all of them, worn volume falls in the order {' > '.join(volume)}, "
        f"greatest depth in the order {' > '.join(depth)}: {volume[0]} wears most, {volume[-1]} least."
    ]


def laws(labelled: Labelled) -> list[str]:
    """Sensitivity of errors and wear to the normal law and to the friction law."""
    # a point is labelled with its normal law, or with "friction" and a friction law or coefficient
    normal = [one for one in labelled if one[0] in NORMAL_LAWS]
    dissipative = [one for one in normal if one[0] != "hertz"]  # Hertz is elastic
    friction = [one for one in labelled if one[0] not in NORMAL_LAWS]
    groups = (("The normal laws", normal), ("The dissipative ones", dissipative), ("Friction", friction))
    sentences = [_law_sentence(what, group) for what, group in groups if len(group) > 1]
    for joint in clearance_joints_of(labelled[0][1]):
        volumes = [
            of_clearance_joints(arrays, "archard_integral_j_per_cycle", joint) for _, arrays in labelled
        ]
        low, high = _extremes(volumes)
        sentences.append(
            f"Wear of {joint}, ∫ F |v| dt [J a cycle]: from {with_spread(volumes[low])} ({labelled[low][0]}) "
            f"to {with_spread(volumes[high])} ({labelled[high][0]})."
        )
    return sentences


def _extremes(spreads: Sequence[Spread]) -> tuple[int, int]:
    """Indices of the smallest and of the largest mean."""
    means = [each.mean for each in spreads]
    return means.index(min(means)), means.index(max(means))


def _law_sentence(what: str, group: Labelled) -> str:
    """Sentence on the relative range of the means within a group of laws."""
    parts = []
    for each in _simulated_quantities(group[0][1]):
        parts.append((each.title, [largest_error(arrays, each.name) for _, arrays in group]))
    for joint in clearance_joints_of(group[0][1]):
        volumes = [of_clearance_joints(arrays, "archard_integral_j_per_cycle", joint) for _, arrays in group]
        parts.append((f"wear of {joint}", volumes))
    texts = [f"{name} {percent(_relative_range(spreads))}" for name, spreads in parts]
    names = joined([label.removeprefix("friction ") for label, _ in group])
    return f"{what} ({names}): largest minus smallest mean, relative to the mean: {', '.join(texts)}."


def _relative_range(spreads: Sequence[Spread]) -> float:
    """Largest minus smallest mean, relative to the mean."""
    means = np.array([each.mean for each in spreads])
    return float(np.ptp(means) / means.mean())
