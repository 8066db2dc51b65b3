"""A study's numbers as text, and its tables."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.report.page import Table
from leg_wear_monitor.studies.plan import (
    ARCHARD,
    DEPTH,
    ERRORS,
    TITLES,
    Arrays,
    Estimate,
    Found,
    Spread,
    clearance_joints_of,
    fraction_of_range,
    largest_error,
    of_joint,
    spread,
    worst_zone,
)
from leg_wear_monitor.studies.results import CONFIDENCE, FAILS, HOLDS, UNDECIDED, ClaimResult, LegClaims
from leg_wear_monitor.wear import BUSHING, wear_zone

NEW, END = 0, 1
"""Stored states of a life: of the wear rates, new and at the end; of the depths, halfway and at the end."""
FORGET = 3  # first cycles of an exponent, in which the separation turns into the fastest growing direction
PICO, MILLIONTH = 1.0e12, 1.0e-6


class Quantity(NamedTuple):
    """A quantity compared with the ideal leg: name in the data, title for readers, unit, factor from SI."""

    name: str
    title: str
    unit: str
    factor: float


QUANTITIES = (
    Quantity(ERRORS[0], TITLES[0], "mm", 1.0e3),
    Quantity(ERRORS[1], TITLES[1], "m/s", 1.0),
    Quantity(ERRORS[2], TITLES[2], "m/s²", 1.0),
    Quantity(ERRORS[3], TITLES[3], "N m", 1.0),
)


def quantities(found: Found) -> list[Quantity]:
    """Quantities whose error against the ideal leg all of the results contain."""
    return [each for each in QUANTITIES if all(f"ideal_{each.name}" in arrays for _, arrays in found)]


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


def named(label: str, joint: str) -> str:
    """A joint of a point; the joint alone if that is the point's label."""
    return joint if joint == label else f"{label}: {joint}"


def fraction_text(result: ClaimResult) -> str:
    """Fraction of the decided legs in which a claim holds, with its interval [%]."""
    if result.fraction is None:
        return "–"
    low, high = result.interval
    return f"{100.0 * result.fraction:.0f} ({100.0 * low:.0f} to {100.0 * high:.0f})"


def error_table(found: Found, head: str) -> Table:
    """Table of the largest errors of toe and drive torque in a cycle; ``head`` titles the first column."""
    known = quantities(found)
    rows = [
        [point.label]
        + [with_spread(largest_error(arrays, each.name), each.factor) for each in known]
        + [percent(fraction_of_range(arrays, each.name)) for each in known]
        for point, arrays in found
    ]
    errors = [f"{each.title} [{each.unit}]" for each in known]
    return Table(
        caption="Largest error against the ideal leg in one cycle",
        head=[head, *errors, *(f"{each.title}, of its range" for each in known)],
        rows=rows,
        note="Mean and standard deviation over the cycles of all runs. The range is that of the ideal curve, "
        "the larger one of x and y.",
    )


Cell = Callable[[Arrays, str], str]


def _mean(name: str, factor: float = 1.0) -> Cell:
    return lambda arrays, joint: with_spread(of_joint(arrays, name, joint), factor)


def _zone(fraction: float) -> Cell:
    return lambda arrays, joint: zone_text(worst_zone(arrays, joint, fraction))


def _joint_table(caption: str, found: Found, head: str, columns: Mapping[str, Cell], note: str) -> Table:
    """Table with a row for each clearance joint of every point; its cells by the columns' titles."""
    rows = [
        [
            named(point.label, joint),
            *(cell(arrays, joint) for cell in columns.values()),
        ]
        for point, arrays in found
        for joint in clearance_joints_of(arrays)
    ]
    return Table(caption=caption, head=[f"{head}, joint", *columns], rows=rows, note=note)


def force_table(found: Found, head: str) -> Table:
    """Table of forces, impacts and contact time."""
    columns = {
        "largest force in a cycle [N]": _mean("peak_force_n"),
        "99 % of the time below [N]": _mean("p99_force_n"),
        "mean force [N]": _mean("mean_force_n"),
        "impacts a cycle": _mean("impacts"),
        "mean approach [mm/s]": _mean("impact_speed_mps", 1.0e3),
        "in contact [%]": _mean("contact_fraction", 100.0),
    }
    note = (
        "Largest forces and impacts: mean and standard deviation over the cycles of all runs; "
        "the others: over runs. A single largest force is a sample of a heavy tail; compare the 99 %."
    )
    return _joint_table("Contact forces and impacts of the clearance joints", found, head, columns, note)


def wear_table(found: Found, head: str) -> Table:
    """Table of wear."""
    columns = {
        "greatest depth [pm a cycle]": _mean(DEPTH, PICO),
        "∫ F |v| dt [J a cycle]": _mean(ARCHARD),
        "zone with half of the wear": _zone(0.5),
        "zone with 90 % of it": _zone(0.9),
    }
    note = (
        "1 pm a cycle is 1 µm in a million cycles. Mean and standard deviation over runs; "
        "angles in the frame of the body that carries the bushing. Depths scale with the wear coefficient."
    )
    return _joint_table("Wear of the bushings", found, head, columns, note)


def life_table(lives: Found, head: str) -> Table:
    """Table of lives."""
    rows = []
    for point, arrays in lives:
        for k, joint in enumerate(clearance_joints_of(arrays)):
            depth = np.asarray(arrays["depth_m"][:, END, k, BUSHING], dtype=float)
            rates = np.asarray(arrays["rate_m_per_cycle"][:, :, k, BUSHING].mean(axis=2), dtype=float)
            rows.append([
                named(point.label, joint),
                with_spread(spread(arrays["cycles"][:, -1]), MILLIONTH),
                with_spread(spread(arrays["clearance_mean_m"][:, -1, k]), 1.0e3),
                with_spread(spread(depth.max(axis=1)), 1.0e6),
                zone_text(wear_zone(depth.mean(axis=0))),
                with_spread(spread(rates[:, NEW]), PICO),
                with_spread(spread(rates[:, END]), PICO),
            ])  # fmt: skip
    return Table(
        caption="A life with wear fed back",
        head=(
            f"{head}, joint",
            "cycles [millions]",
            "mean clearance at the end [mm]",
            "greatest depth of the bushing [µm]",
            "zone with 90 % of the bushing's wear",
            "mean depth a cycle when new [pm]",
            "at the end [pm]",
        ),
        rows=rows,
        note="Mean and standard deviation over runs; the life ends where the joint that wears fastest has "
        "opened as far as the configuration says.",
    )


def exponent_table(exponents: Found, estimates: Sequence[Estimate], head: str) -> Table:
    """Table of Lyapunov exponents."""
    rows = []
    for (point, arrays), one in zip(exponents, estimates, strict=True):
        period = float(arrays["period_s"])
        time = number(math.log(10.0) / one.value) if one.value > 0.0 else "–"
        runs, cycles = arrays["stretch_per_cycle"].shape
        each = [f"{one.value / by:.2f} ± {one.error / by:.2f}" for by in (1.0, period)]
        rows.append([point.label, *each, time, f"{runs} × {cycles - FORGET}"])
    return Table(
        caption="Largest Lyapunov exponent",
        head=(head, "[1/cycle]", "[1/s]", "cycles for a tenfold error", "pairs × cycles"),
        rows=rows,
        note="Mean and standard error over pairs of neighbours (Benettin and others 1980).",
    )


def claim_table(claims: LegClaims) -> Table:
    """Table of the claims against the fractions of legs, and what decides."""
    states = (HOLDS, FAILS, UNDECIDED)
    rows = [
        [
            result.claim.place,
            result.claim.text,
            *(str(result.count(state)) for state in states),
            fraction_text(result),
            result.file_state or "–",
            ", ".join(f"{one.factor} ({one.rank_correlation:+.2f})" for one in result.influences) or "–",
        ]
        for result in claims.claims
    ]
    ends = ("fraction of the decided [%]", "leg of the file", "decided by (rank correlation)")
    return Table(
        caption="The paper's claims in legs of other lengths and masses",
        head=("clearance in", "claim", *states, *ends),
        rows=rows,
        note=f"Undecided: within the scatter over runs (Student's t, {percent(CONFIDENCE)}). Fraction: with "
        f"Wilson's interval of {percent(CONFIDENCE)}. Decided by: factors whose rank correlation with the "
        "measure of the claim is significant after Holm's correction for all claims and factors; positive "
        "where a longer or heavier body favours the claim.",
        is_text=True,
    )
