"""Growth of the clearances: measured over gait cycles, and its error."""

import math

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, body_names
from leg_wear_monitor.mechanism.person import GROUND_LOAD, heavier_person, with_toe_force
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference import MASS_TOLERANCE

# Mean growth over gait cycles: single cycles of a chaotic motion scatter.


GROWTH_CYCLES = 30  # over which the reported growth is averaged
LEAST_CYCLES = 10
LARGEST_ERROR = 0.5  # fraction of the mean: beyond it, the mean says nothing

_BATCHES = 5  # batches of six cycles in a window of thirty: longer than the correlation of neighbours
# five means leave four degrees of freedom: Student's t, not a normal distribution. With this factor, a normal
# distribution has the same interval from p10 to p90 as t: 1.533 standard errors, not 1.282
_WIDER = 1.533 / 1.282


@attrs.frozen
class GrowthRate:
    """Mean growth over a window.

    Attributes
    ----------
    per_cycle_m, sampling_m : float
        A gait cycle, and the uncertainty of this mean because single cycles scatter.
    per_second_m : float
        A second of walking.
    """

    per_cycle_m: float
    sampling_m: float
    per_second_m: float

    def error_m(self, model_error: float) -> float:
        """Uncertainty of a gait cycle's growth in this leg: of the mean, and of the model.

        As of a normal distribution: 80 % lie within 1.28 of it either way.

        Parameters
        ----------
        model_error : float
            Standard deviation of the relative growth (`ModelError`).
        """
        return math.hypot(self.sampling_m, model_error * self.per_cycle_m)


def growth_rate(growth_m: Floats, moving_s: Floats) -> GrowthRate | None:
    """Mean growth, None while there is not enough data to know it.

    A mean is used and not a median: wear comes in bursts, and means add up. Neighbouring cycles of a chaotic
    motion are correlated, so the scatter is computed from the means of batches.

    Parameters
    ----------
    growth_m : (n,) array
        Growth of the mean clearance in each of the last gait cycles.
    moving_s : (n,) array
        Time in motion of each.
    """
    if len(growth_m) < LEAST_CYCLES:
        return None
    mean, sampling = float(growth_m.mean()), _WIDER * _standard_error(growth_m)
    if not sampling <= LARGEST_ERROR * abs(mean):
        return None
    return GrowthRate(mean, sampling, float(growth_m.sum() / moving_s.sum()))


def _standard_error(values: Floats) -> float:
    size = len(values) // _BATCHES
    means = values[len(values) - _BATCHES * size :].reshape(_BATCHES, size).mean(axis=1)
    return float(means.std(ddof=1) / math.sqrt(_BATCHES))


# Error of the modelled growth of a real leg, because of its masses and its load.
#
# Wear grows with force times sliding. The part from the ideal motion follows from its reactions, and so does
# its sensitivity to each body's mass: this needs no simulation, and a fraction of a second for any mechanism.
# Impacts cause the rest.


# squared sensitivity of the impacts' part: by regression over the joints of sixteen legs as built
# (`benchmarks/growth_coverage.py --quick --legs 16`)
_OF_IMPACTS = 1.6
# effect of a load on the impacts' part of the growth, over its effect on the other part: least squares over
# five joints under 300 and 600 N (docs/appendix/forecast.md, lives under a load of the ground)
_LOAD_OF_IMPACTS = 0.3
_POINTS = 160  # points per gait cycle
_MASS_STEP = 0.01


@attrs.frozen(eq=False)
class ModelError:
    """Error of the modelled growth of each clearance joint.

    Attributes
    ----------
    ideal_m : (k,) array
        Growth per gait cycle from the ideal motion.
    sensitivity : (k,) array
        Sensitivity of its logarithm to the logarithms of all masses, root sum of squares; the person's mass
        is known less well.
    load : (k,) array
        Change of its logarithm by the standard deviation of the load's size.
    """

    ideal_m: Floats
    sensitivity: Floats
    load: Floats

    def relative(self, k: int, growth_m: float) -> float:
        """Standard deviation of a joint's growth a gait cycle, as a fraction of it.

        Impacts depend on masses, lengths and ripple in a rugged way, not by sensitivities: their fraction of
        the growth adds to the variance in proportion.
        """
        masses = MASS_TOLERANCE * math.sqrt(
            self.sensitivity[k] ** 2 + _OF_IMPACTS * self._impacts(k, growth_m)
        )
        return math.hypot(masses, self.by_load(k, growth_m))

    def by_load(self, k: int, growth_m: float) -> float:
        """Standard deviation of it by the load alone."""
        return float(self.load[k]) * (1.0 - (1.0 - _LOAD_OF_IMPACTS) * self._impacts(k, growth_m))

    def _impacts(self, k: int, growth_m: float) -> float:
        """Fraction of a joint's growth that impacts make."""
        return min(1.0, abs(1.0 - self.ideal_m[k] / growth_m)) if growth_m > 0.0 else 0.0


def model_error(
    mechanism: Mechanism, speed_radps: float, wear_acceleration: float = 1.0, load_sigma: float = 0.0
) -> ModelError:
    """Model error of a leg on paper.

    Parameters
    ----------
    mechanism : Mechanism
        The masses of its bodies are independent of each other, and inertias follow them.
    speed_radps : float
        Of its crank.
    wear_acceleration : float
        Factor on all wear.
    load_sigma : float
        Standard deviation of the size of the ground's force on its toe, as a fraction of it.
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
    load = np.zeros_like(sliding)
    if load_sigma:
        force = (1.0 + load_sigma) * np.array(mechanism.loads[GROUND_LOAD].force)
        load = np.abs(_force_times_sliding(with_toe_force(mechanism, force), speed_radps) - sliding)
    # a joint without load in the ideal leg: impacts cause all of its growth
    sensitivity, load = (
        np.divide(change, sliding, out=np.zeros_like(sliding), where=sliding > 0.0)
        for change in (np.sqrt(square), load)
    )
    parts = [mechanism.clearances[joint] for joint in mechanism.clearance_joints]
    # Archard's law, spread over the contact's area: both surfaces open the clearance (wear.py)
    per_joule = [sum(part.wear_coefficient) / (TURN * part.bushing_radius * part.width) for part in parts]
    return ModelError(wear_acceleration * np.array(per_joule) * sliding, sensitivity, load)


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
