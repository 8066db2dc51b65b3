"""What callers of the library give: used as it is, or refused in one line."""

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
    "wear": (bool, "true or false"),
}


def given_mechanism(mechanism: Mechanism | str | Path) -> Mechanism:
    """A mechanism, or the one of a name or a file.

    Raises
    ------
    ConfigError
    """
    if isinstance(mechanism, Mechanism):
        return mechanism
    if isinstance(mechanism, str | Path):
        return load_mechanism(mechanism)
    raise ConfigError("mechanism", "", f"{shown(mechanism)} is not a Mechanism, a name or a file")


def given_joints(names: Sequence[str], mechanism: Mechanism) -> tuple[str, ...]:
    """Names of the clearance joints, each once.

    Raises
    ------
    ConfigError
        A text is not a list of names: ``"AB"`` would be two joints.
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
    """Make sure that arguments are what they should be: ``trace`` whole, ``wear`` a flag, others numbers.

    Raises
    ------
    ConfigError
        Naming the argument as the command line does. None stands for a default, but for ``cycles``.
    """
    for name, value in values.items():
        kinds, what = _KINDS.get(name, (Real, "a number"))
        is_flag = isinstance(value, bool | np.bool_)
        if value is None and name != "cycles":
            continue
        if not (is_flag if name == "wear" else isinstance(value, kinds) and not is_flag):
            option = name.removesuffix("_s").replace("_", "-")
            raise ConfigError(option, "", f"{shown(value)} is not {what}")
