"""The leg that was replayed, as a picture needs it: shapes at crank angle 0, joints with their labels."""

import attrs

Place = tuple[float, float]


@attrs.frozen(kw_only=True)
class LegJoint:
    """A joint.

    Attributes
    ----------
    label : str
        Name for operators, such as ``knee``; empty if the mechanism file has no label.
    place_m : tuple of float
        Its place at crank angle 0.
    is_on_ground : bool
        Whether it joins a body to the ground.
    """

    label: str
    place_m: Place
    is_on_ground: bool


@attrs.frozen(kw_only=True)
class ReplayLeg:
    """The mechanism in its plane [m], x to the right and y up.

    Attributes
    ----------
    bodies_m : dict of str to tuple of tuples
        Corners of each moving body.
    joints : dict of str to LegJoint
        All joints, those without clearance too.
    """

    bodies_m: dict[str, tuple[Place, ...]] = attrs.Factory(dict)
    joints: dict[str, LegJoint] = attrs.Factory(dict)

    def joint_words(self, joint: str) -> str:
        """A joint by its name and its label, such as ``G (knee)``."""
        label = self.joints[joint].label if joint in self.joints else ""
        return f"{joint} ({label})" if label else joint
