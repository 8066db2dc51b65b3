"""Reads fleet.yaml, and finds the recordings and parameters that it names."""

import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.errors import ConfigError, ConfigWarning
from leg_wear_monitor.fleet.description.fleet_description import FleetDescription, FleetLeg
from leg_wear_monitor.fleet.description.patterns import recordings_of
from leg_wear_monitor.fleet.description.spec import FleetFile, LegEntry, listed
from leg_wear_monitor.mechanism.loader import is_file_name, load_mechanism, read_yaml
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.parameter_file import load_config
from leg_wear_monitor.monitor.config.plausible import acceleration_doubts
from leg_wear_monitor.monitor.config.settings import MonitorConfig


def is_fleet_file(document: Any) -> bool:
    """Whether the content of a YAML file is meant as the description of a fleet."""
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
            configs[name, entry.node] = _config(home, name, entry.node, source)
        leg = _leg(entry, configs[name, entry.node], file.row, home, source)
        legs.append(attrs.evolve(leg, config_file=home / name if name else None))
    _check_recordings(legs, source)
    return FleetDescription(path=Path(path), out=home / file.out, legs=tuple(legs))


def fleet_directory(path: str | Path) -> Path:
    """Directory of a fleet, given itself or the description of the fleet."""
    if Path(path).is_dir():
        return Path(path)
    file: FleetFile = structure(read_yaml(Path(path), str(path)), FleetFile, str(path), "")
    return Path(path).resolve().parent / file.out


def _leg(entry: LegEntry, config: MonitorConfig, row: str, home: Path, source: str) -> FleetLeg:
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


def _config(home: Path, name: str, node: str, source: str) -> MonitorConfig:
    """Parameters in a file, checked against their mechanism; paths in them become absolute."""
    config = load_config(home / name if name else None, node or None)
    if is_file_name(Path(config.mechanism)):
        config = attrs.evolve(config, mechanism=str(Path(config.mechanism).absolute()))
    if config.diagnosis.reference:
        path = str(Path(config.diagnosis.reference).absolute())
        config = attrs.evolve(config, diagnosis=attrs.evolve(config.diagnosis, reference=path))
    fitted(load_mechanism(config.mechanism), config)
    for doubt in acceleration_doubts(config, most=1.0):
        text = f"{home / name}: {doubt}; legs with it are not ranked, and others learn nothing from them"
        warnings.warn(text, ConfigWarning, stacklevel=3)
    return config


def _check_names(legs: Iterable[LegEntry], source: str) -> None:
    """Refuse two legs with one name, also where a file system does not tell them apart."""
    known: dict[str, str] = {}
    for leg in legs:
        if leg.id.casefold() in known:
            other = known[leg.id.casefold()]
            raise ConfigError(source, "legs", f"the id {leg.id} is given twice, first as {other}")
        known[leg.id.casefold()] = leg.id


def _check_recordings(legs: Iterable[FleetLeg], source: str) -> None:
    """Refuse a recording of two legs, unless the legs have a topic each in it."""
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
