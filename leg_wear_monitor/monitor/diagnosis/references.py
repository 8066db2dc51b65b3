"""The torque reference of a measured leg: chosen, simulated, renewed, and its parameters identified.

A reference is the drive torque of simulated legs: the expected leg, and legs with a changed clearance of one
joint. `LegModels` computes the models that follow from a reference and the state of the observer;
`References` decides which reference is used, and simulates it.
"""

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.estimate import signature
from leg_wear_monitor.estimate.channel import with_channel_of
from leg_wear_monitor.estimate.clearance_fit import ChangeDetector
from leg_wear_monitor.estimate.drive import DIRECT, UNDECLARED, DriveFigures
from leg_wear_monitor.estimate.explanations import Explainer
from leg_wear_monitor.estimate.ground_load import GroundLoad, ground_load
from leg_wear_monitor.estimate.leg_model import (
    FAR_FROM_FILE,
    ONLY_SCATTER,
    WORTH_IDENTIFYING,
    compared_with,
    explainer_of,
    identified_leg,
    leg_of_ideal_torque,
    misfit,
    nuisances,
)
from leg_wear_monitor.estimate.torque_model import body_torques
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references
from leg_wear_monitor.monitor.diagnosis.state import FIRST_CYCLES, SignedCycle, TorqueState
from leg_wear_monitor.twin.reference import CrankProfile, LegParameters, mean_profile
from leg_wear_monitor.twin.references import (
    CADENCES,
    LEAST_CLEARANCE_M,
    TorqueReference,
    TorqueReferenceRun,
    levels_of,
)

# Models that follow from the state of a `TorqueObserver`: explanations, tests and the residual.
#
# They are computed when first used, and again after their inputs have changed.


COMMISSIONING_CYCLES = 50  # gait cycles of a baseline: a recording of a minute at 60 rpm has them
PART_CYCLES = 10  # gait cycles of a baseline that a change ends: a mean and a scatter, in a sixth of a minute

# Residual above which the name of a joint is not sure: names are right up to a residual of 3 in the air,
# partly wrong at 23 with load friction of 20 %, and from 40 on the ground (docs/explanation/diagnosis.md).
NAMED_TO = 5.0

# A channel that makes the residual this many times as large is refused, because it indicates wrong lengths: 5
# times for leg c of benchmarks/diagnosis.py, whose lengths are 1 % off; true channels at most 1.9 times
# (under 300 N of load).
_CHANNEL_MISFIT_FACTOR = 2.5

# residual up to which a leg on the ground matches its reference once it was identified: other shapes of the
# force leave 1.2 to 1.5. Before, twice the friction in the joints left 1.1, and G was taken for B
_UNLIKE_ON_GROUND = 2.0

# largest residual of a matching leg whose clearances are corrected; I was taken for J at 0.68, J for I at
# 0.78
CORRECTED_TO = 0.65

_MOST_KEPT = 3  # latest sets of models: a baseline or a sensor that is tried, and the former one


class LegModels:
    """Models of a leg and of its torque sensor.

    Parameters
    ----------
    mechanism : Mechanism
    figures : DriveFigures, optional
        Declared values of the drive.
    """

    def __init__(self, mechanism: Mechanism, figures: DriveFigures = UNDECLARED) -> None:
        self._mechanism, self._figures = mechanism, figures
        kept = functools.lru_cache(maxsize=_MOST_KEPT)
        self._explainer_of = kept(functools.partial(explainer_of, mechanism))
        self._misfit_of = kept(_misfit_of)
        self._detector_of_last: tuple[Explainer, Floats, ChangeDetector] | None = None
        self._first: tuple[tuple[TorqueReference, int], Explainer] | None = None

    def warm_up(self) -> None:
        """Compute the torque's derivatives by masses and lengths now: later, samples would wait too long."""
        body_torques(self._mechanism)

    def explainer(self, state: TorqueState) -> Explainer:
        """Possible explanations of the measured torque: other clearances and other causes."""
        if state.reference is None or state.sensor is None:
            raise RuntimeError("there is no reference yet")
        return self._explainer_of(state.reference, state.sensor, state.commissioned)

    def detector(self, state: TorqueState, config: MonitorConfig) -> ChangeDetector:
        """Tests for a change of the modelled clearances."""
        own, modelled_m = self.explainer(state), state.modelled_m
        last = self._detector_of_last
        if last is None or last[0] is not own or last[1] is not modelled_m:
            last = self._detector_of_last = own, modelled_m, self._detector(own, state, config)
        return last[2]

    def _detector(self, explainer: Explainer, state: TorqueState, config: MonitorConfig) -> ChangeDetector:
        cycles = 60.0 * abs(config.cadence.commanded_rpm) * config.diagnosis.false_alarm_hours
        return ChangeDetector(explainer, state.modelled_m, cycles)

    def changed_within(self, state: TorqueState, cycles: Sequence[SignedCycle], config: MonitorConfig) -> int:
        """Stamp since when some gait cycles are not like those before them; 0 where all are alike.

        Each number of first gait cycles is a baseline for the rest, with the tests that are used later: a
        joint that opens while the leg is commissioned would otherwise become part of the baseline. If the
        leg does not match the reference, its drive may delay the torque: the first gait cycles show the
        drive dynamics.
        """
        own, most, since_ns = self.explainer(state), 0.0, 0
        if state.fit is None and len(cycles) > PART_CYCLES:
            own = self._behind_drive(state, state.baseline(cycles[:PART_CYCLES], state.modelled_m))
        for number in range(PART_CYCLES, len(cycles), PART_CYCLES):
            known = state.baseline(cycles[:number], state.modelled_m)
            detector = self._detector(compared_with(own, known), state, config)
            found = detector.fresh()
            for cycle in cycles[number:]:
                found = detector.with_cycle(found, cycle.signature, cycle.begin_ns)
                beyond = float(found.sums.max()) - detector.threshold
                if beyond > most:
                    most, since_ns = beyond, detector.detected_ns(found)
        return since_ns

    def _behind_drive(self, state: TorqueState, first: signature.CommissionedTorque) -> Explainer:
        """Explainer behind the drive dynamics of the first gait cycles; found once for these cycles."""
        reference, sensor = state.reference, state.sensor
        if reference is None or sensor is None:
            raise RuntimeError("there is no reference yet")
        key = reference, first.stamp_ns
        if self._first is None or self._first[0] != key:
            behind = self.channel(reference, sensor, first)
            self._first = key, explainer_of(self._mechanism, reference, behind, None)
        return self._first[1]

    def misfit(self, state: TorqueState) -> float:
        """Misfit between the commissioned leg and the reference; 0 if it is not known.

        It is not known for the baseline after a correction, since the corrected clearance is not exact.
        """
        commissioned = state.commissioned
        if state.reference is None or commissioned is None or not commissioned.is_as_modelled:
            return 0.0
        return self._misfit_of(self.explainer(state), commissioned)

    def channel(
        self, reference: TorqueReference, sensor: signature.TorqueSensor, known: signature.CommissionedTorque
    ) -> signature.TorqueSensor:
        """The sensor with the noise and the channel of a commissioned leg.

        Other lengths than expected move the impacts, as a delay does. A channel that explains the impacts of
        such a leg fits the mean torque much worse: it is refused, and the leg is to be identified.
        """
        columns = nuisances(self._mechanism, reference, attrs.evolve(sensor, channel=DIRECT))
        found = with_channel_of(reference, sensor, known.mean, columns, self._figures)
        plain = signature.with_noise_of(reference, attrs.evolve(sensor, channel=DIRECT), known.mean)
        if found == plain:
            return plain
        leg, model = self._mechanism, signature.signature_model
        with_channel, without = (
            misfit(model(reference, one), nuisances(leg, reference, one), known) for one in (found, plain)
        )
        return plain if with_channel > _CHANNEL_MISFIT_FACTOR * without else found

    def ground_load(self, state: TorqueState, reference: TorqueReference) -> GroundLoad:
        """Force of the ground on the commissioned leg; the reference may have a different force."""
        own, known, sensor = self.explainer(state), state.commissioned, state.sensor
        if known is None or sensor is None:
            raise RuntimeError("the leg is not commissioned yet")
        linkage = build_linkage(reference.parameters.in_air.applied(self._mechanism))
        model, columns = own.model, own.nuisances
        covariance = model.covariance * (1.0 / known.cycles + model.own)
        return ground_load(linkage, reference, sensor, known.mean, covariance, columns, self._figures)

    def fits(self, state: TorqueState) -> bool:
        """True if the reference explains the commissioned leg well enough to name a joint."""
        return not state.is_load_other and self.misfit(state) < NAMED_TO

    def is_of_file(self, state: TorqueState) -> bool:
        """True if the commissioned leg matches the mechanism file, or the identified parameters."""
        is_shape = state.is_loaded and state.rounds >= ROUNDS
        return self.misfit(state) < (_UNLIKE_ON_GROUND if is_shape else CORRECTED_TO)

    def is_sure(self, state: TorqueState) -> bool:
        """True if a clearance may be corrected: the leg is known, and its drive passes enough harmonics."""
        return not state.is_load_other and self.is_of_file(state) and not state.is_narrow


def _misfit_of(own: Explainer, commissioned: signature.CommissionedTorque) -> float:
    return misfit(own.model, own.nuisances, commissioned)


# The choice of the reference, its simulation in the background, and the identification of the leg.


# gait cycles alike without a reference until one is made for them; a change of the cadence has fewer
UNLIKE_CYCLES = 20

ROUNDS = 3  # most rounds of identification; later ones simulate how the parameters act near the leg so far
_STEPS = 4  # most steps in a round: each simulates one leg, and a step without improvement ends the round
_NEAR_CADENCE = 0.05  # fraction of the speed within which parameters act alike
LOAD_ROUNDS = 4  # rounds of finding the ground's force: friction and impacts change with it, and it with them

# a reference is renewed if a modelled clearance differs from its leg's by more than this fraction
_FAR_FRACTION = 0.1


class _Search(NamedTuple):
    """A round of identification: legs that show how each parameter acts, and the best leg so far."""

    varied: TorqueReference
    best: LegParameters
    misfit: float = math.inf
    steps: int = 0


class References:
    """Chooses the reference of a leg, and simulates it if required.

    Parameters
    ----------
    mechanism : Mechanism
    models : LegModels
    given : sequence of TorqueReference, optional
        References known beforehand: from files first, then from the ledger. The package's references follow.
        References simulated under a load are for a leg on the ground.
    part : TorqueReference or None
        Unfinished reference of an earlier run, which is continued if it fits.
    is_on_ground : bool
        True if the leg walks on the ground; then the force is identified.

    Attributes
    ----------
    may_be_late : bool
        True if the monitor never waits for simulations, see `TorqueReferenceRun`.
    simulated : tuple of TorqueReference
        References that were simulated in this run, the last one of each cadence, the newest first.

    Raises
    ------
    ConfigError
        If a reference that comes with the package cannot be read.
    """

    may_be_late = False

    def __init__(
        self,
        mechanism: Mechanism,
        models: LegModels,
        given: Sequence[TorqueReference] = (),
        part: TorqueReference | None = None,
        is_on_ground: bool = False,
    ) -> None:
        self._mechanism, self._models, self._part = mechanism, models, part
        self._is_on_ground = is_on_ground
        known = (*given, *shipped_references(mechanism))
        usable = [one for one in known if is_on_ground or not one.parameters.load.size]
        self._stored = [one for one in usable if not one.is_of_parameters]
        self._varied = [one for one in usable if one.is_of_parameters]
        self._search: _Search | None = None
        self.simulated: tuple[TorqueReference, ...] = ()
        self._run: TorqueReferenceRun | None = None

    @property
    def is_busy(self) -> bool:
        """True if legs are being simulated."""
        return self._run is not None and self._run.is_busy

    @property
    def percent(self) -> int:
        """Progress of the simulation [%]."""
        return math.floor(100.0 * self._run.progress) if self._run is not None else 0

    @property
    def is_late(self) -> bool:
        """True if a simulation is overdue: the machine is too slow."""
        return self._run is not None and self._run.is_late

    @property
    def cycles_left(self) -> float:
        """Commanded gait cycles until the simulation is complete."""
        return self._run.cycles_left if self._run is not None else 0.0

    @property
    def part(self) -> TorqueReference | None:
        """The unfinished reference with the legs simulated so far; None if there are none, or all are."""
        return self._run.part if self._run is not None else None

    def stop(self) -> None:
        """Forget the simulation that goes on."""
        self.leave()
        self._run = self._search = None

    def leave(self) -> None:
        """Stop simulating ahead, see `ReferenceRun.leave`."""
        if self._run is not None:
            self._run.leave()

    def advance(self, state: TorqueState, modelled_m: Floats, depth: Floats) -> bool:
        """Choose a reference, continue its simulation, or begin a new one if required.

        Returns
        -------
        bool
            True if the reference of the state was replaced, so that the kept cycles must be evaluated again.
        """
        is_elsewhere = state.is_elsewhere and len(state.waiting) >= FIRST_CYCLES
        stored = self._stored_like(state) if is_elsewhere else None
        if stored is not None and stored is not state.reference:
            state.turn_to(stored)
            return True
        if self._run is not None and self._run.is_busy:
            return self._continue(self._run, state, modelled_m, depth)
        if state.has_failed:
            return False
        if is_elsewhere and (state.reference is None or len(state.waiting) >= UNLIKE_CYCLES):
            self._begin(state.parameters, modelled_m, depth, _mean_motion(state.waiting))
            return False
        if state.reference is None or len(state.cycles) < FIRST_CYCLES:
            return False
        own, identified = state.reference.parameters, state.parameters
        if _is_far(state.reference, modelled_m):
            self._begin(identified or own, modelled_m, depth, state.profile)
        elif identified not in (None, own):  # from a different cadence or earlier
            self._begin(identified, modelled_m, depth, state.reference.profile)
        elif self._may_be_loaded(state):
            self._begin_under_load(state, state.reference, depth)
        elif self.is_to_identify(state):
            self._begin_identification(state, state.reference, modelled_m, depth)
        return False

    def is_to_identify(self, state: TorqueState) -> bool:
        """True if another round of identification is due for the commissioned leg.

        A leg that was identified in an earlier run is identified again only if it differs from that result.
        """
        if state.rounds >= ROUNDS or self.is_load_left_out(state):
            return False
        known, none = state.parameters, LegParameters.none(self._mechanism)
        is_known = not state.rounds and known is not None and known.in_air != none  # not its load alone
        if is_known and self._models.is_of_file(state):
            return False
        return self._models.misfit(state) >= WORTH_IDENTIFYING

    def is_load_left_out(self, state: TorqueState) -> bool:
        """True if the foot surely carries a load, but the configuration has the model walk without one."""
        return state.load is not None and state.load.is_sure and not self._is_on_ground

    def _may_be_loaded(self, state: TorqueState) -> bool:
        """True if the ground's force is to be estimated on a leg that has just been commissioned."""
        is_new = state.commissioned is not None and not state.load_rounds and self._mechanism.toe is not None
        return is_new and (self._is_on_ground or not self._models.is_of_file(state))

    def _begin_under_load(self, state: TorqueState, reference: TorqueReference, depth: Floats) -> None:
        """Estimate the ground's force with a reference, and begin to simulate the expected leg under it.

        If the configuration does not put the leg on the ground, the force is estimated to be reported only.
        """
        if state.commissioned is None:
            return
        # it was sure in the first round, or in an earlier session; later rounds only improve it
        is_known = state.load_rounds > 0 or reference.parameters.load.size > 0
        state.load, state.load_rounds = self._models.ground_load(state, reference), state.load_rounds + 1
        if self._is_on_ground and (is_known or state.load.is_sure):
            sigma = state.load.peak_sigma_n / max(state.load.peak_n, state.load.peak_sigma_n)
            parameters = attrs.evolve(reference.parameters, load=state.load.force, load_sigma=sigma)
            state.is_identifying = True
            self._running().begin_expected(
                state.commissioned.clearance_m, depth, reference.profile, parameters
            )

    def _begin_identification(
        self, state: TorqueState, reference: TorqueReference, modelled_m: Floats, depth: Floats
    ) -> None:
        """Begin a round of identification.

        The first round may start from parameters fitted with ideal joints, and uses stored legs that show how
        the parameters act, if there are any; otherwise these legs are simulated.
        """
        known = state.commissioned
        if known is None:
            return
        start, model, is_first = reference.parameters, self._models.explainer(state).model, not state.rounds
        off = self._models.misfit(state)
        state.rounds, state.is_identifying = state.rounds + 1, True
        clearance_m, profile, leg = known.clearance_m, reference.profile, self._mechanism
        is_far = is_first and not start.compliance and off >= FAR_FROM_FILE
        if is_far:
            ideal = leg_of_ideal_torque(leg, model, known, profile.speed, start.load)
            start = attrs.evolve(ideal, load_sigma=start.load_sigma)
        varied = self._varied_like(start, profile) if is_first else None
        if varied is not None:
            self._search = _Search(varied, start)
            if is_far:
                self._running().begin_expected(clearance_m, depth, profile, start)
            else:
                self._step(state, reference, model.at(clearance_m)[0], known, modelled_m, depth)
            return
        part = self._unfinished(start, profile, clearance_m, is_of_parameters=True)
        if part is not None:
            self._running().go_on(part, depth)
        else:
            self._running().begin_identification(clearance_m, depth, profile, start)

    def _varied_like(self, near: LegParameters, profile: CrankProfile) -> TorqueReference | None:
        """Stored legs that show how the parameters of a leg in the air act at about this cadence."""
        if near.load.size:
            return None
        alike = (
            one
            for one in self._varied
            if abs(one.profile.speed / profile.speed - 1.0) < _NEAR_CADENCE
            and one.parameters.compliance == near.compliance
            and not one.parameters.load.size
        )
        return next(alike, None)

    def _continue(
        self, run: TorqueReferenceRun, state: TorqueState, modelled_m: Floats, depth: Floats
    ) -> bool:
        """Continue the simulation for a period, and use the reference that it completes.

        Returns whether the state has a new reference. At a different cadence by now, a reference is stored
        until the leg returns, and an identification is repeated.
        """
        found = run.advance()
        if found is None:
            if not run.is_busy:
                self._abandon(state)
            return False
        is_here = state.reference is not None and found.profile.is_like(state.reference.profile)
        if state.is_identifying:
            state.is_identifying = False
            if is_here and state.commissioned is not None:
                self._identify(state, found, state.commissioned, modelled_m, depth)
            elif len(found.torque_nm) == 1 and self._search is None:
                state.load_rounds = 0
            else:
                state.rounds, self._search = state.rounds - 1, None
            return False
        others = (one for one in self.simulated if not found.profile.is_like(one.profile))
        self.simulated = (found, *others)[:CADENCES]
        return self._install(state, found) if is_here else False

    def _stored_like(self, state: TorqueState) -> TorqueReference | None:
        """A stored reference of the motion in the waiting gait cycles, preferably one of this leg."""
        profile, drive = _mean_motion(state.waiting), state.parameters.compliance if state.parameters else 0.0
        known = (one for one in (*self.simulated, *self._stored) if profile.is_like(one.profile))
        alike = [one for one in known if one.parameters.compliance == drive]
        return next((one for one in alike if one.parameters == state.parameters), next(iter(alike), None))

    def _running(self) -> TorqueReferenceRun:
        """The run, created when first needed."""
        if self._run is None:
            self._run = TorqueReferenceRun(self._mechanism)
            self._run.may_be_late = self.may_be_late
        return self._run

    def _begin(
        self, parameters: LegParameters | None, modelled_m: Floats, depth: Floats, profile: CrankProfile
    ) -> None:
        """Begin the simulation of a reference, or continue an earlier run's simulation."""
        own = parameters or LegParameters.none(self._mechanism)
        part = self._unfinished(own, profile, modelled_m)
        if part is not None:
            self._running().go_on(part, depth)
        else:
            self._running().begin(modelled_m, depth, profile, own)

    def _unfinished(
        self, own: LegParameters, profile: CrankProfile, clearance_m: Floats, is_of_parameters: bool = False
    ) -> TorqueReference | None:
        """The unfinished reference of an earlier run, if it is of such legs; otherwise None."""
        part = self._part
        if part is None or part.is_of_parameters is not is_of_parameters or part.parameters != own:
            return None
        if is_of_parameters and len(part.clearance_m) != len(levels_of(own)):  # written by an earlier version
            return None
        return part if profile.is_like(part.profile) and not _is_far(part, clearance_m) else None

    def _identify(
        self,
        state: TorqueState,
        legs: TorqueReference,
        known: signature.CommissionedTorque,
        modelled_m: Floats,
        depth: Floats,
    ) -> None:
        """Go on with simulated legs: with a leg under the ground's force, or near the identified parameters.

        Under a load, the force is found again, or is final.
        """
        is_under_load = len(legs.torque_nm) == 1 and self._search is None
        if is_under_load and state.load_rounds < LOAD_ROUNDS:
            self._begin_under_load(state, legs, depth)
        elif is_under_load:
            state.parameters = legs.parameters
            self._begin(state.parameters, modelled_m, depth, legs.profile)
        else:
            if len(legs.torque_nm) > 1:
                self._search = _Search(legs, legs.parameters)
            expected = signature.mean_signatures(legs, self._models.explainer(state).model.sensor)[0]
            self._step(state, legs, expected, known, modelled_m, depth)

    def _step(
        self,
        state: TorqueState,
        near: TorqueReference,
        expected: Floats,
        known: signature.CommissionedTorque,
        modelled_m: Floats,
        depth: Floats,
    ) -> None:
        """Step from a leg near the commissioned one, with its expected signature (F,), to a nearer one.

        At the end of the round, a reference of the nearest leg begins. Another round may follow: the drive
        dynamics of a leg with other lengths are known only then.
        """
        search, own = self._search, self._models.explainer(state)
        if search is None:
            raise RuntimeError("no identification has begun")
        off = misfit(own.model, own.nuisances, known, expected)
        is_better = off < search.misfit
        if is_better:
            search = search._replace(best=near.parameters, misfit=off)
        if is_better and search.steps < _STEPS and (not search.steps or off >= ONLY_SCATTER):
            found = identified_leg(near.parameters, expected, search.varied, own.model, own.nuisances, known)
            if found.is_possible(self._mechanism):
                self._search, state.is_identifying = search._replace(steps=search.steps + 1), True
                self._running().begin_expected(known.clearance_m, depth, near.profile, found)
                return
        self._search, before = None, state.reference.parameters if state.reference else None
        state.parameters, state.is_identifying = search.best, False
        if search.best != before:
            self._begin(search.best, modelled_m, depth, near.profile)

    def _abandon(self, state: TorqueState) -> None:
        """Give up a simulation that failed: keep the reference, or report the failure without one."""
        state.waiting, self._search = (), None
        if state.reference is None:
            state.has_failed = True
        else:
            state.is_identifying, state.parameters, state.rounds = False, state.reference.parameters, ROUNDS

    def _install(self, state: TorqueState, reference: TorqueReference) -> bool:
        """Use a new reference at the present cadence; return whether it is used.

        A reference with identified parameters must explain the leg at least as well as the former one;
        otherwise the former one stays, and the identification ends.
        """
        before, misfit_before, sensor = state.reference, self._models.misfit(state), state.sensor
        if before is None:
            raise RuntimeError("there is no reference yet")
        state.reference = reference
        own, former = reference.parameters, before.parameters
        is_new_load = not np.array_equal(own.load, former.load)
        if is_new_load and sensor is not None and state.commissioned is not None:
            # the channel was found without the load, which hides load friction
            state.sensor = self._models.channel(reference, sensor, state.commissioned)
        if own == former or self._models.misfit(state) <= misfit_before:
            return True
        state.reference, state.sensor = before, sensor
        state.rounds, state.parameters = ROUNDS, former
        self.simulated = tuple(one for one in self.simulated if one is not reference)
        return False


def _mean_motion(cycles: Sequence[SignedCycle]) -> CrankProfile:
    """Mean motion of the crank in some gait cycles."""
    return mean_profile([cycle.profile for cycle in cycles])


def _is_far(reference: TorqueReference, modelled_m: Floats) -> bool:
    """True if the expected leg of a reference has other clearances than the modelled ones (k,) [m]."""
    expected_m = np.maximum(modelled_m, LEAST_CLEARANCE_M)  # no leg is simulated with less
    return bool((np.abs(reference.clearance_m[0] / expected_m - 1.0) > _FAR_FRACTION).any())
