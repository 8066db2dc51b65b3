"""``leg-wear-monitor design``: which bushings let each joint of a leg last the hours that one wants."""

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING

import click

from leg_wear_monitor.cli import common

if TYPE_CHECKING:
    from leg_wear_monitor.life.design import BushingChoices, Design


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
    "N:H,...|FILE",
    "Hours a day at each peak of the ground's vertical force on the toe [N], such as 0:2,300:5; or a "
    "YAML file with duty: [{load_n, hours_per_day, speed_rpm}, ...].",
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
@common.json_option("the design")
@common.out_option("Write design.html, design.json and design.csv with all candidates.")
def design(
    mechanism: str,
    clearances: str | None,
    duty: str,
    hours: float,
    limit_m: float,
    materials: str | None,
    diameters_mm: tuple[float, ...],
    widths_mm: tuple[float, ...],
    clearances_um: tuple[float, ...],
    json_file: Path | None,
    out: Path | None,
) -> None:
    """Find bushings with which each joint of a leg lasts the hours wanted.

    The leg is simulated once with several clearances under the duty; from its forces and sliding follow the
    lives of all pairs and sizes, by wear or by the maker's formula, and which of the maker's limits are
    exceeded. Check a choice with the verb life.
    """
    from leg_wear_monitor.life.design import BushingChoices
    from leg_wear_monitor.life.design import design as of_leg
    from leg_wear_monitor.life.joint_loads import read_duty
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.mechanism.materials import materials as shipped

    leg = common.with_clearance_joints(load_mechanism(mechanism), clearances)
    names = tuple(shipped()) if materials is None else tuple(one.strip() for one in materials.split(","))
    choices = BushingChoices(
        materials=names,
        diameters_m=tuple(1.0e-3 * one for one in diameters_mm),
        widths_m=tuple(1.0e-3 * one for one in widths_mm),
        clearances_m=tuple(1.0e-6 * one for one in clearances_um),
    )
    common.check_outputs(json_file, out)
    with common.options_named(), common.compilation("clearance"), common.progress_bar("design") as progress:
        result = of_leg(leg, read_duty(duty), choices, hours=hours, limit_m=limit_m, progress=progress)
    written = common.write_json(json_file, result.to_json())
    if out is not None:
        from leg_wear_monitor.report.design_page import design_page
        from leg_wear_monitor.report.page import page_html

        page = page_html(design_page(leg, result, choices)).encode()
        files = {"design.html": page, "design.json": result.to_json().encode(), "design.csv": _csv(result)}
        written += common.write_directory(out, files)
    common.say(json_file, lines(result, choices), written)


def lines(result: "Design", choices: "BushingChoices") -> list[str]:
    """The design as a table: each joint as it is, and the smallest bushing that lasts."""
    told = [f"{result.mechanism}: {result.asked}"]
    for now in result.order:
        told.append(f"{now.joint} now: {now.words}: {now.life_words}")
        lasting = result.of(now.joint)
        if lasting:
            told.append(f"  smallest that lasts: {lasting[0].words}: {lasting[0].life_words}")
        else:
            told.append(
                f"  none of {len(choices.materials)} pairs in the sizes tried lasts {result.hours:g} h"
            )
    told += [
        f"life of {one.joint} now: 10 % more load {one.load:+.0f} %, 10 % more cadence {one.cadence:+.0f} %, "
        f"half the clearance when new {one.clearance:+.0f} %, 10 % wider {one.width:+.0f} %"
        for one in result.sensitivities
    ]
    return [*told, result.first]


def _csv(result: "Design") -> bytes:
    """All candidates, a row each."""
    rows = [one.row() for one in result.candidates]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()
