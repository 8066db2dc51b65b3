"""The JSON documents and the fields that each declares."""

from collections.abc import Iterator
from typing import get_args, get_type_hints

from json_fields import Row, descriptions, rows_of, unit_of

import leg_wear_monitor as lw

LegState = get_args(get_type_hints(lw.LegOverview)["state"])[0]

VERSION = ("schema_version", "whole number", "", "Version of these fields; see above.")


def simulation() -> Iterator[Row]:
    clock = {
        "wall_s": ("number", "Wall-clock duration of the run; the command line writes it."),
        "real_time_factor": ("number", "Simulated time as a multiple of that."),
    }
    yield VERSION
    yield from ((name, kind, unit_of(name), text) for name, (kind, text) in clock.items())
    yield from rows_of(lw.SimulationResult, left_out=("clearance_joints", "surfaces"))


def state() -> Iterator[Row]:
    yield VERSION
    yield from rows_of(LegState)


def replay() -> Iterator[Row]:
    yield VERSION
    yield from rows_of(lw.ReplaySummary)


_LOAD = "number", "Pa m/s", "Mean of pressure times sliding speed when new."


def life() -> Iterator[Row]:
    texts = descriptions(lw.Life)
    yield "mechanism", "text", "", "Name of the mechanism."
    yield "validity.<joint>.holds_for", "text", "", "Material pair and regime that its life holds for."
    yield "validity.<joint>.mean_pressure_speed_pa_mps", *_LOAD
    beyond = "What of it is beyond the limits of the joint's material; None within them."
    yield "validity.<joint>.outside_limits", "text or null", "", beyond
    beyond = "Why its normal law does not hold for the contact arc when new; None if it does."
    yield "validity.<joint>.outside_contact_law", "text or null", "", beyond
    yield VERSION
    for name in ("cycles", "error_m"):
        yield name, "list of numbers", unit_of(name), texts[name]
    columns = "clearance_m", "growth_m_per_cycle", "clearance_max_m", "worst_sector_deg", "peak_force_n"
    for name in columns:
        yield f"joints.<joint>.{name}", "list of numbers", unit_of(name), texts[name]
    name = "part_growth_m_per_cycle"
    words = f"{texts[name].removesuffix('.')}, load by load; with a duty only."
    yield f"joints.<joint>.{name}", "list of lists of numbers", unit_of(name), words
    yield "duty", "object", "", "Hours a day under each load, of `--duty`; missing without one."
    yield "duty.peak_n", "list of numbers", "N", "Largest vertical force of the ground on the toe."
    yield "duty.hours_per_day", "list of numbers", "h", "Hours a day under each of them."
    yield "duty.limit_m", "number", "m", "Mean radial clearance at which a joint's life ends."
    for name, unit, words in (
        ("cycles", "gait cycles", "When each joint, and the `leg`, reaches the limit; null if never."),
        ("hours", "h", "The same in hours of walking."),
        ("days", "d", "The same in days of this duty."),
    ):
        yield f"duty.end.<joint>.{name}", "number or null", unit, words


def commissioning() -> Iterator[Row]:
    texts = descriptions(lw.CommissioningResult)
    yield VERSION
    yield "turns", "number", "", texts["turns"]
    yield "is_sure", "true or false", "", lw.CommissioningResult.is_sure.__doc__ or ""
    yield "items[]", "object", "", texts["items"]
    yield from rows_of(lw.CommissioningItem, "items[].")
    yield "not_enough_to_tell[]", "text", "", texts["not_told"]
    yield "findings[]", "text", "", texts["findings"]
    yield "notes[]", "text", "", texts["notes"]


def fleet() -> Iterator[Row]:
    yield VERSION
    yield from rows_of(lw.FleetOverview)


DOCUMENTS = {
    "simulation": simulation,
    "state": state,
    "replay": replay,
    "life": life,
    "commissioning": commissioning,
    "fleet": fleet,
}
