"""Joints for which a drive torque is good enough: the results of the monitor's tests on wider joints.

The signature of a wider joint is the signature of the measured leg plus the change that the simulated leg
shows with this joint. The tests and explanations of the diagnosis evaluate it, gait cycle by gait cycle.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import attrs
import numpy as np

from leg_wear_monitor.commissioning.result import CommissioningResult, JointDetection
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.estimate.cause import Cause
from leg_wear_monitor.estimate.change_detector import ChangeDetector
from leg_wear_monitor.estimate.explanations import Explainer, change_of, opened
from leg_wear_monitor.estimate.identification import misfit
from leg_wear_monitor.estimate.leg_model import explainer_of
from leg_wear_monitor.estimate.signature import (
    SAMPLES,
    CommissionedTorque,
    TorqueSensor,
    simulated_signatures,
)
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.parameters import config_from, values_of
from leg_wear_monitor.monitor.config.sections import drive_figures
from leg_wear_monitor.monitor.config.settings import LedgerFile, MonitorConfig
from leg_wear_monitor.monitor.diagnosis.gait_cycles import find_sensor, signed_cycle
from leg_wear_monitor.monitor.diagnosis.reference_file import (
    read_references,
    shipped_references,
    simulated_under,
)
from leg_wear_monitor.monitor.diagnosis.references import (
    COMMISSIONING_CYCLES,
    NAMED_TO,
    LegModels,
)
from leg_wear_monitor.monitor.diagnosis.state import (
    FIRST_CYCLES,
    NotUsed,
    SignedCycle,
    TorqueState,
)
from leg_wear_monitor.monitor.input_health import INPUT_RULES
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.recordings.bag import Recordable
from leg_wear_monitor.recordings.reader import Recording
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import CrankProfile, mean_profile
from leg_wear_monitor.twin.sample import NONE
from leg_wear_monitor.twin.torque_reference import (
    CYCLES,
    FRICTIONS,
    MASSES,
    PACE,
    WIDER,
    TorqueReference,
)

# A recording as the monitor sees it with the proposed parameters: gait cycles with their torques.


LEAST_CYCLES = 8  # without which the scatter of a gait cycle is not known
_SETTLING = 1  # gait cycles at the start of a walk, after which the joints move as in all others


@attrs.frozen(eq=False)
class Walk:
    """Gait cycles of a healthy leg.

    Attributes
    ----------
    mechanism : Mechanism
        With the parameters applied.
    config : MonitorConfig
    mismatch : (n,) array
        Torque residual in each gait cycle, as the monitor finds it.
    cycles : tuple of SignedCycle
        Gait cycles at the commanded cadence whose torque has a signature.
    sensor : TorqueSensor or None
        How the torque was measured, without its noise; None without torques.
    faults : tuple of str
        Faults of the input that the monitor reports, with their remedies.
    """

    mechanism: Mechanism
    config: MonitorConfig
    mismatch: Floats
    cycles: tuple[SignedCycle, ...]
    sensor: TorqueSensor | None
    faults: tuple[str, ...] = ()

    @property
    def profile(self) -> CrankProfile:
        """Mean motion of the crank in the gait cycles; at least one is there."""
        return mean_profile([cycle.profile for cycle in self.cycles])

    @property
    def new_m(self) -> Floats:
        """Clearances (k,) of a new leg [m]."""
        joints = self.mechanism.clearance_joints
        return np.array([self.mechanism.clearances[joint].radial_clearance for joint in joints])

    @property
    def baseline(self) -> CommissionedTorque:
        """The gait cycles as the baseline of a leg."""
        signatures = np.array([cycle.signature for cycle in self.cycles])
        return CommissionedTorque(self.cycles[-1].end_ns, self.new_m, signatures, speed=self.profile.speed)


def walk_of(
    recordings: Sequence[Recordable],
    config: MonitorConfig,
    joint_states: str | None,
    drive_torque: str | None,
) -> Walk:
    """Results of the monitor for recordings of a healthy leg.

    Parameters
    ----------
    recordings : sequence
        Recordings of the leg with the crank's zero of the parameters.
    config : MonitorConfig
        Proposed parameters.
    joint_states, drive_torque : str or None
        Topics, as asked for.

    Raises
    ------
    RecordingError
        If their topics cannot be told apart.
    """
    quiet = attrs.evolve(config.diagnosis, enabled=False)
    config = attrs.evolve(config, diagnosis=quiet, ledger=LedgerFile())
    mechanism = fitted(load_mechanism(config.mechanism), config)
    monitor, mismatch = WearMonitor(load_mechanism(config.mechanism), config), []
    cycles: list[SignedCycle] = []
    size_nm = torque_size(build_linkage(mechanism), config.cadence.commanded_rpm / 60.0 * TURN)
    state = TorqueState(np.zeros(len(mechanism.clearance_joints)))
    codes, faults = {rule.code for rule in INPUT_RULES}, dict[str, str]()
    with Recording(recordings, config, joint_states=joint_states, drive_torque=drive_torque) as recording:
        for block in recording.blocks():
            state.samples = state.samples.extended(block.samples)
            reports = monitor.update(block.samples)
            reported = (each.verdict for each in reports.verdicts)
            faults |= {one.fault_code: f"{one.why}: {one.do}" for one in reported if one.fault_code in codes}
            for one in reports.cycles:
                mismatch.append(one.torque_mismatch)
                before, is_short = state.sensor, len(cycles) < LEAST_CYCLES
                found = _signed(state, one, config, size_nm, is_short)
                cycles = [*(cycles if state.sensor is before else ()), *found]
                state.samples = state.samples.after(one.stamp_ns)
    signed = tuple(cycles[_SETTLING:])
    return Walk(mechanism, config, np.array(mismatch), signed, state.sensor, tuple(faults.values()))


def _signed(
    state: TorqueState, report: CycleReport, config: MonitorConfig, size_nm: float, is_short: bool
) -> list[SignedCycle]:
    """A gait cycle, if it was walked as commanded, without gaps, and has a signature.

    All are of one sensor, whose rate may be found anew while there are few.
    """
    if not config.cadence.allows(report.cadence_rpm) or report.bridged_s > 0.0:
        return []
    if is_short:
        find_sensor(state, report.begin_ns, report.stamp_ns, config, size_nm)
    found = signed_cycle(state, report.begin_ns, report.stamp_ns)
    if isinstance(found, NotUsed):
        state.leave_out(found)
        return []
    state.unused = ()
    return [found]


OPENED = (1.5, 2.0)  # 0.45 and 0.60 mm of the default leg's joints
SOON = 100  # gait cycles: by then, a joint twice as wide must be identified

# fraction of the simulated change, in the direction that a test looks at: legs in full coordinates, masses
# 4 % off, A, B, G, I, J at 0.45 mm, G, I at 0.60 mm, six sensors of 50 to 200 Hz, 0.5 and 3 N m, some behind
# 20 Hz, had 0.27 to 1.47, half of them 0.87 and more, four of five 0.57 and more (n = 42, 2026-11-24)
_USUAL, _AT_LEAST = 0.85, 0.6

_FIRST = 2  # gait cycles that an explanation needs at least
# log-odds x scatter by sqrt(2 x): with so much on average: nine of ten are sure of a change, and of its name
_SURELY, _SURELY_OF_NAME = 11.0, 18.0
_QUIETER = 0.25


def joint_detections(walk: Walk, reference: TorqueReference) -> tuple[JointDetection, ...]:
    """Detectability of each joint in the torque of a walk, with a reference for its crank's motion.

    Parameters
    ----------
    walk : Walk
        With enough signatures.
    reference : TorqueReference
    """
    if walk.sensor is None:
        return ()
    known = walk.baseline
    models = LegModels(walk.mechanism, drive_figures(walk.config.drive))
    sensor = models.channel(reference, walk.sensor, known)
    explainer = _commissioned(walk, reference, sensor, known)
    off = misfit(explainer.model, explainer.nuisances, known)
    found = _found(walk, explainer)
    if off >= NAMED_TO:
        why = (
            f"it does not fit this leg in the air (mean square {off:.2g}, names are sure up to "
            f"{NAMED_TO:g}): a load, other masses or lengths, or a drive that rubs or gives way"
        )
        return tuple(attrs.evolve(each, is_good=False, reason=why) for each in found)
    bad = [k for k, each in enumerate(found) if not each.is_good]
    if bad:
        reasons = _reasons(walk, reference, sensor, bad)
        found = [
            attrs.evolve(each, reason=f"{_why(each)}{reasons[k]}") if k in reasons else each
            for k, each in enumerate(found)
        ]
    return tuple(found)


def _commissioned(
    walk: Walk, reference: TorqueReference, sensor: TorqueSensor, known: CommissionedTorque
) -> Explainer:
    """Explainer of changes of the leg once the monitor has a whole baseline."""
    one = explainer_of(walk.mechanism, reference, sensor, known)
    part = min(1.0, known.cycles / COMMISSIONING_CYCLES)
    baseline = attrs.evolve(one.baseline, covariance=part * one.baseline.covariance)
    return Explainer(one.model, one.joints, baseline, one.nuisances, one.channels, one.noises, one.fresh_m)


def _found(walk: Walk, explainer: Explainer) -> list[JointDetection]:
    """The joints, without reasons."""
    new_m, config = walk.new_m, walk.config
    cycles = 60.0 * abs(config.cadence.commanded_rpm) * config.diagnosis.false_alarm_hours
    detector = ChangeDetector(explainer, new_m, cycles)
    counted = explainer.model.at(new_m)[0]
    found = []
    for k, joint in enumerate(explainer.joints):
        sizes = [factor * float(new_m[k]) for factor in OPENED]
        changes = [explainer.model.at(opened(new_m, k, size))[0] - counted for size in sizes]
        usual, least = (
            [counted + explainer.baseline.offset + part * change for change in changes]
            for part in (_USUAL, _AT_LEAST)
        )
        named = [_named(explainer, one, joint, new_m, _detected(detector, one)) for one in least]
        found.append(
            JointDetection(
                joint=joint,
                is_good=named[-1][0] <= SOON,
                clearances_m=tuple(sizes),
                cycles=tuple(_detected(detector, one) for one in usual),
                named_cycles=tuple(cycles for cycles, _ in named),
                runner_up=named[-1][1],
            )
        )
    return found


def _detected(detector: ChangeDetector, signature: Floats) -> float:
    """Mean number of gait cycles with a signature (F,) until it is detected; NaN if it is not."""
    gain = float(detector.with_cycle(detector.fresh(), signature, 1).sums.max())
    return max(float(_FIRST), detector.threshold / gain) if gain > 0.0 else math.nan


def _named(
    explainer: Explainer, signature: Floats, joint: str, new_m: Floats, detected: float
) -> tuple[float, str]:
    """Gait cycles until a signature (F,) surely is a wider joint, NaN if never; best other explanation."""
    runner_up = ""
    for cycles in _longer(detected):
        explanations = explainer.explanations(signature, cycles, new_m)
        other = next(one for one in explanations if one.cause is not Cause.UNKNOWN and one.subject != joint)
        runner_up = f"{other.cause.value} {other.subject}".strip()
        change = change_of(explanations, 1)
        if change is None or not change.is_sure or change.subject != joint:
            continue
        if change.log_odds >= _SURELY and change.runner_up_log_odds >= _SURELY_OF_NAME:
            return float(cycles), runner_up
    return math.nan, runner_up


def _longer(detected: float) -> Iterator[int]:
    """Numbers of gait cycles from detection on, each twice the one before."""
    cycles = math.ceil(detected) if math.isfinite(detected) else SOON + 1
    while cycles <= SOON:
        yield cycles
        cycles = min(2 * cycles, SOON) if cycles < SOON else SOON + 1


def _why(each: JointDetection) -> str:
    """Other explanation of a wider joint that is detected but not identified."""
    return f"{each.runner_up} explains as much, and " if each.runner_up else ""


def _reasons(walk: Walk, reference: TorqueReference, sensor: TorqueSensor, bad: list[int]) -> dict[int, str]:
    """Remedies that would make the torque good enough, by joint number."""
    reasons: dict[int, str] = {}
    for text, better in _better(sensor):
        left = [k for k in bad if k not in reasons]
        if left:
            simulated = simulated_signatures(reference, 0, better)[: len(walk.cycles)]
            known = CommissionedTorque(0, walk.new_m, simulated, speed=reference.profile.speed)
            found = _found(walk, _commissioned(walk, reference, better, known))
            reasons |= {k: text for k in left if found[k].is_good}
    nothing = "it changes the torque too little, however that is measured"
    return {k: reasons.get(k, nothing) for k in bad}


def _better(sensor: TorqueSensor) -> Iterator[tuple[str, TorqueSensor]]:
    """Sensors that are better in one respect, then in all, with the fault of the present sensor."""
    yield (
        "the torque varies from step to step by more than for a leg that walks steadily in the air",
        sensor,
    )
    rate, fast = 1.0 / sensor.period_s, SAMPLES / sensor.cycle_s
    faster = attrs.evolve(sensor, period_s=min(sensor.period_s, sensor.cycle_s / SAMPLES))
    if faster.period_s < sensor.period_s:
        yield f"{rate:.0f} samples a second are too few, {fast:.0f} would do", faster
    quieter = attrs.evolve(sensor, noise_nm=_QUIETER * sensor.noise_nm)
    noise = f"a noise of {sensor.noise_nm:.2g} N m is too strong, {quieter.noise_nm:.2g} N m would do"
    yield noise, quieter
    direct = attrs.evolve(sensor.channel, time_constant_s=0.0, mean_s=0.0)
    if sensor.channel.low_pass_s:
        hz = sensor.channel.bandwidth_hz
        yield f"a low-pass of {hz:.0f} Hz hides it", attrs.evolve(sensor, channel=direct)
    yield (
        f"rate ({rate:.0f} Hz), noise ({sensor.noise_nm:.2g} N m) and low-pass together hide it",
        attrs.evolve(faster, noise_nm=quieter.noise_nm, channel=direct),
    )


# The joints for which a recorded torque is good enough, by the reference that the monitor would use.


_PERIODS = 4  # evaluation periods in a gait cycle
_SIMULATED_SETTLING = 2  # simulated gait cycles of a leg that do not count


def with_detections(
    result: CommissioningResult,
    walk: Walk,
    file: str | Path | None,
    progress: Callable[[float], None] = lambda _fraction: None,
) -> CommissioningResult:
    """The result with the detectability of each joint.

    Parameters
    ----------
    result : CommissioningResult
        With proposed parameters.
    walk : Walk
    file : str, pathlib.Path or None
        File for a reference to simulate; None: use the existing reference.
    progress : callable

    Raises
    ------
    ConfigError
        If the file of the parameter ``diagnosis.reference`` cannot be read.
    LegWearError
        If a reference is asked for and cannot be simulated.
    """
    if len(walk.cycles) < LEAST_CYCLES or result.config is None:
        if file is not None:
            raise LegWearError(
                f"--reference: the recording has {len(walk.cycles)} gait cycles at "
                f"{walk.config.cadence.commanded_rpm:g} rpm with torques, expected at least {LEAST_CYCLES}"
            )
        used = f"joints are not judged: fewer than {LEAST_CYCLES} gait cycles at the commanded cadence"
        return attrs.evolve(result, reference_used=used)
    if file is not None:
        (made,) = simulated_under(walk.mechanism, [walk.profile], progress)
        values = {**values_of(result.config), "diagnosis.reference": str(file)}
        result = attrs.evolve(result, reference=made, config=config_from(values, "commission"))
        used = f"simulated for this recording, {file}"
        return attrs.evolve(result, joints=joint_detections(walk, made), reference_used=used)
    known, used = _known(walk)
    if known is None:
        return attrs.evolve(result, reference_used=_none(walk))
    return attrs.evolve(result, joints=joint_detections(walk, known), reference_used=used)


def _known(walk: Walk) -> tuple[TorqueReference | None, str]:
    """A reference of this leg for the recorded motion of its crank, and where it is from."""
    path, is_in_air = walk.config.diagnosis.reference, walk.config.load.model == NONE
    given = read_references(Path(path), walk.mechanism) if path else ()
    for one in (*given, *shipped_references(walk.mechanism)):
        if walk.profile.is_like(one.profile) and not (is_in_air and one.parameters.load.size):
            return one, path if any(one is each for each in given) else "the one that comes with the package"
    return None, ""


def _none(walk: Walk) -> str:
    """Message that there is no reference yet, and when the monitor will have it."""
    leg = walk.mechanism
    of_factors = len(leg.bodies) * len(MASSES) + len(FRICTIONS)
    legs = 1 + len(leg.clearance_joints) * len(WIDER) + of_factors
    cycles = FIRST_CYCLES + math.ceil((CYCLES * (legs + 1) + _SIMULATED_SETTLING * legs) / PACE / _PERIODS)
    rpm = walk.profile.cadence_rpm
    return (
        f"joints are not judged: there is no torque reference of {walk.mechanism.name} at {rpm:.3g} rpm. The "
        f"monitor simulates one while the leg walks, in {cycles} gait cycles "
        f"({60.0 * cycles / abs(rpm):.0f} s); --reference FILE simulates it now"
    )
