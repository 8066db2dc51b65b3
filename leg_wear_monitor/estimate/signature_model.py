"""Expected signatures over clearances, for a torque sensor, from simulated torque references."""

import attrs
import numpy as np

from leg_wear_monitor.estimate.signature import TorqueSensor, quiet_phases
from leg_wear_monitor.estimate.simulated_sensor import SimulatedSensor
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.twin.reference.torque_reference import TorqueReference

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
    _log_grid: Floats = attrs.field(init=False)
    _slopes: Floats = attrs.field(init=False)

    def at(self, clearance_m: Floats) -> tuple[Floats, Floats]:
        """Signature (F,) at clearances (k,) [m], and its derivatives (F, k) by their logarithms.

        Linear in the logarithms of the clearances between points of the grid, and beyond its ends.
        """
        x, joints = np.log(clearance_m), np.arange(len(self.grid_m))
        grid = self._log_grid
        i = (grid[:, 1:-1] < x[:, None]).sum(axis=1)
        slopes, beyond = self._slopes[joints, i], x - grid[joints, i]
        return self.mean + self.change[joints, i].sum(axis=0) + beyond @ slopes, slopes.T

    @_log_grid.default
    def _logarithms(self) -> Floats:
        return np.asarray(np.log(self.grid_m))

    @_slopes.default
    def _derivatives(self) -> Floats:
        """Derivatives (k, s - 1, F) by the logarithm of a clearance between points of the grid."""
        with np.errstate(invalid="ignore", divide="ignore"):  # where a clearance can be no wider
            return np.asarray(np.diff(self.change, axis=1) / np.diff(self._log_grid, axis=1)[:, :, None])


def signature_model(reference: TorqueReference, sensor: TorqueSensor) -> SignatureModel:
    """Model for a sensor, whose noise is added to the simulated torques."""
    cycles = [len(torque) for torque in reference.torque_nm]
    sensors = {n: SimulatedSensor(reference, n, sensor) for n in set(cycles)}
    legs = [sensors[n].signatures(leg) for leg, n in enumerate(cycles)]
    means = np.array([leg.mean(axis=0) for leg in legs])
    scatter = np.concatenate([leg - mean for leg, mean in zip(legs, means, strict=True)])
    covariance = scatter.T @ scatter / (len(scatter) - len(legs))
    joints = reference.clearance_m.shape[1]
    order = np.arange(1, len(legs)).reshape(joints, -1)
    grid = np.array([reference.clearance_m[[0, *order[k]], k] for k in range(joints)])
    change = np.array([means[[0, *order[k]]] - means[0] for k in range(joints)])
    place = np.argsort(grid, axis=1, kind="stable")
    grid, change = np.take_along_axis(grid, place, 1), np.take_along_axis(change, place[:, :, None], 1)
    return SignatureModel(sensor, grid, means[0], change, covariance, cycles[1])


def simulated_signatures(
    reference: TorqueReference,
    leg: int,
    sensor: TorqueSensor,
    scale: float = 1.0,
    offset_rad: float = 0.0,
    cycles: int | None = None,
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
    cycles : int, optional
        The first ones; all by default.
    """
    simulated = SimulatedSensor(reference, cycles or len(reference.torque_nm[leg]), sensor, offset_rad)
    return simulated.signatures(leg, scale)


def with_noise_of(reference: TorqueReference, sensor: TorqueSensor, measured: Floats) -> TorqueSensor:
    """The sensor with the noise that makes simulated torques as rough as measured ones in quiet phases.

    Parameters
    ----------
    reference : TorqueReference
    sensor : TorqueSensor
    measured : (F,) array
        Mean of measured signatures.
    """
    simulated = SimulatedSensor(reference, len(reference.torque_nm[0]), sensor)
    torque, noise = simulated.torque(0), simulated.noise(0)
    quiet = quiet_phases(simulated.signatures_of(torque + sensor.noise_nm * noise).mean(axis=0))
    low, high = (np.log(fraction * sensor.size_nm) for fraction in (_WEAKEST_NOISE, _STRONGEST_NOISE))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        rough = simulated.signatures_of(torque + np.exp(middle) * noise).mean(axis=0)
        low, high = (middle, high) if (rough - measured)[quiet].mean() < 0.0 else (low, middle)
    return attrs.evolve(sensor, noise_nm=float(np.exp(0.5 * (low + high))))
