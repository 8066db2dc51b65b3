"""Lives from files of ``leg-wear-monitor life --json``, each bound to the leg it was simulated for."""

import json
import reprlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.life.result import SCHEMA_VERSION
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.forecast.growth_law import GrowthLaw, SimulatedLife, fitted_law, no_law
from leg_wear_monitor.monitor.ledger.entry import fingerprint
from leg_wear_monitor.share import share_directory


def law_of(mechanism: Mechanism, path: str, sigma: float) -> GrowthLaw:
    """Law of growth of a leg.

    Parameters
    ----------
    mechanism : Mechanism
        As the configuration wants it.
    path : str
        A file of its lives. If empty, the one that comes with the package for just this leg; if there is
        none, growth stays as it is.
    sigma : float
        Standard deviation of what ln growth is off, where lives do not tell.

    Raises
    ------
    ConfigError
        If the file cannot be read, or is of another leg.
    """
    lives = read_lives(path, mechanism) if path else _shipped_lives(mechanism)
    if not lives:
        fresh = [mechanism.clearances[joint].radial_clearance for joint in mechanism.clearance_joints]
        return no_law(np.array(fresh), sigma)
    return fitted_law(lives, sigma)


def read_lives(path: str, mechanism: Mechanism) -> Sequence[SimulatedLife]:
    """Lives of a leg from their file, its joints in the mechanism's order.

    Raises
    ------
    ConfigError
        If it cannot be read, or is of another leg.
    """
    document = _document(path)
    own = fingerprint(mechanism)
    if document.get("fingerprint") != own:
        raise ConfigError(
            path,
            "fingerprint",
            f"{document.get('fingerprint')!r} is of another leg than this one, {own!r} (bodies, joints, or "
            "clearances when new); simulate its lives again with `leg-wear-monitor life --json`",
        )
    return _lives_in(document, path, mechanism)


def _shipped_lives(mechanism: Mechanism) -> Sequence[SimulatedLife]:
    """Lives that come with the package for just this leg; none if there are none."""
    own = fingerprint(mechanism)
    for file in sorted((share_directory() / "config" / "lives").glob("*.json")):
        document = _document(str(file))
        if document.get("fingerprint") == own:
            return _lives_in(document, str(file), mechanism)
    return ()


def _lives_in(document: dict[str, Any], path: str, mechanism: Mechanism) -> Sequence[SimulatedLife]:
    try:
        return [_life(each, mechanism.clearance_joints) for each in (document, *document["further"])]
    except (ValueError, KeyError, TypeError, OverflowError) as error:
        joints = ", ".join(mechanism.clearance_joints)
        raise ConfigError(
            path, "", f"is not a life of the joints {joints}, expected the output of `life --json`"
        ) from error


def _document(path: str) -> dict[str, Any]:
    try:
        document = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(path, "", f"cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise ConfigError(path, "", f"is not JSON: {' '.join(str(error).split())}") from error
    if not isinstance(document, dict):
        raise ConfigError(path, "", "is not a life, expected the output of `life --json`")
    version = document.get("schema_version", 1)
    if version != SCHEMA_VERSION:
        fault = f"{reprlib.repr(version)} is not {SCHEMA_VERSION}, the version that this program reads"
        raise ConfigError(path, "schema_version", f"{fault}; simulate the lives again")
    return document


def _life(record: dict[str, Any], clearance_joints: Sequence[str]) -> SimulatedLife:
    def columns(name: str) -> Any:
        return np.array(
            [_numbers(record["joints"][joint][name]) for joint in clearance_joints], dtype=float
        ).T

    life = SimulatedLife(
        factor=np.array(_numbers([record["wear_factor"][joint] for joint in clearance_joints]), dtype=float),
        cycles=np.array(_numbers(record["cycles"]), dtype=float),
        clearance_m=columns("clearance_m"),
        growth_m_per_cycle=columns("growth_m_per_cycle"),
    )
    shapes = {life.clearance_m.shape, life.growth_m_per_cycle.shape, (len(life.cycles), len(life.factor))}
    if len(shapes) > 1 or len(life.cycles) < 2 or not _can_be(life):
        raise ValueError("figures that do not fit together")
    return life


def _numbers(values: Any) -> list[float]:
    """A list of numbers as it is; numpy would take texts and flags for some."""
    if not isinstance(values, list) or not all(type(value) in (int, float) for value in values):
        raise ValueError("no list of numbers")
    return values


def _can_be(life: SimulatedLife) -> bool:
    """Whether the figures of a life can be those of one; NaN is within no bounds."""
    within = (
        (life.factor, 1.0e-9, 1.0e9),
        (life.cycles, 0.0, 1.0e30),
        (life.clearance_m, 1.0e-9, 1.0),
        (life.growth_m_per_cycle, 0.0, 1.0),
    )
    bounded = all(bool(((least <= values) & (values <= most)).all()) for values, least, most in within)
    return bounded and bool((np.diff(life.cycles) >= 0.0).all())
