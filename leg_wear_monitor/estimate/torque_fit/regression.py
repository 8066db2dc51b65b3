"""Regression of measured on predicted torque: its terms, its parameters under way, and its columns."""

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.estimate.signature import Channel
from leg_wear_monitor.estimate.torque_fit.blocks import Blocks, blocks_of
from leg_wear_monitor.estimate.torque_fit.pairing import Pair
from leg_wear_monitor.estimate.torque_fit.start import Start
from leg_wear_monitor.estimate.torque_fit.torque_model import TorqueModel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN

PHASES = 128  # offsets tried where a start does not tell one


@attrs.frozen
class Terms:
    """Terms of the regression beside gain, friction and offset."""

    ratio: bool = True
    bias: bool = False
    load: bool = False
    load_friction: bool = False
    lag: bool = False

    @property
    def linear(self) -> tuple[str, ...]:
        """Names of the linear terms."""
        further = ("bias", "load", "load_friction")
        return ("gain", "friction", *(name for name in further if getattr(self, name)))


@attrs.frozen(eq=False)
class State:
    """Parameters under way.

    Attributes
    ----------
    ratio : float
        Turns of the crank per turn of the joint.
    phase, middle : (recordings,) array
        Crank angle at a position in the middle of each recording, and that position [rad].
    row : (n,) array of int
        Recording of each sample, as an index of `phase`.
    lag_s, low_pass_s : float
        As those of `Start`.
    """

    ratio: float
    phase: Floats
    middle: Floats
    row: NDArray[np.int64]
    lag_s: float = 0.0
    low_pass_s: float = 0.0

    def vector(self, terms: Terms) -> Floats:
        """Phases, and ratio and lag where they are terms (k,)."""
        return np.concatenate([self.phase, [self.ratio] * terms.ratio, [self.lag_s] * terms.lag])

    def at(self, x: Floats, terms: Terms) -> "State":
        """State with other phases, ratio and lag (k,)."""
        k = len(self.phase)
        ratio, lag_s = float(x[k]) if terms.ratio else self.ratio, float(x[-1]) if terms.lag else self.lag_s
        return attrs.evolve(self, phase=x[:k], ratio=ratio, lag_s=lag_s)


def begin(pair: Pair, model: TorqueModel, start: Start) -> State:
    """State at a start; the phases of other recordings are those that explain most."""
    numbers, row = np.unique(pair.recording, return_inverse=True)
    middle = np.array([np.median(pair.position_rad[row == i]) for i in range(len(numbers))])
    phase = start.ratio * middle + start.offset_rad
    for i, number in enumerate(numbers.tolist()):
        if number != start.recording:
            phase[i] = _best_phase(pair.part(row == i), model, start, float(middle[i]))
    return State(start.ratio, phase, middle, row, start.lag_s, start.low_pass_s)


def _best_phase(pair: Pair, model: TorqueModel, start: Start, middle: float) -> float:
    return int(np.argmax(explained_by_phase(pair, model, start, middle))) * TURN / PHASES


def explained_by_phase(pair: Pair, model: TorqueModel, start: Start, middle: float) -> Floats:
    """Torque that the model explains (PHASES,), at equal steps of the crank angle at a position [rad]."""
    blocks = blocks_of(pair, start.ratio)
    measured = blocks.mean(pair.torque)
    speed, acceleration = start.ratio * pair.speed_radps, start.ratio * pair.acceleration_radps2
    explained = np.empty(PHASES)
    for i in range(PHASES):
        angle = start.ratio * (pair.position_rad - middle) + i * TURN / PHASES
        torque = blocks.mean(model.torque(angle, speed, acceleration)[0])
        torque -= torque.mean()
        explained[i] = start.torque_sign * float(torque @ measured) / float(np.linalg.norm(torque))
    return explained


def columns(
    pair: Pair, model: TorqueModel, state: State, terms: Terms, blocks: Blocks
) -> tuple[Floats, Floats]:
    """Columns of the linear terms, and at unit gain of small changes of phases, ratio and lag, by block."""
    position, speed, acceleration = pair.earlier(state.lag_s - state.low_pass_s)
    late, speed = position - state.middle[state.row], state.ratio * speed
    angle = state.ratio * late + state.phase[state.row]
    torque, slope = model.torque(angle, speed, state.ratio * acceleration)
    channel = Channel(time_constant_s=state.low_pass_s)

    def filtered(each: Floats) -> Floats:
        return channel.received(each, pair.interval_s, direction=1.0)

    slope = filtered(slope)
    linear = [filtered(torque), np.sign(speed)]
    if terms.bias:
        linear.append(np.ones_like(torque))
    if terms.load:
        linear.append(filtered(model.load_torque(angle)))
    if terms.load_friction:
        linear.append(filtered(np.abs(torque) * np.sign(speed)))
    moving = [np.where(state.row == i, slope, 0.0) for i in range(len(state.phase))]
    if terms.ratio:
        moving.append(slope * late)
    if terms.lag:
        moving.append(-slope * speed)
    return blocks.mean(np.array(linear)), blocks.mean(np.array(moving))
