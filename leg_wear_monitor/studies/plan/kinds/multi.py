"""Study ``multi``: clearance in several places at once."""

import attrs

from leg_wear_monitor.studies.plan.kinds.location import Location
from leg_wear_monitor.studies.point import Point


@attrs.frozen(kw_only=True)
class Multi(Location):
    """Clearance in all those places at once, against each place alone."""

    title = "Several clearances at once"
    question = (
        "Is the effect of clearances in all these joints the sum of the effects of each alone, and which "
        "joint is worst?"
    )

    def points(self) -> list[Point]:
        """The sets, and last all of their joints at once."""
        everything = dict.fromkeys(joint for clearance_joints in self.sets for joint in clearance_joints)
        return [*super().points(), self._response(tuple(everything))]
