"""Unknown keys of configurations, among them renamed ones (CHANGELOG.rst)."""

from collections.abc import Collection

from leg_wear_monitor.configuration.nearest import nearest

RENAMED = {
    "drop_share": "drop_fraction",
    "duplicate_share": "duplicate_fraction",
    "fault_share": "fault_fraction",
    "late_share": "late_fraction",
    "bad_sample_share": "bad_sample_fraction",
    "loose_joints": "clearance_joints",
    "lost_time_share": "lost_time_fraction",
    "perturb_share": "perturb_fraction",
    "stuck_torque_share": "stuck_torque_fraction",
    "warn_share": "warn_fraction",
}


def new_name(name: str) -> str | None:
    """Present name of a renamed key, including its sections; None for a key that was not renamed."""
    section, dot, key = name.rpartition(".")
    return f"{section}{dot}{RENAMED[key]}" if key in RENAMED else None


def unknown_fault(what: str, name: str, known: Collection[str], listed: str) -> str:
    """Error message for an unknown name.

    Parameters
    ----------
    what : str
        Kind of the name, such as ``key`` or ``parameter``.
    name : str
    known : collection of str
        Known names, to find a renamed or similar one.
    listed : str
        End of the message if there is none: where the known names are listed.
    """
    renamed = new_name(name)
    if renamed in known:
        return f"is now called {renamed}"
    near = nearest(name, known)
    return f"unknown {what}, {f'did you mean {near}?' if near else listed}"
