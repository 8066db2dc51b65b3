"""Study ``size``: clearance size at chosen joints."""

import attrs

from leg_wear_monitor.studies.plan.keys import Names, clearance_joints_field, clearances_field, speed_field
from leg_wear_monitor.studies.plan.responses import millimetres, place, response
from leg_wear_monitor.studies.plan.study import Study, Sweep
from leg_wear_monitor.studies.point import Point


@attrs.frozen(kw_only=True)
class Size(Study):
    """Clearance size at chosen joints."""

    title = "Clearance size"
    question = (
        "How does the size of a clearance affect the motion, the impacts, the drive and the wear of the leg?"
    )
    sweep = Sweep("clearance", "radial clearance [mm]", lambda point: 1.0e3 * point.clearance_m)

    joints: Names = clearance_joints_field()
    clearances_m: tuple[float, ...] = clearances_field()
    speed_rpm: float = speed_field()

    def points(self) -> list[Point]:
        """Responses over the clearance."""
        return [
            response(millimetres(clearance), place(self.joints, clearance, self.speed_rpm), self.ensemble)
            for clearance in self.clearances_m
        ]
