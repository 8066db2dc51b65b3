"""The parts of a monitor: their construction, and the state that they share."""

import math
from collections.abc import Sequence
from pathlib import Path

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import Cause, Change, TorqueExplanation
from leg_wear_monitor.estimate.torque_model import torque_model
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.materials import bushing_of
from leg_wear_monitor.mechanism.person import with_toe_force
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.accounting import Accounting
from leg_wear_monitor.monitor.config.fitting import fitted, twin_settings
from leg_wear_monitor.monitor.config.inputs import AT_START
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.crank_zero import CrankZero
from leg_wear_monitor.monitor.diagnosis.observer import TorqueObserver
from leg_wear_monitor.monitor.diagnosis.reference_file import read_references
from leg_wear_monitor.monitor.diagnosis.state import Body, Diagnosis, DiagnosisState
from leg_wear_monitor.monitor.encoders import EncoderObserver
from leg_wear_monitor.monitor.evaluation import (
    A_CYCLE,
    AlarmEvaluation,
    EvaluationPeriods,
)
from leg_wear_monitor.monitor.foot_load import FootLoadCheck
from leg_wear_monitor.monitor.forecast.forecaster import Forecaster
from leg_wear_monitor.monitor.forecast.growth import GrowthWindow
from leg_wear_monitor.monitor.forecast.model_error import ModelError, model_error
from leg_wear_monitor.monitor.gait_evidence import NO_MISMATCH, MismatchWindow, TorqueRecord
from leg_wear_monitor.monitor.input_health import InputJudge
from leg_wear_monitor.monitor.inputs import InputGuard
from leg_wear_monitor.monitor.ledger.entry import Measurement, SimulatedReference
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.monitor.reports import AlarmList, CycleReport
from leg_wear_monitor.monitor.verdict.verdict import estimate
from leg_wear_monitor.state import Verdict
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.sample import GROUND, NO_LOAD
from leg_wear_monitor.twin.statistics import Event
from leg_wear_monitor.twin.torque_reference import TorqueReference

WRONG_TORQUE = "the received drive torque is wrong; see the status `torque`"
ACCELERATED = "wear is accelerated: clearances grow within the gait cycles that are compared"
_CONTRADICTS = 3.0  # standard deviations between what the torque shows and what a person measured
# of a part, since it was measured, that wear it by little: at ten times the wear that is counted for joint A
# of the example in the air, 17 pm a gait cycle, 17 um; a correction is 90 um at least (diagnosis.md)
_LATELY_CYCLES = 100_000
_LEAST_BEFORE = 3  # kept gait cycles that show a leg without a change


@attrs.define
class MonitorState:
    """State beside twin, alarms and accounting; every value is immutable.

    ``findings`` are those of the last evaluation period; empty before the first. ``happened``: the last event
    of the twin. ``unexplained``: why a torque mismatch has no explanation; empty if it has one or there is
    none. ``has_ended``: whether a gait cycle has ended since the last state of the leg was reported.
    """

    growth: tuple[GrowthWindow, ...]
    torque: TorqueRecord
    last: CycleReport | None = None
    happened: Event | None = None
    findings: tuple[Verdict, ...] = ()
    mismatch: MismatchWindow = NO_MISMATCH
    unexplained: str = ""
    has_ended: bool = False


class Parts:
    """Parts of a monitor, and its state.

    Parameters
    ----------
    mechanism : Mechanism
    config : MonitorConfig
    ledger : Ledger or None

    Attributes
    ----------
    mechanism : Mechanism
        With the clearance joints and clearances of the configuration.
    config : MonitorConfig
        Replaced where parameters change.
    state : MonitorState
    """

    def __init__(self, mechanism: Mechanism, config: MonitorConfig, ledger: Ledger | None) -> None:
        self.config = config
        self.mechanism = fitted(mechanism, config)
        self.clearance_joints = self.mechanism.clearance_joints
        self.twin = DigitalTwin(self.mechanism, twin_settings(self.config))
        self.guard = InputGuard(self.twin.settings.tracker, self.twin.torque_size_nm)
        self.judge = InputJudge(self.config, self.twin.torque_size_nm)
        self.foot_load = (
            FootLoadCheck(self.mechanism, self.config) if self.config.foot_load.source != NO_LOAD else None
        )
        self.crank_zero = (
            CrankZero(torque_model(self.mechanism), self.config, self.twin.settings.tracker)
            if self.config.crank.zero == AT_START
            else None
        )
        self.accounting = Accounting(self.twin, ledger, self.config.ledger)
        cycle_ns = round(60.0e9 / abs(self.config.cadence.commanded_rpm))
        self.evaluation = AlarmEvaluation(self.twin, self.config, cycle_ns, self.guard)
        self.bushings = {joint: bushing_of(self.mechanism, joint) for joint in self.clearance_joints}
        self.forecaster = Forecaster(
            self.mechanism,
            self.config.forecast,
            ledger.measurements if ledger else (),
            self.accounting.replaced_ns,
            ledger.corrections if ledger else (),
        )
        self.encoders = (
            EncoderObserver(
                self.mechanism,
                self.config,
                [one.prior.sigma for one in self.forecaster.state.coefficient_estimates],
                ledger.commissioned if ledger else None,
            )
            if self.config.encoders.names
            else None
        )
        is_diagnosed = self.config.diagnosis.enabled and self.config.wear_acceleration == 1.0
        self.torque = self._torque_observer(ledger) if is_diagnosed else None
        if self.torque and self.torque.state.parameters and self.config.diagnosis.apply_corrections:
            self.twin.set_parameters(self.torque.state.parameters)
        if ledger and ledger.entry:
            board, stamp_ns = self.evaluation.board, ledger.entry.stamp_ns
            board.restore(ledger.entry.alarms)
            self.accounting.note_alarms(AlarmList(stamp_ns, tuple(board.alarms.values())))
        self._of_leg = self.twin.parameters, self._model_error()
        self.evaluation_periods = EvaluationPeriods(cycle_ns // A_CYCLE)
        self._fresh_m = [self.mechanism.clearances[joint].radial_clearance for joint in self.clearance_joints]
        kept = TorqueRecord.of(self.accounting.state.commissioned)
        self.state = MonitorState(tuple(GrowthWindow() for _ in self.clearance_joints), kept)

    def _torque_observer(self, ledger: Ledger | None) -> TorqueObserver:
        """The torque observer, with what files and the ledger know of this leg."""
        path = self.config.diagnosis.reference
        return TorqueObserver(
            self.mechanism,
            self.config,
            self.twin.torque_size_nm,
            self.twin.clearance_mean_m,
            ledger.commissioned_torques if ledger else (),
            self._known_parameters(ledger),
            (*(read_references(Path(path), self.mechanism) if path else ()), *self._known_references(ledger)),
        )

    def _known_parameters(self, ledger: Ledger | None) -> LegParameters | None:
        """Parameters of the leg in the ledger, in the order of the mechanism."""
        known = ledger.parameters if ledger else None
        return known.parameters.of_bodies(known.bodies, self.mechanism) if known else None

    def _known_references(self, ledger: Ledger | None) -> list[TorqueReference]:
        """Torque references of the ledger, with bodies in the order of the mechanism."""
        references = ledger.references if ledger else ()
        return [kept.reference.in_order_of(self.mechanism, kept.bodies) for kept in references]

    @property
    def model_error(self) -> ModelError:
        """What the growth may be off by masses, and by a load that was found; a measured one is known."""
        if self._of_leg[0] is not self.twin.parameters:
            self._of_leg = self.twin.parameters, self._model_error()
        return self._of_leg[1]

    def _model_error(self) -> ModelError:
        own, speed = self.twin.parameters, self.twin.settings.tracker.commanded_speed_radps
        sigma = own.load_sigma if self.config.load.model == GROUND else 0.0
        leg = with_toe_force(self.mechanism, own.load) if own.load.size else self.mechanism
        return model_error(leg, speed, self.config.wear_acceleration, sigma)

    def worn_m(self, clearance_m: Floats) -> Floats:
        """Wear of each part at some mean clearances [m]."""
        return np.asarray(clearance_m - self._fresh_m)

    def grows_anew(self, joints: Sequence[str]) -> None:
        """Discard the growth of some joints: what was counted of it is of another leg."""
        each = zip(self.clearance_joints, self.state.growth, strict=True)
        self.state.growth = tuple(GrowthWindow() if name in joints else window for name, window in each)

    @property
    def without_zero(self) -> str:
        """Why nothing is monitored while the crank's zero is not known; empty if it is."""
        return self.crank_zero.cause if self.crank_zero else ""

    @property
    def measured(self) -> tuple[Measurement | None, ...]:
        """Last measured clearance of each joint's present part."""
        return self.forecaster.last_measured(self.accounting.replaced_ns)

    @property
    def diagnosis(self) -> Diagnosis:
        """Clearances that the drive torque shows; empty while the received torque is wrong."""
        if self.torque:
            found = self.torque.diagnosis
            if not self.is_torque_wrong:
                own, contradictions = self.twin.parameters, map(self.contradiction, found.changes)
                return attrs.evolve(
                    found,
                    reason="; ".join(filter(None, (found.reason, self.state.unexplained, *contradictions))),
                    bodies=self._counted_bodies(),
                    friction=own.friction,
                    compliance=own.compliance,
                )
            settled = tuple(change for change in found.changes if change.is_corrected)
            return Diagnosis(
                state=DiagnosisState.WAITING,
                reason=WRONG_TORQUE,
                changes=settled,
                cycles_not_used=found.cycles_not_used,
            )
        return Diagnosis(
            reason=ACCELERATED if self.config.diagnosis.enabled else "diagnosis.enabled is false"
        )

    def contradiction(self, change: Change) -> str:
        """A measurement of the changed leg that contradicts the change of a clearance; empty without one.

        One from before the change says nothing of it. Before this run, another clock may have stamped it: it
        is of the changed leg unless kept gait cycles of this run show the leg before the change, or the part
        had walked many since.
        """
        if change.is_corrected or change.cause is not Cause.CLEARANCE:
            return ""
        k = self.clearance_joints.index(change.subject)
        measured, own = self.measured[k], self.accounting
        if measured is None:
            return ""
        begun = own.cycles_before - own.state.parts[k].cycles
        if measured.cycles > begun:
            is_since = measured.stamp_ns >= change.since_ns
        else:
            kept = self.torque.state.cycles if self.torque else ()
            before = sum(one.begin_ns < change.since_ns for one in kept)
            is_since = begun - measured.cycles <= _LATELY_CYCLES and before < _LEAST_BEFORE
        apart_m = abs(measured.clearance_m - change.value)
        if not is_since or apart_m <= _CONTRADICTS * math.hypot(measured.sigma_m, change.sigma):
            return ""
        return (
            f"the drive torque ({estimate(change.value, change.sigma, 'm')}) and a measurement "
            f"({estimate(measured.clearance_m, measured.sigma_m, 'm')}) of joint {change.subject} disagree, "
            "so its modelled clearance is not corrected: measure it again"
        )

    def _counted_bodies(self) -> tuple[Body, ...]:
        """Bodies of the twin; none where its parameters are those of the mechanism file."""
        own = self.twin.parameters
        if attrs.evolve(own.in_air, compliance=0.0) == LegParameters.none(self.mechanism):
            return ()
        factors = zip(self.mechanism.bodies, own.mass.tolist(), own.length.tolist(), strict=True)
        return tuple(Body(*one) for one in factors)

    @property
    def explanation(self) -> TorqueExplanation | None:
        """What explains a mismatch of the torque; None where the diagnosis names another cause."""
        explained = self.state.mismatch.explanation
        return None if explained and self.diagnosis.contradicts(explained) else explained

    @property
    def is_torque_wrong(self) -> bool:
        """Whether drive torque or crank angle are wrong as received, by what explains a mismatch."""
        explained = self.state.mismatch.explanation
        return explained is not None and explained.is_input_fault

    @property
    def unmeasured(self) -> frozenset[str]:
        """Alarms of the drive torque, if none came in the last gait cycle, or of what nothing shows now."""
        last = self.state.last
        is_gone = last is not None and not last.torque_samples
        silent = {
            "torque": is_gone or self.torque is None or self.is_torque_wrong,
            "encoders": self.encoders is None,
        }
        alarms = self.evaluation.board.alarms.values()
        shown = frozenset(alarm.name for alarm in alarms if silent.get(alarm.cause))
        return alarm_specs.OF_TORQUE | shown if is_gone else shown

    def leave(self) -> None:
        """Leave what is simulated ahead: the process is about to end."""
        for each in (self.encoders, self.torque):
            if each:
                each.leave()

    def keep(self, closed: bool = False) -> bool:
        """Write an entry into the ledger; return whether it is on the disk.

        The last one of a run keeps what is simulated of a reference: recordings are often shorter.
        """
        part = self.torque.part_of_reference if closed and self.torque else None
        if part is not None:
            names = tuple(self.mechanism.bodies)
            self.accounting.note(SimulatedReference(self.twin.intake.followed_stamp_ns, names, part))
        return self.accounting.keep(self.evaluation.board.alarms.values(), closed)
