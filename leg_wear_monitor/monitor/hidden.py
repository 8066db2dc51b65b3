"""Clearances seen in the joint states: a regression on the angles of further joints, cycle by cycle.

Each gait cycle gives an estimate of all clearances and of the encoders' own errors, robust against outliers.
Single cycles are chaotic, so how far cycles scatter, and nothing else, says how good their mean is. That mean
is fused with what was known before: the clearances that Archard's law predicts, and the encoders' errors as
held since commissioning. A sensor that comes later starts with errors that are not known.
"""

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.angle_regression import Estimate, binned, blind_directions, regress, rms
from leg_wear_monitor.twin.joint_angles import SHAPE_CYCLES, AngleModel, contact_shape, design

LEAST_CYCLES = 20
# what the linear model and its shape are off against full coordinates (benchmarks/hidden.py)
MODEL_SIGMA_M = 2.0e-5

_BATCH = 2  # cycles: neighbours hang together
_NO_NEWS = 1.0e6  # of the variance before


class HiddenClearance:
    """Estimates clearances from encoders, cycle by cycle.

    Parameters
    ----------
    model : AngleModel
    shape : (P, k, 2) array
        As `contact_shape` gives it.
    before : Estimate
        What is known without these cycles.
    cycles : int
        That are kept: the estimate is of these last ones.
    shape_cycles : int
        That were simulated for a shape.
    """

    def __init__(
        self,
        model: AngleModel,
        shape: Floats,
        before: Estimate,
        cycles: int = 300,
        shape_cycles: int = SHAPE_CYCLES,
    ) -> None:
        self._model, self._columns, self._most = model, design(model, shape), cycles
        self.before, self._shape_cycles = before, shape_cycles
        self._seen: list[tuple[Floats, Floats]] = []
        self._each: list[Floats] = []

    def add(self, crank_angle: Floats, angles: Floats) -> None:
        """Take in a gait cycle's samples: crank angles (n,) [rad], encoders (n, m) [rad], NaN where none."""
        deviation, counts = binned(self._model, crank_angle, angles)
        self._seen.append((deviation, counts))
        self._each.append(regress(self._columns, deviation, counts, self.before))
        del self._seen[: -self._most], self._each[: -self._most]

    def reshape(self, shape: Floats) -> None:
        """Look at the kept cycles again with another shape: that of the clearances found."""
        self._columns = design(self._model, shape)
        self._each = [regress(self._columns, *seen, self.before) for seen in self._seen]

    def alone_worn(self, k: int, shape: Floats) -> tuple[float, float]:
        """How badly the kept cycles fit if joint k alone is not as expected; and its clearance then [m].

        Parameters
        ----------
        k : int
        shape : (P, k, 2) array
            As `contact_shape` gives it for such a leg.

        Returns
        -------
        misfit, clearance_m : float
            RMS of what is left [rad], and the clearance that leaves least.
        """
        counts = np.sum([counts for _, counts in self._seen], axis=0)
        sums = np.nansum([deviation * counts for deviation, counts in self._seen], axis=0)
        used = counts.ravel() > 0.0
        columns = design(self._model, shape).reshape(-1, len(self.before.mean))[used]
        rest, column = self.before.mean.copy(), columns[:, k]
        rest[k] = 0.0
        left = (sums.ravel()[used] / counts.ravel()[used]) - columns @ rest
        size = float(column @ column)
        clearance_m = float(column @ left) / size if size > 0.0 else float(self.before.mean[k])
        return rms(left - clearance_m * column), clearance_m

    @property
    def cycles(self) -> int:
        """Cycles that are kept."""
        return len(self._each)

    def alone(self) -> Estimate | None:
        """What the cycles say by themselves; None while there are not enough."""
        if len(self._each) < LEAST_CYCLES:
            return None
        each = np.array(self._each)
        size = len(each) // _BATCH
        batches = each[len(each) - _BATCH * size :].reshape(size, _BATCH, -1).mean(axis=1)
        # a shape has the scatter of the cycles that it was simulated from
        covariance = np.cov(batches, rowvar=False) * (1.0 / size + _BATCH / self._shape_cycles)
        floor = 1.0e-6 * np.diagonal(self.before.covariance)
        floor[: self.before.joints] += MODEL_SIGMA_M**2
        return Estimate(np.median(batches, axis=0), covariance + np.diag(floor), self.before.joints)

    def fused(self) -> Estimate | None:
        """The cycles and what was known before, weighted by their covariances (a Kalman filter's update)."""
        seen = self.alone()
        if seen is None:
            return None
        blind = blind_directions(self._columns, np.sum([counts for _, counts in self._seen], axis=0))
        # along what the sensors do not show, each cycle repeats what was known before: that is no news
        scale = np.sqrt(np.diagonal(self.before.covariance))
        across = blind / scale
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        prior = self.before.covariance / np.outer(scale, scale)
        noise = seen.covariance / np.outer(scale, scale) + _NO_NEWS * across.T @ across
        gain = np.linalg.solve(prior + noise, prior).T
        mean = self.before.mean + scale * (gain @ ((seen.mean - self.before.mean) / scale))
        rest = np.eye(len(mean)) - gain
        covariance = rest @ prior @ rest.T + gain @ noise @ gain.T
        return Estimate(mean, covariance * np.outer(scale, scale), self.before.joints)


def worn_joint(
    expected: Estimate, found: Estimate, sigmas: float = 4.0, least_m: float = 5.0e-5
) -> int | None:
    """The loose joint whose clearance is most surely another than expected, None if none surely is.

    Parameters
    ----------
    expected : Estimate
        By Archard's law.
    found : Estimate
        By the encoders.
    sigmas, least_m : float
        Least departure, in standard deviations and in metres.
    """
    off = np.abs(found.clearance_m - expected.clearance_m)
    surely = np.where(off >= least_m, off / found.sigma_m, 0.0)
    k = int(surely.argmax())
    return k if surely[k] >= sigmas else None


def likeliest_worn(
    mechanism: Mechanism, hidden: HiddenClearance, expected: Estimate, shape_cycles: int = SHAPE_CYCLES
) -> tuple[int, float]:
    """The joint that, alone not as expected, fits the kept cycles best; and its clearance then [m].

    To be asked once `worn_joint` has found that something is worn. Each joint in turn is supposed to be the
    one, with the shape that contacts have then: joints that act alike are told apart.

    Raises
    ------
    SimulationError
    """
    found = hidden.fused() or expected
    most = float(np.abs(found.clearance_m - expected.clearance_m).max())
    fits = []
    for k in range(expected.joints):
        clearance = expected.clearance_m.copy()
        clearance[k] += most
        fits.append(hidden.alone_worn(k, contact_shape(mechanism, clearance, shape_cycles)))
    likeliest = int(np.argmin([misfit for misfit, _ in fits]))
    return likeliest, fits[likeliest][1]
