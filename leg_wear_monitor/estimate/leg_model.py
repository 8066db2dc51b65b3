"""The expected leg: its baseline, its changes besides clearances, and its masses, lengths and friction."""

import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.estimate.cause import Cause, NamedCause
from leg_wear_monitor.estimate.explanations import (
    Baseline,
    Explainer,
    LeftOut,
    Nuisance,
    OtherSensor,
)
from leg_wear_monitor.estimate.least_squares import Point, gauss_newton
from leg_wear_monitor.estimate.signature import (
    CommissionedTorque,
    SignatureModel,
    SimulatedSensor,
    TorqueSensor,
    ideal_torque,
    mean_signatures,
    signature_model,
    signature_of_torque,
    simulated_signatures,
)
from leg_wear_monitor.estimate.torque_model import body_torques
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.person import nominal_stance
from leg_wear_monitor.mechanism.position import TURN, Linkage, build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.load import load_shape, load_signatures
from leg_wear_monitor.twin.reference import MASS_TOLERANCE, LegParameters
from leg_wear_monitor.twin.references import (
    HEAVIER,
    LONGER,
    ROUGHER,
    TorqueReference,
    levels_of,
)

# usual changes of a leg that is all right: friction warms up, sensors drift, the ground differs
_FRICTION_CHANGE = 0.1  # fraction of the torque's size
_SCALE = 0.02
# a lag of 1.6 ms at 60 rpm, or a crank offset: at one speed, the two cannot be distinguished
_OFFSET_RAD = 0.01
_LOAD_N = 5.0
_LOAD_FRICTION = 0.03  # a gear that warms up
# fractions of the ground's peak force: its mean over some steps, and the harmonics of its vertical and
# fore-aft shape
_LOAD_FRACTION, _VERTICAL, _FORE_AFT_CHANGE, _LOAD_HARMONICS = 0.05, 0.01, 0.005, 8

# leg without a commissioning: tolerances of bodies and further errors of the model
_TOLERANCES = {Cause.MASS: MASS_TOLERANCE, Cause.LENGTH: 0.005}
_MEAN_ERROR = 0.05  # fraction of the torque's size, in each phase
_ROUGHNESS_ERROR = 0.15
_SENSOR_TOLERANCE = 5.0  # times the usual changes of friction, scale and lag

_SCALE_STEP, _OFFSET_STEP_RAD, _LOAD_FRICTION_STEP = 0.1, 0.03, 0.05
_MASS_STEP, _LENGTH_STEP = 0.05, 0.005

_LATER_S = 0.0025 * np.array([*range(-8, 0), *range(1, 13)])
_LATE_S = 0.005 * np.arange(0.5, 6.0)  # reference legs with a slower low-pass
_LATE_SIGMA_S = 0.0015  # about half of the step
_SLOWER_S = tuple(1.0 / (TURN * hz) for hz in (70.0, 35.0, 20.0, 10.0))
_NOISE_STEP = 0.16  # step of the noise's logarithm
_NOISE = 0.001 * np.exp(_NOISE_STEP * np.arange(40))  # fractions of the torque's size
_SENSOR_CYCLES = 20

# gait cycles that the expected covariance counts as: the other cycles are most probable if 50 measured cycles
# have a tenth to 0.45 of the weight, in the air and on the ground (2026-11-25)
_EXPECTED_CYCLES = 120
_PARTS = 5  # parts of the commissioned cycles; each part is tested against the others
_LEAST_PARTED = 4  # gait cycles: each part leaves a mean and a scatter


def nuisances(mechanism: Mechanism, reference: TorqueReference, sensor: TorqueSensor) -> list[Nuisance]:
    """Nuisances of a leg that walks as a reference does."""
    phases, speed = sensor.phases, reference.profile.speed
    constant = np.concatenate([np.full(phases, np.sign(speed)), np.zeros(phases)])
    scaled = _difference(reference, sensor, scale_step=_SCALE_STEP)
    shifted = _difference(reference, sensor, offset_step_rad=_OFFSET_STEP_RAD)
    rubbing = _difference(reference, sensor, load_friction_step=_LOAD_FRICTION_STEP)
    found = [
        Nuisance(Cause.FRICTION, "", constant, _FRICTION_CHANGE * sensor.size_nm),
        Nuisance(Cause.SCALE, "", scaled, _SCALE),
        # the samples' angle is too large where the torque comes late, and too small where the crank is ahead
        Nuisance(Cause.TIMING, "", -shifted, _OFFSET_RAD),
        Nuisance(Cause.LOAD_FRICTION, "", rubbing, _LOAD_FRICTION),
    ]
    # added torques, because behind a low-pass they change the roughness as well
    simulated = SimulatedSensor(reference, len(reference.torque_nm[0]), sensor)
    if mechanism.toe is not None:
        linkage = build_linkage(reference.parameters.in_air.applied(mechanism))
        found += _loads(linkage, reference.parameters.load, simulated)
    for name, mass, length in zip(mechanism.bodies, *body_torques(mechanism).at(speed), strict=True):
        found.append(Nuisance(Cause.MASS, name, simulated.slope(0, mass, _MASS_STEP), 0.0))
        found.append(Nuisance(Cause.LENGTH, name, simulated.slope(0, length, _LENGTH_STEP), 0.0))
    return found


def _loads(linkage: Linkage, known: Floats, simulated: SimulatedSensor) -> list[Nuisance]:
    """The ground's force: its size, and for a leg that walks under a known one (PHASES, 2) its shape, too."""
    usual = [(load_shape(linkage), _LOAD_N)]
    if known.size:
        stance = nominal_stance(linkage)
        peak_n = float((known @ stance.up).max())
        s, order = stance.fractions(), np.arange(1, _LOAD_HARMONICS + 1)
        waves = np.where(s <= 1.0, np.sin(0.5 * TURN * np.outer(order, s)), 0.0)
        usual = [(known / peak_n, _LOAD_FRACTION * peak_n)]
        usual += [(np.outer(one, stance.up), _VERTICAL * peak_n) for one in waves]
        usual += [(np.outer(one, stance.back), _FORE_AFT_CHANGE * peak_n) for one in waves]
    torques = load_signatures(linkage, [force for force, _ in usual])
    return [
        Nuisance(Cause.LOAD, "", simulated.slope(0, torque, spread), spread)
        for torque, (_, spread) in zip(torques, usual, strict=True)
    ]


def other_sensors(reference: TorqueReference, sensor: TorqueSensor) -> list[OtherSensor]:
    """Sensors that may take the place of a torque sensor: earlier, later, filtered, with other noise."""
    present, phases = sensor.channel, sensor.phases
    slower = [one for one in _SLOWER_S if one > present.time_constant_s]
    tried = [(late, present.time_constant_s) for late in _LATER_S]
    tried += [(late, time_constant_s) for time_constant_s in slower for late in (0.0, *_LATE_S)]
    channels = [
        attrs.evolve(present, delay_s=present.delay_s + later_s, time_constant_s=time_constant_s)
        for later_s, time_constant_s in tried
    ]
    own = simulated_signatures(reference, 0, sensor, cycles=_SENSOR_CYCLES)

    def other(cause: NamedCause, counted: float, changed: TorqueSensor) -> OtherSensor:
        each = simulated_signatures(reference, 0, changed, cycles=_SENSOR_CYCLES)
        # 20 gait cycles hardly give a variance per phase, but all phases together do
        more = (each.var(axis=0, ddof=1) - own.var(axis=0, ddof=1)).reshape(2, phases).mean(axis=1)
        scatter = np.repeat(np.maximum(more, 0.0), phases)
        return OtherSensor(cause, counted, each.mean(axis=0) - own.mean(axis=0), scatter)

    found = []
    for channel in channels:
        late_s = float(channel.lateness_s - present.lateness_s)
        late = NamedCause(Cause.LAG, late_s, _LATE_SIGMA_S)
        found.append(other(late, 0.0, attrs.evolve(sensor, channel=channel)))
    for noise_nm in (_NOISE * sensor.size_nm).tolist():
        if abs(math.log(noise_nm / max(sensor.noise_nm, _NOISE[0] * sensor.size_nm))) >= _NOISE_STEP:
            noise = NamedCause(Cause.NOISE, noise_nm, 0.5 * _NOISE_STEP * noise_nm)
            found.append(other(noise, sensor.noise_nm, attrs.evolve(sensor, noise_nm=noise_nm)))
    return found


def with_scatter_of(covariance: Floats, signatures: Floats) -> Floats:
    """Covariance (F, F) of a gait cycle in a leg that scatters as some commissioned cycles do.

    The sample covariance is shrunk to the expected one, whose variances are at least the measured ones.

    Parameters
    ----------
    covariance : (F, F) array
        Expected one.
    signatures : (n, F) array
        Measured gait cycles.
    """
    if len(signatures) < 2:
        return covariance
    measured = np.cov(signatures.T)
    more = np.maximum(0.0, np.diagonal(measured) - np.diagonal(covariance))
    weight = len(signatures) / (len(signatures) + _EXPECTED_CYCLES)
    return np.asarray(weight * measured + (1.0 - weight) * (covariance + np.diag(more)))


def parts_left_out(covariance: Floats, signatures: Floats) -> tuple[LeftOut, ...]:
    """Parts of some commissioned gait cycles, signatures (n, F), each compared with the others.

    Within the cycles that a covariance was made of, any test scatters less than in later ones.

    Parameters
    ----------
    covariance : (F, F) array
        Expected one, as in `with_scatter_of`.
    signatures : (n, F) array
    """
    if len(signatures) < _LEAST_PARTED:
        return ()
    found = []
    for part in np.array_split(np.arange(len(signatures)), min(_PARTS, len(signatures) // 2)):
        others = np.delete(signatures, part, axis=0)
        departures = signatures[part] - others.mean(axis=0)
        found.append(LeftOut(with_scatter_of(covariance, others), departures, len(others)))
    return tuple(found)


def commissioned_baseline(
    commissioned: CommissionedTorque,
    expected: Floats,
    covariance: Floats,
    left_out: tuple[LeftOut, ...] = (),
    places: Floats | float = 0.0,
) -> Baseline:
    """Baseline of a commissioned leg; the signature (F,) that is expected, covariance (F, F) of a cycle.

    The error of the reference of the expected leg is part of the difference, and cancels. The effect of other
    sample places, with its own covariance (F, F), does not cancel.
    """
    mean = commissioned.mean
    return Baseline(mean - expected, covariance / commissioned.cycles + places, left_out)


def unknown_baseline(found: list[Nuisance], sensor: TorqueSensor, covariance: Floats) -> Baseline:
    """Baseline of a leg that was never commissioned, with its tolerances.

    The covariance (F, F) belongs to the expected signature.
    """
    phases = sensor.phases
    sigma = np.repeat([_MEAN_ERROR * sensor.size_nm, _ROUGHNESS_ERROR], phases)
    covariance = covariance + np.diag(sigma**2)
    for one in found:
        spread = _TOLERANCES.get(one.cause, _SENSOR_TOLERANCE * one.spread)
        covariance += spread**2 * np.outer(one.column, one.column)
    return Baseline(np.zeros(2 * phases), covariance)


def _difference(
    reference: TorqueReference,
    sensor: TorqueSensor,
    scale_step: float = 0.0,
    offset_step_rad: float = 0.0,
    load_friction_step: float = 0.0,
) -> Floats:
    """Derivative of the expected leg's signature: by a factor on the torque, the crank's offset, friction."""

    def stepped(sign: float) -> Floats:
        own = sensor.channel
        channel = attrs.evolve(own, load_friction=own.load_friction + sign * load_friction_step)
        behind = attrs.evolve(sensor, channel=channel)
        scale, offset_rad = 1.0 + sign * scale_step, sign * offset_step_rad
        return np.asarray(simulated_signatures(reference, 0, behind, scale, offset_rad).mean(axis=0))

    step = scale_step or offset_step_rad or load_friction_step
    return np.asarray((stepped(1.0) - stepped(-1.0)) / (2.0 * step))


def explainer_of(
    mechanism: Mechanism,
    reference: TorqueReference,
    sensor: TorqueSensor,
    commissioned: CommissionedTorque | None,
) -> Explainer:
    """Explainer of changes of a leg, measured by a sensor whose noise is known."""
    model = signature_model(reference, sensor)
    found, joints = nuisances(mechanism, reference, sensor), mechanism.clearance_joints
    baseline = unknown_baseline(found, sensor, model.own * model.covariance + model.places)
    fresh_m = np.array([mechanism.clearances[joint].radial_clearance for joint in joints])
    own = Explainer(model, joints, baseline, found, other_sensors(reference, sensor), fresh_m)
    return own if commissioned is None else compared_with(own, commissioned)


def compared_with(own: Explainer, commissioned: CommissionedTorque) -> Explainer:
    """The same explainer of changes, as in `explainer_of`, but with a baseline."""
    model = own.model
    expected = model.at(commissioned.clearance_m)[0]
    left_out = parts_left_out(model.covariance, commissioned.signatures)
    covariance = with_scatter_of(model.covariance, commissioned.signatures)
    model = attrs.evolve(model, covariance=covariance)
    baseline = commissioned_baseline(commissioned, expected, covariance, left_out, model.places)
    return Explainer(model, own.joints, baseline, own.nuisances, own.sensors, own.fresh_m)


# Masses, lengths and friction of a commissioned leg, from its drive torque.
#
# A real leg differs a little from its mechanism file. The times of its impacts and the effect of a clearance
# depend on its masses, lengths and friction: a length that is 1 % off, or twice the friction, makes a
# reference name wrong joints. So the reference is simulated again with the parameters that explain the torque
# of the leg when it was commissioned.
#
# Simulated legs show the effect of each parameter near the simulated leg. All parameters are changed at once:
# with one leg for each, 4 % of a body's mass changed less than the scatter of simulated legs, and slopes of
# masses were noise.
#
# If a leg is far from its file, the torque with ideal joints leads near it: lengths that are 5 % off change
# this torque by half of its size.


# residual from which on a leg is identified, and the residual at which its steps end: scatter alone
# leaves 0.1 to 0.25, and 0.5 to 0.6 where samples fall at the same angles in each gait cycle. J at 0.45 mm
# was 0.48 to 0.50 mm where 0.39 was left, 0.54 at 0.58, and 0.62, or I was taken for it, at 0.68 (2026-11-26)
WORTH_IDENTIFYING, ONLY_SCATTER = 0.6, 0.45

FAR_FROM_FILE = 20.0  # torque residual above which the ideal torque is fitted first

_MASS, _LENGTH = 0.03, 0.006  # standard deviations of a leg's bodies about the file's bodies
_LOG_FRICTION = 0.7  # standard deviation of the logarithm of its friction: a factor of two, greased or not
_FAR = 0.03  # standard deviation of masses and lengths of a leg far from its file
_HARMONICS = 6  # harmonics of the torque that show masses and lengths rather than impacts
_IDEAL = 0.01  # effect of impacts on each harmonic, as a fraction of the torque's size
_STEP = 1.0e-4  # step of the differences for masses and lengths, in standard deviations
_DONE = 1.0e-3  # last step of masses and lengths
_LARGEST_LOG = 10.0  # largest logarithm of friction: far beyond a possible leg
_SENSOR = 5.0  # times the usual changes of friction, scale, offset and load: they are constant here

# a model with the right parameters is off by a part of the torque's size, by a part of its steps where it is
# steep, and in its roughness (docs/explanation/diagnosis.md)
_OF_SIZE, _OF_STEP, _ROUGHNESS = 0.005, 0.1, 0.1


def misfit(
    model: SignatureModel,
    nuisances: Sequence[Nuisance],
    commissioned: CommissionedTorque,
    expected: Floats | None = None,
) -> float:
    """Mean square of a model's residual for a commissioned leg, in units of its uncertainty.

    The expected signature (F,) may be of a different simulated leg than the model's.
    """
    expected = model.at(commissioned.clearance_m)[0] if expected is None else expected
    rest = commissioned.mean - expected
    covariance = _covariance(model, nuisances, commissioned.cycles)
    return float(rest @ np.linalg.solve(covariance, rest)) / len(rest)


def identified_leg(
    near: LegParameters,
    expected: Floats,
    varied: TorqueReference,
    model: SignatureModel,
    nuisances: Sequence[Nuisance],
    commissioned: CommissionedTorque,
) -> LegParameters:
    """Most probable parameters of a commissioned leg: one step of Gauss and Newton.

    Parameters that the torque does not show keep the file's values. Lengths are assumed to be as far from the
    file as the lengths of the leg near it.

    Parameters
    ----------
    near : LegParameters
        A leg near the commissioned one.
    expected : (F,) array
        Its simulated signature, with the clearances of the commissioned leg.
    varied : TorqueReference
        Legs of `begin_identification`. They need not be exactly near this leg: then further steps are needed.
    model : SignatureModel
    nuisances : sequence of Nuisance
    commissioned : CommissionedTorque
    """
    means, bodies = mean_signatures(varied, model.sensor), len(near.mass)
    # friction is positive, and known to a factor: its logarithm is the unknown
    before = np.concatenate([near.mass - 1.0, near.length - 1.0, [math.log(near.friction)]])
    far = float(np.sqrt(np.mean(np.square(near.length - 1.0))))
    steps = np.append(np.repeat([HEAVIER, LONGER], bodies), math.log(ROUGHER))
    sigma = np.append(np.repeat([_MASS, np.hypot(_LENGTH, far)], bodies), _LOG_FRICTION)
    levels = levels_of(near)[1:]
    slopes = means[1:].T @ levels / (len(levels) * steps)
    weighted = np.linalg.solve(_covariance(model, nuisances, commissioned.cycles), slopes)
    information = slopes.T @ weighted + np.diag(sigma**-2.0)
    rest = commissioned.mean - expected
    found = before + np.linalg.solve(information, weighted.T @ rest - before / sigma**2)
    mass, length, log_friction = np.split(found, [bodies, 2 * bodies])
    friction = math.exp(np.clip(log_friction.item(), -_LARGEST_LOG, _LARGEST_LOG))
    return attrs.evolve(near, mass=1.0 + mass, length=1.0 + length, friction=friction)


def leg_of_ideal_torque(
    mechanism: Mechanism, model: SignatureModel, commissioned: CommissionedTorque, speed: float, load: Floats
) -> LegParameters:
    """Approximate masses and lengths of a leg far from its file, from the torque with ideal joints.

    The ideal torques of this leg and of the file's leg differ as the measured mean torque differs from the
    model's, if impacts have the same part in both.

    Parameters
    ----------
    mechanism : Mechanism
    model : SignatureModel
        Model of the file's leg.
    commissioned : CommissionedTorque
    speed : float
        Speed of the crank [rad/s].
    load : (PHASES, 2) array
        Load of the model's leg [N], or none.
    """
    phases, bodies = model.sensor.phases, len(mechanism.bodies)
    unit = _IDEAL * model.sensor.size_nm
    rest = (commissioned.mean - model.at(commissioned.clearance_m)[0])[:phases]

    def bodies_at(x: Floats) -> LegParameters:
        return LegParameters(1.0 + _FAR * x[:bodies], 1.0 + _FAR * x[bodies:], load=load)

    def residual(x: Floats) -> Floats:
        torque = ideal_torque(bodies_at(x).applied(mechanism), speed) - of_file
        left = _harmonics(signature_of_torque(torque, model.sensor, speed)[:phases] - rest)
        return np.concatenate([left / unit, x])

    def at(x: Floats) -> Point:
        impossible = Point(np.full(1, np.inf), lambda: np.zeros((1, len(x))))
        if not bodies_at(x).is_possible(mechanism):
            return impossible
        try:
            now = residual(x)
        except AssemblyError:  # such a leg cannot move
            return impossible
        steps = _STEP * np.eye(len(x))
        return Point(now, lambda: np.array([residual(x + one) - now for one in steps]).T / _STEP)

    of_file = ideal_torque(bodies_at(np.zeros(2 * bodies)).applied(mechanism), speed)
    return bodies_at(gauss_newton(at, np.zeros(2 * bodies), done=_DONE).x)


def _harmonics(torque: Floats) -> Floats:
    """The mean and the first harmonics (1 + 2 n,) of a torque over the phases."""
    found = np.fft.rfft(torque)[: _HARMONICS + 1] / len(torque)
    return np.concatenate([found.real, found.imag[1:]])


def _covariance(model: SignatureModel, nuisances: Sequence[Nuisance], cycles: int) -> Floats:
    """Covariance (F, F) of the difference between a leg's mean signature over some cycles and its model."""
    phases = model.sensor.phases
    steep = np.hypot(_OF_SIZE * model.sensor.size_nm, _OF_STEP * np.exp(model.mean[phases:]))
    found = model.covariance * (1.0 / cycles + model.own)
    found = found + np.diag(np.concatenate([steep, np.full(phases, _ROUGHNESS)]) ** 2)
    for one in nuisances:
        found = found + (_SENSOR * one.spread) ** 2 * np.outer(one.column, one.column)
    return np.asarray(found)
