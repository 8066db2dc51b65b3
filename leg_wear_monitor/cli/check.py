"""``leg-wear-monitor check``: what is wrong with a configuration or an installation."""

import platform
from collections.abc import Callable, Mapping
from functools import partial
from importlib import metadata
from pathlib import Path

import click

from leg_wear_monitor.cli.main import version
from leg_wear_monitor.cli.output import check_directory
from leg_wear_monitor.cli.simulate import DEFAULT_MODEL
from leg_wear_monitor.cli.waiting import compilation, is_compiled
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.share import share_directory

_LIBRARIES = ("attrs", "cattrs", "click", "jinja2", "matplotlib", "numba", "numpy", "rich", "ruamel.yaml")


@click.command(short_help="Say what is wrong with a configuration or an installation.")
@click.argument("configs", nargs=-1, metavar="[CONFIG]...")
def check(configs: tuple[str, ...]) -> int:
    """Check files of mechanisms and of parameters, or, without any, the installation and its own files.

    Prints a line for each that is in order, and one on stderr for each that is not.
    """
    return 0 if (_all_well(_files(configs)) if configs else _installation()) else 2


def _installation() -> bool:
    click.echo(f"{'version':<13} {version()}")
    libraries = {name: _library(name) for name in _LIBRARIES}
    if not _all_well({"python": platform.python_version, **libraries}):
        return False  # the rest needs them
    if not _all_well({"kernels": _kernels, "share": lambda: str(share_directory())}):
        return False
    from leg_wear_monitor.mechanism.loader import shipped_mechanisms
    from leg_wear_monitor.monitor.parameter_file import shipped_config

    shipped = {"monitor.yaml": partial(_parameters, str(shipped_config()))}
    return _all_well({name: partial(_mechanism, name) for name in shipped_mechanisms()} | shipped)


def _all_well(parts: Mapping[str, Callable[[], str]]) -> bool:
    """Print what each part says of itself, on stderr what is wrong with it."""
    well = True
    for name, part in parts.items():
        try:
            click.echo(f"{name:<13} {part()}")
        except LegWearError as error:
            click.echo(f"error: {error}", err=True)
            well = False
    return well


def _library(name: str) -> Callable[[], str]:
    def find() -> str:
        try:
            return metadata.version(name)
        except metadata.PackageNotFoundError as error:
            raise LegWearError(f"{name}: is not installed, expected by leg_wear_monitor") from error

    return find


def _kernels() -> str:
    from leg_wear_monitor.kernel import cache_directory

    place = cache_directory()
    if place is None:
        return "compiled anew at every start: no place for compiled code is private"
    check_directory("NUMBA_CACHE_DIR", place)
    state = "compiled" if is_compiled(DEFAULT_MODEL) else "to be compiled by the first simulation"
    return f"{state}, in {place}"


def _files(names: tuple[str, ...]) -> Mapping[str, Callable[[], str]]:
    return {name: partial(_file, name) for name in names}


def _file(name: str) -> str:
    """Check a file as what it is."""
    from leg_wear_monitor.mechanism.loader import is_file_name, read_yaml
    from leg_wear_monitor.monitor.parameter_file import is_parameter_file

    if is_file_name(name) and is_parameter_file(read_yaml(Path(name), name)):
        return _parameters(name)
    return _mechanism(name)


def _parameters(path: str) -> str:
    """Read the monitor's parameters, and say what they are set to."""
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.fitting import fitted, twin_settings
    from leg_wear_monitor.monitor.parameter_file import load_config

    config = load_config(path)
    leg = fitted(load_mechanism(config.mechanism), config, path)
    twin_settings(config, path)
    return (
        f"parameters of the monitor: {config.mechanism}, {', '.join(leg.loose)} loose, "
        f"{config.cadence.commanded_rpm:g} rpm, hardware {config.hardware}"
    )


def _mechanism(name: str) -> str:
    """Load, assemble and turn a mechanism, and say what it is."""
    from leg_wear_monitor.mechanism.loader import load_mechanism

    leg = load_mechanism(name)
    with compilation("mechanism", "a few seconds"):
        from leg_wear_monitor.dynamics.simulation import prepare

        prepare(leg)
    loose = f"{', '.join(leg.loose)} loose" if leg.loose else "none loose"
    return (
        f"{len(leg.bodies)} moving bodies, {len(leg.joints)} joints ({loose}), mobility 1, "
        "closes, and the crank turns through"
    )
