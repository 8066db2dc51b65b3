"""Verbs that look: ``check``, ``drives``, ``materials``, ``cache``."""

import platform
import shutil
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli import common
from leg_wear_monitor.errors import ConfigError, ConfigWarning, LegWearError, extras_hinted
from leg_wear_monitor.files import json_text, package_version, share_directory

if TYPE_CHECKING:
    from leg_wear_monitor.monitor.config.settings import DriveParameters


# ``leg-wear-monitor check``: faults of a configuration or an installation.


@click.command(short_help="Check a configuration or the installation.")
@click.argument("configs", nargs=-1, metavar="[CONFIG]...")
def check(configs: tuple[str, ...]) -> int:
    """Check mechanism, parameter and fleet files; without a file, the installation and its own files.

    Prints a summary of each correct file, and a line on stderr for each fault. A value that is probably in a
    wrong unit causes a warning and exit code 1. To check a table (.csv, .parquet), name its parameter file
    first: check monitor.yaml leg.csv. Without a parameter file, the command proposes the parameters: check
    leg.csv.
    """
    with warnings.catch_warnings(record=True) as doubted:
        warnings.simplefilter("always", ConfigWarning)
        well = _all_well(_files(configs)) if configs else _installation()
    for doubt in doubted:
        warnings.showwarning(doubt.message, doubt.category, doubt.filename, doubt.lineno)
    if not well:
        return 2
    return common.WITH_FINDINGS if any(one.category is ConfigWarning for one in doubted) else 0


def _installation() -> bool:
    click.echo(f"{'version':<13} {package_version()}")
    click.echo(f"{'python':<13} {platform.python_version()}")
    if not _all_well({"kernels": _kernels, "share": lambda: str(share_directory())}):
        return False  # the rest needs them
    from leg_wear_monitor.mechanism.loader import shipped_mechanisms
    from leg_wear_monitor.monitor.config.parameters import shipped_config

    shipped = {"monitor.yaml": partial(_parameters, str(shipped_config()))}
    return _all_well({name: partial(_first_line, name) for name in shipped_mechanisms()} | shipped)


def _all_well(parts: Mapping[str, Callable[[], str]]) -> bool:
    """Print each part's description, and its faults on stderr."""
    well = True
    for name, part in parts.items():
        try:
            with extras_hinted():
                click.echo(f"{name:<13} {part()}")
        except LegWearError as error:
            click.echo(f"error: {error}", err=True)
            well = False
    return well


def _kernels() -> str:
    from leg_wear_monitor.compiled.kernel import cache_directory, shipped_directory

    place = cache_directory()
    if place is not None and shipped_directory(place.name):
        return "compiled in the package"
    if place is None:
        return "compiled at every start, because no directory for compiled code is private"
    common.check_directory("NUMBA_CACHE_DIR", place)
    return f"compiled once, in {place}"


def _files(names: tuple[str, ...]) -> Mapping[str, Callable[[], str]]:
    from leg_wear_monitor.recordings.findings import is_table_name

    files, parameters = {}, None
    for name in names:
        is_table = is_table_name(name)
        files[name] = partial(_table, name, parameters) if is_table else partial(_file, name)
        parameters = name if name.endswith((".yaml", ".yml")) else parameters
    return files


def _table(name: str, parameters: str | None) -> str:
    """Read a table, and describe how it was interpreted."""
    from leg_wear_monitor.monitor.config.parameters import config_from, load_config
    from leg_wear_monitor.recordings.findings import Severity
    from leg_wear_monitor.recordings.table_proposal import propose, understood

    proposal = None if parameters else propose(Path(name))
    if proposal and proposal.missing:
        click.echo(proposal.text)
        fault = f"no column is recognised. Complete the parameters above. Expected one of: {proposal.columns}"
        raise ConfigError(name, " and ".join(proposal.missing), fault)
    config = config_from(proposal.values) if proposal else load_config(parameters)
    lines, findings = understood(Path(name), config)
    for finding in findings:
        if finding.weight is Severity.LOSS:
            warnings.warn(str(finding), ConfigWarning, stacklevel=2)
        else:
            lines.append(f"note: {finding.text}")
    text = f"\n{'':13} ".join(lines)
    return (
        f"{text}\nread with these parameters. Copy them to start.yaml:\n{proposal.text}" if proposal else text
    )


def _file(name: str) -> str:
    """Check a file according to its kind."""
    from leg_wear_monitor.mechanism.loader import is_file_name, read_yaml
    from leg_wear_monitor.monitor.config.parameters import is_parameter_file, monitors_of

    if name.endswith((".mcap", ".db3")):
        raise ConfigError(
            name, "", f"a recording. Expected a configuration. Run: leg-wear-monitor replay {name}"
        )
    document = read_yaml(Path(name), name) if is_file_name(name) else None
    if is_parameter_file(document):
        nodes = monitors_of(document)
        if len(nodes) <= 1:
            return _parameters(name, *nodes)
        return f"\n{'':13} ".join(f"{node}: {_parameters(name, node)}" for node in nodes)
    from leg_wear_monitor.fleet.description import is_fleet_file

    return _fleet(name) if is_fleet_file(document) else _mechanism(name)


def _fleet(path: str) -> str:
    """Read the description of a fleet, and describe how it was interpreted."""
    from leg_wear_monitor.fleet.description import load_fleet, understood

    fleet = load_fleet(path)
    for file in dict.fromkeys(leg.config_file for leg in fleet.legs if leg.config_file):
        click.echo(f"{file.name:<13} {_parameters(str(file))}")
    return f"\n{'':13} ".join(understood(fleet))


def _parameters(path: str, node: str | None = None) -> str:
    """Read the monitor's parameters, and list their values."""
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.config.fitting import fitted, parameter_doubts, twin_settings
    from leg_wear_monitor.monitor.config.parameters import load_config

    config = load_config(path, node)
    if node:
        config = config.on_node(node)
    leg = fitted(load_mechanism(config.mechanism), config, path)
    twin_settings(config, path)
    common.warn_of(path, parameter_doubts(config, leg))
    text = (
        f"parameters of the monitor: {config.mechanism}, clearance joints {', '.join(leg.clearance_joints)}, "
        f"{config.cadence.commanded_rpm:g} rpm, hardware {config.hardware}"
    )
    if config.diagnosis.reference:
        from leg_wear_monitor.monitor.diagnosis.reference_file import read_references

        known = read_references(Path(config.diagnosis.reference), leg)
        at = {f"{one.profile.cadence_rpm:.3g}": None for one in known}
        text += f", references at {', '.join(at)} rpm"
    return text + _drive(config.drive, path)


def _drive(parameters: "DriveParameters", path: str) -> str:
    """The declared values of the drive, on a separate line; empty if none is declared."""
    from leg_wear_monitor.monitor.config.settings import drive_figures

    declared = drive_figures(parameters, path).declared
    if not (declared or parameters.type):
        return ""
    known = [f"{name} {value:.4g}" for name, value in declared.items()]
    drive = f"\n{'':13} drive {parameters.type}".rstrip()
    return f"{drive}, at the crank: {', '.join(known) or 'no value is declared'}; the rest is estimated"


def _first_line(name: str) -> str:
    return _mechanism(name).splitlines()[0]


def _mechanism(name: str) -> str:
    """Load, assemble and turn a mechanism, and describe it."""
    from leg_wear_monitor.mechanism.loader import doubts, load_mechanism, understood

    leg = load_mechanism(name)
    with common.compilation():
        from leg_wear_monitor.contact.geometry import conformity_doubts
        from leg_wear_monitor.dynamics.simulation import prepare

        linkage = prepare(leg).linkage
    common.warn_of(leg.source, (*doubts(leg), *conformity_doubts(linkage)))
    what = (
        f"{len(leg.bodies)} moving bodies, {len(leg.joints)} joints "
        f"(clearance joints {', '.join(leg.clearance_joints) or 'none'}), mobility 1, closes, and the crank "
        "turns through"
    )
    return "\n".join([what, *(f"{'':13} {statement}" for statement in understood(linkage))])


# ``leg-wear-monitor drives``, ``leg-wear-monitor materials``: files of the package with sourced values.


@click.command(short_help="List the known drives, or show one with its sources.")
@click.argument("name", required=False)
@common.json_option("the drives")
def drives(name: str | None, json_file: Path | None) -> None:
    """List the drives that the parameter drive.type can name, or print the file of one of them.

    NAME is a drive of the list, or a file such as ./my_drive.yaml.
    """
    from leg_wear_monitor.mechanism import materials as loader

    _show("drives", loader.drives(), loader.load_drive, name, json_file)


@click.command(short_help="List the known material pairs, or show one with its sources.")
@click.argument("name", required=False)
@common.json_option("the pairs")
def materials(name: str | None, json_file: Path | None) -> None:
    """List the material pairs that a joint can name, or print the file of one of them.

    NAME is a pair of the list, or a file such as ./my_pair.yaml.
    """
    from leg_wear_monitor.mechanism import materials as loader

    _show("materials", loader.materials(), loader.load_material, name, json_file)


def _show(
    kind: str, files: Mapping[str, Path], load: Callable[[str], Any], name: str | None, json_file: Path | None
) -> None:
    """Print a title per file, or the text of one file; write the values."""
    common.check_outputs(json_file, None)
    known = [load(each) for each in ([name] if name is not None else files)]
    document = {"schema_version": 1, kind: [one.to_dict() for one in known]}
    written = common.write_json(json_file, json_text(document))
    lines = [f"{one.name}: {one.title}" for one in known]
    if name is not None:
        lines = Path(files.get(name, name)).read_text(encoding="utf-8").splitlines()
    common.say(json_file, lines, written)


# ``leg-wear-monitor cache``: compiled code on this machine.


@click.command(short_help="Show, fill or remove the compiled code on this machine.")
@common.flag("--fill", "Compile the kernels now instead of at the first start: about two minutes.")
@common.flag("--clear", "Remove the compiled code; the next start compiles it again.")
def cache(fill: bool, clear: bool) -> None:
    """Show the directory and the size of the compiled code, remove it, or compile it ahead of time.

    After `--fill`, the first simulation, replay and start of a node do not compile anything.

    Each change of the source makes a new version. Old versions are kept until `--clear`.
    """
    from leg_wear_monitor.compiled.cache import kept_directories
    from leg_wear_monitor.compiled.kernel import cache_directory

    if fill and clear:
        raise click.UsageError("--fill and --clear cannot be combined")
    here = cache_directory()
    if here is None:
        raise LegWearError("no directory is safe for compiled code, so it is not stored")
    if fill:
        from leg_wear_monitor.cli import kernels

        kernels.compile_all(common.progress_bar("compiling numerical kernels (once per installation)"))
    kept = kept_directories(here.parent)
    click.echo(f"place: {here.parent}")
    if clear:
        size = sum(map(_size, kept))
        for directory in kept:
            shutil.rmtree(directory, ignore_errors=True)
        left = [each for each in kept if each.exists()]
        if left:
            raise LegWearError(f"{left[0]} and {len(left) - 1} more could not be removed")
        click.echo(f"removed: {_in_mb(size)} in {len(kept)} directories")
        return
    click.echo(f"total: {_in_mb(sum(map(_size, kept)))} in {len(kept)} directories")


def _size(directory: Path) -> int:
    return sum(file.stat().st_size for file in directory.rglob("*") if file.is_file())


def _in_mb(size: int) -> str:
    return f"{size / 1e6:.1f} MB"
