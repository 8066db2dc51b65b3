"""Verbs on lives: ``life``, ``design``."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli import common
from leg_wear_monitor.files import json_text

if TYPE_CHECKING:
    from leg_wear_monitor.life.design import BushingLife
    from leg_wear_monitor.life.result import Life
    from leg_wear_monitor.mechanism.spec import Mechanism

# ``leg-wear-monitor life``: a leg from new until a clearance reaches its limit, by cycle jumps.


_TABLE_ROWS = 12  # most rows of the printed table, spread over the life


@click.command(short_help="Simulate the wear of a leg over its whole life.")
@common.mechanism_option
@common.clearances_option
@common.speed_option
@common.limit_option
@common.option(
    "--duty",
    "N:H,...",
    "Hours per day at each peak of the ground's vertical force on the "
    "toe, as N:hours, such as 0:2,300:5,600:1.  "
    "[default: as in the mechanism file]",
)
@common.positive("--max-wear-per-jump-m", "M", "Deepest change of a surface in a jump [m].  [default: 3e-05]")
@common.count("--legs", "N", "Number of legs averaged.  [default: 2]")
@common.option("--cycles", "N", "Gait cycles averaged per leg.  [default: 4]", type=click.IntRange(min=2))
@common.json_option("the life")
@common.out_option("Write life.json and life.png.")
def life(mechanism: str, json_file: Path | None, out: Path | None, **options: Any) -> None:
    """Simulate the wear of a leg from new until a clearance reaches its limit.

    A few gait cycles are simulated, and their mean wear is applied over many. Single cycles are chaotic, so
    the values scatter; the scatter is reported.
    """
    from leg_wear_monitor.mechanism.loader import doubts, load_mechanism

    names, limit_m = options.pop("clearances"), options["limit_m"]
    leg = common.with_clearance_joints(load_mechanism(mechanism), names)
    common.check_outputs(json_file, out)
    with common.options_named():
        result = _life(leg, **options)
    # only after success, because the message of a failure contains the doubts
    common.warn_of(leg.source, doubts(leg))
    document = _document(leg, result, limit_m)
    text = json_text(document)
    written = common.write_json(json_file, text)
    if out is not None:
        from leg_wear_monitor.report.figure import life_picture

        files = {"life.json": text.encode(), "life.png": life_picture(result)}
        written += common.write_directory(out, files)
    common.say(json_file, life_lines(result, limit_m, document["validity"]), written)


_HORIZON_CYCLES = 1.0e9


def _life(
    leg: "Mechanism", duty: str | None, limit_m: float, speed_rpm: float | None, **given: Any
) -> "Life":
    """Simulate the life; options that were not given have the defaults of LifeSettings."""
    from leg_wear_monitor.life.life import LifeRun, LifeSettings, simulate_life
    from leg_wear_monitor.life.result import Duty

    settings = LifeSettings(**{name: value for name, value in given.items() if value is not None})
    loads = None if duty is None else Duty.parse(duty)
    with common.compilation(), common.progress_bar("life") as progress:
        run = LifeRun(leg, settings, speed_rpm=speed_rpm, duty=loads)
        return simulate_life(run, limit_m=limit_m, horizon_cycles=_HORIZON_CYCLES, progress=progress)


def _document(leg: "Mechanism", result: "Life", limit_m: float) -> dict[str, Any]:
    """Content of the JSON file: the life, and the leg that it belongs to."""
    from leg_wear_monitor.life.life import life_document
    from leg_wear_monitor.life.result import validity

    return {
        "mechanism": leg.name,
        "validity": validity(leg, result),
        **life_document(result, limit_m),
    }


def life_lines(result: "Life", limit_m: float, validity: dict[str, Any]) -> list[str]:
    """Lines: clearances [µm] over the life, when each joint reaches the limit, and the validity."""
    points = len(result.cycles)
    rows = min(_TABLE_ROWS, points)
    lines = [f"{'cycles':>10}" + "".join(f"{f'{joint} µm':>10}" for joint in result.clearance_joints)]
    for i in (round(row * (points - 1) / max(1, rows - 1)) for row in range(rows)):
        cells = "".join(f"{1e6 * each:10.1f}" for each in result.clearance_m[i])
        lines.append(f"{result.cycles[i]:10.3g}{cells}")
    lines.append(f"jumps: {points - 1}; largest error of one: {1e6 * result.error_m.max():.2g} µm")
    ends = result.end(limit_m)
    for joint in (*result.clearance_joints, *(["leg"] if result.duty else [])):
        lines.append(f"{joint} {_life_end(result, ends[joint], limit_m)}")
    for joint, known in validity.items():
        lines.append(f"{joint} holds for {known['holds_for']}")
        doubts = filter(None, (known["outside_limits"], known["outside_contact_law"]))
        lines += [f"{joint}: {doubt}" for doubt in doubts]
    return lines


def _life_end(result: "Life", end: dict[str, float | None], limit_m: float) -> str:
    """When a joint, or the leg, reaches the limit."""
    if end["cycles"] is None:
        return f"does not reach {1e6 * limit_m:g} µm: its clearance does not grow at the last rate"
    days = f", {end['days']:.3g} days of {result.duty.hours_per_day:g} h" if result.duty else ""
    beyond = "" if end["cycles"] <= result.cycles[-1] else ", extrapolated with the last growth"
    after = f"{end['cycles']:.3g} gait cycles, {end['hours']:.3g} h{days}"
    return f"reaches {1e6 * limit_m:g} µm after {after}{beyond}"


# ``leg-wear-monitor design``: bushings that let each joint of a leg last the wanted hours.


def _numbers(ctx: click.Context, param: click.Parameter, value: str) -> tuple[float, ...]:
    """Positive numbers of a text such as ``8,10,12``."""
    try:
        found = tuple(sorted({float(part) for part in value.split(",")}))
    except ValueError:
        found = ()
    if not found or not 0.0 < found[0] <= found[-1] < 1000.0:
        raise click.BadParameter(f"{value!r} is not a list of numbers above 0, such as 8,10,12", ctx, param)
    return found


@click.command(short_help="Find bushings for a wanted life of each joint.")
@click.argument("mechanism", default="bionic_leg")
@common.clearances_option
@common.option(
    "--duty",
    "N:H,...",
    "Hours per day at each peak of the ground's vertical force on the toe, as N:hours, such as 0:2,300:5.",
    default="0:8",
)
@common.positive("--hours", "H", "Hours of walking that each joint should last.", default=1000.0)
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
    """Find bushings for a wanted life of each joint of a leg.

    One life of the leg under the duty gives forces and sliding over the clearance. They give the life of
    every pair and size, and the maker's limits that are exceeded. Check a choice with the verb life.
    """
    import attrs

    from leg_wear_monitor.life.design import design as of_leg
    from leg_wear_monitor.life.result import Duty
    from leg_wear_monitor.mechanism.loader import load_mechanism

    leg = common.with_clearance_joints(load_mechanism(mechanism), clearances)
    common.check_outputs(json_file, None)
    with common.options_named(), common.compilation(), common.progress_bar("design") as progress:
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


_PAIRS = 5  # pairs per joint in the printed table


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
            lines.append(f"{joint:8}no bushing that was tried lasts {hours:g} h")
    return lines


def _design_line(joint: str, row: "BushingLife") -> str:
    life = f"not valid: {row.limited_by} exceeds the maker's limit"
    if row.limited_by == "nothing":
        life = "does not wear"
    elif row.limited_by == "wear" and row.wear_h:
        p10, p50, p90 = (f"{float(f'{each:.3g}'):g}" for each in row.wear_h)
        life = f"{p50} ({p10} to {p90})"
    sizes = f"{1e3 * row.diameter_m:8g}{1e3 * row.width_m:10g}{1e6 * row.clearance_m:14g}"
    return f"{joint:8}{row.material or 'no pair named':32}{sizes}  {life}"
