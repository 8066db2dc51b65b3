"""Clearance estimates from the joint states: a regression on the angles of further joints, cycle by cycle.

Each gait cycle gives an estimate of all clearances and of the encoders' own errors, robust against outliers.
Single cycles are chaotic, so the uncertainty of their mean is computed from the scatter of the cycles alone.
The mean is fused with the prior: the expected clearances, and the encoders' errors as fixed at commissioning.
A sensor that is added later starts with unknown errors.
"""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.encoders.angle_regression import Estimate, binned, blind_directions, regress
from leg_wear_monitor.twin.reference.joint_angles import AngleModel
from leg_wear_monitor.twin.reference.reference import Reference

LEAST_CYCLES = 20
# error of the linear model and its reference against full coordinates (benchmarks/hidden.py)
MODEL_SIGMA_M = 2.0e-5

_BATCH = 2  # cycles per batch: neighbouring cycles are correlated
_NO_NEWS = 1.0e6  # times the prior variance: no information


class ClearanceRegressionSnapshot(NamedTuple):
    """All of a `ClearanceRegression`; nothing in it changes."""

    reference: Reference | None
    before: Estimate | None
    cycles: tuple[tuple[Floats, Floats], ...]
    each: tuple[Floats, ...]


class ClearanceRegression:
    """Estimates clearances from encoders, cycle by cycle.

    Parameters
    ----------
    model : AngleModel
    reference : Reference, optional
        Expected angles; cycles are kept without evaluation until it is given.
    before : Estimate, optional
        Prior knowledge without these cycles; given with the reference.
    most : int
        Number of cycles that are kept; the estimate uses the last ones.

    Attributes
    ----------
    most : int
        As above; may be changed.
    """

    def __init__(
        self,
        model: AngleModel,
        reference: Reference | None = None,
        before: Estimate | None = None,
        most: int = 300,
    ) -> None:
        self._model, self.most = model, most
        self._reference, self._before = reference, before
        self._cycles: list[tuple[Floats, Floats]] = []
        self._each: list[Floats] = []

    def add(self, crank_angle: Floats, angles: Floats) -> None:
        """Add the samples of a gait cycle: crank (n,) and encoder angles (n, m) [rad], NaN where absent."""
        self.add_binned(*binned(self._model, crank_angle, angles))

    def add_binned(self, deviation: Floats, counts: Floats) -> None:
        """Add a gait cycle as returned by `binned`."""
        self._cycles.append((deviation, counts))
        if self._reference is not None:
            self._each.append(self._regressed(deviation, counts))
        del self._cycles[: -self.most], self._each[: -self.most]

    def refer(self, reference: Reference, before: Estimate) -> None:
        """Evaluate the kept cycles with a new reference and a new prior."""
        self._reference, self._before = reference, before
        self._each = [self._regressed(*cycle) for cycle in self._cycles]

    def forget(self) -> None:
        """Drop the kept cycles, because the leg has changed."""
        self._cycles, self._each = [], []

    def _regressed(self, deviation: Floats, counts: Floats) -> Floats:
        reference, before = self._given()
        joints = before.joints
        columns = self._columns(counts)
        # the prior is expressed at the linearisation point: at the clearances of the reference
        shift = reference.deviation - columns[:, :, :joints] @ reference.clearance_m
        return regress(columns, deviation - shift, counts, before)

    def _columns(self, counts: Floats) -> Floats:
        """Columns of the regression for the available encoders, given the counts (P, m) of their samples.

        Joints without a direct effect are excluded: an effect through other joints alone is not
        proportional to the clearance and would give wrong estimates.
        """
        reference, before = self._given()
        there = counts.any(axis=0)
        shown = self._model.by_e[:, there].any(axis=(0, 1, 3))
        columns = reference.columns.copy()
        columns[:, :, : before.joints][:, :, ~shown] = 0.0
        return columns

    def _given(self) -> tuple[Reference, Estimate]:
        if self._reference is None or self._before is None:
            raise LegWearError("no reference was given yet")
        return self._reference, self._before

    @property
    def reference(self) -> Reference | None:
        """Reference that the cycles are compared with."""
        return self._reference

    @property
    def cycles(self) -> int:
        """Number of kept cycles."""
        return len(self._cycles)

    def alone(self) -> Estimate | None:
        """Estimate from the cycles alone, without the prior; None while there are not enough."""
        if len(self._each) < LEAST_CYCLES:
            return None
        reference, before = self._given()
        each = np.array(self._each)
        size = len(each) // _BATCH
        batches = each[len(each) - _BATCH * size :].reshape(size, _BATCH, -1).mean(axis=1)
        # from differences of neighbouring cycles, so that a slow change does not count as scatter
        steps = np.diff(batches, axis=0)
        scatter = steps.T @ steps / (2.0 * len(steps))
        # the reference adds the scatter of the cycles that it was simulated from
        covariance = scatter * (1.0 / size + _BATCH / reference.cycles)
        floor = 1.0e-6 * np.diagonal(before.covariance)
        floor[: before.joints] += MODEL_SIGMA_M**2
        return Estimate(np.median(batches, axis=0), covariance + np.diag(floor), before.joints)

    def fused(self) -> Estimate | None:
        """Cycles and prior, weighted by their covariances (update step of a Kalman filter)."""
        alone = self.alone()
        if alone is None:
            return None
        _, before = self._given()
        counts = np.sum([counts for _, counts in self._cycles], axis=0)
        blind = blind_directions(self._columns(counts), counts)
        # in unobservable directions, each cycle repeats the prior and adds no information
        scale = np.sqrt(np.diagonal(before.covariance))
        across = blind / scale
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        prior = before.covariance / np.outer(scale, scale)
        noise = alone.covariance / np.outer(scale, scale) + _NO_NEWS * across.T @ across
        gain = np.linalg.solve(prior + noise, prior).T
        mean = before.mean + scale * (gain @ ((alone.mean - before.mean) / scale))
        rest = np.eye(len(mean)) - gain
        covariance = rest @ prior @ rest.T + gain @ noise @ gain.T
        return Estimate(mean, covariance * np.outer(scale, scale), before.joints)

    def snapshot(self) -> ClearanceRegressionSnapshot:
        """The whole state."""
        return ClearanceRegressionSnapshot(
            self._reference, self._before, tuple(self._cycles), tuple(self._each)
        )

    def restore(self, snapshot: ClearanceRegressionSnapshot) -> None:
        """Go back to a snapshot."""
        self._reference, self._before = snapshot.reference, snapshot.before
        self._cycles, self._each = list(snapshot.cycles), list(snapshot.each)
