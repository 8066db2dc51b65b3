"""Further encoders in the monitor: their results go into reports, forecast and ledger."""

import math
from collections.abc import Mapping, Sequence

import attrs

from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.alarms import ENCODERS, worst_code
from leg_wear_monitor.monitor.angle_regression import ClearanceEstimate, ClearanceObservation
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.encoders import EncoderObserver, faults
from leg_wear_monitor.monitor.evaluation import AlarmBoard
from leg_wear_monitor.monitor.forecast.forecaster import RENEWED_NS
from leg_wear_monitor.monitor.forecast.wear_coefficients import ClearanceAtWear
from leg_wear_monitor.monitor.observer import Observer
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.monitor.verdict.situation import KnownClearance
from leg_wear_monitor.monitor.wear_model import WearModel
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin.sample import Samples
from leg_wear_monitor.twin.statistics import CycleStatistics


class EncoderWatch(Observer):
    """Watches the clearances by further encoders.

    Parameters
    ----------
    leg : WearModel
    board : AlarmBoard

    Attributes
    ----------
    encoders : EncoderObserver
    estimates : tuple of ClearanceEstimate or None
        Estimates of the last gait cycle, and whether the forecast uses them.
    """

    def __init__(self, leg: WearModel, board: AlarmBoard) -> None:
        self._leg, self._board = leg, board
        self.encoders = EncoderObserver(
            leg.mechanism,
            leg.config,
            [one.prior.sigma for one in leg.forecaster.coefficient_estimates],
            leg.ledger.commissioned if leg.ledger else None,
        )
        self.estimates: tuple[ClearanceEstimate, ...] | None = None
        self._known = 0  # measurements and corrections in the forecast when it was last updated

    def configure(self, config: MonitorConfig) -> None:
        """Use other parameters from now on."""
        self.encoders.config = config

    def go_live(self) -> None:
        """Never wait for simulations."""
        self.encoders.go_live()

    def leave(self) -> None:
        """Stop simulating ahead: the process is about to end."""
        self.encoders.leave()

    def add_samples(self, piece: Samples) -> None:
        """Add samples that the twin follows."""
        self.encoders.add_samples(piece)

    def end_cycle(self, statistics: CycleStatistics, is_refused: bool) -> None:
        """Estimate the clearances; they update the forecast each minute of stamps, or if something is new."""
        del is_refused
        self.encoders.ended(statistics)
        leg, state = self._leg, self.encoders.state
        estimates = self.encoders.estimates(statistics.clearance_mean_m)
        is_seen = [one.observation is ClearanceObservation.SEEN for one in estimates]
        other = tuple(one.is_other for one in estimates)
        known = len(leg.forecaster.measurements) + len(leg.forecaster.corrections)
        is_new = other != state.other or known != self._known
        is_due = is_new or not 0 <= statistics.stamp_ns - state.updated_ns < RENEWED_NS
        if is_due and any(is_seen):
            state.updated_ns, state.other, self._known = statistics.stamp_ns, other, known
            worn_m, replaced_ns = leg.worn_m(statistics.clearance_mean_m), leg.accounting.replaced_ns
            state.believed = tuple(
                is_seen[k]
                and leg.forecaster.use_estimate(
                    k, ClearanceAtWear(one.clearance_m, one.sigma_m, float(worn_m[k])), replaced_ns[k]
                )
                for k, one in enumerate(estimates)
            )
        believed = state.believed or (False,) * len(estimates)
        each = zip(estimates, believed, is_seen, strict=True)
        self.estimates = tuple(attrs.evolve(one, believed=yes and seen) for one, yes, seen in each)

    def end_period(self) -> None:
        """Evaluate the gait cycles that ended in an evaluation period."""
        twin = self._leg.twin
        new = self.encoders.end_period(twin.clearance_mean_m, twin.depth)
        if new:
            self._leg.accounting.note(new)

    def replaced(self, k: int) -> None:
        """Forget the estimates of the former part of joint k."""
        self.encoders.replaced()
        if self.estimates:
            none = ClearanceEstimate(observation=ClearanceObservation.WAITING)
            self.estimates = (*self.estimates[:k], none, *self.estimates[k + 1 :])

    @property
    def seen(self) -> Sequence[KnownClearance | None]:
        """Clearance of each joint estimated from encoders; None if it is not observable.

        The encoders were commissioned with the modelled clearances, whose error is in each estimate.
        """
        return [
            KnownClearance("encoders", one.clearance_m, math.hypot(one.sigma_m, tolerance_m))
            if one.observation is ClearanceObservation.SEEN
            else None
            for one, tolerance_m in zip(self.estimates or (), self._leg.tolerance_m, strict=False)
        ]

    @property
    def shows(self) -> str:
        """Source of the estimated clearances."""
        return "encoders"

    @property
    def notes(self) -> Mapping[str, Sequence[str]]:
        """Encoders that give nothing that can be used."""
        return {"ENCODER": faults(self._leg.config.encoders.names, self.encoders.state)}

    @property
    def statuses(self) -> Sequence[Status]:
        """Further encoders: their faults, their errors, and the clearances estimated from them."""
        names, state = self._leg.config.encoders.names, self.encoders.state
        kinds = {spec.kind for spec in alarm_specs.ENCODERS}
        departures = [alarm for alarm in self._board.alarms.values() if alarm.kind in kinds]
        level, code = max(alarm.level for alarm in departures), worst_code(departures)
        values = {"cycles": float(self.encoders.cycles)}
        for i, name in enumerate(names):
            kept = state.samples
            for what in ("samples", "absent", "no_angle"):
                values[f"{name}_{what}"] = float(getattr(kept, what)[i])
            if state.errors.known[i]:  # mean: offset of the crank's encoder, then offsets, then scale errors
                values[f"{name}_offset_rad"] = float(state.errors.centre_rad[i] + state.errors.mean[1 + i])
                values[f"{name}_scale_error"] = float(state.errors.mean[1 + len(names) + i])
        for joint, one in zip(self._leg.clearance_joints, self.estimates or (), strict=False):
            values[f"{joint}_estimated_m"] = one.clearance_m
            values[f"{joint}_sigma_m"] = one.sigma_m
            values[f"{joint}_departure_m"] = one.departure_m
        wrong = faults(names, state)
        if self.encoders.has_failed:
            wrong.append("no reference: the leg could not be simulated with its clearances")
        if wrong and level is Level.OK:
            level, code = Level.WARN, ENCODERS
        return (Status("encoders", level, "; ".join([*wrong, *self._words()]), values, code),)

    def _words(self) -> list[str]:
        """Joints that differ from the model, or the reason why there is no estimate."""
        if not self.estimates:
            return ["no whole gait cycle yet"]
        each = list(zip(self._leg.clearance_joints, self.estimates, strict=True))
        words = [
            f"joint {joint} is {'wider' if one.departure_m > 0.0 else 'narrower'} than modelled"
            for joint, one in each
            if one.is_other
        ]
        states = {one.observation for _, one in each}
        waiting = states & {ClearanceObservation.WAITING, ClearanceObservation.COMMISSIONING}
        if not words and not waiting and ClearanceObservation.SEEN in states:
            words = ["clearances agree with the modelled ones"]
        hidden = ClearanceObservation.NOT_OBSERVABLE
        words += [f"{joint} {hidden.value}" for joint, one in each if one.observation is hidden]
        return words + sorted(one.value for one in waiting)
