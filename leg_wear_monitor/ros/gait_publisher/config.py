"""Parameters of the gait publisher: those of the synthetic leg, and those of publication."""

import attrs

from leg_wear_monitor.configuration.quantity import described, quantity
from leg_wear_monitor.gait.config import GaitConfig


@attrs.frozen(kw_only=True)
class TruthConfig:
    """What is known of the leg."""

    path: str = described("JSON file for its true clearances, written at the end; none if empty", default="")


@attrs.frozen(kw_only=True)
class PublisherConfig(GaitConfig):
    """All parameters of the gait publisher."""

    crank_joint: str = described("name of the crank in joint_states", default="crank")
    further_joints: tuple[str, ...] = described(
        "names of other joints in the message; they stand still", default=()
    )
    frame_id: str = described("frame of the torque", default="pelvis")
    reliable: bool = described("publish reliably, else with best effort", default=False)
    time_scale: float = quantity("", "simulated seconds per second", above=0.0, at_most=1000.0, default=1.0)
    precompute: bool = described("simulate the whole gait before publishing; needs a duration", default=False)
    wait_for_subscribers: int = quantity(
        "",
        "number of subscribers of each topic to wait for before the start",
        at_least=0,
        at_most=100,
        default=0,
    )
    truth: TruthConfig = described("what is known of the leg", factory=TruthConfig)
