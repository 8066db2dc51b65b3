"""Text of a study's numbers, and its tables."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from leg_wear_monitor.report.parts import Table
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.summary import (
    Spread,
    clearance_joints_of,
    depth_per_cycle,
    fraction_of_range,
    joint_force,
    largest_error,
    of_clearance_joints,
    peak_force,
    worst_zone,
)

Labelled = Sequence[tuple[str, Arrays]]


class Quantity(NamedTuple):
    """A quantity compared with the ideal leg: name in the data, title for readers, unit, factor from SI."""

    name: str
    title: str
    unit: str
    factor: float


QUANTITIES = (
    Quantity("toe_position_m", "toe displacement", "mm", 1.0e3),
    Quantity("toe_velocity_mps", "toe velocity", "m/s", 1.0),
    Quantity("toe_acceleration_mps2", "toe acceleration", "m/s²", 1.0),
    Quantity("drive_torque_nm", "drive torque", "N m", 1.0),
)
PICO = 1.0e12


def number(value: float) -> str:
    """A number with three significant digits; with an exponent below 0.001 and from a million on."""
    if not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    if not 1.0e-3 <= abs(value) < 1.0e6:
        return f"{value:.2e}"
    return f"{value:.{max(0, 2 - math.floor(math.log10(abs(value))))}f}"


def with_spread(value: Spread, factor: float = 1.0) -> str:
    """Mean and standard deviation, with two digits of the deviation and at most four of the mean."""
    mean, deviation = factor * value.mean, factor * value.deviation
    if not deviation > 0.0 or mean == 0.0:
        return number(mean)
    most = max(0, 3 - math.floor(math.log10(abs(mean))))
    digits = max(0, min(most, 1 - math.floor(math.log10(deviation))))
    least = 10.0**-digits
    around = f"{deviation:.{digits}f}" if deviation >= 0.5 * least else f"<{least:.{digits}f}"
    return f"{mean:.{digits}f} ± {around}"


def percent(fraction: float) -> str:
    """A fraction as text in percent."""
    text = number(100.0 * fraction)
    return f"{text.rstrip('0').rstrip('.') if text.endswith('.0') else text} %"


def zone_text(zone: tuple[float, float] | None) -> str:
    """A zone of angles (from, to) [deg] and its width as text."""
    if zone is None:
        return "–"
    return f"{zone[0] % 360.0:.0f}° to {zone[1] % 360.0:.0f}° ({zone[1] - zone[0]:.0f}° wide)"


def joined(names: Sequence[str]) -> str:
    """Names joined by commas, the last by "and"."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def error_table(labelled: Labelled, head: str) -> Table:
    """Table of the largest errors of toe and drive torque in a cycle, a row for each point."""
    known = [quantity for quantity in QUANTITIES if _has(labelled, quantity)]
    rows = [
        [label]
        + [with_spread(largest_error(arrays, each.name), each.factor) for each in known]
        + [percent(fraction_of_range(arrays, each.name)) for each in known]
        for label, arrays in labelled
    ]
    return Table(
        caption="Largest error against the ideal leg in one cycle",
        head=[
            head,
            *(f"{each.title} [{each.unit}]" for each in known),
            *(f"{each.title}, of its range" for each in known),
        ],
        rows=rows,
        note="Mean and standard deviation over the cycles of all runs. The range is that of the ideal curve, "
        "the larger one of x and y.",
    )


def _has(labelled: Labelled, quantity: Quantity) -> bool:
    return all(f"ideal_{quantity.name}" in arrays for _, arrays in labelled)


def joint_table(labelled: Labelled, head: str) -> Table:
    """Table of forces, impacts and contact time, a row for each clearance joint of every point."""
    rows = [
        [
            f"{label}: {joint}" if len(clearance_joints_of(arrays)) > 1 else label,
            with_spread(peak_force(arrays, joint)),
            with_spread(joint_force(arrays, "p99_force_n", joint)),
            with_spread(joint_force(arrays, "mean_force_n", joint)),
            with_spread(of_clearance_joints(arrays, "impacts", joint)),
            with_spread(of_clearance_joints(arrays, "impact_speed_mps", joint), 1.0e3),
            with_spread(of_clearance_joints(arrays, "contact_fraction", joint), 100.0),
        ]
        for label, arrays in labelled
        for joint in clearance_joints_of(arrays)
    ]
    return Table(
        caption="Contact forces and impacts of the clearance joints",
        head=[
            f"{head}, joint",
            "largest force in a cycle [N]",
            "99 % of the time below [N]",
            "mean force [N]",
            "impacts a cycle",
            "mean approach [mm/s]",
            "in contact [%]",
        ],
        rows=rows,
        note="Largest forces and impacts: mean and standard deviation over the cycles of all runs; "
        "the others: over runs. A single largest force is a sample of a heavy tail; compare the 99 %.",
    )


def wear_table(labelled: Labelled, head: str) -> Table:
    """Table of wear, a row for each clearance joint of every point."""
    rows = [
        [
            f"{label}: {joint}" if len(clearance_joints_of(arrays)) > 1 else label,
            with_spread(depth_per_cycle(arrays, joint), PICO),
            with_spread(of_clearance_joints(arrays, "archard_integral_j_per_cycle", joint)),
            zone_text(worst_zone(arrays, joint, 0.5)),
            zone_text(worst_zone(arrays, joint)),
        ]
        for label, arrays in labelled
        for joint in clearance_joints_of(arrays)
    ]
    return Table(
        caption="Wear of the bushings",
        head=[
            f"{head}, joint",
            "greatest depth [pm a cycle]",
            "∫ F |v| dt [J a cycle]",
            "zone with half of the wear",
            "zone with 90 % of it",
        ],
        rows=rows,
        note="1 pm a cycle is 1 µm in a million cycles. Mean and standard deviation over runs; "
        "angles in the frame of the body that carries the bushing. Depths scale with the wear coefficient.",
    )
