"""A replay over time: gait cycles as columns, thinned where they are many."""

from typing import TYPE_CHECKING

import attrs

from leg_wear_monitor.data_frame import data_frame
from leg_wear_monitor.mechanism.arrays import Floats, Ints

if TYPE_CHECKING:
    import pandas as pd


@attrs.frozen(kw_only=True, eq=False)
class ReplayHistory:
    """Columns over n groups of gait cycles: last value of each; maximum of peaks, sum of impacts.

    NaN where a value is not known, such as forces and torques of gait cycles that were tracked only. What a
    joint has is an array a joint, by its name.

    Attributes
    ----------
    stamp_ns : (n,) array
        End of the last gait cycle [ns].
    cycle : (n,) array
        Number of that gait cycle over the whole life in the ledger.
    cadence_rpm : (n,) array
        Mean crank speed while moving.
    moving_s : (n,) array
        Time in motion.
    bridged_s : (n,) array
        Of it the time bridged in gaps.
    measured_torque_rms_nm : (n,) array
        RMS of the measured drive torque.
    predicted_torque_rms_nm : (n,) array
        RMS of the predicted drive torque.
    torque_mismatch : (n,) array
        Fraction of the predicted RMS that load, friction and lag do not explain.
    load_n : (n,) array
        Foot load, as estimated, up positive.
    friction_nm : (n,) array
        Friction of the drive, as estimated.
    clearance_m : dict of str to (n,) array
        Mean radial clearance around the bushing.
    clearance_max_m : dict of str to (n,) array
        Largest radial clearance around the bushing.
    growth_m_per_cycle : dict of str to (n,) array
        Growth of the mean clearance in a gait cycle.
    peak_force_n : dict of str to (n,) array
        Largest contact force.
    p99_force_n : dict of str to (n,) array
        Contact force that is not exceeded 99 % of the time.
    mean_force_n : dict of str to (n,) array
        Mean contact force.
    impacts : dict of str to (n,) array
        Number of impacts.
    seen_m : dict of str to (n,) array
        Mean radial clearance that encoders or the drive torque show, the surer one; empty in a file of an
        older version.
    lowest : dict of str to (n,) array
        Of cadence, torques, mismatch, load and friction, by their names: the smallest value in each group;
        empty if each group is one gait cycle.
    highest : dict of str to (n,) array
        The largest value in each group.
    """

    stamp_ns: Ints
    cycle: Floats
    cadence_rpm: Floats
    moving_s: Floats
    bridged_s: Floats
    measured_torque_rms_nm: Floats
    predicted_torque_rms_nm: Floats
    torque_mismatch: Floats
    load_n: Floats
    friction_nm: Floats
    clearance_m: dict[str, Floats]
    clearance_max_m: dict[str, Floats]
    growth_m_per_cycle: dict[str, Floats]
    peak_force_n: dict[str, Floats]
    p99_force_n: dict[str, Floats]
    mean_force_n: dict[str, Floats]
    impacts: dict[str, Floats]
    seen_m: dict[str, Floats] = attrs.Factory(dict)
    lowest: dict[str, Floats] = attrs.Factory(dict)
    highest: dict[str, Floats] = attrs.Factory(dict)

    def columns(self) -> dict[str, Floats | Ints]:
        """Columns of a table over time; a joint's value after a dot: ``clearance_m.A``."""
        columns: dict[str, Floats | Ints] = {}
        for name, value in attrs.asdict(self, recurse=False).items():
            if isinstance(value, dict):
                columns |= {f"{name}.{joint}": column for joint, column in value.items()}
            else:
                columns[name] = value
        return columns

    def to_pandas(self) -> "pd.DataFrame":
        """Table of `columns` by stamp [ns]; requires pandas.

        Raises
        ------
        LegWearError
            If pandas is not installed.
        """
        return data_frame(self.columns(), index="stamp_ns")
