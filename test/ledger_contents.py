"""What an entry of a ledger holds, to the bit, to be compared."""

import attrs

from leg_wear_monitor.monitor.ledger.entry import Entry


def contents(entry: Entry | None) -> object:
    """All of an entry, whatever the order of its joints and totals."""
    if entry is None:
        return None
    joints = sorted(attrs.astuple(attrs.evolve(j, depth=j.depth.tobytes())) for j in entry.joints)
    alarms = [(a.kind, a.subject, a.level, a.present, a.acknowledged, a.raised_ns) for a in entry.alarms]
    spans = entry.spans, entry.loads
    return entry.stamp_ns, joints, sorted(entry.totals.items()), sorted(alarms), spans
