"""The result of a simulation, with its conversion to JSON and to tables."""

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
from leg_wear_monitor.json_text import json_text
from leg_wear_monitor.shown import Drawable
from leg_wear_monitor.wear.surfaces import Surfaces

if TYPE_CHECKING:
    import pandas as pd

SCHEMA_VERSION = 1
"""Version of the JSON schema; incremented when a field is renamed, removed or changes its meaning."""


@attrs.frozen(eq=False)
class SimulationResult(Drawable):
    """Result of `simulate` over the counted cycles.

    Attributes
    ----------
    mechanism : str
        Name of the mechanism.
    model : str
        Formulation of the motion: ``clearance``, ``full`` or ``ideal``.
    speed_rpm : float
        Mean crank speed, negative for clockwise.
    cycles : float
        Number of counted gait cycles.
    simulated_s : float
        Simulated time [s], skipped cycles included.
    drive_torque_nm : TorqueResult
        Torque of the drive on the crank.
    energy_j : EnergyBalance or None
        Energy balance; None for an ideal leg and for a leg of a batch.
    toe : ToeResult or None
        Deviations of the toe; None without a point called ``toe`` or without an ideal motion to compare with.
    joints : dict of str to JointResult
        All joints, ideal ones included.
    impacts : dict of str to tuple of Impact
        The first thousand impacts of each clearance joint.
    trace : Trace or None
        Samples over the counted cycles; None if no trace was requested.
    standard_error : dict of str to float, or None
        Standard error of a value by its path, such as ``joints.A.mean_force_n``: the standard deviation
        between gait cycles, divided by the root of their number, as if successive cycles were independent.
        None below two whole cycles, for an ideal leg and for a leg of a batch.
    clearance_joints : tuple of str
        Joints with clearance, in the order of ``surfaces``.
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
    standard_error: dict[str, float] | None = None
    clearance_joints: tuple[str, ...] = ()
    surfaces: Surfaces | None = None

    def to_dict(self, wall_s: float | None = None) -> dict[str, Any]:
        """Plain object: what ``simulate --json`` writes.

        Parameters
        ----------
        wall_s : float, optional
            Wall-clock duration of the simulation [s]; without it, what follows from it is left out.
        """
        clock = {} if wall_s is None else {"wall_s": wall_s}
        factor = {} if wall_s is None else {"real_time_factor": self.simulated_s / wall_s}
        record = {
            "schema_version": SCHEMA_VERSION,
            "mechanism": self.mechanism,
            "model": self.model,
            "speed_rpm": self.speed_rpm,
            "cycles": self.cycles,
            **clock,
            "simulated_s": self.simulated_s,
            **factor,
            "drive_torque_nm": part_document(self.drive_torque_nm),
            "energy_j": part_document(self.energy_j),
            "toe": part_document(self.toe),
            "joints": {name: joint_document(joint) for name, joint in self.joints.items()},
            "impacts": {name: [part_document(one) for one in all_] for name, all_ in self.impacts.items()},
            "standard_error": self.standard_error,
        }
        return record if self.trace is None else {**record, "trace": trace_document(self.trace)}

    def to_json(self, wall_s: float | None = None) -> str:
        """Text of `to_dict`: what ``simulate --json`` writes.

        Examples
        --------
        >>> import json
        >>> import leg_wear_monitor as lw
        >>> result = lw.simulate("four_bar", clearances=[], cycles=1)
        >>> json.loads(result.to_json())["model"]
        'ideal'
        """
        return json_text(self.to_dict(wall_s))

    def to_pandas(self) -> "dict[str, pd.DataFrame]":
        """Tables ``joints``, ``impacts`` and, if there is a trace, ``trace``; requires pandas.

        Columns have the names of the fields, parts of a field after a dot: ``clearance_m.mean``.

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
