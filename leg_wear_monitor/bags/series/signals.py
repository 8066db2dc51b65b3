"""Joint positions and torques of a recording as time series, each a candidate for the crank or its torque."""

import attrs

from leg_wear_monitor.estimate.torque_fit.series import Series

WRENCH, FLOAT64, EFFORT = "wrench", "float64", "effort"


@attrs.frozen
class JointName:
    """A joint of a recording: its topic and its name in the messages."""

    topic: str
    joint: str


@attrs.frozen
class TorqueSource:
    """A torque of a recording.

    Attributes
    ----------
    source : str
        Value of `drive_torque.source`.
    topic : str
    component : str
        Axis of a wrench (x, y, z), joint of an effort; empty for a Float64.
    """

    source: str
    topic: str
    component: str = ""

    @property
    def label(self) -> str:
        """The torque in words."""
        if self.source == WRENCH:
            return f"wrench, axis {self.component}, of {self.topic}"
        if self.source == EFFORT:
            return f"effort of {self.component} in {self.topic}"
        return f"Float64 of {self.topic}"


@attrs.frozen(eq=False)
class Signals:
    """All candidates of one or more recordings."""

    joints: dict[JointName, Series]
    torques: dict[TorqueSource, Series]
