"""Study ``load``: a leg in the air, and under the force of the ground on its foot."""

import attrs

from leg_wear_monitor.configuration.quantity import described, quantity
from leg_wear_monitor.studies.plan.keys import check_rising
from leg_wear_monitor.studies.plan.kinds.chaos import Exponent, exponent_point
from leg_wear_monitor.studies.plan.kinds.wear import Life, life_point
from leg_wear_monitor.studies.plan.responses import OnePlace, response
from leg_wear_monitor.studies.point import Point


@attrs.frozen(kw_only=True)
class Load(OnePlace):
    """The same leg under forces of the ground of several sizes, in the stance of a person."""

    title = "Load of the ground"
    question = (
        "What does the force of the ground on the foot change in the forces of the joints, in where and in "
        "which order they wear, in how long they last, and in the disorder of the motion?"
    )

    loads_n: tuple[float, ...] = quantity(
        "N",
        "largest vertical forces of the ground on the toe in stance, one per point; 0 in the air",
        at_least=0.0,
        at_most=10_000.0,
        check=check_rising,
    )
    life: Life = described("how far wear is followed", factory=Life)
    exponent: Exponent = described("how the Lyapunov exponent is measured", factory=Exponent)

    def points(self) -> list[Point]:
        """Response, life and Lyapunov exponent under each load."""
        points = []
        for load_n in self.loads_n:
            where = self.place(ground_n=load_n)
            label = f"{load_n:g} N"
            points += [
                response(label, where, self.ensemble),
                life_point(label, where, self.ensemble, self.life),
                exponent_point(label, where, self.ensemble, self.exponent),
            ]
        return points
