"""Rows of the page's table, as plain data for its script."""

from collections.abc import Container, Sequence
from typing import Any
from urllib.parse import quote

from leg_wear_monitor.fleet.overview.parts import LegOverview
from leg_wear_monitor.report.fleet.change import growth, was
from leg_wear_monitor.report.fleet.standing import Day, by_urgency
from leg_wear_monitor.report.fleet.used import band, valid_used


def table_data(
    legs: Sequence[LegOverview], joints: Sequence[str], day: Day, pages: Container[str]
) -> dict[str, Any]:
    """All that the script of the table needs.

    Parameters
    ----------
    legs : sequence of LegOverview
    joints : sequence of str
        Columns of the heat map.
    day : Day
    pages : container of str
        Ids of the legs that have a page of their own.
    """
    rank = {leg.id: number for number, leg in enumerate(by_urgency(legs, day))}
    lives = [leg.life["leg"] for leg in legs if leg.life.get("leg") and not leg.is_accelerated]
    return {
        "joints": list(joints),
        "life_h": [
            min((life.p10_h for life in lives if life and life.p10_h > 0.0), default=1.0),
            max((life.p90_h for life in lives if life), default=10.0),
        ],
        "legs": [_row(leg, joints, day, rank[leg.id], leg.id in pages) for leg in legs],
    }


def page_address(name: str) -> str:
    """Address of a leg's own page, relative to the page of the fleet."""
    return f"legs/{quote(name, safe='')}/report.html"


def _row(leg: LegOverview, joints: Sequence[str], day: Day, rank: int, has_page: bool) -> dict[str, Any]:
    standing, used, age = day.standing(leg), valid_used(leg), day.age_days(leg)
    life, health, rise = leg.life.get("leg"), leg.recordings, growth(leg)
    if leg.is_accelerated:
        life = None
    doubt = day.doubt(leg)
    why = "; ".join(filter(None, [leg.verdict.why if leg.verdict else "", doubt]))
    return {
        "id": leg.id,
        "page": page_address(leg.id) if has_page else "",
        "lot": leg.lot,
        "standing": standing.value,
        "rank": rank,
        "symbol": standing.symbol,
        "tone": standing.tone,
        "used": [_cell(used, joint) for joint in joints],
        "life": [life.p10_h, life.p50_h, life.p90_h] if life else None,
        "was": was(leg),
        "rise": list(rise) if rise else None,
        "age": None if age is None else round(age, 2),
        "is_old": bool(doubt),
        "counted": health.counted,
        "bad": health.partial + health.no_gait + health.unreadable,
        "why": why,
        "code": leg.verdict.fault_code if leg.verdict else "",
    }


def _cell(used: dict[str, float | None], joint: str) -> list[float] | str | None:
    """Percent and band of a joint; None if the leg has no such joint, a word if it is not valid."""
    if joint not in used:
        return None
    fraction = used[joint]
    return "not valid" if fraction is None else [round(100.0 * fraction, 1), band(fraction)]
