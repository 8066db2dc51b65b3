"""Expected signatures over clearances, for a torque sensor, from simulated torque references."""

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.monitor.diagnosis.signature import TorqueSensor, averaged, quiet_phases, signatures
from leg_wear_monitor.twin.reference.torque_reference import POINTS, TorqueReference

# of the noise that is added to simulated torques: the same at each start, and another one for each leg, or
# their covariance would be that of a single leg's cycles
_SEED = 20261122
_PART_OF_SAMPLE = 0.618  # by which samples move in each simulated gait cycle
_WEAKEST_NOISE, _STRONGEST_NOISE = 1.0e-4, 1.0  # of the torque's size
_HALVINGS = 12  # of that range: the noise is found to 0.2 %


@attrs.frozen(eq=False)
class SignatureModel:
    """Expected signatures (F,) of a leg, as a function of its k clearances.

    What several clearances change is the sum of what each of them changes alone.

    Attributes
    ----------
    sensor : TorqueSensor
    grid_m : (k, s) array
        Increasing clearances of each joint.
    mean : (F,) array
        Signature of the expected leg.
    change : (k, s, F) array
        What each joint changes, at each clearance of the grid.
    covariance : (F, F) array
        Of the signature of one gait cycle.
    cycles : int
        Simulated gait cycles of each leg.
    """

    sensor: TorqueSensor
    grid_m: Floats
    mean: Floats
    change: Floats
    covariance: Floats
    cycles: int

    def at(self, clearance_m: Floats) -> tuple[Floats, Floats]:
        """Signature (F,) at clearances (k,) [m], and its derivatives (F, k) by their logarithms.

        Linear in the logarithms of the clearances between points of the grid, and beyond its ends.
        """
        found, slopes = self.mean.copy(), np.empty((len(self.mean), len(clearance_m)))
        for k, clearance in enumerate(clearance_m):
            grid, x = np.log(self.grid_m[k]), np.log(clearance)
            i = int(np.clip(np.searchsorted(grid, x) - 1, 0, len(grid) - 2))
            slopes[:, k] = (self.change[k, i + 1] - self.change[k, i]) / (grid[i + 1] - grid[i])
            found += self.change[k, i] + (x - grid[i]) * slopes[:, k]
        return found, slopes


def signature_model(reference: TorqueReference, sensor: TorqueSensor) -> SignatureModel:
    """Model for a sensor, whose noise is added to the simulated torques."""
    legs = [simulated_signatures(reference, leg, sensor) for leg in range(len(reference.torque_nm))]
    means = np.array([leg.mean(axis=0) for leg in legs])
    scatter = sum((leg - mean).T @ (leg - mean) for leg, mean in zip(legs, means, strict=True))
    freedom = sum(len(leg) - 1 for leg in legs)
    joints = reference.clearance_m.shape[1]
    order = np.arange(1, len(legs)).reshape(joints, -1)
    grid = [[reference.clearance_m[0, k], *reference.clearance_m[order[k], k]] for k in range(joints)]
    change = [np.vstack([np.zeros_like(means[0]), means[order[k]] - means[0]]) for k in range(joints)]
    return SignatureModel(
        sensor, np.array(grid), means[0], np.array(change), np.asarray(scatter / freedom), len(legs[1])
    )


def simulated_signatures(
    reference: TorqueReference, leg: int, sensor: TorqueSensor, scale: float = 1.0, offset_rad: float = 0.0
) -> Floats:
    """Signatures (cycles, F) of a leg of a reference.

    Parameters
    ----------
    reference : TorqueReference
    leg : int
    sensor : TorqueSensor
    scale : float
        Factor on the torque.
    offset_rad : float
        Added to the crank angle.
    """
    torque = reference.torque_nm[leg].astype(float)
    period, points = TURN / abs(reference.profile.speed), torque.size
    # another part of a sample each gait cycle: samples of a real leg fall anywhere, too
    between = period / (period / sensor.period_s + _PART_OF_SAMPLE)
    ends = np.arange(between, period * len(torque), between)
    place = ends * (POINTS / period)
    if sensor.is_instant:
        sampled = torque.ravel()[np.minimum(place.astype(np.int64), points - 1)]
    else:
        impulse = np.concatenate([[0.0], np.cumsum(torque)])
        sampled = np.diff(np.interp(place, np.arange(points + 1.0), impulse), prepend=0.0) / np.diff(
            place, prepend=0.0
        )
    noise = np.random.default_rng([_SEED, leg]).standard_normal(len(sampled))
    sampled = averaged(scale * sampled + sensor.noise_nm * noise, sensor.together)
    place = place[sensor.together - 1 :: sensor.together][: len(sampled)]
    angle = np.interp(place % POINTS, np.arange(POINTS + 1.0), reference.angle)
    cycle = np.minimum((place / POINTS).astype(np.int64), len(torque) - 1)
    step = np.diff(sampled, prepend=np.nan)
    return signatures(cycle, angle + offset_rad, sampled, step, sensor)


def with_noise_of(reference: TorqueReference, sensor: TorqueSensor, measured: Floats) -> TorqueSensor:
    """The sensor with the noise that makes simulated torques as rough as measured ones in quiet phases.

    Parameters
    ----------
    reference : TorqueReference
    sensor : TorqueSensor
    measured : (F,) array
        Mean of measured signatures.
    """
    quiet = quiet_phases(simulated_signatures(reference, 0, sensor).mean(axis=0))
    low, high = (np.log(fraction * sensor.size_nm) for fraction in (_WEAKEST_NOISE, _STRONGEST_NOISE))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        tried = attrs.evolve(sensor, noise_nm=float(np.exp(middle)))
        rough = simulated_signatures(reference, 0, tried).mean(axis=0)
        low, high = (middle, high) if (rough - measured)[quiet].mean() < 0.0 else (low, middle)
    return attrs.evolve(sensor, noise_nm=float(np.exp(0.5 * (low + high))))
