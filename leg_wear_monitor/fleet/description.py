"""The description of a fleet: fleet.yaml, and the recordings and parameters that it names.

The parts: the result (`FleetDescription`), recordings by patterns, the keys of the file, and its reading.
"""

import glob
import hashlib
import heapq
import os
import re
import warnings
from collections.abc import Iterable
from itertools import groupby
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.bags.budget import DEFAULT_MB
from leg_wear_monitor.configuration import choice, described
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
        Name of the leg; its directories are named after it.
    lot : str
        Production lot of its joints; empty if unknown.
    config : MonitorConfig
        Parameters of its monitor.
    config_file : pathlib.Path or None
        File of these parameters; None for those of the package.
    recordings : tuple of pathlib.Path
        Recordings, sorted by name.
    home : pathlib.Path
        Directory of the description.
    row : str
        What a row of its table of cycles is: ``minute`` or ``cycle``.
    node, joint_states, drive_torque : str or None
        As in `leg_wear_monitor.replay`.
    learned_priors : str
        File with the priors of its wear coefficients that were learned from the fleet; empty if none.
    memory_mb : float
        Memory limit of reading, as in `leg_wear_monitor.replay` [10⁶ bytes].
    sample : float, optional
        Fraction of the gait cycles that are followed, as in `leg_wear_monitor.replay`.
    """

    id: str
    lot: str
    config: MonitorConfig
    recordings: tuple[Path, ...]
    home: Path
    row: str
    node: str | None
    joint_states: str | None
    drive_torque: str | None
    learned_priors: str = ""
    memory_mb: float = DEFAULT_MB
    sample: float | None = None
    config_file: Path | None = None

    def shown(self, recording: Path) -> str:
        """Printable name of a recording in tables; relative to `home` if it is below it."""
        is_below = recording.is_relative_to(self.home)
        return printable(str(recording.relative_to(self.home) if is_below else recording))

    def with_priors(self, file: Path) -> "FleetLeg":
        """The leg with priors learned from its fleet, unless its parameters name a file of priors."""
        if self.config.forecast.priors or self.learned_priors:
            return self
        return attrs.evolve(self, learned_priors=str(file))

    @property
    def used_config(self) -> MonitorConfig:
        """Parameters of its monitor, with the learned priors."""
        if not self.learned_priors:
            return self.config
        forecast = attrs.evolve(self.config.forecast, priors=self.learned_priors)
        return attrs.evolve(self.config, forecast=forecast)

    @property
    def settings(self) -> str:
        """Digest of all settings that decide whether a recording can be read and fits the leg."""
        parts: tuple[object, ...] = (self.config, self.node, self.joint_states, self.drive_torque)
        parts += () if self.memory_mb == DEFAULT_MB else (self.memory_mb,)
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:20]


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


# Recordings by patterns: as `glob`, but safe with links that lead back.


def recordings_of(home: Path, pattern: str) -> list[Path]:
    """Recordings that a pattern matches.

    Parameters
    ----------
    home : pathlib.Path
        Directory that a relative pattern starts at.
    pattern : str
        Without wildcards, the path itself, if it exists. With wildcards, only recordings match: files by
        their name, and bag directories; files in a matching bag directory are part of it. Below ``**``, links
        are followed, and each directory counts once.
    """
    if not glob.has_magic(pattern):
        path = home / pattern
        return [path] if path.exists() else []
    from leg_wear_monitor.bags.bag import is_bag_directory, is_recording_name

    found = _matches(home, pattern)
    bags = {path for path in found if path.is_dir() and is_bag_directory(path)}
    files = {path for path in found if is_recording_name(path) and path.is_file()}
    return sorted(bags | {path for path in files if path.parent not in bags})


def _matches(home: Path, pattern: str) -> set[Path]:
    """Files and directories that match, as with `glob`; but links that lead back do not make it endless."""
    found = {Path("/") if pattern.startswith("/") else home}
    is_recursive = False
    for is_recursive, parts in groupby(pattern.lstrip("/").split("/"), "**".__eq__):
        found = _all_directories(found) if is_recursive else _glob_in(found, "/".join(parts))
    return found | {path for path in _glob_in(found, "*") if not path.is_dir()} if is_recursive else found


def _glob_in(directories: Iterable[Path], pattern: str) -> set[Path]:
    """Matches of a pattern without ``**`` in some directories."""
    places = (os.path.join(glob.escape(str(each)), pattern) for each in directories)
    return {Path(name) for place in places for name in glob.glob(place)}


def _all_directories(tops: Iterable[Path]) -> set[Path]:
    """Directories and all below them, without hidden ones.

    A directory that several paths lead to is in the result once, by the path with the fewest links: the queue
    returns paths in this order, and a directory is known by its device and inode.
    """
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
        except OSError:  # not readable: skipped, as by `glob`
            continue
    return set(found.values())


# The keys of fleet.yaml.


Patterns = str | tuple[str, ...]

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")


def _name_fault(name: str) -> str | None:
    """Why a leg cannot have this name; None if it can."""
    if _NAME.fullmatch(name):
        return None
    return f"{name!r} is no name for a directory, expected up to 100 letters, digits, '.', '_' or '-'"


def _patterns_fault(patterns: Patterns) -> str | None:
    """Why these patterns cannot be used; None if they can."""
    return None if patterns and all(listed(patterns)) else "has an empty pattern, expected files"


def listed(patterns: Patterns) -> tuple[str, ...]:
    """Patterns as a tuple, also if there is only one."""
    return (patterns,) if isinstance(patterns, str) else patterns


# in the file, a list or a single pattern
choose(Patterns, lambda value: (tuple[str, ...] if isinstance(value, list) else str, value))


@attrs.frozen(kw_only=True)
class Defaults:
    """Values for legs that have none of their own."""

    config: str = described("parameter file of the monitor; empty: the one of the package", default="")


@attrs.frozen(kw_only=True)
class LegEntry:
    """Keys of one leg."""

    id: str = described("name of the leg; its directories are named after it", check=_name_fault)
    recordings: Patterns = described(
        "recordings: a file, a bag directory, a pattern with * or **, or a list of these",
        check=_patterns_fault,
    )
    config: str = described("parameter file of the monitor; empty: that of the defaults", default="")
    lot: str = described("production lot of its joints", default="")
    node: str = described(
        "full name of the node whose parameters apply; empty: beside the crank's topic", default=""
    )
    joint_states: str = described("topic of the crank; empty: found by its name", default="")
    drive_torque: str = described("topic of the drive torque; empty: found by its name", default="")


@attrs.frozen(kw_only=True)
class FleetFile:
    """All keys of the file."""

    defaults: Defaults = described("values for legs that have none of their own", factory=Defaults)
    out: str = described("directory of the fleet, unless a command has another one", default="fleet")
    row: str = choice(("minute", "cycle"), "what a row of the cycles' table is", default="minute")
    legs: tuple[LegEntry, ...] = described(
        "the legs", check=lambda legs: None if legs else "is empty, expected at least one leg"
    )


# Reading of fleet.yaml, with checks across its legs.


def is_fleet_file(document: Any) -> bool:
    """Whether the content of a YAML file is the description of a fleet, and not a mechanism."""
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
        Naming file, key, value and what was expected.

    Warns
    -----
    ConfigWarning
        For each pattern that matches no recording, and for accelerated wear.
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
        leg = _fleet_leg(entry, configs[name, entry.node], file.row, home, source)
        legs.append(attrs.evolve(leg, config_file=home / name if name else None))
    _check_recordings(legs, source)
    return FleetDescription(path=Path(path), out=home / file.out, legs=tuple(legs))


def fleet_directory(path: str | Path) -> Path:
    """Directory of a fleet, from this directory itself or from the description."""
    if Path(path).is_dir():
        return Path(path)
    file: FleetFile = structure(read_yaml(Path(path), str(path)), FleetFile, str(path), "")
    return Path(path).resolve().parent / file.out


def _fleet_leg(entry: LegEntry, config: MonitorConfig, row: str, home: Path, source: str) -> FleetLeg:
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
        lot=entry.lot,
        config=attrs.evolve(config, hardware_id=config.hardware_id or entry.id),
        recordings=tuple(sorted(recordings)),
        home=home,
        row=row,
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
        text = f"{home / name}: {doubt}; legs with it are not ranked, and others learn nothing from them"
        warnings.warn(text, ConfigWarning, stacklevel=3)
    return config


def _check_names(legs: Iterable[LegEntry], source: str) -> None:
    """Refuse two legs with the same name, or with names that differ in case only: both name directories."""
    known: dict[str, str] = {}
    for leg in legs:
        if leg.id.casefold() in known:
            other = known[leg.id.casefold()]
            raise ConfigError(source, "legs", f"the id {leg.id} is given twice, first as {other}")
        known[leg.id.casefold()] = leg.id


def _check_recordings(legs: Iterable[FleetLeg], source: str) -> None:
    """Refuse a recording that two legs share, unless each leg has a topic of its own in it."""
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
