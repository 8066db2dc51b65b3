"""Recordings that a pattern matches."""

import glob
import heapq
import os
from collections.abc import Iterable
from itertools import groupby
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
        files. Files in a directory that is taken are part of it. Below ``**``, links are followed, and each
        directory counts once. Without wildcards, the path is taken as it is, if it exists.
    """
    if not glob.has_magic(pattern):
        path = home / pattern
        return [path] if path.exists() else []
    found = _matches(home, pattern)
    bags = {path for path in found if path.is_dir() and is_bag_directory(path)}
    files = {path for path in found if is_recording_name(path) and path.is_file()}
    return sorted(bags | {path for path in files if path.parent not in bags})


def _matches(home: Path, pattern: str) -> set[Path]:
    """Files and directories; the one difference to `glob` is that links which lead back do not hang it."""
    found = {Path("/") if pattern.startswith("/") else home}
    is_recursive = False
    for is_recursive, parts in groupby(pattern.lstrip("/").split("/"), "**".__eq__):
        found = _directories(found) if is_recursive else _in(found, "/".join(parts))
    return found | {path for path in _in(found, "*") if not path.is_dir()} if is_recursive else found


def _in(directories: Iterable[Path], pattern: str) -> set[Path]:
    places = (os.path.join(glob.escape(str(each)), pattern) for each in directories)
    return {Path(name) for place in places for name in glob.glob(place)}


def _directories(tops: Iterable[Path]) -> set[Path]:
    """Directories and all below them, without hidden ones: each once, by the path with the fewest links."""
    found: dict[tuple[int, int], Path] = {}
    waiting = sorted((int(top.is_symlink()), str(top)) for top in tops if top.is_dir())
    while waiting:
        links, name = heapq.heappop(waiting)
        try:
            state = os.stat(name)
            if found.setdefault((state.st_dev, state.st_ino), Path(name)) != Path(name):
                continue
            with os.scandir(name) as entries:
                for entry in entries:
                    if not entry.name.startswith(".") and os.path.isdir(entry):
                        heapq.heappush(waiting, (links + entry.is_symlink(), entry.path))
        except OSError:  # may not be read: like `glob`, without it
            continue
    return set(found.values())
