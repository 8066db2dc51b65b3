"""Binding of a ledger to its hardware, mechanism and rate of wear."""

import hashlib
import json
from typing import Any

import attrs

from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.wear.surfaces import SECTORS

# fields of a mechanism that may change without a change of the worn parts
# (a person is in the masses of the bodies)
_FREE = ("name", "source", "drive", "loads", "clearance_joints", "clearances", "person_kg")
_FREE_OF_CLEARANCE = ("wear_coefficient", "material")  # what a pair gives is in the other settings
_LATER = ("film",)  # settings of later versions: absent, they leave the hash of an older leg as it was
_FREE_OF_JOINTS = ("label",)


def fingerprint(mechanism: Mechanism) -> str:
    """Hash of the bodies, joints, springs and clearance joints of a mechanism, 16 hexadecimal digits.

    The hash excludes names, labels and comments of the file, drive, loads and wear coefficients: with a
    better value of these, the same wear is continued.
    """
    fields = {field.name: getattr(mechanism, field.name) for field in attrs.fields(Mechanism)}
    parts = {name: _plain(value) for name, value in fields.items() if name not in _FREE}
    for joint in mechanism.clearance_joints:
        settings = attrs.asdict(mechanism.clearances[joint])
        parts[f"clearance {joint}"] = {
            name: _plain(value)
            for name, value in settings.items()
            if name not in _FREE_OF_CLEARANCE and not (name in _LATER and value is None)
        }
    text = json.dumps(parts, sort_keys=True, default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _plain(value: Any) -> Any:
    if attrs.has(type(value)):
        return attrs.asdict(value, filter=lambda field, _: field.name not in _FREE_OF_JOINTS)
    if isinstance(value, dict):
        return {name: _plain(entry) for name, entry in value.items()}
    return value


@attrs.frozen(kw_only=True)
class Binding:
    """Properties that must be equal for a ledger to be continued.

    Attributes
    ----------
    hardware_id : str
    mechanism : str
        Name of the mechanism, for messages.
    fingerprint : str
    joints : tuple of str
        The clearance joints.
    wear_acceleration : float
    sectors : int
        Number of sectors of each surface.
    """

    hardware_id: str
    mechanism: str
    fingerprint: str
    joints: tuple[str, ...]
    wear_acceleration: float = 1.0
    sectors: int = SECTORS

    def as_texts(self) -> dict[str, str]:
        """Texts as the ledger keeps them."""
        texts = {name: str(value) for name, value in attrs.asdict(self).items()}
        return texts | {"joints": ", ".join(sorted(self.joints))}


def binding_of(mechanism: Mechanism, config: MonitorConfig) -> Binding:
    """Binding of a mechanism that `fitted` returned."""
    return Binding(
        hardware_id=config.hardware,
        mechanism=mechanism.name,
        fingerprint=fingerprint(mechanism),
        joints=mechanism.clearance_joints,
        wear_acceleration=config.wear_acceleration,
    )
