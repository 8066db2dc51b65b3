"""A leg whose masses, lengths and friction are not quite those of the mechanism file."""

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ground_reaction import with_toe_force
from leg_wear_monitor.mechanism.spec import Mechanism

MASS_TOLERANCE = (
    0.05  # standard deviation of a body's mass about that of the file, where nothing else is known
)


# of the crank on its coupling, with the mean inertia of the ideal leg: belts and elastomer couplings lose 30
# to 60 % of the energy of an oscillation in it, 4 pi times as much
COUPLING_DAMPING = 0.05


@attrs.frozen
class LegParameters:
    """Factors on the parameters of a mechanism, the compliance of its drive, and the ground under its toe.

    Attributes
    ----------
    mass, length : (bodies,) arrays
        On bodies, in the order of the file. A heavier body has the same shape; a longer one is scaled in all
        directions and has the same mass.
    friction : float
        On the friction coefficients of all clearance joints.
    compliance : float
        Of what is between the measured crank angle and the crank [rad/(N m)], at the crank; 0 if it is rigid.
    damping : float
        Of the crank on a compliant drive, over the critical one with the mean inertia of the ideal leg.
    load : (PHASES, 2) array
        Mean force of the ground on the toe at equal steps of the crank angle from 0 [N]; (0, 2) without one.
    """

    mass: Floats = attrs.field(eq=attrs.cmp_using(eq=np.array_equal))
    length: Floats = attrs.field(eq=attrs.cmp_using(eq=np.array_equal))
    friction: float = 1.0
    compliance: float = 0.0
    damping: float = COUPLING_DAMPING
    load: Floats = attrs.field(factory=lambda: np.zeros((0, 2)), eq=attrs.cmp_using(eq=np.array_equal))

    @classmethod
    def none(cls, mechanism: Mechanism) -> "LegParameters":
        """Factors of the mechanism as it is."""
        return cls(np.ones(len(mechanism.bodies)), np.ones(len(mechanism.bodies)))

    @property
    def in_air(self) -> "LegParameters":
        """Those of the leg without a load."""
        return attrs.evolve(self, load=np.zeros((0, 2)))

    def applied(self, mechanism: Mechanism) -> Mechanism:
        """The mechanism with these factors; the compliance is none of it."""
        bodies = {}
        for (name, body), mass, length in zip(mechanism.bodies.items(), self.mass, self.length, strict=True):
            bodies[name] = attrs.evolve(
                body,
                mass=float(mass * body.mass),
                inertia=float(mass * length**2 * body.inertia),
                com=_scaled(body.com, length),
                points={point: _scaled(place, length) for point, place in body.points.items()},
            )
        clearances = {
            joint: attrs.evolve(
                one,
                friction=attrs.evolve(one.friction, coefficient=self.friction * one.friction.coefficient),
            )
            for joint, one in mechanism.clearances.items()
        }
        leg = attrs.evolve(mechanism, bodies=bodies, clearances=clearances)
        return with_toe_force(leg, self.load) if self.load.size else leg


def _scaled(place: tuple[float, float], factor: float) -> tuple[float, float]:
    return (float(factor * place[0]), float(factor * place[1]))
