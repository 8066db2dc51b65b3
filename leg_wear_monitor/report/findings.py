"""What to conclude from a study: sentences computed from its data, whatever they say."""

from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.report.study_text import (
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
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.summary import (
    Spread,
    depth_per_cycle,
    largest_error,
    loose_of,
    of_loose,
    peak_force,
    power_law,
    share_of_range,
    worst_zone,
)

_SUM_WITHIN = 0.1  # of the sum


def _known(arrays: Arrays) -> list[Quantity]:
    return [quantity for quantity in QUANTITIES if f"ideal_{quantity.name}" in arrays]


def disturbance(labelled: Labelled) -> list[str]:
    """Which part of the motion clearance disturbs most."""
    known = [quantity for quantity in _known(labelled[0][1]) if quantity.name.startswith("toe")]
    if len(known) < 3:
        return []
    shares = {each.title: [share_of_range(arrays, each.name) for _, arrays in labelled] for each in known}
    texts = [f"{percent(min(share))} to {percent(max(share))}" if len(share) > 1 and min(share) < max(share)
             else percent(share[0]) for share in shares.values()]  # fmt: skip
    rises = all(a < b < c for a, b, c in zip(*shares.values(), strict=True))
    judged = (
        "the higher the derivative, the more it is disturbed"
        if rises
        else "the order displacement, velocity, acceleration does not hold everywhere"
    )
    parts = [f"{title} {text}" for title, text in zip(shares, texts, strict=True)]
    return [f"Largest errors in a cycle, of the ideal curve's range: {joined(parts)}; {judged}."]


def growth(values: Sequence[float], labelled: Labelled, what: str) -> list[str]:
    """How errors, forces and wear grow with a number."""
    sentences = []
    for each in _known(labelled[0][1]):
        spreads = [largest_error(arrays, each.name) for _, arrays in labelled]
        sentences.append(
            f"The largest {each.title} error goes from {with_spread(spreads[0], each.factor)} to "
            f"{with_spread(spreads[-1], each.factor)} {each.unit}{_as_power(values, spreads, what)}."
        )
    for joint in loose_of(labelled[0][1]):
        forces = [peak_force(arrays, joint) for _, arrays in labelled]
        wear = [depth_per_cycle(arrays, joint) for _, arrays in labelled]
        sentences.append(
            f"Joint {joint}: the largest contact force in a cycle goes from {with_spread(forces[0])} to "
            f"{with_spread(forces[-1])} N{_as_power(values, forces, what)}; the greatest wear depth from "
            f"{with_spread(wear[0], PICO)} to {with_spread(wear[-1], PICO)} pm a cycle"
            f"{_as_power(values, wear, what)}."
        )
    return sentences


def _as_power(values: Sequence[float], spreads: Sequence[Spread], what: str) -> str:
    means = np.array([each.mean for each in spreads])
    if len(values) < 4 or not (means > 0.0).all():
        return ""
    power, error = power_law(values, means)
    return f", about as {what} to the power {power:.2f} ± {error:.2f}"


def places(labelled: Labelled) -> list[str]:
    """Where clearance does most, and how impacts differ between joints."""
    sentences = []
    for each in _known(labelled[0][1]):
        errors = [(label, largest_error(arrays, each.name)) for label, arrays in labelled]
        ranking = _ranked(errors, each.factor)
        sentences.append(
            f"Largest {each.title} error in a cycle [{each.unit}], the greatest first: {ranking}."
        )
    joints = _joints(labelled)
    forces = [(name, peak_force(arrays, joint)) for name, joint, arrays in joints]
    sentences.append(f"Largest contact force in a cycle [N], the greatest first: {_ranked(forces)}.")
    return [*sentences, *wear(labelled), *impacts(labelled), *regularity(labelled), *zones(labelled)]


def _joints(labelled: Labelled) -> list[tuple[str, str, Arrays]]:
    """Every loose joint of every point with a name that tells it from the others."""
    several = len(labelled) > 1
    return [
        (f"{joint} of {{{label}}}" if several and label != joint else joint, joint, arrays)
        for label, arrays in labelled
        for joint in loose_of(arrays)
    ]


def _ranked(values: Sequence[tuple[str, Spread]], factor: float = 1.0) -> str:
    ranked = sorted(values, key=lambda one: -one[1].mean)
    return "; ".join(f"{name} {with_spread(value, factor)}" for name, value in ranked)


def wear(labelled: Labelled) -> list[str]:
    """Which joint wears most."""
    joints = _joints(labelled)
    depths = [(name, depth_per_cycle(arrays, joint)) for name, joint, arrays in joints]
    return [f"Greatest wear depth [pm a cycle], the greatest first: {_ranked(depths, PICO)}."]


def impacts(labelled: Labelled) -> list[str]:
    """Which joint is hit most often."""
    counts = [(name, of_loose(arrays, "impacts", joint)) for name, joint, arrays in _joints(labelled)]
    return [f"Impacts a cycle, the most first: {_ranked(counts)}."]


def regularity(labelled: Labelled) -> list[str]:
    """Whose contact repeats itself from cycle to cycle."""
    shares = [
        (name, of_loose(arrays, "repeats_contact_force", joint)) for name, joint, arrays in _joints(labelled)
    ]
    return [
        "Share of the contact force's variance that repeats from cycle to cycle [%] (100 is periodic), "
        f"the most regular first: {_ranked(shares, 100.0)}."
    ]


def zones(labelled: Labelled) -> list[str]:
    """Whose wear is concentrated in a zone."""
    sentences = []
    for share in (0.5, 0.9):
        known = [
            (name, zone) for name, joint, a in _joints(labelled) if (zone := worst_zone(a, joint, share))
        ]
        ranked = sorted(known, key=lambda one: one[1][1] - one[1][0])
        texts = "; ".join(f"{name} {zone_text(zone)}" for name, zone in ranked)
        if texts:
            head = f"Zone that holds {percent(share)} of the bushing's wear"
            sentences.append(f"{head}, the narrowest first: {texts}.")
    return sentences


def superposition(parts: Labelled, whole: Arrays) -> list[str]:
    """Whether all clearances at once do what the places do one by one, added up."""
    ratios, texts = [], []
    for each in _known(whole):
        together = largest_error(whole, each.name)
        total = sum(largest_error(arrays, each.name).mean for _, arrays in parts)
        ratios.append(together.mean / total)
        summed = f"{number(each.factor * total)} {each.unit}"
        texts.append(f"{each.title} {with_spread(together, each.factor)} against {summed}")
    verdict = "is" if all(abs(ratio - 1.0) < _SUM_WITHIN for ratio in ratios) else "is not"
    shares = joined([percent(ratio) for ratio in ratios])
    return [
        f"All at once {verdict} the sum of the places alone: largest errors are {shares} of the sum "
        f"({joined(texts)}).",
        *(_against_alone(joint, arrays, whole) for _, joint, arrays in _joints(parts)),
    ]


def _against_alone(joint: str, alone: Arrays, whole: Arrays) -> str:
    force = peak_force(whole, joint).mean / peak_force(alone, joint).mean
    depth = depth_per_cycle(whole, joint).mean / depth_per_cycle(alone, joint).mean
    volume = of_loose(whole, "archard_integral_j_per_cycle", joint).mean
    volume /= of_loose(alone, "archard_integral_j_per_cycle", joint).mean
    return (
        f"Joint {joint}, all at once against its place alone: largest contact force × {number(force)}, "
        f"worn volume × {number(volume)}, greatest depth × {number(depth)}."
    )


def worst_joint(whole: Arrays) -> list[str]:
    """Joints by their wear."""
    names = loose_of(whole)
    depth = sorted(names, key=lambda joint: -depth_per_cycle(whole, joint).mean)
    volume = sorted(names, key=lambda joint: -of_loose(whole, "archard_integral_j_per_cycle", joint).mean)
    return [
        f"With all of them loose, worn volume falls in the order {' > '.join(volume)}, greatest depth in the "
        f"order {' > '.join(depth)}: {volume[0]} wears most, {volume[-1]} least."
    ]


def laws(labelled: Labelled) -> list[str]:
    """How much depends on the law, against how much cycles and runs differ anyway."""
    sentences = []
    for each in _known(labelled[0][1]):
        spreads = [largest_error(arrays, each.name) for _, arrays in labelled]
        sentences.append(
            _law_sentence(f"Largest {each.title} error", each.unit, each.factor, labelled, spreads)
        )
    for joint in loose_of(labelled[0][1]):
        volumes = [of_loose(arrays, "archard_integral_j_per_cycle", joint) for _, arrays in labelled]
        sentences.append(_law_sentence(f"Wear of {joint}, ∫ F |v| dt", "J a cycle", 1.0, labelled, volumes))
    return sentences


def _law_sentence(what: str, unit: str, factor: float, labelled: Labelled, spreads: Sequence[Spread]) -> str:
    means = np.array([each.mean for each in spreads])
    low, high = int(means.argmin()), int(means.argmax())
    share = percent((means[high] - means[low]) / means.mean())
    return (
        f"{what}: from {number(factor * means[low])} ({labelled[low][0]}) to {number(factor * means[high])} "
        f"({labelled[high][0]}) {unit}, {share} of the mean."
    )
