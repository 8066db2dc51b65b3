"""How far the growth of a real leg may be from that of the leg on paper, because of its masses.

Wear grows with force times sliding. What the ideal motion makes of it follows from its reactions, and so does
its sensitivity to each body's mass: without a simulation, a fraction of a second for any mechanism. The rest
is made by impacts.
"""

import math

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, body_names
from leg_wear_monitor.mechanism.ideal import TURN, one_cycle
from leg_wear_monitor.mechanism.person import heavier_person
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference.leg_parameters import MASS_TOLERANCE

# squared sensitivity of what impacts make: by regression over the joints of sixteen legs as built
# (`benchmarks/growth_coverage.py --quick --legs 16`)
_OF_IMPACTS = 1.6
_POINTS = 160  # of a gait cycle
_MASS_STEP = 0.01


@attrs.frozen(eq=False)
class ModelError:
    """What the counted growth of each clearance joint may be off.

    Attributes
    ----------
    ideal_m : (k,) array
        Growth a gait cycle that the ideal motion makes.
    sensitivity : (k,) array
        Of its logarithm to those of all masses, root sum of squares; the person's is known less well.
    """

    ideal_m: Floats
    sensitivity: Floats

    def relative(self, k: int, growth_m: float) -> float:
        """Standard deviation of a joint's growth a gait cycle, as a fraction of it.

        Impacts depend on masses, lengths and ripple in a rugged way, not by sensitivities: their fraction of
        the growth adds to the variance in proportion.
        """
        impacts = min(1.0, abs(1.0 - self.ideal_m[k] / growth_m)) if growth_m > 0.0 else 0.0
        return MASS_TOLERANCE * math.sqrt(self.sensitivity[k] ** 2 + _OF_IMPACTS * impacts)


def model_error(mechanism: Mechanism, speed_radps: float, wear_acceleration: float = 1.0) -> ModelError:
    """Model error of a leg on paper.

    Parameters
    ----------
    mechanism : Mechanism
        The masses of its bodies are independent of each other, and inertias follow them.
    speed_radps : float
        Of its crank.
    wear_acceleration : float
        Factor on all wear.
    """
    sliding = _force_times_sliding(mechanism, speed_radps)
    square = np.zeros_like(sliding)
    for name, body in mechanism.bodies.items():
        factor = 1.0 + _MASS_STEP
        heavier = attrs.evolve(body, mass=factor * body.mass, inertia=factor * body.inertia)
        changed = attrs.evolve(mechanism, bodies={**mechanism.bodies, name: heavier})
        square += np.square((_force_times_sliding(changed, speed_radps) - sliding) / _MASS_STEP)
    if mechanism.person_kg:
        more = _force_times_sliding(heavier_person(mechanism), speed_radps) - sliding
        square += np.square(more / MASS_TOLERANCE)
    # a joint that carries nothing on paper: all of its growth is made by impacts
    sensitivity = np.divide(np.sqrt(square), sliding, out=np.zeros_like(sliding), where=sliding > 0.0)
    parts = [mechanism.clearances[joint] for joint in mechanism.clearance_joints]
    # Archard's law, spread over the contact's area: both surfaces open the clearance (wear/surfaces.py)
    per_joule = [sum(part.wear_coefficient) / (TURN * part.bushing_radius * part.width) for part in parts]
    return ModelError(wear_acceleration * np.array(per_joule) * sliding, sensitivity)


def _force_times_sliding(mechanism: Mechanism, speed_radps: float) -> Floats:
    """Force times sliding distance [J] over a gait cycle in each clearance joint, all joints ideal (k,)."""
    motion = one_cycle(build_linkage(mechanism), _POINTS, speed_radps)
    names, joints, found = body_names(mechanism), list(mechanism.joints), []
    for name in mechanism.clearance_joints:
        bushing, journal = (names.index(body) for body in mechanism.sides(name))
        turning = np.abs(motion.v[:, journal, 2] - motion.v[:, bushing, 2])
        force = np.linalg.norm(motion.joint_force[:, joints.index(name)], axis=1)
        radius = mechanism.clearances[name].bushing_radius
        found.append(radius * (force * turning).mean() * TURN / abs(speed_radps))
    return np.array(found)
