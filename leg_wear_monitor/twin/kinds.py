"""Kinds of samples, one entry each: order of arrival, counts, rates, their alarms and silence follow from it.

Which message becomes a sample of which kind stands in `messages.streams`. Nothing heavy is imported.
"""

from collections.abc import Mapping

import attrs


@attrs.frozen(kw_only=True)
class SampleKind:
    """What samples of a kind measure.

    Attributes
    ----------
    name : str
        In statuses (``crank_rate_hz``), alarms (``input_rate crank``) and counts; the status of this name,
        if there is one, has no current data while no sample of the kind comes.
    value : str
        Field of `GAIT_SAMPLE` that a sample of this kind must have, finite. A sample of another kind may
        bring it too.
    largest : float
        Magnitude in the field's unit: no leg's value is beyond it.
    """

    name: str
    value: str
    largest: float


CRANK, TORQUE = 0, 1  # at one stamp, samples are followed in this order
KINDS: Mapping[int, SampleKind] = {
    CRANK: SampleKind(name="crank", value="crank_angle_rad", largest=1.0e6),
    TORQUE: SampleKind(name="torque", value="torque_nm", largest=1.0e6),
}
