"""What a simulation found, and how it goes out: as JSON and as tables."""

from typing import TYPE_CHECKING, Any

import attrs

from leg_wear_monitor.data_frame import data_frame
from leg_wear_monitor.dynamics.result.document import joint_document, part_document, trace_document
from leg_wear_monitor.dynamics.result.parts import (
    EnergyBalance,
    Impact,
    JointResult,
    ToeResult,
    TorqueResult,
    Trace,
)
from leg_wear_monitor.dynamics.result.tables import impact_columns, joint_columns, trace_columns
from leg_wear_monitor.wear.surfaces import Surfaces

if TYPE_CHECKING:
    import pandas as pd

SCHEMA_VERSION = 1
"""Of the JSON; counts up when a field is renamed, removed or means something else."""


@attrs.frozen(eq=False)
class SimulationResult:
    """What `simulate` found over the counted cycles.

    Attributes
    ----------
    mechanism, model : str
    speed_rpm : float
        Mean speed of the crank, negative for clockwise.
    cycles : float
        Gait cycles counted.
    simulated_s : float
        Time simulated [s], with the cycles skipped.
    drive_torque_nm : TorqueResult
    energy_j : EnergyBalance or None
        None for an ideal leg and for a leg of a batch.
    toe : ToeResult or None
        None without a point called ``toe`` or without an ideal motion to compare with.
    joints : dict of str to JointResult
        Every joint, those without clearance too.
    impacts : dict of str to tuple of Impact
        The first thousand of each clearance joint.
    trace : Trace or None
        None unless it was asked for.
    clearance_joints : tuple of str
    surfaces : Surfaces or None
        Worn surfaces at the end, in the order of ``clearance_joints``; None for an ideal leg.
    """

    mechanism: str
    model: str
    speed_rpm: float
    cycles: float
    simulated_s: float
    drive_torque_nm: TorqueResult
    energy_j: EnergyBalance | None
    toe: ToeResult | None
    joints: dict[str, JointResult]
    impacts: dict[str, tuple[Impact, ...]] = attrs.Factory(dict)
    trace: Trace | None = None
    clearance_joints: tuple[str, ...] = ()
    surfaces: Surfaces | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain object: what ``simulate --json`` writes, but for the clock's values."""
        record = {
            "schema_version": SCHEMA_VERSION,
            "mechanism": self.mechanism,
            "model": self.model,
            "speed_rpm": self.speed_rpm,
            "cycles": self.cycles,
            "simulated_s": self.simulated_s,
            "drive_torque_nm": part_document(self.drive_torque_nm),
            "energy_j": part_document(self.energy_j),
            "toe": part_document(self.toe),
            "joints": {name: joint_document(joint) for name, joint in self.joints.items()},
            "impacts": {name: [part_document(one) for one in all_] for name, all_ in self.impacts.items()},
        }
        return record if self.trace is None else {**record, "trace": trace_document(self.trace)}

    def to_pandas(self) -> "dict[str, pd.DataFrame]":
        """Tables ``joints``, ``impacts`` and, if there is a trace, ``trace``; this needs pandas.

        Columns are named as the fields are, parts of a field after a dot: ``clearance_m.mean``.

        Raises
        ------
        LegWearError
            If pandas is not installed.
        """
        tables = {
            "joints": data_frame(joint_columns(self.joints), index="joint"),
            "impacts": data_frame(impact_columns(self.impacts)),
        }
        return tables if self.trace is None else {**tables, "trace": data_frame(trace_columns(self.trace))}
