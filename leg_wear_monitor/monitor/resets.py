"""The last reset of a joint, which can be taken back as long as the ledger has all of what was before."""

import attrs

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.ledger.entry import JointWear
from leg_wear_monitor.monitor.ledger.ledger import Ledger


@attrs.frozen(eq=False)
class Reset:
    """A reset that can be taken back: its row in the ledger, and the joint's wear before it."""

    id: int
    before: JointWear


def last_reset(ledger: Ledger | None, joint: str, now: JointWear) -> Reset:
    """The last reset of a joint that was not taken back.

    Parameters
    ----------
    ledger : Ledger or None
    joint : str
    now : JointWear
        The joint, as the monitor counts it.

    Raises
    ------
    LegWearError
        If there is none, or what was before is not kept.
    """
    if ledger is None:
        raise LegWearError(f"joint {joint}: no ledger is used, so the wear before a reset is not stored")
    if ledger.fault:
        raise LegWearError(f"joint {joint}: the ledger was not written: {ledger.fault}; try again when it is")
    found = ledger.last_reset(joint)
    if found is None:
        raise LegWearError(f"joint {joint}: the ledger has no reset to undo")
    if found.joint is None:
        raise LegWearError(f"joint {joint}: was reset by an older version, which stored only its depth")
    if found.joint.depth.shape != now.depth.shape:
        raise LegWearError(f"joint {joint}: had {found.joint.depth.shape[1]} sectors when it was reset")
    return Reset(found.id, found.joint)
