"""Recordings that a pattern matches."""

import glob
import os
from pathlib import Path

from leg_wear_monitor.bags.bag import is_bag_directory, is_recording_name


def recordings_of(home: Path, pattern: str) -> list[Path]:
    """Recordings that a pattern matches.

    Parameters
    ----------
    home : pathlib.Path
        Directory that a relative pattern starts at.
    pattern : str
        With wildcards, only recordings are taken: files by their name, and directories that contain such
        files. Files in a directory that is taken are part of it. Without wildcards, the path is taken as it
        is, if it exists.
    """
    place = os.path.join(glob.escape(str(home)), pattern)
    if not glob.has_magic(pattern):
        path = home / pattern
        return [path] if path.exists() else []
    found = {Path(name) for name in glob.glob(place, recursive=True)}
    bags = {path for path in found if path.is_dir() and is_bag_directory(path)}
    files = {path for path in found if is_recording_name(path) and path.is_file()}
    return sorted(bags | {path for path in files if path.parent not in bags})
