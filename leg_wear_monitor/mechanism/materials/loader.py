"""Reading of material files."""

from functools import cache
from pathlib import Path

from leg_wear_monitor.configuration.nearest import did_you_mean
from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.configuration.yaml_file import read_document
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.materials.material import Material
from leg_wear_monitor.share import share_directory


def materials() -> dict[str, Path]:
    """Files of the material pairs that come with the package, by name.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> "du-on-steel-dry" in lw.materials()
    True
    """
    return dict(_files(share_directory() / "config" / "materials"))


@cache
def _files(directory: Path) -> dict[str, Path]:
    """Files of a directory of the package, which each joint of a leg asks for."""
    return {path.stem: path for path in sorted(directory.glob("*.yaml"))}


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
    path = Path(name_or_path)
    if path.suffix or path.parent != Path():
        return _read(path, str(path))
    shipped = materials()
    if path.name not in shipped:
        hint = did_you_mean(path.name, shipped)
        fault = f"no material of this name, leg-wear-monitor materials lists them{hint}"
        raise ConfigError(str(name_or_path), "", fault)
    return _shipped(shipped[path.name])


@cache
def _shipped(path: Path) -> Material:
    """A file of the package."""
    return _read(path, path.name)


def _read(path: Path, source: str) -> Material:
    try:
        document = read_document(path, source)
    except FileNotFoundError as error:
        raise ConfigError(source, "", f"cannot be read: {error.strerror}") from error
    material: Material = structure(document, Material, source, "")
    return material
