"""The measured foot load over the last gait cycles: size, heel strike and toe-off, and faults of its sensor.

The checks compare it with the template of stance (`mechanism.person`) and with the drive torque,
which a load at the foot needs by virtual work.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.files import or_nan
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.person import USUAL_PEAK_N, nominal_stance
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle, point_motion
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.alarms import (
    EXCHANGED,
    FOOT_LOAD_LIMITS,
    GAPS,
    SCALE,
    SIGN,
    STUCK,
    ZERO,
    code_of,
    worst_code,
)
from leg_wear_monitor.monitor.evaluation import AlarmBoard
from leg_wear_monitor.monitor.input_health import correlation
from leg_wear_monitor.monitor.observer import Observer
from leg_wear_monitor.monitor.reports import CycleReport, Status
from leg_wear_monitor.monitor.verdict.situation import ACTS
from leg_wear_monitor.monitor.verdict.verdict import rules
from leg_wear_monitor.monitor.wear_model import WearModel
from leg_wear_monitor.state import FootLoad, Level
from leg_wear_monitor.twin import KINDS, LOAD
from leg_wear_monitor.twin.following import FINE_PHASES
from leg_wear_monitor.twin.sample import CONTACT, MEASURED, NO_FAULT, Samples
from leg_wear_monitor.twin.statistics import CycleStatistics, LoadProfile, TorqueProfile, means_by_phase

_CYCLES = 10  # gait cycles over which the load is averaged
_LEAST_CYCLES = 3  # gait cycles from which on the sensor is checked
_NOISE_SIGMAS = 3.0  # a force that changes by less within a gait cycle, in units of its noise, is none
_OF_MEDIAN = 1.48  # standard deviation over the median deviation, of normal noise
# Fraction of the peak above which the foot stands. The template has the same fraction some time after heel
# strike and before toe-off; the difference is known, and subtracted (`_phase_bias`).
_STANCE_FRACTION = 0.25
_SWING_MARGIN = 0.08  # turns from the template's stance at which the foot is surely in the air
# Comparison with the drive torque: number of independent values in the residual of a gait cycle, standard
# deviations from which a load in the torque counts, and error of the torque by other masses and clearances,
# as a fraction of it.
_INDEPENDENT_PHASES, _SURE_SIGMAS, _MODEL_FRACTION = 16.0, 5.0, 0.1


class FootLoadCheck(Observer):
    """Averages the measured foot load over gait cycles, and checks its sensor.

    Parameters
    ----------
    leg : WearModel
    board : AlarmBoard

    Raises
    ------
    ConfigError
        If the toe of the mechanism does not move back and forth.
    """

    def __init__(self, leg: WearModel, board: AlarmBoard) -> None:
        self._twin, self._board = leg.twin, board
        mechanism, config = leg.mechanism, leg.config
        linkage = build_linkage(mechanism)
        self.is_contact = config.foot_load.source == CONTACT
        self._stance = stance = nominal_stance(linkage)
        # values at the middle of each phase
        self._expected = stance.force(points=2 * FINE_PHASES)[1::2] @ stance.up
        motion = one_cycle(linkage, 2 * FINE_PHASES, 1.0)
        speed = getattr(mechanism.drive, "speed", TURN)
        self._model_nm = _MODEL_FRACTION * float(
            np.sqrt(np.mean(one_cycle(linkage, FINE_PHASES, speed).drive_torque ** 2))
        )
        self._toe_per_turn = point_motion(motion, linkage, *(mechanism.toe or ("", "")))[1][1::2].T
        phase = (np.arange(FINE_PHASES) + 0.5) / FINE_PHASES
        # phases, starting at the margin before heel strike; stance lasts `whole` turns
        whole = (stance.turned * (stance.toe_off - stance.heel_strike)) % 1.0
        self._swing = (
            stance.turned * (phase - stance.heel_strike) + _SWING_MARGIN
        ) % 1.0 > whole + 2.0 * _SWING_MARGIN
        self._phase_bias = self._stance_phases(self._expected) - np.array(
            [stance.heel_strike, stance.toe_off]
        )
        self._load_acts = float(config.load.model == MEASURED)
        # last gait cycles with samples of the load: force (2, n), unexplained torque (n,) by phase, and 1 if
        # the twin walked under this load, so that its predicted torque contains it
        self._forces_n: tuple[Floats, ...] = ()
        self._unexplained_nm: tuple[Floats, ...] = ()
        self._have_acted: tuple[float, ...] = ()
        self._acted = 0.0  # the same for the present gait cycle; at first no mean is known
        self._largest_n = 0.0  # largest force received since the last gait cycle, unusable values included
        self._is_missing = False  # True if the last gait cycle had no sample
        self._is_frozen = False  # whether the samples do not act
        self._has_mean = False  # whether the twin knows a mean load of gait cycles
        self._is_noise = False  # whether the load of the last gait cycles is not above the sensor's noise
        self.values: dict[str, float] = {}

    def add_samples(self, piece: Samples) -> None:
        """Add received samples."""
        force = piece["foot_force_n"][(piece["kind"] == LOAD) & (piece["fault"] == NO_FAULT)]
        if len(force):
            largest = float(np.nan_to_num(np.abs(force)).max())
            self._largest_n = max(self._largest_n, largest)

    def end_cycle(self, statistics: CycleStatistics, is_refused: bool) -> None:
        """Check the load of a gait cycle; a wrong one does not act on the twin."""
        del is_refused
        self.values = self._checked(statistics)
        self._has_mean = self._twin.freeze_load(*self._freezes(self.values))

    def alarm_values(self, report: CycleReport) -> Mapping[str, float]:
        """Values of the sensor's alarms by their names."""
        del report
        values = dict.fromkeys(FOOT_LOAD_LIMITS, math.nan) | self.values
        return {spec.name(): spec.value(values) for spec in alarm_specs.FOOT_LOAD}

    def _checked(self, statistics: CycleStatistics) -> dict[str, float]:
        """Add a gait cycle; returns the values of the alarms that can be evaluated."""
        load = statistics.load
        # scaled so that a force at the end of its valid range has the limit of the alarm
        beyond = FOOT_LOAD_LIMITS[SCALE] * self._largest_n / KINDS[LOAD].largest
        self._largest_n, self._is_missing = 0.0, load is None
        if load is None:
            return {SCALE: beyond} if beyond > FOOT_LOAD_LIMITS[SCALE] else {}
        force_n, unexplained_nm = (
            means_by_phase(load.number, load.force_n),
            _unexplained(statistics.torque_profile),
        )
        self._forces_n = (*self._forces_n, force_n)[-_CYCLES:]
        self._unexplained_nm = (*self._unexplained_nm, unexplained_nm)[-_CYCLES:]
        self._have_acted = (*self._have_acted, self._acted)[-_CYCLES:]
        stuck = _stuck_fraction(load)
        self._is_noise = stuck < FOOT_LOAD_LIMITS[STUCK] and self._is_only_noise()
        stuck = 1.0 if self._is_noise else stuck
        values = {GAPS: load.gap_s / statistics.duration_s, STUCK: stuck}
        if stuck < FOOT_LOAD_LIMITS[STUCK]:
            values |= self._comparisons()
        return values | ({SCALE: beyond} if beyond > FOOT_LOAD_LIMITS[SCALE] else {})

    def _freezes(self, values: Mapping[str, float]) -> tuple[bool, bool]:
        """Two flags: the last gait cycle shows a wrong load or none; the load has always been wrong.

        A sensor that got stuck, lost its zero or went silent was right before; any other fault, and noise
        without a load, applies to earlier cycles as well.
        """
        wrong = {kind for kind, limit in FOOT_LOAD_LIMITS.items() if values.get(kind, 0.0) >= limit}
        is_frozen = self._is_missing or bool(wrong - {GAPS})
        clears = self._is_noise or bool(wrong - {GAPS, STUCK, ZERO})
        self._acted = 0.0 if clears else self._load_acts
        self._is_frozen = is_frozen
        return is_frozen, clears

    @property
    def acts(self) -> str:
        """Sentence on the foot load that acts on the leg."""
        if not self._load_acts:
            return "the model uses the load estimated from the drive torque, if there is one"
        if not self._has_mean:
            return "the model uses no load, so the modelled wear on the ground is too small"
        if self._is_frozen:
            return "the model uses the mean load of earlier gait cycles"
        return "the model uses the mean load of the last gait cycles"

    @property
    def load(self) -> FootLoad:
        """The load over the last gait cycles."""
        up = self._up_n
        if not len(up):
            return FootLoad()
        mean = up.mean(axis=0)
        found, several = self._stance_phases(mean), len(up) > 1
        spread = (np.array([self._stance_phases(each) for each in up]) - found + 0.5) % 1.0 - 0.5
        sigma = spread.std(axis=0, ddof=1).tolist() if several else [None, None]
        heel_strike, toe_off = ((found - self._phase_bias) % 1.0).tolist()
        size = up @ mean / (mean @ mean or 1.0)
        peak_n, scatter = float(mean.max()), float(size.std(ddof=1)) if several else math.nan
        return FootLoad(
            source="measured",
            peak_n=None if self.is_contact else peak_n,
            peak_sigma_n=peak_n * scatter if several and not self.is_contact else None,
            heel_strike_phase=heel_strike,
            toe_off_phase=toe_off,
            heel_strike_sigma=sigma[0],
            toe_off_sigma=sigma[1],
            cycles=len(up),
        )

    @property
    def mean_force_n(self) -> Floats | None:
        """Mean force (FINE_PHASES, 2) by phase along the axes of the mechanism [N]; None before the first."""
        return np.mean(self._forces_n, axis=0).T if self._forces_n else None

    @property
    def _up_n(self) -> Floats:
        """Vertical force (cycles, n) by phase [N]."""
        return np.array([self._stance.up @ force_n for force_n in self._forces_n])

    @property
    def notes(self) -> Mapping[str, Sequence[str]]:
        """Notes on the load that acts while the sensor is wrong."""
        return {ACTS: (self.acts,)}

    @property
    def leg_fields(self) -> Mapping[str, Any]:
        """The measured load."""
        return {"load": self.load} if self._forces_n else {}

    @property
    def statuses(self) -> Sequence[Status]:
        """The measured foot load, faults of its sensor, and outliers among its samples."""
        load, outliers = self.load, self._twin.intake.load_outliers
        alarms = [self._board.alarms[spec.name()] for spec in alarm_specs.OF_FOOT_LOAD]
        raised = [alarm for alarm in alarms if alarm.level is not Level.OK]
        level = max((alarm.level for alarm in raised), default=Level.OK)
        fields = attrs.asdict(load).items()
        values = {name: or_nan(value) for name, value in fields if not isinstance(value, str)}
        values["outliers"] = float(outliers)
        rows = [rules().get(code_of(alarm)) for alarm in raised]
        messages = [
            row.fault if row else f"see: {alarm.name}" for row, alarm in zip(rows, raised, strict=True)
        ]
        if messages:
            messages.append(self.acts)
        else:
            messages = ["measured" if load.cycles else "no whole gait cycle with samples yet"]
        if outliers:
            noun = "sample is an outlier" if outliers == 1 else "samples are outliers"
            messages.append(f"{outliers} {noun}, far from the samples before and after; not used")
        return (Status(KINDS[LOAD].name, level, "; ".join(messages), values, worst_code(raised)),)

    def _stance_phases(self, up: Floats) -> Floats:
        """Phases (2,) [turns] at which a vertical force rises and falls, around the middle of stance."""
        low = min(float(np.median(up)), 0.0)
        stands = up - low > _STANCE_FRACTION * (up.max() - low)
        angle = TURN * (np.arange(len(up)) + 0.5) / len(up)
        middle = math.atan2(float(np.sin(angle) @ stands), float(np.cos(angle) @ stands)) / TURN
        half = 0.5 * self._stance.turned * float(stands.mean())
        return np.array([middle - half, middle + half]) % 1.0

    def _comparisons(self) -> dict[str, float]:
        """Values of the alarms that compare the load with stance and with the drive torque or usual steps."""
        force = np.mean(self._forces_n, axis=0)
        up = self._stance.up @ force
        largest = float(np.abs(up).max())
        if len(self._forces_n) < _LEAST_CYCLES or not self._is_above_noise(up):
            return {}
        sign = -1.0 if -up.min() > up.max() else 1.0
        swings, expected = sign * (up - up.mean()), self._expected - self._expected.mean()
        fits = [correlation(swings, np.roll(expected, k)) for k in (0, FINE_PHASES // 2)]
        values = {EXCHANGED: fits[1] - fits[0], SIGN: max(0.0, -float(up.min()) / largest)}
        # with the sensor of the other foot, the next checks would compare stance with swing
        if not self.is_contact and values[EXCHANGED] < FOOT_LOAD_LIMITS[EXCHANGED]:
            values[ZERO] = abs(float(np.median(up[self._swing]))) / largest
            if sign > 0.0:
                values[SCALE] = self._scale_factor(force)
                is_step = all(values[kind] < FOOT_LOAD_LIMITS[kind] for kind in (SIGN, ZERO))
                if is_step and np.isnan(self._unexplained_nm).all():
                    # without a torque, its size as a step
                    values[SCALE] = max(1.0, USUAL_PEAK_N[0] / largest, largest / USUAL_PEAK_N[1])
        return values

    def _is_above_noise(self, up: Floats) -> bool:
        """True if the mean vertical force (n,) changes within a gait cycle by more than its noise."""
        cycles = self._up_n
        noise = float(cycles.std(axis=0, ddof=1).mean()) / math.sqrt(len(cycles))
        return float(up.std()) > _NOISE_SIGMAS * noise

    def _is_only_noise(self) -> bool:
        """True if the mean vertical force changes within a gait cycle by less than by the noise in swing.

        Unlike in `_is_above_noise`, steps that differ or are missed are a load, and one cycle in which the
        sensor failed does not count: most phases are in swing, and most cycles are sound.
        """
        cycles = self._up_n
        if len(cycles) < _LEAST_CYCLES:
            return False
        noise = _OF_MEDIAN * float(np.median(np.abs(cycles - np.median(cycles, axis=0))))
        return float(cycles.mean(axis=0).std()) < _NOISE_SIGMAS * noise / math.sqrt(len(cycles))

    def _scale_factor(self, force: Floats) -> float:
        """Factor between the load and its estimate from the drive torque, at least 1; NaN if unknown."""
        unexplained = np.mean(self._unexplained_nm, axis=0)
        if not np.isfinite(unexplained).all():
            return math.nan
        needed = -np.einsum("cn,cn->n", force, self._toe_per_turn)
        # regression of the unexplained torque on the load's torque, by virtual work; a constant is friction
        of_load, residual = needed - needed.mean(), unexplained - unexplained.mean()
        square = float(of_load @ of_load)
        if not square > 0.0:
            return math.nan
        shown = float(of_load @ residual) / square
        variance = float(np.mean((residual - shown * of_load) ** 2)) + self._model_nm**2
        sigma = math.sqrt(variance * FINE_PHASES / square / _INDEPENDENT_PHASES)
        # the part that the twin explains already
        shown += float(np.mean(self._have_acted))
        if shown > 1.0:
            return shown if shown > _SURE_SIGMAS * sigma else math.nan
        return min(1.0 / shown, 1.0e3) if 0.0 < shown < 1.0 - 2.0 * sigma else 1.0


def _unexplained(profile: TorqueProfile) -> Floats:
    """Measured minus predicted drive torque (n,) by phase [N m]; NaN without measured ones."""
    unexplained = (profile.measured_nm - profile.predicted_nm)[None]
    return np.asarray(means_by_phase(profile.number, unexplained)[0])


def _stuck_fraction(load: LoadProfile) -> float:
    """Fraction of the largest force, of either sign, that is constant over a gait cycle; 1 if it is stuck."""
    largest = max(abs(load.least_n), abs(load.largest_n))
    return 1.0 - min(1.0, (load.largest_n - load.least_n) / largest) if largest > 0.0 else 1.0
