"""Resets of a joint whose part was replaced, and their undoing, which needs what the ledger has of before.

A monitor resets its twin. Without a monitor, the entry of a ledger is reset in the same way.
"""

import attrs

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.alarms.alarm import Level, acknowledged
from leg_wear_monitor.monitor.ledger.entry import Audit, Entry, JointWear, new_part, one_part
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


def reset_in(ledger: Ledger, joint: str, stamp_ns: int, who: str) -> JointWear:
    """Enter a replaced part into a ledger that no monitor uses; its history stays.

    Its alarms are acknowledged, so that those whose value returns clear with the next gait cycles: without a
    monitor, nobody else can.

    Returns
    -------
    JointWear
        The wear of the former part.

    Raises
    ------
    LegWearError
        If the ledger has no wear of this joint, or cannot be written.
    """
    entry, was = _entry_with(ledger, joint)
    alarms = tuple(acknowledged(alarm) if alarm.subject == joint else alarm for alarm in entry.alarms)
    entry = attrs.evolve(entry, alarms=tuple(alarm for alarm in alarms if alarm.level is not Level.OK))
    ledger.note(Audit(stamp_ns, who, "reset_wear", was))
    ledger.record(_with_part(entry, attrs.evolve(new_part(joint), replaced_ns=stamp_ns)))
    return was


def undo_in(ledger: Ledger, joint: str, stamp_ns: int, who: str) -> JointWear:
    """Undo the last reset of a joint in a ledger that no monitor uses.

    Returns
    -------
    JointWear
        Sum of the wear before the reset and since.

    Raises
    ------
    LegWearError
        If there is no reset to undo, or the ledger cannot be written.
    """
    entry, since = _entry_with(ledger, joint)
    reset = last_reset(ledger, joint, since)
    part = one_part(reset.before, since)
    ledger.note(Audit(stamp_ns, who, "undo_reset", since, undoes=reset.id))
    ledger.record(_with_part(entry, part))
    return part


def wear_words(wear: JointWear) -> str:
    """Mean total wear of both surfaces, and its number of gait cycles."""
    return f"{1e6 * wear.mean_m:.4g} um of wear from {wear.cycles} gait cycles"


def _entry_with(ledger: Ledger, joint: str) -> tuple[Entry, JointWear]:
    """The ledger's entry, and the present part of a joint in it."""
    parts = {part.name: part for part in ledger.entry.joints} if ledger.entry else {}
    if ledger.entry is None or joint not in parts:
        raise LegWearError(f"joint {joint}: the ledger contains no wear yet")
    return ledger.entry, parts[joint]


def _with_part(entry: Entry, part: JointWear) -> Entry:
    """The entry with another part of a joint; the spans stay those of the run that counted them."""
    joints = tuple(part if each.name == part.name else each for each in entry.joints)
    return attrs.evolve(entry, joints=joints, spans=(), span_epochs=())
