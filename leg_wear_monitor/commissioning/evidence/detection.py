"""For which joints a drive torque is good enough: what the monitor's tests would find of wider joints.

The signature that a wider joint would have is that of the measured leg, changed as a simulated leg with this
joint changes. The tests and explanations of the diagnosis are asked about it, gait cycle by gait cycle.
"""

import math
from collections.abc import Iterator

import attrs

from leg_wear_monitor.commissioning.evidence.walk import Walk
from leg_wear_monitor.commissioning.result.joint_detection import JointDetection
from leg_wear_monitor.estimate.cause import Cause
from leg_wear_monitor.estimate.change_detector import ChangeDetector
from leg_wear_monitor.estimate.commissioned_torque import CommissionedTorque
from leg_wear_monitor.estimate.explanations import Explainer, opened
from leg_wear_monitor.estimate.identification import misfit
from leg_wear_monitor.estimate.leg_model import change_of, explainer_of
from leg_wear_monitor.estimate.signature import SAMPLES, TorqueSensor
from leg_wear_monitor.estimate.signature_model import simulated_signatures
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.monitor.config.drive import drive_figures
from leg_wear_monitor.monitor.diagnosis.leg_models import COMMISSIONING_CYCLES, NAMED_TO, LegModels
from leg_wear_monitor.twin.reference.torque_reference import TorqueReference

WIDER = (1.5, 2.0)  # 0.45 and 0.60 mm of the default leg's joints
SOON = 100  # gait cycles: until then, a joint twice as wide has to be named

# of the simulated change, in the direction that a test looks at: legs in full coordinates, masses 4 % off,
# A, B, G, I, J at 0.45 mm, G, I at 0.60 mm, six sensors of 50 to 200 Hz, 0.5 and 3 N m, some behind 20 Hz,
# had 0.27 to 1.47, half of them 0.87 and more, four of five 0.57 and more (n = 42, 2026-11-24)
_USUAL, _AT_LEAST = 0.85, 0.6

_FIRST = 2  # gait cycles that an explanation needs at least
# log-odds x scatter by sqrt(2 x): with so much on average, nine of ten are SURE_LOG_ODDS and more
_SURELY = 11.0
_QUIETER = 0.25


def joint_detections(walk: Walk, reference: TorqueReference) -> tuple[JointDetection, ...]:
    """What the torque of a walk will show of each joint, with a reference for its crank's motion.

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
            f"it is not that of this leg in the air (mean square {off:.2g}, names are sure up to "
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
    """What explains changes of the leg once the monitor has a whole baseline."""
    one = explainer_of(walk.mechanism, reference, sensor, known)
    part = min(1.0, known.cycles / COMMISSIONING_CYCLES)
    baseline = attrs.evolve(one.baseline, covariance=part * one.baseline.covariance)
    return Explainer(one.model, one.joints, baseline, one.nuisances, one.channels, one.fresh_m)


def _found(walk: Walk, explainer: Explainer) -> list[JointDetection]:
    """The joints, without reasons."""
    new_m, config = walk.new_m, walk.config
    cycles = 60.0 * abs(config.cadence.commanded_rpm) * config.diagnosis.false_alarm_hours
    detector = ChangeDetector(explainer, new_m, cycles)
    counted = explainer.model.at(new_m)[0]
    found = []
    for k, joint in enumerate(explainer.joints):
        sizes = [factor * float(new_m[k]) for factor in WIDER]
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
    """Gait cycles until a signature (F,) surely is a wider joint, NaN if never, and what else explains it."""
    runner_up = ""
    for cycles in _longer(detected):
        explanations = explainer.explanations(signature, cycles, new_m)
        other = next(one for one in explanations if one.cause is not Cause.UNKNOWN and one.subject != joint)
        runner_up = f"{other.cause.value} {other.subject}".strip()
        change = change_of(explanations, 1)
        if change is None or not change.is_sure or change.subject != joint:
            continue
        if min(change.log_odds, change.runner_up_log_odds) >= _SURELY:
            return float(cycles), runner_up
    return math.nan, runner_up


def _longer(detected: float) -> Iterator[int]:
    """Numbers of gait cycles from detection on, each twice the one before."""
    cycles = math.ceil(detected) if math.isfinite(detected) else SOON + 1
    while cycles <= SOON:
        yield cycles
        cycles = min(2 * cycles, SOON) if cycles < SOON else SOON + 1


def _why(each: JointDetection) -> str:
    """What else explains a wider joint that is detected but not named."""
    return f"{each.runner_up} explains as much, and " if each.runner_up else ""


def _reasons(walk: Walk, reference: TorqueReference, sensor: TorqueSensor, bad: list[int]) -> dict[int, str]:
    """For joints by number, what would make the torque good enough."""
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
    """Sensors that are better in one respect, then in all, with what is wrong with the present one."""
    yield (
        "the torque varies from step to step by more than that of a leg that walks steadily in the air",
        sensor,
    )
    rate, fast = 1.0 / sensor.period_s, SAMPLES / sensor.cycle_s
    faster = attrs.evolve(sensor, period_s=min(sensor.period_s, sensor.cycle_s / SAMPLES))
    if faster.period_s < sensor.period_s:
        yield f"{rate:.0f} samples a second are too few, {fast:.0f} would do", faster
    quieter = attrs.evolve(sensor, noise_nm=_QUIETER * sensor.noise_nm)
    noise = f"a noise of {sensor.noise_nm:.2g} N m is too strong, {quieter.noise_nm:.2g} N m would do"
    yield noise, quieter
    direct = attrs.evolve(sensor.channel, time_constant_s=0.0)
    if sensor.channel.time_constant_s:
        hz = 1.0 / (TURN * sensor.channel.time_constant_s)
        yield f"a low-pass of {hz:.0f} Hz hides it", attrs.evolve(sensor, channel=direct)
    yield (
        f"rate ({rate:.0f} Hz), noise ({sensor.noise_nm:.2g} N m) and low-pass together hide it",
        attrs.evolve(faster, noise_nm=quieter.noise_nm, channel=direct),
    )
