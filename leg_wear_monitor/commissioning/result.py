"""The result of commissioning: the parameter file, and the result with all of it."""

from collections.abc import Sequence
from io import StringIO
from typing import TYPE_CHECKING, Any

import attrs
from ruamel.yaml import YAML

from leg_wear_monitor.configuration import part_document
from leg_wear_monitor.errors import LegWearError, printable
from leg_wear_monitor.files import data_frame, json_text
from leg_wear_monitor.monitor.config.parameters import MARK, PARAMETERS, nested, values_of
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings.findings import Finding
from leg_wear_monitor.twin.references import TorqueReference

if TYPE_CHECKING:
    import pandas as pd


# The ROS parameter file: parameters that differ from the defaults, which `config/monitor.yaml` lists.


_HEAD_LINES = (
    "Parameters of the monitor, proposed by `leg-wear-monitor commission`; others have their defaults.",
    "crank angle = sign * position / gear_ratio + offset_rad",
    "torque on the crank = sign * scale * gear_ratio * value",
)
# parameters that are written even if they have their default, because a leg depends on them
_ALWAYS_WRITTEN = ("mechanism", "crank_joint", "crank.", "drive_torque.", "cadence.")


def parameter_text(config: MonitorConfig, remarks: Sequence[str]) -> str:
    """Text of a parameter file, with remarks as comments at its head."""
    head = "".join(f"# {printable(line)}\n" for line in (*_HEAD_LINES, *remarks))
    written = {
        name: value
        for name, value in values_of(config).items()
        if value != () and (value != PARAMETERS[name].default or name.startswith(_ALWAYS_WRITTEN))
    }
    stream = StringIO()
    yaml: Any = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False
    yaml.dump({"/**": {MARK: nested(written)}}, stream)
    return head + stream.getvalue()


# The result: each parameter with its second-best value, the undetermined parameters, and the quantities that
# do not fit.


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
        Torque residual: RMS of the torque that this value leaves unexplained, as a fraction of the torque's
        RMS.
    other : str, int, float or None
        The runner-up.
    other_mismatch : float, optional
        Torque residual of the runner-up.
    remark : str
        Further information.
    """

    name: str
    value: str | int | float
    unit: str = ""
    sigma: float | None = None
    mismatch: float | None = None
    other: str | int | float | None = None
    other_mismatch: float | None = None
    remark: str = ""


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
        Quantities that do not fit, and the remedy.
    notes : tuple of str
        Further information.
    config : MonitorConfig or None
        The proposed parameters; None if a choice between alternatives is not certain.
    turns : float
        Turns of the crank in the recording.
    faults : tuple of Finding
        Faults of the recordings, whose other parts were used.
    reference : TorqueReference or None
        Reference simulated for ``diagnosis.reference``, if it was requested.
    """

    items: tuple[CommissioningItem, ...]
    not_told: tuple[str, ...]
    findings: tuple[str, ...]
    notes: tuple[str, ...]
    config: MonitorConfig | None
    turns: float
    faults: tuple[Finding, ...] = ()
    reference: TorqueReference | None = None

    @property
    def is_sure(self) -> bool:
        """True if every parameter was determined, and everything fits."""
        return self.config is not None and not self.not_told and not self.findings

    @property
    def remarks(self) -> list[str]:
        """Parameters that are not determined, contradictions, and notes, one line each."""
        labels = {"not determined": self.not_told, "does not fit": self.findings, "note": self.notes}
        return [f"{label}: {text}" for label, texts in labels.items() for text in texts]

    def item(self, name: str) -> CommissioningItem:
        """The item of a name; raises KeyError if there is none."""
        return {each.name: each for each in self.items}[name]

    def to_dict(self) -> dict[str, Any]:
        """Plain object for JSON; null for a value that cannot be determined."""
        return {
            "schema_version": SCHEMA_VERSION,
            "turns": self.turns,
            "is_sure": self.is_sure,
            "items": part_document(self.items),
            "not_enough_to_tell": list(self.not_told),
            "findings": list(self.findings),
            "notes": list(self.notes),
        }

    def to_json(self) -> str:
        """Text of `to_dict`, as ``commission --json`` writes it."""
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
        return parameter_text(self.config, self.remarks)
