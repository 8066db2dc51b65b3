"""A leg whose bodies are a little heavier or longer than those of the mechanism file."""

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism

MASS_TOLERANCE = (
    0.05  # standard deviation of a body's mass about that of the file, where nothing else is known
)


@attrs.frozen
class BodyFactors:
    """Factors on the bodies of a mechanism, in the order of its file.

    Attributes
    ----------
    mass, length : (bodies,) arrays
        A heavier body has the same shape; a longer one is scaled in all directions and has the same mass.
    """

    mass: Floats = attrs.field(eq=attrs.cmp_using(eq=np.array_equal))
    length: Floats = attrs.field(eq=attrs.cmp_using(eq=np.array_equal))

    @classmethod
    def none(cls, mechanism: Mechanism) -> "BodyFactors":
        """Factors of the mechanism as it is."""
        return cls(np.ones(len(mechanism.bodies)), np.ones(len(mechanism.bodies)))

    def applied(self, mechanism: Mechanism) -> Mechanism:
        """The mechanism with these factors on its bodies."""
        bodies = {}
        for (name, body), mass, length in zip(mechanism.bodies.items(), self.mass, self.length, strict=True):
            bodies[name] = attrs.evolve(
                body,
                mass=float(mass * body.mass),
                inertia=float(mass * length**2 * body.inertia),
                com=_scaled(body.com, length),
                points={point: _scaled(place, length) for point, place in body.points.items()},
            )
        return attrs.evolve(mechanism, bodies=bodies)


def _scaled(place: tuple[float, float], factor: float) -> tuple[float, float]:
    return (float(factor * place[0]), float(factor * place[1]))
