"""Verbs on lives: ``life``, ``design``."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli import common
from leg_wear_monitor.files import json_text

if TYPE_CHECKING:
    from leg_wear_monitor.life.design import BushingLife
    from leg_wear_monitor.life.result import Life
    from leg_wear_monitor.mechanism.arrays import Floats
    from leg_wear_monitor.mechanism.materials import RatingLife
    from leg_wear_monitor.mechanism.spec import Mechanism

    Lives = list[tuple[Floats, Life]]  # factors on the joints' wear coefficients, and the life with them

# ``leg-wear-monitor life``: a leg from new until a clearance reaches its limit, by cycle jumps.


_TABLE_ROWS = 12  # most rows of the printed table, spread over the life


@click.command(short_help="Simulate the wear of a leg over its life, by cycle jumps.")
@common.mechanism_option
@common.clearances_option("A,B")
@common.speed_option
@common.limit_option
@common.number_option("--horizon-cycles", "N", "Largest number of gait cycles.", above=0.0, default=1.0e9)
@common.number_option("--wear-factor", "X", "Factor on all wear coefficients.", above=0.0, default=1.0)
@common.option(
    "--duty",
    "N:H,...",
    "Hours a day at each peak of the ground's vertical force on the toe [N], such as 0:2,300:5,600:1. "
    "[default: the mechanism's own loads]",
)
@common.number_option(
    "--max-wear-per-jump-m", "M", "Deepest change of a surface in a jump.  [default: 3e-05]", "m", above=0.0
)
@common.option("--legs", "N", "Number of legs averaged.  [default: 2]", type=click.IntRange(min=1))
@common.option("--cycles", "N", "Gait cycles of each leg averaged.  [default: 4]", type=click.IntRange(min=2))
@common.option(
    "--ensemble-size",
    "N",
    "Number of lives for --json; lives after the first have different wear coefficients, from which the "
    "forecast finds the effect of joints on each other.",
    type=click.IntRange(min=1),
    default=1,
)
@common.json_option("the life")
@common.out_option("Write life.json and life.png.")
def life(mechanism: str, json_file: Path | None, out: Path | None, **options: Any) -> None:
    """Simulate the wear of a leg from new until a clearance reaches its limit.

    A few gait cycles are simulated, and their mean wear is applied over many. Single cycles are chaotic, so
    the values scatter; the scatter is reported.
    """
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.mechanism.materials import lacks_wear
    from leg_wear_monitor.mechanism.plausible import doubts

    names = options.pop("clearances")
    leg = common.with_clearance_joints(load_mechanism(mechanism), names)
    common.check_outputs(json_file, out)
    with common.options_named():
        lives = _lives(leg, **options)
    # only after success: the message of a failure names the doubts itself
    common.warn_of(leg.source, doubts(leg))
    result = lives[0][1]
    text = json_text(_document(leg, lives, options["limit_m"]))
    written = common.write_json(json_file, text)
    if out is not None:
        from leg_wear_monitor.report.figure import life_picture

        files = {"life.json": text.encode(), "life.png": life_picture(result)}
        written += common.write_directory(out, files)
    not_counted = [joint for joint in leg.clearance_joints if lacks_wear(leg.clearances[joint])]
    printed = life_lines(result, options["limit_m"], not_counted)
    common.say(json_file, [*printed, *_remarks(leg, result, options["wear_factor"])], written)


def _lives(
    leg: "Mechanism", ensemble_size: int, max_wear_per_jump_m: float | None, duty: str | None, **options: Any
) -> "Lives":
    """Check the options, and simulate the lives."""
    import attrs
    import numpy as np

    from leg_wear_monitor.contact.arrays import clearance_settings
    from leg_wear_monitor.life.jumps import JumpControl
    from leg_wear_monitor.life.life import LifeSettings, check_life, simulate_lives
    from leg_wear_monitor.life.result import Duty
    from leg_wear_monitor.mechanism.materials import check_wear_is_known

    # options that were not given have the defaults of LifeSettings
    given = {name: value for name in ("legs", "cycles") if (value := options.pop(name)) is not None}
    settings = LifeSettings(**given)
    if max_wear_per_jump_m is not None:
        settings = attrs.evolve(settings, jump=JumpControl.of(max_wear_per_jump_m))
    loads = None if duty is None else Duty.parse(duty)
    # bad settings are refused before the kernels are compiled, which takes a while
    joints = clearance_settings(leg, leg.clearance_joints)
    check_wear_is_known(leg, leg.clearance_joints)
    sizes = np.array([[joint.radial_clearance, joint.bushing_radius] for joint in joints])
    clearance_m, radius_m = sizes.reshape(-1, 2).T
    check_life(leg.clearance_joints, clearance_m, radius_m, options["limit_m"], settings.jump)
    with common.compilation("clearance"), common.progress_bar("life") as progress:
        return list(simulate_lives(leg, settings, ensemble_size, progress=progress, duty=loads, **options))


def _document(leg: "Mechanism", lives: "Lives", limit_m: float) -> dict[str, Any]:
    """Content of the JSON file: the lives, and the fingerprint of the leg that they belong to."""
    from leg_wear_monitor.life.life import lives_document
    from leg_wear_monitor.life.result import validity
    from leg_wear_monitor.monitor.ledger.entry import fingerprint

    return {
        "mechanism": leg.name,
        "fingerprint": fingerprint(leg),
        "validity": validity(leg, lives[0][1]),
        **lives_document(lives, limit_m),
    }


def _remarks(leg: "Mechanism", result: "Life", wear_factor: float) -> list[str]:
    """The wear regime of each joint, and its limits of load and speed, rating life and wide contacts."""
    from leg_wear_monitor.life.result import contact_doubts, pressure_speed, rating_hours
    from leg_wear_monitor.mechanism.materials import bushing_of, load_material, regimes

    found = regimes(leg, result.clearance_joints, wear_factor).items()
    remarks = [f"holds for {', '.join(joints)}: {what}" for what, joints in found]
    for joint, load in pressure_speed(leg, result).items():
        settings = leg.clearances[joint]
        beyond = bushing_of(leg, joint).loaded(0.0, 0.0, 0.0, load).outside_limits
        remarks += [f"{joint}: {beyond}"] if beyond else []
        hours = rating_hours(settings, load)
        if hours is not None:
            constants = load_material(settings.material).rating_life
            remarks.append(
                f"{joint}: maker's rating life {_rating_life(hours, load, result.period_s, constants)}"
            )
    return remarks + [f"{joint}: {doubt}" for joint, doubt in contact_doubts(leg, result).items()]


def _rating_life(hours: float, load: float, period_s: float, constants: "RatingLife | None") -> str:
    """The maker's rating life of a bushing at a load p v [Pa m/s], and the range of its formula."""
    least = constants.least_pressure_speed.si if constants else 0.0
    largest = constants.largest_pressure_speed if constants else None
    validity = f"its formula holds from {1e-6 * least:g}"
    validity += f" to {1e-6 * largest.si:g} MPa m/s" if largest else " MPa m/s"
    at = f"p v {1e-6 * load:.3g} MPa m/s"
    if math.isnan(hours):
        return f"not given at {at}: {validity}"
    # below its range, the formula is evaluated at the lower end
    below = f", {1e-6 * least:g} inserted" if load < least else ""
    cycles = 3600.0 * hours / period_s
    return f"{hours:.3g} h ({cycles:.3g} gait cycles) at {at}{below}, all factors 1; {validity}"


def life_lines(result: "Life", limit_m: float, not_counted: Sequence[str]) -> list[str]:
    """The life as a table of some of its points, and when each joint reaches the limit."""
    points = len(result.cycles)
    rows = min(_TABLE_ROWS, points)
    shown = [round(i * (points - 1) / max(1, rows - 1)) for i in range(rows)]
    head = "".join(f"{joint:>22}" for joint in result.clearance_joints)
    table = [
        f"{'cycles':>10}{head}",
        f"{'':10}" + f"{'mean µm  deg  peak N':>22}" * len(result.clearance_joints),
    ]
    for i in shown:
        cells = "".join(
            f"{1e6 * result.clearance_m[i, k]:11.1f}{_degrees(result.worst_sector_deg[i, k]):>5}"
            f"{result.peak_force_n[i, k]:6.0f}"
            for k in range(len(result.clearance_joints))
        )
        table.append(f"{result.cycles[i]:10.3g}{cells}")
    table.append(f"jumps: {points - 1}; largest error of one: {1e6 * result.error_m.max():.2g} µm")
    if result.duty:
        table += _growth_by_load(result)
    ends = result.end(limit_m)
    for joint in (*result.clearance_joints, *(["leg"] if result.duty else [])):
        if joint in not_counted:
            table.append(f"{joint} not counted: its pair gives no wear coefficient")
        else:
            table.append(f"{joint} {_life_end(result, ends[joint], limit_m)}")
    return table


def _growth_by_load(result: "Life") -> list[str]:
    """Growth of each joint's clearance in the new leg, under each load of the duty."""
    table = [
        "growth when new [µm a million gait cycles]" + "".join(f"{j:>10}" for j in result.clearance_joints)
    ]
    for part, (peak_n, hours) in enumerate(result.duty.hours_by_peak.items() if result.duty else ()):
        growth = 1e12 * result.part_growth_m_per_cycle[0, part]
        table.append(f"{f'{peak_n:g} N, {hours:g} h a day':42}" + "".join(f"{one:10.3g}" for one in growth))
    return table


def _degrees(sector_deg: float) -> str:
    """Direction of the deepest wear, for the table; a dash before there is any."""
    return "-" if math.isnan(sector_deg) else f"{sector_deg:.0f}"


def _life_end(result: "Life", end: dict[str, float | None], limit_m: float) -> str:
    """When a joint, or the leg, reaches the limit."""
    if end["cycles"] is None:
        return f"does not reach {1e6 * limit_m:g} µm: at its last rate, its clearance does not grow"
    days = f", {end['days']:.3g} days of {result.duty.hours_per_day:g} h" if result.duty else ""
    beyond = "" if end["cycles"] <= result.cycles[-1] else ", extrapolated at its last rate"
    after = f"{end['cycles']:.3g} gait cycles, {end['hours']:.3g} h{days}"
    return f"reaches {1e6 * limit_m:g} µm after {after}{beyond}"


# ``leg-wear-monitor design``: which bushings let each joint of a leg last the hours that one wants.


def _numbers(ctx: click.Context, param: click.Parameter, value: str) -> tuple[float, ...]:
    """Positive numbers of a text such as ``8,10,12``."""
    try:
        found = tuple(sorted({float(part) for part in value.split(",")}))
    except ValueError:
        found = ()
    if not found or not 0.0 < found[0] <= found[-1] < 1000.0:
        raise click.BadParameter(f"{value!r} is not a list of numbers above 0, such as 8,10,12", ctx, param)
    return found


@click.command(short_help="Find bushings with which each joint lasts the hours wanted.")
@click.argument("mechanism", default="bionic_leg")
@common.clearances_option("A,B")
@common.option(
    "--duty",
    "N:H,...",
    "Hours a day at each peak of the ground's vertical force on the toe [N], such as 0:2,300:5.",
    default="0:8",
)
@common.number_option(
    "--hours", "H", "Hours of walking that each joint should last.", "h", above=0.0, default=1000.0
)
@common.limit_option
@common.option("--materials", "NAME,...", "Pairs to try.  [default: all that come with the package]")
@common.option(
    "--diameters-mm", "MM,...", "Diameters of the pin to try.", default="8,10,12,16,20", callback=_numbers
)
@common.option(
    "--widths-mm", "MM,...", "Widths of the bushing to try.", default="8,10,12,15,20", callback=_numbers
)
@common.option(
    "--clearances-um", "UM,...", "Radial clearances when new to try.", default="25,50,100", callback=_numbers
)
@common.json_option("the table of all bushings tried")
def design(
    mechanism: str,
    clearances: str | None,
    duty: str,
    materials: str | None,
    json_file: Path | None,
    **options: Any,
) -> None:
    """Find bushings with which each joint of a leg lasts the hours wanted.

    One life of the leg under the duty gives forces and sliding over the clearance. From these follow the
    lives of all pairs and sizes, by wear or by the maker's formula, and which of the maker's limits are
    exceeded. Check a choice with the verb life.
    """
    import attrs

    from leg_wear_monitor.life.design import design as of_leg
    from leg_wear_monitor.life.result import Duty
    from leg_wear_monitor.mechanism.loader import load_mechanism

    leg = common.with_clearance_joints(load_mechanism(mechanism), clearances)
    common.check_outputs(json_file, None)
    with common.options_named(), common.compilation("clearance"), common.progress_bar("design") as progress:
        table = of_leg(
            leg,
            Duty.parse(duty),
            hours=options["hours"],
            limit_m=options["limit_m"],
            pairs=[name.strip() for name in materials.split(",")] if materials else None,
            diameters_m=[1.0e-3 * each for each in options["diameters_mm"]],
            widths_m=[1.0e-3 * each for each in options["widths_mm"]],
            clearances_m=[1.0e-6 * each for each in options["clearances_um"]],
            progress=progress,
        )
    written = common.write_json(json_file, json_text({"bushings": [attrs.asdict(row) for row in table]}))
    common.say(json_file, design_lines(table, options["hours"]), written)


_PAIRS = 5  # of each joint in the printed table


def design_lines(table: "Sequence[BushingLife]", hours: float) -> list[str]:
    """The present bushing of each joint, and the smallest bushings that last, one per pair."""
    head = "life in hours of walking (10 to 90 %)"
    lines = [f"{'joint':8}{'pair':32}{'pin mm':>8}{'width mm':>10}{'clearance µm':>14}  {head}"]
    for joint in dict.fromkeys(row.joint for row in table):
        now, *others = (row for row in table if row.joint == joint)
        smallest: dict[str, BushingLife] = {}
        for row in others:
            if row.lasts:
                smallest.setdefault(row.material, row)
        lines.append(_design_line(f"{joint} now", now))
        lines += [_design_line(joint, row) for row in list(smallest.values())[:_PAIRS]]
        if not smallest:
            lines.append(f"{joint:8}none of the bushings tried lasts {hours:g} h")
    return lines


_LIVES = {"nothing": "does not wear", "unknown": "not known: the pair has no wear coefficient and no formula"}


def _design_line(joint: str, row: "BushingLife") -> str:
    life = _LIVES.get(row.limited_by, f"not valid: {row.limited_by} exceeds the maker's limit")
    if row.limited_by == "wear" and row.wear_h:
        p10, p50, p90 = (f"{float(f'{each:.3g}'):g}" for each in row.wear_h)
        life = f"{p50} ({p10} to {p90})"
    elif row.limited_by == "rating life":
        life = f"{float(f'{row.rating_h:.3g}'):g} by the maker's formula"
    sizes = f"{1e3 * row.diameter_m:8g}{1e3 * row.width_m:10g}{1e6 * row.clearance_m:14g}"
    return f"{joint:8}{row.material or 'no pair named':32}{sizes}  {life}"
