"""Result of commissioning: each parameter with its runner-up, the undetermined ones, what does not fit."""

import math
from typing import TYPE_CHECKING, Any

import attrs

from leg_wear_monitor.bags.findings import Finding
from leg_wear_monitor.commissioning.result.joint_detection import JointDetection, judgement
from leg_wear_monitor.commissioning.result.parameter_text import parameter_text
from leg_wear_monitor.data_frame import data_frame
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.json_text import json_text
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.twin.reference.torque_reference import TorqueReference

if TYPE_CHECKING:
    import pandas as pd

SCHEMA_VERSION = 1


@attrs.frozen(kw_only=True)
class CommissioningItem:
    """A quantity that commissioning determines.

    Attributes
    ----------
    name : str
        A parameter of the monitor, or another measured quantity.
    value : str, int or float
        NaN if it cannot be determined.
    unit : str
        Unit of the value; empty for a name or a ratio.
    sigma : float, optional
        Standard deviation, in the unit.
    mismatch : float, optional
        RMS of the torque that this leaves unexplained, as a fraction of the torque's.
    other : str, int, float or None
        The runner-up.
    other_mismatch : float, optional
        Its mismatch.
    remark : str
        Further information.
    better : str
        How it could be known better; empty if it need not be.
    """

    name: str
    value: str | int | float
    unit: str = ""
    sigma: float | None = None
    mismatch: float | None = None
    other: str | int | float | None = None
    other_mismatch: float | None = None
    remark: str = ""
    better: str = ""


@attrs.frozen(kw_only=True)
class CommissioningResult:
    """Result of commissioning.

    Attributes
    ----------
    items : tuple of CommissioningItem
        The quantities, one by one.
    not_told : tuple of str
        Parameters that the recording does not determine, and why.
    findings : tuple of str
        What does not fit, and the remedy.
    notes : tuple of str
        Further information.
    config : MonitorConfig or None
        The proposed parameters; None if a choice between alternatives is not certain.
    turns : float
        Turns of the crank in the recording.
    faults : tuple of Finding
        Of the recordings, whose other parts were used.
    joints : tuple of JointDetection
        What the torque will show of each joint; empty where that is not known.
    reference_used : str
        Torque reference by which the joints are judged, or why they are not.
    reference : TorqueReference or None
        The one that was simulated for ``diagnosis.reference``, if it was asked for.
    """

    items: tuple[CommissioningItem, ...]
    not_told: tuple[str, ...]
    findings: tuple[str, ...]
    notes: tuple[str, ...]
    config: MonitorConfig | None
    turns: float
    faults: tuple[Finding, ...] = ()
    joints: tuple[JointDetection, ...] = ()
    reference_used: str = ""
    reference: TorqueReference | None = None

    @property
    def is_sure(self) -> bool:
        """Whether every parameter was determined, and everything fits."""
        return self.config is not None and not self.not_told and not self.findings

    @property
    def judgement(self) -> str:
        """For which joints the torque is good enough, in a sentence; empty where that is not known."""
        return judgement(self.joints)

    def item(self, name: str) -> CommissioningItem:
        """The item of a name; raises KeyError if there is none."""
        return {each.name: each for each in self.items}[name]

    def to_dict(self) -> dict[str, Any]:
        """Plain object for JSON; null for what cannot be determined."""
        return {
            "schema_version": SCHEMA_VERSION,
            "turns": self.turns,
            "is_sure": self.is_sure,
            "items": [_document(each) for each in self.items],
            "not_enough_to_tell": list(self.not_told),
            "findings": list(self.findings),
            "notes": list(self.notes),
            "joints": [_document(each) for each in self.joints],
            "judgement": self.judgement,
            "reference_used": self.reference_used,
        }

    def to_json(self) -> str:
        """Text of `to_dict`: what ``commission --json`` writes."""
        return json_text(self.to_dict())

    def to_pandas(self) -> "pd.DataFrame":
        """Table of the items, a row each.

        Raises
        ------
        LegWearError
            If pandas is not installed.
        """
        rows = [attrs.asdict(item) for item in self.items]
        columns = {key: [row[key] for row in rows] for key in rows[0]}
        return data_frame(columns, index="name")

    def to_yaml(self) -> str:
        """Parameter file of the monitor; uncertain parameters are comments at its head.

        Raises
        ------
        LegWearError
            If no parameters are proposed.
        """
        if self.config is None:
            raise LegWearError(f"no parameters are proposed: {'; '.join(self.not_told)}")
        labels = {"not enough to tell": self.not_told, "does not fit": self.findings, "note": self.notes}
        labels["torque"] = tuple(text for text in (self.judgement, self.reference_used) if text)
        remarks = [f"{label}: {text}" for label, texts in labels.items() for text in texts]
        return parameter_text(self.config, remarks)


def _document(part: Any) -> dict[str, Any]:
    return {key: _plain(value) for key, value in attrs.asdict(part).items()}


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
