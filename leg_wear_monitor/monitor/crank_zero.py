"""The zero of the crank's encoder, from the phase of the drive torque; before, nothing is monitored.

An encoder on the motor's shaft starts at zero at each boot. The zero is looked for at the ends of evaluation
periods, which do not depend on how samples are cut into blocks.
"""

import math
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.joint_motion import Series, motion_of, paired, series
from leg_wear_monitor.estimate.torque_model import (
    PHASE_ERROR_RAD,
    Start,
    Terms,
    TorqueModel,
    fit,
    repeating,
    too_alike,
)
from leg_wear_monitor.mechanism.arrays import Ints
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.alarms import CRANK_ZERO
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.observer import Observer
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.monitor.verdict.verdict import estimate
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin import CRANK, KINDS, TORQUE
from leg_wear_monitor.twin.sample import (
    AVERAGE,
    BRIDGE_LIMIT_S,
    GAIT_SAMPLE,
    GATE_RAD,
    Samples,
    TrackerSettings,
    is_valid,
    of_crank,
)

# turns after which a zero is looked for: two are enough for averages, and the third shows the repeating
# residual; instants need up to twelve (docs/appendix/commissioning.md). Then the search begins again
TURNS = (3, 6, 12)
# Time of a search, as a multiple of the commanded turns' time. A slower walk is not at the commanded cadence.
_LONGEST = 1.5
_MOST_SAMPLES = 400_000  # 30 MB, for torques without a crank
_SURE_RAD = 0.015  # scatter that a found zero may have: less than the phase error by clearances
_LEAST_SAMPLES = 25  # torque samples in a turn: two and a half in a period of the tenth harmonic
_PHASES = np.arange(12) * (TURN / 12)  # where fits begin: four in a period of the torque's third harmonic
_APART_RAD = 0.3  # two phases nearer than that are one: fifteen times the phase error by clearances
_UNLIKE = 0.7  # torque residual from which on less than half of the torque's energy is explained
_ANOTHER_LEG = 0.5  # repeating residual from which on the torque comes from a different leg
_DIGITS = 6  # digits of a zero [rad]: further digits may depend on the library of linear algebra


@attrs.frozen
class Zero:
    """A zero that was found.

    Attributes
    ----------
    offset_rad, sigma_rad : float
        Crank angle at joint position 0, from -pi to pi, and its standard deviation.
    turns : int
        Turns of the crank from which the zero was found.
    mismatch : float
        Torque residual: RMS of the unexplained torque over the RMS of the measured torque.
    """

    offset_rad: float
    sigma_rad: float
    turns: int
    mismatch: float


class CrankZero(Observer):
    """Finds the zero of the crank's encoder, and again after a jump of the angle or a gap.

    Parameters
    ----------
    model : TorqueModel
    config : MonitorConfig
    tracker : TrackerSettings

    Attributes
    ----------
    zero : Zero or None
        The present one.
    times_found : int
    """

    def __init__(self, model: TorqueModel, config: MonitorConfig, tracker: TrackerSettings) -> None:
        self._model, self._config, self._tracker = model, config, tracker
        self.zero: Zero | None = None
        self.times_found = 0
        self._begin()
        self._last_ns, self._last_rad = 0, 0.0  # the last crank sample; stamp 0 before the first
        # The zero is unknown from this stamp on. The twin does not count the time before the first zero.
        self._lost_ns, self._before_s = 0, 0.0

    def _begin(self, why: str = "") -> None:
        """Begin a search; ``why`` the search before was in vain."""
        self._wanted, self._why, self._turns = TURNS[0], why, 0.0
        self._samples: list[Samples] = [np.zeros(0, GAIT_SAMPLE)]

    def passed(self, samples: Samples, ends_period: bool) -> Samples:
        """Samples to track, shifted by the zero; empty while the zero is unknown."""
        out = []
        for i, part in enumerate(np.split(samples, self._breaks(samples))):
            if i and self.zero is not None:
                self.zero, self._lost_ns = None, int(part["stamp_ns"][0])
            if i:
                self._begin()
            out.append(self._taken(part))
        if ends_period and self.zero is None:
            self._search()
        return np.concatenate(out)

    def _breaks(self, samples: Samples) -> Ints:
        """Indices of crank samples that do not continue the sample before.

        The encoder may have restarted in a gap, unless its angle continues after the gap.
        """
        is_possible = np.abs(samples["crank_angle_rad"]) <= KINDS[CRANK].largest
        at = np.flatnonzero((samples["kind"] == CRANK) & is_valid(samples) & is_possible)
        if not len(at):
            return at
        stamp_ns, angle = samples["stamp_ns"][at], samples["crank_angle_rad"][at]
        self._lost_ns = self._lost_ns or int(stamp_ns[0])
        before = (self._last_ns, self._last_rad) if self._last_ns else (stamp_ns[0], angle[0])
        self._last_ns, self._last_rad = int(stamp_ns[-1]), float(angle[-1])
        time_s = np.abs(1.0e-9 * np.diff(stamp_ns, prepend=before[0]))
        moved = np.abs((np.diff(angle, prepend=before[1]) + math.pi) % TURN - math.pi)
        reach = self._tracker.largest_speed * time_s
        may_restart = (time_s > BRIDGE_LIMIT_S) & (np.abs(angle) <= reach + TURN)
        return np.asarray(at[may_restart | (moved > GATE_RAD + reach)])

    def _taken(self, samples: Samples) -> Samples:
        """Samples without a break: with the zero; none without."""
        if self.zero is None:
            self._samples.append(samples[is_valid(samples)])
            return samples[:0]
        samples = samples.copy()
        samples["crank_angle_rad"] += self.zero.offset_rad
        return samples

    def _search(self) -> None:
        """Look for the zero once the crank has turned often enough."""
        samples, cadence = np.concatenate(self._samples), self._config.cadence
        crank = _series(of_crank(samples), "crank_angle_rad", self._last_ns)
        if not len(crank.value) or len(samples) > _MOST_SAMPLES:
            self._begin(self._why)
            return
        crank = attrs.evolve(crank, value=np.unwrap(crank.value))
        self._turns = float(crank.value[-1] - crank.value[0]) / TURN
        passed_s = float(crank.time_s[-1] - crank.time_s[0])
        longest_s = _LONGEST * self._wanted * 60.0 / abs(cadence.commanded_rpm)
        if abs(self._turns) < self._wanted and passed_s < longest_s:
            return
        rpm, commanded = 60.0 * self._turns / passed_s, cadence.commanded_rpm
        if not cadence.allows(rpm):
            most = f"{commanded:.3g} ± {cadence.tolerance_rpm:.2g} rpm"
            self._begin(f"the leg walks at {rpm:.3g} rpm; the commanded cadence is {most}")
            return
        torques = samples[np.abs(samples["torque_nm"]) <= KINDS[TORQUE].largest]
        torque = _series(torques, "torque_nm", self._last_ns)
        found = zero_of(crank, torque, self._wanted, self._model, self._config.drive_torque.sampling)
        if isinstance(found, Zero):
            self._before_s = self._before_s if self.times_found else self.unmonitored_s
            self.zero, self.times_found = found, self.times_found + 1
        elif self._wanted < TURNS[-1]:
            self._wanted, self._why = TURNS[TURNS.index(self._wanted) + 1], found
        else:
            self._begin(found)

    @property
    def cause(self) -> str:
        """Why nothing is monitored at present; empty if the zero is known."""
        if self.zero is not None:
            return ""
        turns = f"searching for the crank's zero: {abs(self._turns):.0f} of {self._wanted} turns"
        return f"{turns}; before, {self._why}" if self._why else turns

    @property
    def unmonitored_s(self) -> float:
        """Time [s] without a zero, as far as the twin does not count it."""
        searched_s = 0.0 if self.zero else max(0.0, 1.0e-9 * (self._last_ns - self._lost_ns))
        return self._before_s + searched_s

    @property
    def notes(self) -> Mapping[str, Sequence[str]]:
        """Why nothing is monitored at present."""
        return {CRANK_ZERO: (self.cause,)} if self.cause else {}

    @property
    def statuses(self) -> Sequence[Status]:
        """The zero of the crank's encoder, or why it is not known."""
        zero = self.zero
        values = {
            **{name: getattr(zero, name, math.nan) for name in ("offset_rad", "sigma_rad", "mismatch")},
            "turns": float(zero.turns if zero else abs(self._turns)),
            "least_turns": float(self._wanted),
            "times_found": float(self.times_found),
            "not_monitored_s": self.unmonitored_s,
        }
        if zero is None:
            return (Status("crank zero", Level.WARN, self.cause, values, CRANK_ZERO),)
        offset = estimate(zero.offset_rad, zero.sigma_rad, "rad")
        return (Status("crank zero", Level.OK, f"crank angle at joint position 0: {offset}", values),)


def _series(samples: Samples, name: str, origin_ns: int) -> Series:
    return series(samples["stamp_ns"], samples[name], origin_ns)


def zero_of(crank: Series, torque: Series, turns: int, model: TorqueModel, sampling: str) -> Zero | str:
    """The crank's zero from some turns at the commanded cadence; else why it cannot be found.

    Parameters
    ----------
    crank, torque : Series
        Crank angle up to the unknown zero, counted on over turns [rad], and drive torque [N m] meanwhile.
    turns : int
    model : TorqueModel
    sampling : str
        Value of `drive_torque.sampling`.
    """
    number = len(torque.value)
    if number < _LEAST_SAMPLES * turns:
        return f"the drive torque had {number} samples in {turns} turns. Expected {_LEAST_SAMPLES} per turn"
    late_s = 0.5 * float(np.median(np.diff(torque.time_s))) if sampling == AVERAGE else 0.0
    pair = paired(motion_of(crank), torque, late_s)
    if len(pair.torque) < _LEAST_SAMPLES or not float(pair.torque.std()) > 0.0:
        return "the drive torque did not change"
    # fits from all phases, with the configured sign, the best first; the foot may be on the ground
    terms, middle = Terms(ratio=False, load=bool(model.load.any())), float(np.median(pair.position_rad))
    start = Start(1.0, -middle, torque_sign=1, explained=0.0)
    starts = [attrs.evolve(start, offset_rad=phase - middle) for phase in _PHASES.tolist()]
    fits = [one for one in (fit(pair, model, each, terms) for each in starts) if one.gain > 0.0]
    fits.sort(key=lambda one: one.mismatch)
    best = fit(pair, model, fits[0].refined, terms, with_errors=True) if fits else None
    # reasons why the best fit may be wrong
    if best is None or best.mismatch > _UNLIKE or repeating(best) > _ANOTHER_LEG:
        return "the drive torque did not fit this leg at any crank angle: see drive_torque.sign"
    offset_rad, sigma_rad = best.offset_rad, best.sigma["offset_rad"]
    rivals = (one for one in fits if abs(math.remainder(one.offset_rad - offset_rad, TURN)) > _APART_RAD)
    rival = next(rivals, None)
    if rival and too_alike(best, rival):
        both = f"{offset_rad:.2f} and {rival.offset_rad:.2f} rad"
        return f"{both} explained the drive torque almost equally well"
    if sigma_rad > _SURE_RAD:
        return f"the zero was uncertain by {sigma_rad:.2g} rad. Expected {_SURE_RAD:g} rad"
    sigma_rad = math.hypot(sigma_rad, PHASE_ERROR_RAD)
    return Zero(round(offset_rad, _DIGITS), round(sigma_rad, _DIGITS), turns, best.mismatch)
