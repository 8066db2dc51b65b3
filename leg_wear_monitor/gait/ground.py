"""The ground under the synthetic leg: a force on its toe that differs from step to step."""

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.gait.config import TEMPLATE, GaitConfig, LoadConfig
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ground_reaction import Stance, nominal_stance, stance_template
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism

POINTS = 512  # entries of the force's table: 2 ms at 60 rpm, a tenth of the transient

_TRANSIENT_S = 0.02
_FURTHEST = 3.0  # standard deviations: further steps are drawn in, so that stance never meets the next one

# Walking on a treadmill, mean of three stances (opensim-models, Rajagopal, grf_walk.mot): coefficients of
# sin(k pi s) of the vertical and of the fore-aft force, over their peaks
_TREADMILL = (
    (0.9697, -0.0111, 0.2704, 0.0111, -0.0928, 0.0058, -0.0567, 0.0148),
    (0.0543, 0.7599, -0.0784, 0.1612, -0.1057, -0.0958, -0.0441, -0.1037),
)


class Ground:
    """Draws the ground's force on the toe, step by step.

    Parameters
    ----------
    mechanism : Mechanism
    config : GaitConfig

    Attributes
    ----------
    swing : float
        Crank angle in the middle of swing, as a fraction of a turn: there, a step begins.

    Raises
    ------
    ConfigError
        For a mechanism without a toe that moves to and fro, or a stance that leaves no swing.
    """

    def __init__(self, mechanism: Mechanism, config: GaitConfig) -> None:
        self._load, self._random = config.load, np.random.default_rng([config.seed, 6])
        self._stance = stance = _stance(mechanism, config)
        self._whole = (stance.turned * (stance.toe_off - stance.heel_strike)) % 1.0
        half = 0.5 * (1.0 - self._whole)
        if half < _FURTHEST * self._load.timing_scatter + 0.01:
            fault = f"{self._load.timing_scatter!r} leaves no swing beside {self._whole:.2f} turns of stance"
            raise ConfigError("gait", "load.timing_scatter", fault)
        self.swing = stance.toe_off + stance.turned * half

    def step(self, speed: float) -> Floats:
        """Force (POINTS, 2) [N] of the next step at equal steps of the crank angle from 0.

        Parameters
        ----------
        speed : float
            Of the crank [rad/s], for the duration of the transient.
        """
        load, stance = self._load, self._stance
        size, late = np.clip(self._random.standard_normal(2), -_FURTHEST, _FURTHEST)
        strike = stance.heel_strike + stance.turned * load.timing_scatter * late
        since = (stance.turned * (np.arange(POINTS) / POINTS - strike)) % 1.0
        vertical, along = _shape(load, since / self._whole)
        risen = since / max(_TRANSIENT_S * abs(speed) / TURN, 1.0 / POINTS)
        vertical += load.heel_strike_transient * np.sin(0.5 * TURN * np.minimum(risen, 1.0)) ** 2
        peak_n = load.ground_n * (1.0 + load.amplitude_scatter * size)
        return np.asarray(
            peak_n * (np.outer(vertical, stance.up) + load.fore_aft * np.outer(along, stance.back))
        )


def _stance(mechanism: Mechanism, config: GaitConfig) -> Stance:
    """Stance of a leg that walks as the crank first turns."""
    load, nominal = config.load, nominal_stance(build_linkage(mechanism))
    if nominal.turned * next((rpm for rpm in config.pace.speeds_rpm if rpm), nominal.turned) < 0.0:
        ends = nominal.toe_off, nominal.heel_strike
        nominal = Stance(*ends, -nominal.turned, nominal.up, -nominal.back)
    return attrs.evolve(
        nominal,
        heel_strike=nominal.heel_strike + nominal.turned * load.heel_strike_shift,
        toe_off=nominal.toe_off + nominal.turned * load.toe_off_shift,
    )


def _shape(load: LoadConfig, s: Floats) -> tuple[Floats, Floats]:
    """Vertical and fore-aft force (n,) over their peaks, at fractions (n,) of stance; 0 beyond 1."""
    known = stance_template(s) if load.shape == TEMPLATE else [_waves(one, s) for one in _TREADMILL]
    vertical, along = (
        _waves(own, s) if own else one
        for own, one in zip((load.vertical_waves, load.fore_aft_waves), known, strict=True)
    )
    return vertical, along


def _waves(coefficients: tuple[float, ...], s: Floats) -> Floats:
    waves = np.sin(0.5 * TURN * np.outer(s, np.arange(1, len(coefficients) + 1)))
    return np.where(s <= 1.0, waves @ np.array(coefficients), 0.0)
