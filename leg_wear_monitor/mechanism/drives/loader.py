"""Reading of drive files."""

from pathlib import Path

from leg_wear_monitor.configuration.library import Library
from leg_wear_monitor.mechanism.drives.drive import Drive

LIBRARY = Library("drives", "drive", Drive)


def drives() -> dict[str, Path]:
    """Files of the drives that come with the package, by name.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> "erob80-50" in lw.drives()
    True
    """
    return LIBRARY.files()


def load_drive(name_or_path: str | Path) -> Drive:
    """Read a drive from YAML.

    Parameters
    ----------
    name_or_path : str or pathlib.Path
        Name of a drive that comes with the package, or a path: anything with a suffix or a directory.

    Returns
    -------
    Drive

    Raises
    ------
    ConfigError
        Names file, key, value and what was expected.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> lw.load_drive("erob80-50").load_friction.value
    0.036
    """
    drive: Drive = LIBRARY.load(name_or_path)
    return drive
