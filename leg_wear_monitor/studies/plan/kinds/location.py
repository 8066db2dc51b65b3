"""Study ``location``: clearance in one place or another."""

import attrs

from leg_wear_monitor.configuration.quantity import described
from leg_wear_monitor.studies.plan.keys import Names, check_sets, clearance_field, speed_field
from leg_wear_monitor.studies.plan.responses import place, response, set_name
from leg_wear_monitor.studies.plan.study import Study
from leg_wear_monitor.studies.point import Point


@attrs.frozen(kw_only=True)
class Location(Study):
    """Clearance in one place or another."""

    title = "Clearance location"
    question = "How do the effects of the same clearance differ between hip, knee and foot?"

    sets: tuple[Names, ...] = described("clearance joints of one run, a list of lists", check=check_sets)
    clearance_m: float = clearance_field()
    speed_rpm: float = speed_field()

    def points(self) -> list[Point]:
        """Response of each set of clearance joints."""
        return [self._response(clearance_joints) for clearance_joints in self.sets]

    def _response(self, clearance_joints: Names) -> Point:
        where = place(clearance_joints, self.clearance_m, self.speed_rpm)
        return response(set_name(clearance_joints), where, self.ensemble)
