"""Digital twin: crank tracker, leg model, load from drive torque (physics.md section 9); kinds of samples.

The modules imported here do not import numpy or numba.
"""

from collections.abc import Mapping

import attrs

# Kinds of samples: order, counts, rates, alarms and silence detection follow from these entries.
#
# `recordings.streams` maps messages to kinds.


@attrs.frozen(kw_only=True)
class SampleKind:
    """A kind of samples.

    Attributes
    ----------
    name : str
        Name in statuses (``crank_rate_hz``), alarms (``input_rate crank``) and counts. A status of this name
        has no current data while no sample of the kind arrives.
    value : str
        Field of `GAIT_SAMPLE` that must be finite in a sample of this kind. A sample of a different kind may
        contain the field as well.
    largest : float
        Largest plausible magnitude, in the field's unit, of each component.
    """

    name: str
    value: str
    largest: float


CRANK, TORQUE, LOAD = 0, 1, 2  # samples with equal stamps are processed in this order
KINDS: Mapping[int, SampleKind] = {
    CRANK: SampleKind(name="crank", value="crank_angle_rad", largest=1.0e6),
    TORQUE: SampleKind(name="torque", value="torque_nm", largest=1.0e6),
    # five tons on a foot; the weight of a person in millinewtons is larger
    LOAD: SampleKind(name="foot_load", value="foot_force_n", largest=5.0e4),
}
