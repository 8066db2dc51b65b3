"""``leg-wear-monitor check``: what is wrong with a configuration or an installation."""

import platform
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

import click

from leg_wear_monitor.cli.doubts import warn_of
from leg_wear_monitor.cli.main import version
from leg_wear_monitor.cli.output import check_directory
from leg_wear_monitor.cli.verbs.simulate import DEFAULT_MODEL
from leg_wear_monitor.cli.waiting import compilation, is_compiled
from leg_wear_monitor.errors import ConfigWarning, LegWearError
from leg_wear_monitor.share import share_directory

if TYPE_CHECKING:
    from leg_wear_monitor.monitor.config.drive import DriveParameters

DOUBTED = 1

_FIGURES = {
    "lag_s": "lag",
    "bandwidth_hz": "bandwidth",
    "load_friction": "load friction",
    "coulomb_nm": "Coulomb friction",
    "viscous_nms": "viscous friction",
    "stiffness_nm_per_rad": "stiffness",
}
_LIBRARIES = ("attrs", "cattrs", "click", "jinja2", "matplotlib", "numba", "numpy", "rich", "ruamel.yaml")


@click.command(short_help="Check a configuration or the installation.")
@click.argument("configs", nargs=-1, metavar="[CONFIG]...")
def check(configs: tuple[str, ...]) -> int:
    """Check mechanism, parameter and fleet files; without a file, the installation and its own files.

    Prints a summary of each correct file, and a line on stderr for each fault. A value that is probably in
    another unit causes a warning; the exit code is then 1. Tables (.csv, .parquet) are read with the columns
    and units of the parameter file before them: check monitor.yaml leg.csv.
    """
    with warnings.catch_warnings(record=True) as doubted:
        warnings.simplefilter("always", ConfigWarning)
        well = _all_well(_files(configs)) if configs else _installation()
    for doubt in doubted:
        warnings.showwarning(doubt.message, doubt.category, doubt.filename, doubt.lineno)
    if not well:
        return 2
    return DOUBTED if any(one.category is ConfigWarning for one in doubted) else 0


def _installation() -> bool:
    click.echo(f"{'version':<13} {version()}")
    libraries = {name: _library(name) for name in _LIBRARIES}
    if not _all_well({"python": platform.python_version, **libraries}):
        return False  # the rest needs them
    if not _all_well({"kernels": _kernels, "share": lambda: str(share_directory())}):
        return False
    from leg_wear_monitor.mechanism.loader import shipped_mechanisms
    from leg_wear_monitor.monitor.config.parameter_file import shipped_config

    shipped = {"monitor.yaml": partial(_parameters, str(shipped_config()))}
    return _all_well({name: partial(_first_line, name) for name in shipped_mechanisms()} | shipped)


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
        return "compiled at every start: no place for compiled code is private"
    check_directory("NUMBA_CACHE_DIR", place)
    state = "compiled" if is_compiled(DEFAULT_MODEL) else "to be compiled by the first simulation"
    return f"{state}, in {place}"


def _files(names: tuple[str, ...]) -> Mapping[str, Callable[[], str]]:
    files, parameters = {}, None
    for name in names:
        files[name] = partial(_table, name, parameters) if _is_table(name) else partial(_file, name)
        parameters = name if name.endswith((".yaml", ".yml")) else parameters
    return files


def _is_table(name: str) -> bool:
    return name.lower().endswith((".csv", ".parquet"))


def _table(name: str, parameters: str | None) -> str:
    """Read a table, and say what was understood of it."""
    try:
        from leg_wear_monitor.bags.findings import Severity
        from leg_wear_monitor.bags.table_check import understood
    except ModuleNotFoundError as error:
        raise LegWearError(f"{error.name} is not installed; pip install 'leg_wear_monitor[bags]'") from error
    from leg_wear_monitor.monitor.config.parameter_file import load_config

    lines, findings = understood(Path(name), load_config(parameters))
    for finding in findings:
        if finding.severity is Severity.LOSS:
            warnings.warn(str(finding), ConfigWarning, stacklevel=2)
        else:
            lines.append(f"note: {finding.text}")
    return f"\n{'':13} ".join(lines)


def _file(name: str) -> str:
    """Check a file as what it is."""
    from leg_wear_monitor.mechanism.loader import is_file_name, read_yaml
    from leg_wear_monitor.monitor.config.parameter_file import is_parameter_file

    document = read_yaml(Path(name), name) if is_file_name(name) else None
    if is_parameter_file(document):
        return _parameters(name)
    from leg_wear_monitor.fleet.description.loader import is_fleet_file

    return _fleet(name) if is_fleet_file(document) else _mechanism(name)


def _fleet(path: str) -> str:
    """Read the description of a fleet and the begins of its recordings, and say what was understood."""
    from leg_wear_monitor.cli.waiting import progress_bar
    from leg_wear_monitor.fleet.description.loader import load_fleet
    from leg_wear_monitor.fleet.understood import understood

    fleet = load_fleet(path)
    for file in dict.fromkeys(leg.config_file for leg in fleet.legs if leg.config_file):
        click.echo(f"{file.name:<13} {_parameters(str(file))}")
    with progress_bar("looking at the recordings") as progress:
        pairs = list(understood(fleet, progress))
    for fault in (fault for _, fault in pairs if fault):
        warnings.warn(f"{path}: {fault}", ConfigWarning, stacklevel=2)
    return f"\n{'':13} ".join(line for line, _ in pairs if line)


def _parameters(path: str) -> str:
    """Read the monitor's parameters, and say what they are set to."""
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.config.fitting import fitted, twin_settings
    from leg_wear_monitor.monitor.config.parameter_file import load_config
    from leg_wear_monitor.monitor.config.plausible import parameter_doubts

    config = load_config(path)
    leg = fitted(load_mechanism(config.mechanism), config, path)
    twin_settings(config, path)
    warn_of(path, parameter_doubts(config, leg))
    text = (
        f"parameters of the monitor: {config.mechanism}, clearance joints {', '.join(leg.clearance_joints)}, "
        f"{config.cadence.commanded_rpm:g} rpm, hardware {config.hardware}"
    )
    if config.diagnosis.reference:
        from leg_wear_monitor.monitor.diagnosis.reference_file import read_references

        known = read_references(Path(config.diagnosis.reference), leg)
        text += f", references at {', '.join(f'{one.profile.cadence_rpm:.3g}' for one in known)} rpm"
    return text + _drive(config.drive, path)


def _drive(parameters: "DriveParameters", path: str) -> str:
    """What is declared of the drive, in a line of its own; empty if nothing is."""
    from leg_wear_monitor.monitor.config.drive import drive_figures
    from leg_wear_monitor.monitor.config.parameters import PARAMETERS

    declared = drive_figures(parameters, path).declared
    if not (declared or parameters.type):
        return ""
    known = [
        f"{_FIGURES[name]} {value:.4g} {PARAMETERS[f'drive.{name}'].unit}".rstrip()
        for name, value in declared.items()
    ]
    drive = f"\n{'':13} drive {parameters.type}".rstrip()
    return f"{drive}, at the crank: {', '.join(known) or 'no figure is declared'}; the rest is estimated"


def _first_line(name: str) -> str:
    return _mechanism(name).splitlines()[0]


def _mechanism(name: str) -> str:
    """Load, assemble and turn a mechanism, and say what it is."""
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.mechanism.plausible import doubts
    from leg_wear_monitor.mechanism.understood import understood

    leg = load_mechanism(name)
    with compilation("mechanism", how_long="a few seconds"):
        from leg_wear_monitor.contact.conformity import conformity_doubts
        from leg_wear_monitor.dynamics.simulation import prepare

        linkage = prepare(leg).linkage
    warn_of(leg.source, (*doubts(leg), *conformity_doubts(linkage)))
    clearance_joints = (
        f"clearance joints {', '.join(leg.clearance_joints)}"
        if leg.clearance_joints
        else "no clearance joint"
    )
    what = (
        f"{len(leg.bodies)} moving bodies, {len(leg.joints)} joints ({clearance_joints}), mobility 1, "
        "closes, and the crank turns through"
    )
    return "\n".join([what, *(f"{'':13} {statement}" for statement in understood(linkage))])
