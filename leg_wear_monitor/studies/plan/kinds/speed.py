"""Study ``speed``: crank speed with clearance at chosen joints."""

import attrs

from leg_wear_monitor.studies.plan.keys import Names, clearance_field, clearance_joints_field, speeds_field
from leg_wear_monitor.studies.plan.responses import place, response
from leg_wear_monitor.studies.plan.study import Study, Sweep
from leg_wear_monitor.studies.point import Point


@attrs.frozen(kw_only=True)
class Speed(Study):
    """Crank speed with clearance at chosen joints."""

    title = "Crank speed"
    question = "How does the crank's speed affect a leg with clearance?"
    sweep = Sweep("speed", "crank speed [rpm]", lambda point: point.speed_rpm)

    joints: Names = clearance_joints_field()
    speeds_rpm: tuple[float, ...] = speeds_field()
    clearance_m: float = clearance_field()

    def points(self) -> list[Point]:
        """Responses over the speed."""
        return [
            response(f"{speed:g} rpm", place(self.joints, self.clearance_m, speed), self.ensemble)
            for speed in self.speeds_rpm
        ]
