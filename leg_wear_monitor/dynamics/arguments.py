"""Checks of the arguments of library functions; an invalid one raises an error of one line."""

from collections.abc import Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import numpy as np

from leg_wear_monitor.configuration.nearest import did_you_mean
from leg_wear_monitor.configuration.strict import shown
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.spec import Mechanism

_KINDS: dict[str, tuple[Any, str]] = {
    "trace": (Integral, "a whole number"),
    "intervals": (Integral, "a whole number"),
    "wear": (bool, "true or false"),
}


def given_mechanism(mechanism: Mechanism | str | Path) -> Mechanism:
    """The given mechanism, or the one of a name or a file.

    Raises
    ------
    ConfigError
        If the argument is of another type, or the file is invalid.
    """
    if isinstance(mechanism, Mechanism):
        return mechanism
    if isinstance(mechanism, str | Path):
        return load_mechanism(mechanism)
    raise ConfigError("mechanism", "", f"{shown(mechanism)} is not a Mechanism, a name or a file")


def given_joints(names: Sequence[str], mechanism: Mechanism) -> tuple[str, ...]:
    """Names of the clearance joints as a tuple, checked.

    Raises
    ------
    ConfigError
        If a name is unknown or occurs twice, or for a text in place of a list: ``"AB"`` would be two joints.
    """
    if isinstance(names, str):
        raise ConfigError("clearances", "", f"{shown(names)} is a text, expected a list of names")
    try:
        clearance_joints = tuple(names)
    except TypeError as error:
        raise ConfigError("clearances", "", f"{shown(names)} is not a list of names") from error
    for name in clearance_joints:
        if not isinstance(name, str):
            raise ConfigError("clearances", "", f"{shown(name)} is not the name of a joint")
        if name not in mechanism.clearances:
            ready = ", ".join(mechanism.clearances) or "none"
            raise ConfigError(
                "clearances",
                "",
                f"{name!r} has no clearance settings in {mechanism.source}, expected some of: {ready}"
                + did_you_mean(name, mechanism.clearances),
            )
    if len(set(clearance_joints)) < len(clearance_joints):
        raise ConfigError("clearances", "", f"{','.join(clearance_joints)!r} names a joint twice")
    return clearance_joints


def check_kinds(**values: object) -> None:
    """Check the types: ``trace`` and ``intervals`` are integers, ``wear`` is a bool, all others are numbers.

    None is allowed except for ``cycles``; it selects the default.

    Raises
    ------
    ConfigError
        Names the argument as the command line does.
    """
    for name, value in values.items():
        kinds, what = _KINDS.get(name, (Real, "a number"))
        is_flag = isinstance(value, bool | np.bool_)
        if value is None and name != "cycles":
            continue
        if not (is_flag if name == "wear" else isinstance(value, kinds) and not is_flag):
            option = name.removesuffix("_s").replace("_", "-")
            raise ConfigError(option, "", f"{shown(value)} is not {what}")
