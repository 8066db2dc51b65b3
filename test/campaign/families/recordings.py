"""Damaged recordings through ``replay``: refused, told of, or as if whole."""

import json
from pathlib import Path

import numpy as np

from campaign.case import Case, Ran, command_line

SHORT, LONG = 4, 200
_BAG = Path(__file__).parents[3] / "bags" / "healthy.mcap"


def warm() -> None:
    """Import and compile all that a replay needs."""
    from leg_wear_monitor.recording.replay import replay

    replay(_BAG)


def case(seed: int) -> Case:
    """A recording that is cut, or has flipped bits."""
    rng = np.random.default_rng(seed)
    content = bytearray(_BAG.read_bytes())
    if seed % 2:
        at = int(rng.integers(len(content)))
        what, content = f"cut at byte {at}", content[:at]
    else:
        at, bit = int(rng.integers(len(content))), int(rng.integers(8))
        what = f"bit {bit} of byte {at} flipped"
        content[at] ^= 1 << bit
    return Case(
        description=f"healthy.mcap, {what}",
        prepare=lambda directory: (directory / "x.mcap").write_bytes(content),
        run=command_line("replay", "x.mcap", "--json", "-"),
        unsound=_unsound,
    )


def _unsound(ran: Ran) -> str:
    record = json.loads(ran.stdout)
    found = (record["cycles"], record["recording"]["crank_samples"])
    return "" if found == (10, 2400) else f"{found}"
