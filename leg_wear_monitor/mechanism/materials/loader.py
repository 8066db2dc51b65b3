"""Reading of material files."""

from pathlib import Path

from leg_wear_monitor.configuration.library import Library
from leg_wear_monitor.mechanism.materials.material import Material

_LIBRARY = Library("materials", "material", Material)


def materials() -> dict[str, Path]:
    """Files of the material pairs that come with the package, by name.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> "du-on-steel-dry" in lw.materials()
    True
    """
    return _LIBRARY.files()


def load_material(name_or_path: str | Path) -> Material:
    """Read a material pair from YAML.

    Parameters
    ----------
    name_or_path : str or pathlib.Path
        Name of a pair that comes with the package, or a path: anything with a suffix or a directory.

    Returns
    -------
    Material

    Raises
    ------
    ConfigError
        Names file, key, value and what was expected.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> lw.load_material("steel-on-steel-greased-mild").wear_coefficients  # 1/Pa
    (1e-15, 1e-15)
    """
    material: Material = _LIBRARY.load(name_or_path)
    return material
