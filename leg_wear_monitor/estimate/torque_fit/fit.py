"""Least squares (Gauss-Newton) of gear ratio, offset, lag, scale, friction, bias and foot load."""

import math

import attrs
import numpy as np

from leg_wear_monitor.estimate.least_squares import Point, gauss_newton, jackknife, solved
from leg_wear_monitor.estimate.torque_fit.blocks import Blocks, blocks_of
from leg_wear_monitor.estimate.torque_fit.pairing import Pair
from leg_wear_monitor.estimate.torque_fit.regression import State, Terms, begin, columns
from leg_wear_monitor.estimate.torque_fit.start import Start
from leg_wear_monitor.estimate.torque_fit.torque_model import ModelError, TorqueModel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN

_LONGEST_STEP_RAD = 0.2  # of the phase in one step, half a radian of the torque's third harmonic
_DONE_RAD = 1.0e-3  # a twentieth of what clearances shift the phase by
_EXACT_RAD = 1.0e-6
_CHUNKS = 12  # stretches of time, each left out once
_NO_TERMS = Terms()


@attrs.frozen(eq=False)
class Fit:
    """What fits best, near a start.

    Attributes
    ----------
    ratio : float
        Turns of the crank per turn of the joint, negative if it turns against it.
    offset_rad : dict of int to float
        Crank angle at joint position 0, of each recording, from -pi to pi.
    linear : dict of str to float
        By name: ``gain`` (measured torque per torque on the crank, negative for a negative sign),
        ``friction`` and ``bias`` (constant along the motion, and constant) in the sensor's unit, ``load``
        (``gain`` times the foot load [N]).
    lag_s : float
        Time by which slow changes of the torque are late [s].
    sigma : dict of str to float
        Standard deviations of ``ratio``, ``offset_rad``, ``lag_s`` and the linear terms; empty if not asked
        for.
    error : ModelError
        What clearances change that is not in the standard deviations.
    measured, predicted, rest : (m,) arrays
        Torques of the blocks, in the sensor's unit; the prediction is that of the leg alone.
    """

    ratio: float
    offset_rad: dict[int, float]
    linear: dict[str, float]
    lag_s: float
    sigma: dict[str, float]
    error: ModelError
    measured: Floats
    predicted: Floats
    rest: Floats
    blocks: Blocks
    pair: Pair
    start: Start

    @property
    def gain(self) -> float:
        """Measured torque per torque on the crank."""
        return self.linear["gain"]

    @property
    def refined(self) -> Start:
        """Where a further fit starts."""
        return attrs.evolve(
            self.start, ratio=self.ratio, offset_rad=self.offset_rad[self.start.recording], lag_s=self.lag_s
        )

    @property
    def mismatch(self) -> float:
        """RMS of the rest as a fraction of the RMS of the measured torque about its mean."""
        return float(np.sqrt(np.mean(self.rest**2)) / self.measured.std())

    @property
    def direction(self) -> int:
        """1 if the joint turns in the direction of the crank angle, else -1."""
        return 1 if self.ratio > 0.0 else -1

    @property
    def torque_sign(self) -> int:
        """1 if a positive torque drives the crank in its positive direction, else -1."""
        return 1 if self.gain > 0.0 else -1

    @property
    def gear_ratio(self) -> float:
        """Turns of the joint per turn of the crank."""
        return 1.0 / abs(self.ratio)

    @property
    def turns(self) -> float:
        """Turns of the crank from first to last sample of each recording, the longest way round."""
        pair = self.pair
        reach = sum(float(np.ptp(pair.position_rad[pair.recording == i])) for i in self.offset_rad)
        return abs(self.ratio) * reach / TURN

    def crank(self) -> tuple[Floats, Floats, Floats]:
        """Angle, speed and acceleration of the crank when the torque was made, for each sample."""
        pair = self.pair
        offset = np.array([self.offset_rad[number] for number in pair.recording.tolist()])
        position, speed, acceleration = pair.earlier(self.lag_s)
        return self.ratio * position + offset, self.ratio * speed, self.ratio * acceleration


@attrs.frozen(eq=False)
class _Columns(Point):
    """Parameters under way, columns (k, m) and coefficients (k,) of linear terms, columns of the motion."""

    state: State
    by_linear: Floats
    linear: Floats
    by_motion: Floats


def fit(
    pair: Pair, model: TorqueModel, start: Start, terms: Terms = _NO_TERMS, with_errors: bool = False
) -> Fit:
    """Best fit near a start; its standard deviations and last digits only if asked for: they take long."""
    blocks = blocks_of(pair, start.ratio)
    measured = blocks.mean(pair.torque)
    begun = begin(pair, model, start)

    sign = 0.0

    def at(x: Floats) -> _Columns:
        """Motion (k,) with the best linear terms, which go with it, and a gain of the sign at the start."""
        nonlocal sign
        state = begun.at(x, terms)
        by_linear, by_motion = columns(pair, model, state, terms, blocks)
        linear = solved(by_linear.T, measured)
        by_motion *= linear[0]
        sign = sign or float(np.sign(linear[0]))
        return _Columns(
            linear @ by_linear - measured if linear[0] * sign > 0.0 else np.full(len(measured), np.inf),
            lambda: by_motion.T - by_linear.T @ solved(by_linear.T, by_motion.T),
            state,
            by_linear,
            linear,
            by_motion,
        )

    reach = 0.5 * float(np.ptp(pair.position_rad))
    scale = np.concatenate([np.ones(len(begun.phase)), [1.0 / reach] * terms.ratio, [np.inf] * terms.lag])
    done = scale * (_EXACT_RAD if with_errors else _DONE_RAD)
    best = gauss_newton(at, begun.vector(terms), longest=scale * _LONGEST_STEP_RAD, done=done).point
    state, linear, rest = best.state, best.linear, -best.rest
    by = np.concatenate([best.by_linear, best.by_motion])
    sigma = _errors(by, rest, state, terms) if with_errors else {}
    offset = (state.phase - state.ratio * state.middle + math.pi) % TURN - math.pi
    return Fit(
        ratio=state.ratio,
        offset_rad=dict(zip(np.unique(pair.recording).tolist(), offset.tolist(), strict=True)),
        linear=dict(zip(terms.linear, linear.tolist(), strict=True)),
        lag_s=state.lag_s,
        sigma=sigma,
        error=model.error,
        measured=measured,
        predicted=linear[0] * best.by_linear[0],
        rest=rest,
        blocks=blocks,
        pair=pair,
        start=start,
    )


def _errors(by: Floats, rest: Floats, state: State, terms: Terms) -> dict[str, float]:
    """Standard deviations by name."""
    moving = [name for name, is_free in (("ratio", terms.ratio), ("lag_s", terms.lag)) if is_free]
    names = (*terms.linear, *(f"phase {i}" for i in range(len(state.phase))), *moving)
    found = jackknife(lambda some: solved(by[:, some].T, rest[some]), len(rest), _CHUNKS)
    sigma = {"ratio": 0.0} | dict(zip(names, found.tolist(), strict=True))
    phase = max(sigma[f"phase {i}"] for i in range(len(state.phase)))
    sigma["offset_rad"] = math.hypot(phase, sigma["ratio"] * float(np.abs(state.middle).max()))
    return sigma
