"""Clearance that is used up, joint by joint over the fleet."""

import statistics
from collections.abc import Sequence
from itertools import pairwise

from leg_wear_monitor.fleet.overview.parts import LegOverview
from leg_wear_monitor.report.fleet.used import BANDS, band, valid_used
from leg_wear_monitor.report.page import Section
from leg_wear_monitor.report.parts import Table, Text

_HEAD = (
    f"below {100 * BANDS[0]:.0f} %",
    *(f"{100 * low:.0f} to {100 * high:.0f} %" for low, high in pairwise(BANDS)),
    "at the limit",
)


def joints_section(legs: Sequence[LegOverview], joints: Sequence[str]) -> Section:
    """Number of legs in each band, for each joint."""
    if not joints:
        return Section("Joints", [Text("No clearance of any leg is known.")])
    used = [valid_used(leg) for leg in legs]
    return Section(
        "Joints",
        [
            Table(
                caption="Legs by the part of a joint's clearance, from new to limit, that is used up",
                head=("joint", *_HEAD, "not valid", "median", "most"),
                rows=[_row(joint, [each[joint] for each in used if joint in each]) for joint in joints],
            )
        ],
    )


def _row(joint: str, used: Sequence[float | None]) -> list[str]:
    known = [each for each in used if each is not None]
    bands = [band(each) for each in known]
    counts = [str(bands.count(number)) for number in range(len(BANDS) + 1)]
    ends = (statistics.median, max)
    return [
        joint,
        *counts,
        str(len(used) - len(known)),
        *(f"{100.0 * end(known):.0f} %" if known else "-" for end in ends),
    ]
