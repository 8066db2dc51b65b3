"""Where the files that come with the package are: config/, launch/, bags/."""

from pathlib import Path

from leg_wear_monitor.errors import LegWearError


class ShareNotFoundError(LegWearError):
    """The package was copied somewhere without its share/ directory."""


def share_directory() -> Path:
    """Directory that contains config/, in every form of installation.

    A checkout is its own share directory; an editable install and ``colcon build --symlink-install`` lead
    back to it. Otherwise pip and colcon put ``share/leg_wear_monitor`` into the prefix whose
    ``lib/python3.x/site-packages`` holds this file, so it is met on the way up: no ROS and no environment
    variable is needed.

    Returns
    -------
    pathlib.Path
        The checkout, or ``<prefix>/share/leg_wear_monitor``.

    Raises
    ------
    ShareNotFoundError
        If neither is there.
    """
    package = Path(__file__).resolve().parent
    if (package.parent / "package.xml").is_file():
        return package.parent
    for prefix in package.parents:
        share = prefix / "share" / package.name
        if (share / "config").is_dir():
            return share
    raise ShareNotFoundError(
        f"{package}: no share/{package.name}/config in a directory above; install with pip or colcon"
    )
