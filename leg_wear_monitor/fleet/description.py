"""The description of a fleet: fleet.yaml, and the recordings and parameters that it names."""

import glob
import hashlib
import re
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.configuration import described
from leg_wear_monitor.configuration.strict import choose, structure
from leg_wear_monitor.errors import ConfigError, ConfigWarning, printable
from leg_wear_monitor.mechanism.loader import is_file_name, load_mechanism, read_yaml
from leg_wear_monitor.monitor.config.fitting import acceleration_doubts, fitted
from leg_wear_monitor.monitor.config.parameters import load_config
from leg_wear_monitor.monitor.config.settings import MonitorConfig

# The result: the legs of a fleet with their recordings and parameters.


@attrs.frozen(kw_only=True)
class FleetLeg:
    """A leg with its recordings and parameters.

    Attributes
    ----------
    id : str
        Name of the leg; its directory is named after it.
    config : MonitorConfig
        Parameters of its monitor.
    config_file : pathlib.Path or None
        File of these parameters; None for the parameters of the package.
    recordings : tuple of pathlib.Path
        Recordings, sorted by name.
    home : pathlib.Path
        Directory of the description.
    node, joint_states, drive_torque : str or None
        Same meaning as in `leg_wear_monitor.replay`.
    """

    id: str
    config: MonitorConfig
    config_file: Path | None = None
    recordings: tuple[Path, ...]
    home: Path
    node: str | None = None
    joint_states: str | None = None
    drive_torque: str | None = None

    def shown(self, recording: Path) -> str:
        """Printable name of a recording in tables; relative to `home` if it is below it."""
        is_below = recording.is_relative_to(self.home)
        return printable(str(recording.relative_to(self.home) if is_below else recording))

    @property
    def settings(self) -> str:
        """Digest of all settings that decide whether a recording can be read and fits the leg."""
        parts = (self.config, self.node, self.joint_states, self.drive_torque)
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:20]

    @property
    def acceleration_doubt(self) -> str:
        """One line if the wear of the leg is accelerated, as in a demonstration; empty otherwise."""
        return "; ".join(map(str, acceleration_doubts(self.config, most=1.0)))


@attrs.frozen(kw_only=True)
class FleetDescription:
    """A fleet as its description defines it.

    Attributes
    ----------
    path : pathlib.Path
        File of the description.
    out : pathlib.Path
        Directory of the fleet.
    legs : tuple of FleetLeg
        In the order of the file.
    """

    path: Path
    out: Path
    legs: tuple[FleetLeg, ...]


def recordings_of(home: Path, pattern: str) -> list[Path]:
    """Recordings that a pattern matches.

    Parameters
    ----------
    home : pathlib.Path
        Directory that a relative pattern starts at.
    pattern : str
        Without wildcards, the path itself, if it exists. With wildcards, only recordings match: files by
        their name, and bag directories. Files in a matching bag directory are part of it.
    """
    if not glob.has_magic(pattern):
        path = home / pattern
        return [path] if path.exists() else []
    from leg_wear_monitor.recordings.bag import is_bag_directory, is_recording_name

    found = {home / name for name in glob.glob(pattern, root_dir=home, recursive=True)}
    bags = {path for path in found if path.is_dir() and is_bag_directory(path)}
    files = {path for path in found if is_recording_name(path) and path.is_file()}
    return sorted(bags | {path for path in files if path.parent not in bags})


# The keys of fleet.yaml.


Patterns = str | tuple[str, ...]

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")


def _name_fault(name: str) -> str | None:
    """Why a leg cannot have this name; None if it can."""
    if _NAME.fullmatch(name):
        return None
    return f"{name!r} is not a name for a directory. Expected up to 100 letters, digits, '.', '_' or '-'"


def _patterns_fault(patterns: Patterns) -> str | None:
    """Why these patterns cannot be used; None if they can."""
    return None if patterns and all(listed(patterns)) else "has an empty pattern. Expected files"


def listed(patterns: Patterns) -> tuple[str, ...]:
    """Patterns as a tuple, also if there is only one."""
    return (patterns,) if isinstance(patterns, str) else patterns


# in the file, a list or a single pattern
choose(Patterns, lambda value: (tuple[str, ...] if isinstance(value, list) else str, value))


@attrs.frozen(kw_only=True)
class Defaults:
    """Values for legs without their own values."""

    config: str = described("parameter file of the monitor; if empty, the package's parameters", default="")


@attrs.frozen(kw_only=True)
class LegEntry:
    """Keys of one leg."""

    id: str = described("name of the leg; its directory is named after it", check=_name_fault)
    recordings: Patterns = described(
        "recordings: a file, a bag directory, a pattern with * or **, or a list of these",
        check=_patterns_fault,
    )
    config: str = described("parameter file of the monitor; if empty, the file of the defaults", default="")
    node: str = described(
        "full name of the node whose parameters apply; if empty, the node in the namespace of the crank's "
        "topic",
        default="",
    )
    joint_states: str = described("topic of the crank; if empty, it is found by its name", default="")
    drive_torque: str = described("topic of the drive torque; if empty, it is found by its name", default="")


@attrs.frozen(kw_only=True)
class FleetFile:
    """All keys of the file."""

    defaults: Defaults = described("values for legs without their own values", factory=Defaults)
    out: str = described("directory of the fleet; --out overrides it", default="fleet")
    legs: tuple[LegEntry, ...] = described(
        "the legs", check=lambda legs: None if legs else "is empty. Expected at least one leg"
    )


# Reading of fleet.yaml, with checks across its legs.


def is_fleet_file(document: Any) -> bool:
    """True if the content of a YAML file is the description of a fleet, and not a mechanism."""
    return isinstance(document, dict) and ("legs" in document or "defaults" in document)


def load_fleet(path: str | Path) -> FleetDescription:
    """Read the description of a fleet.

    Parameters
    ----------
    path : str or pathlib.Path
        File; paths in it are relative to its directory.

    Raises
    ------
    ConfigError
        Names file, key, value and the expected value.

    Warns
    -----
    ConfigWarning
        If a pattern matches no recording, or wear is accelerated.
    """
    source, home = str(path), Path(path).resolve().parent
    file: FleetFile = structure(read_yaml(Path(path), source), FleetFile, source, "")
    _check_names(file.legs, source)
    configs: dict[tuple[str, str], MonitorConfig] = {}
    legs = []
    for entry in file.legs:
        name = entry.config or file.defaults.config
        if (name, entry.node) not in configs:
            configs[name, entry.node] = _load_parameters(home, name, entry.node, source)
        leg = _fleet_leg(entry, configs[name, entry.node], home, source)
        legs.append(attrs.evolve(leg, config_file=home / name if name else None))
    _check_recordings(legs, source)
    return FleetDescription(path=Path(path), out=home / file.out, legs=tuple(legs))


def fleet_directory(path: str | Path) -> Path:
    """Directory of a fleet, from this directory itself or from the description."""
    if Path(path).is_dir():
        return Path(path)
    file: FleetFile = structure(read_yaml(Path(path), str(path)), FleetFile, str(path), "")
    return Path(path).resolve().parent / file.out


def understood(fleet: FleetDescription) -> list[str]:
    """Summary of a description, one line per leg; recordings are not opened."""
    number = sum(len(leg.recordings) for leg in fleet.legs)
    lines = [
        f"fleet of {_count_of(len(fleet.legs), 'leg')}, {_count_of(number, 'recording')}, in {fleet.out}"
    ]
    for leg in fleet.legs:
        parts = [_count_of(len(leg.recordings), "recording")]
        parts.append(f"parameters {leg.config_file.name if leg.config_file else 'of the package'}")
        if leg.config.hardware != leg.id:
            parts.append(f"hardware {leg.config.hardware}")
        lines.append(f"{leg.id}: {'; '.join(parts)}")
    return lines


def _count_of(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _fleet_leg(entry: LegEntry, config: MonitorConfig, home: Path, source: str) -> FleetLeg:
    """Leg of an entry; warns of patterns that match nothing."""
    recordings: dict[Path, None] = {}
    for pattern in listed(entry.recordings):
        found = recordings_of(home, pattern)
        recordings |= dict.fromkeys(found)
        if not found:
            text = f"{source}: legs.{entry.id}.recordings: {pattern} matches no recording"
            warnings.warn(text, ConfigWarning, stacklevel=3)
    return FleetLeg(
        id=entry.id,
        config=attrs.evolve(config, hardware_id=config.hardware_id or entry.id),
        recordings=tuple(sorted(recordings)),
        home=home,
        node=entry.node or None,
        joint_states=entry.joint_states or None,
        drive_torque=entry.drive_torque or None,
    )


def _load_parameters(home: Path, name: str, node: str, source: str) -> MonitorConfig:
    """Parameters in a file, checked against their mechanism; paths in them become absolute."""
    config = load_config(home / name if name else None, node or None)
    if is_file_name(Path(config.mechanism)):
        config = attrs.evolve(config, mechanism=str(Path(config.mechanism).absolute()))
    if config.diagnosis.reference:
        path = str(Path(config.diagnosis.reference).absolute())
        config = attrs.evolve(config, diagnosis=attrs.evolve(config.diagnosis, reference=path))
    fitted(load_mechanism(config.mechanism), config)  # raises if they do not fit
    for doubt in acceleration_doubts(config, most=1.0):
        warnings.warn(f"{home / name}: {doubt}", ConfigWarning, stacklevel=3)
    return config


def _check_names(legs: Iterable[LegEntry], source: str) -> None:
    """Refuse two legs with the same name, or with names that differ in case only: both name directories."""
    known: dict[str, str] = {}
    for leg in legs:
        if leg.id.casefold() in known:
            other = known[leg.id.casefold()]
            raise ConfigError(source, "legs", f"the id {leg.id} occurs twice, first as {other}")
        known[leg.id.casefold()] = leg.id


def _check_recordings(legs: Iterable[FleetLeg], source: str) -> None:
    """Refuse a recording of two legs, unless each leg names its own topic in it."""
    owners: dict[Path, list[FleetLeg]] = {}
    for leg in legs:
        for path in leg.recordings:
            others = owners.setdefault(path.resolve(), [])
            for other in others:
                if not leg.joint_states or not other.joint_states or leg.joint_states == other.joint_states:
                    fault = (
                        f"{leg.shown(path)} is a recording of the leg {other.id} already; "
                        "if it contains both legs, set joint_states of each"
                    )
                    raise ConfigError(source, f"legs.{leg.id}.recordings", fault)
            others.append(leg)
