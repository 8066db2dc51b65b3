"""Renamed keys of configurations (CHANGELOG.rst)."""

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
