"""The result of commissioning: parameters with their intervals, their file, and undetermined parameters."""

import math
from collections.abc import Iterator, Sequence
from io import StringIO
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
from ruamel.yaml import YAML

from leg_wear_monitor.commissioning.evidence import (
    Timing,
    cadence_rpm,
    cadences_rpm,
    sampling_of,
    separates_lag,
    timing_of,
    with_load,
)
from leg_wear_monitor.commissioning.search import SAME_GEAR, Choice
from leg_wear_monitor.configuration import part_document
from leg_wear_monitor.errors import LegWearError, printable
from leg_wear_monitor.estimate.drive import DriveFigures
from leg_wear_monitor.estimate.joint_motion import JointMotion, with_repeating_acceleration
from leg_wear_monitor.estimate.torque_model import Fit, Terms, TorqueModel, fit, repeating
from leg_wear_monitor.files import data_frame, json_text
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.inputs import FLOAT64, INTERFACE, MAX_LAG_S, WRENCH
from leg_wear_monitor.monitor.config.parameters import MARK, PARAMETERS, nested, values_of
from leg_wear_monitor.monitor.config.settings import MonitorConfig, drive_figures
from leg_wear_monitor.recordings.findings import Finding
from leg_wear_monitor.twin.references import TorqueReference

if TYPE_CHECKING:
    import pandas as pd


# The ROS parameter file: parameters that differ from the defaults, which `config/monitor.yaml` lists.


_HEAD_LINES = (
    "Parameters of the monitor, proposed by `leg-wear-monitor commission`; others have their defaults.",
    "crank angle = sign * position / gear_ratio + offset_rad",
    "torque on the crank = sign * scale * gear_ratio * value",
)
# parameters that are written even if they have their default, because a leg depends on them
_ALWAYS_WRITTEN = ("mechanism", "crank_joint", "crank.", "drive_torque.", "cadence.")


def parameter_text(config: MonitorConfig, remarks: Sequence[str]) -> str:
    """Text of a parameter file, with remarks as comments at its head."""
    head = "".join(f"# {printable(line)}\n" for line in (*_HEAD_LINES, *remarks))
    written = {
        name: value
        for name, value in values_of(config).items()
        if value != () and (value != PARAMETERS[name].default or name.startswith(_ALWAYS_WRITTEN))
    }
    stream = StringIO()
    yaml: Any = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False
    yaml.dump({"/**": {MARK: nested(written)}}, stream)
    return head + stream.getvalue()


# The result: each parameter with its second-best value, the undetermined parameters, and the quantities that
# do not fit.


SCHEMA_VERSION = 1


@attrs.frozen(kw_only=True)
class CommissioningItem:
    """A quantity that commissioning determines.

    Attributes
    ----------
    name : str
        A parameter of the monitor, or another measured quantity.
    value : str, int or float
        NaN if it cannot be determined.
    unit : str
        Unit of the value; empty for a name or a ratio.
    sigma : float, optional
        Standard deviation, in the unit.
    mismatch : float, optional
        Torque residual: RMS of the torque that this value leaves unexplained, as a fraction of the torque's
        RMS.
    other : str, int, float or None
        The runner-up.
    other_mismatch : float, optional
        Torque residual of the runner-up.
    remark : str
        Further information.
    """

    name: str
    value: str | int | float
    unit: str = ""
    sigma: float | None = None
    mismatch: float | None = None
    other: str | int | float | None = None
    other_mismatch: float | None = None
    remark: str = ""


@attrs.frozen(kw_only=True)
class CommissioningResult:
    """Result of commissioning.

    Attributes
    ----------
    items : tuple of CommissioningItem
        The quantities, one by one.
    not_told : tuple of str
        Parameters that the recording does not determine, and why.
    findings : tuple of str
        Quantities that do not fit, and the remedy.
    notes : tuple of str
        Further information.
    config : MonitorConfig or None
        The proposed parameters; None if a choice between alternatives is not certain.
    turns : float
        Turns of the crank in the recording.
    faults : tuple of Finding
        Faults of the recordings, whose other parts were used.
    reference : TorqueReference or None
        Reference simulated for ``diagnosis.reference``, if it was requested.
    """

    items: tuple[CommissioningItem, ...]
    not_told: tuple[str, ...]
    findings: tuple[str, ...]
    notes: tuple[str, ...]
    config: MonitorConfig | None
    turns: float
    faults: tuple[Finding, ...] = ()
    reference: TorqueReference | None = None

    @property
    def is_sure(self) -> bool:
        """True if every parameter was determined, and everything fits."""
        return self.config is not None and not self.not_told and not self.findings

    @property
    def remarks(self) -> list[str]:
        """Parameters that are not determined, contradictions, and notes, one line each."""
        labels = {"not determined": self.not_told, "does not fit": self.findings, "note": self.notes}
        return [f"{label}: {text}" for label, texts in labels.items() for text in texts]

    def item(self, name: str) -> CommissioningItem:
        """The item of a name; raises KeyError if there is none."""
        return {each.name: each for each in self.items}[name]

    def to_dict(self) -> dict[str, Any]:
        """Plain object for JSON; null for a value that cannot be determined."""
        return {
            "schema_version": SCHEMA_VERSION,
            "turns": self.turns,
            "is_sure": self.is_sure,
            "items": part_document(self.items),
            "not_enough_to_tell": list(self.not_told),
            "findings": list(self.findings),
            "notes": list(self.notes),
        }

    def to_json(self) -> str:
        """Text of `to_dict`, as ``commission --json`` writes it."""
        return json_text(self.to_dict())

    def to_pandas(self) -> "pd.DataFrame":
        """Table of the items, a row each.

        Raises
        ------
        LegWearError
            If pandas is not installed.
        """
        rows = [attrs.asdict(item) for item in self.items]
        columns = {key: [row[key] for row in rows] for key in rows[0]}
        return data_frame(columns, index="name")

    def to_yaml(self) -> str:
        """Parameter file of the monitor; uncertain parameters are comments at its head.

        Raises
        ------
        LegWearError
            If no parameters are proposed.
        """
        if self.config is None:
            raise LegWearError(f"no parameters are proposed: {'; '.join(self.not_told)}")
        return parameter_text(self.config, self.remarks)


# The measured quantities: the chosen fit again, with the terms that the recording determines and the lag to
# allow for.

_AS_WELL = 1.02  # a fit is as good as the best fit up to this ratio of torque residuals
# fraction of the torque's RMS, half of its energy: legs with clearance have 0.03 to 0.05 with averages, 0.3
# to 0.45 with instants at 50 to 200 Hz (full coordinates, 60 rpm)
_UNEXPLAINED = 0.7
# factor on the errors of friction if the foot carries a load, because its shape is uncertain
_UNDER_LOAD = 3.0


@attrs.frozen(eq=False)
class Found:
    """Measured quantities from which the parameters are derived.

    Attributes
    ----------
    choice : Choice
    fit : Fit
        With the lag to allow for.
    motion : JointMotion
        Motion of the chosen joint.
    sampling, why_sampling : str
        Sampling of the torque, empty if it is not known, and why.
    timing : Timing
    declared : DriveFigures
    base : MonitorConfig
    """

    choice: Choice
    fit: Fit
    motion: JointMotion
    sampling: str
    why_sampling: str
    timing: Timing
    declared: DriveFigures
    base: MonitorConfig

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why nothing is proposed; empty if the choice is sure, and explains the torque."""
        mismatch = self.fit.mismatch
        if mismatch < _UNEXPLAINED:
            return self.choice.doubts
        sentence = f"the torque: {100.0 * mismatch:.0f} % of its RMS does not fit, whatever the parameters"
        return (*self.choice.doubts, sentence)

    def friction(self, name: str) -> tuple[float, float]:
        """Friction on the crank and its standard deviation: constant [N m], or relative to the torque."""
        one = self.fit
        by_clearances = one.error.load_friction * abs(one.gain)
        if name == "friction":
            by_clearances = one.error.friction * float(one.predicted.std())
        by_clearances *= _UNDER_LOAD if "load" in one.linear else 1.0
        return one.linear[name] / one.gain, math.hypot(one.sigma[name], by_clearances) / abs(one.gain)


def found_of(choice: Choice, motion: JointMotion, model: TorqueModel, base: MonitorConfig) -> Found:
    """Everything that the recording says about the chosen joint and torque."""
    one, declared = choice.best.fit, drive_figures(base.drive)
    terms = Terms(bias=one.pair.walks_both_ways, load_friction=True, lag=separates_lag(one.pair))
    # a repeating acceleration has less noise, but lacks the acceleration of a ramp
    pairs = one.pair, with_repeating_acceleration(one.pair, one.ratio)
    own, smoother = (fit(pair, model, one.refined, terms, with_errors=True) for pair in pairs)
    again = smoother if smoother.mismatch <= _AS_WELL * own.mismatch else own
    again, terms = with_load(again, model, terms)
    sampling, why = sampling_of(again, model)
    timing = timing_of(again, sampling or base.drive_torque.sampling, bool(sampling), declared)
    start = attrs.evolve(again.refined, lag_s=timing.lag_s)
    settled = fit(again.pair, model, start, attrs.evolve(terms, lag=False), with_errors=True)
    return Found(choice, settled, motion, sampling, why, timing, declared, base)


# A gear's ratio is the ratio of two numbers of teeth: the simplest fraction within a measurement's error.


_SURE = 3.0  # standard deviations
_DRIFT_RAD = 0.05  # phase shift by clearances over a recording
_LARGEST_DENOMINATOR = 20
_BY_CHANCE = 0.1  # number of fractions that may be within the error by chance


def exact_ratio(measured: float, error: float) -> float | None:
    """The simplest fraction within a relative error; None if no fraction fits, or if a fit may be chance.

    Parameters
    ----------
    measured : float
        Gear ratio above 0; below 1, its inverse is taken for a fraction.
    error : float
        Largest relative error.
    """
    if measured < 1.0:
        inverse = exact_ratio(1.0 / measured, error)
        return None if inverse is None else 1.0 / inverse
    fractions = 0
    for denominator in range(1, _LARGEST_DENOMINATOR + 1):
        fractions += denominator
        if 2.0 * error * measured * fractions > _BY_CHANCE:
            return None
        numerator = round(measured * denominator)
        if abs(numerator / denominator / measured - 1.0) <= error:
            return numerator / denominator
    return None


def gear(found: Found) -> tuple[float, bool]:
    """Gear ratio, and whether it is exact: the given one or a fraction of small numbers within the error."""
    measured, error = found.fit.gear_ratio, _gear_error(found.fit)
    given = found.base.crank.gear_ratio
    if abs(given / measured - 1.0) <= error:
        return given, True
    exact = exact_ratio(measured, error)
    return (measured, False) if exact is None else (exact, True)


def _gear_error(one: Fit) -> float:
    """Largest relative error of the gear ratio."""
    travel = abs(one.ratio) * float(np.ptp(one.pair.position_rad))
    return _SURE * one.sigma["ratio"] / abs(one.ratio) + _DRIFT_RAD / max(travel, 1.0e-9)


def offset_rad(found: Found, number: int) -> float:
    """Crank angle at joint position 0 of a recording, from -pi to pi."""
    one = found.fit
    # with the exact ratio, the phase in the middle of the recording stays the same
    middle = float(np.median(one.pair.position_rad[one.pair.recording == number]))
    offset = one.offset_rad[number] + (one.ratio - one.direction / gear(found)[0]) * middle
    return float((offset + math.pi) % TURN - math.pi)


def _offset_sigma_rad(found: Found) -> float:
    """Standard deviation of the offset, with the effect of clearances, a repeating residual and a lag."""
    one = found.fit
    angle, speed, _ = one.crank()
    # were all of the rest that repeats a shift of the phase, it would shift by this
    slope = np.gradient(one.predicted) / np.gradient(one.blocks.mean(angle))
    by_rest = repeating(one) * float(one.measured.std() / np.sqrt(np.mean(slope**2)))
    by_lag = found.timing.sigma_s * float(np.median(np.abs(speed)))
    return math.hypot(one.sigma["offset_rad"], one.error.phase_rad, by_rest, by_lag)


# Parameters of the monitor from the chosen fit, each with its error and its runner-up.


_NEAR = 0.05  # relative error of the scale due to clearances; a given scale within this error is kept
_HALF_A_GEAR = 0.5, 1.5  # efficiencies for which a torque may be measured at the motor's shaft


def items(found: Found) -> list[CommissioningItem]:
    """Everything that was looked for, parameters first."""
    return [*_crank(found), *_torque(found), *_drive(found)]


def changes(found: list[CommissioningItem]) -> dict[str, Any]:
    """Values of the monitor's parameters among items."""
    return {item.name: item.value for item in found if "." in item.name or item.name == "crank_joint"}


def _chosen(found: Found, name: str, **own: Any) -> CommissioningItem:
    """A choice among candidates, with the best candidate that differs in this choice."""
    rival = found.choice.rivals.get(name)
    if rival:
        values = {
            "crank_joint": rival.joint.joint,
            "drive_torque.source": rival.torque.label,
            "crank.sign": rival.fit.direction,
            "drive_torque.sign": rival.fit.torque_sign,
            "crank.gear_ratio": float(f"{rival.fit.gear_ratio:.4g}"),
        }
        own |= {"other": values[name], "other_mismatch": rival.fit.mismatch}
    return CommissioningItem(name=name, mismatch=found.fit.mismatch, **own)


def _crank(found: Found) -> Iterator[CommissioningItem]:
    one, (ratio, is_exact) = found.fit, gear(found)
    joint = found.choice.best.joint
    yield _chosen(found, "crank_joint", value=joint.joint, remark=f"in {joint.topic}")
    yield _chosen(found, "crank.sign", value=one.direction)
    yield _chosen(
        found,
        "crank.gear_ratio",
        value=ratio,
        sigma=one.gear_ratio * one.sigma["ratio"] / abs(one.ratio),
        remark=f"measured {one.gear_ratio:.7g}" if is_exact else "not a ratio of small whole numbers",
    )
    yield CommissioningItem(
        name="crank.offset_rad",
        value=round(offset_rad(found, max(one.offset_rad)), 4),
        unit="rad",
        sigma=_offset_sigma_rad(found),
        remark="shifted by clearances"
        + ("" if found.timing.is_separated else " and, at one cadence, by a lag"),
        mismatch=one.mismatch,
    )


def _torque(found: Found) -> Iterator[CommissioningItem]:
    one, torque = found.fit, found.choice.best.torque
    yield _chosen(found, "drive_torque.source", value=torque.source, remark=torque.label)
    if torque.source == WRENCH:
        yield CommissioningItem(name="drive_torque.axis", value=torque.component)
    if torque.source == INTERFACE:
        yield CommissioningItem(name="drive_torque.interface", value=torque.interface)
    yield _chosen(found, "drive_torque.sign", value=one.torque_sign)
    scale, turns = _scale(found)
    total = 1.0 / abs(one.gain)
    yield CommissioningItem(
        name="drive_torque.scale",
        value=scale,
        sigma=total / turns * math.hypot(one.sigma["gain"] / abs(one.gain), one.error.scale),
        mismatch=one.mismatch,
        remark=f"measured scale times gear ratio: {total:.4g}",
    )
    yield CommissioningItem(name="drive_torque.gear_ratio", value=turns)
    yield CommissioningItem(
        name="drive_torque.sampling",
        value=found.sampling or found.base.drive_torque.sampling,
        remark=found.why_sampling if found.sampling else "your value, because it was not determined",
    )


def _scale(found: Found) -> tuple[float, float]:
    """Scale and gear ratio of the torque; only their product is measured."""
    one, given = found.fit, found.base.drive_torque
    total = 1.0 / abs(one.gain)
    if abs(given.scale * given.gear_ratio / total - 1.0) <= _NEAR:
        return given.scale, given.gear_ratio
    ratio = gear(found)[0]
    is_geared = abs(ratio - 1.0) > SAME_GEAR and _HALF_A_GEAR[0] < total / ratio < _HALF_A_GEAR[1]
    turns = ratio if is_geared else 1.0
    scale = total / turns
    return (1.0 if abs(scale - 1.0) <= _NEAR else float(f"{scale:.4g}")), turns


def _drive(found: Found) -> Iterator[CommissioningItem]:
    one, timing, declared, is_separated = found.fit, found.timing, found.declared, found.timing.is_separated
    yield CommissioningItem(
        name="lag",
        value=timing.late_s,
        unit="s",
        sigma=timing.error_s if is_separated else None,
        remark="in addition to the sampling" if is_separated else "at one cadence, part of the offset",
    )
    cadence, tolerance = cadence_rpm(one)
    yield CommissioningItem(name="cadence.commanded_rpm", value=cadence, unit="rpm")
    yield CommissioningItem(name="cadence.tolerance_rpm", value=tolerance, unit="rpm")
    for name, unit, remark, given in (
        ("friction", "N m", "constant part, at the crank", declared.coulomb_nm),
        ("load_friction", "", "part proportional to the torque", declared.load_friction),
    ):
        value, sigma = found.friction(name)
        known = f"; declared: {given:.4g} {unit}".rstrip() if math.isfinite(given) else ""
        yield CommissioningItem(
            name=name.replace("_", " "), value=value, unit=unit, sigma=sigma, remark=remark + known
        )
    if "bias" in one.linear:
        bias = one.linear["bias"] / one.gain
        yield CommissioningItem(name="bias", value=bias, unit="N m", sigma=one.sigma["bias"] / abs(one.gain))


# Sentences on undetermined parameters, on quantities that do not fit, and on further information.


_KNOWN_SIGMAS = 2.0  # standard deviations that must be below the requested accuracy
_ANEW_RAD = 0.1  # largest difference between the offsets of two recordings with an absolute encoder
_ROUGH_SCALE = 0.05
_ROUGH_REST = 0.15  # a repeating residual that may shift the scale more than twice as much as clearances
# Clearances of 0.3 mm in five joints of the default leg repeat with 0.03 to 0.17 of the torque
_NOTABLE_REST = 0.2
_DRIVES = 0.02  # a constant torque that drives the crank, as a fraction of the torque's size


def not_told(found: Found) -> Iterator[str]:
    """Parameters that the recording does not determine, and why."""
    one, timing = found.fit, found.timing
    yield from found.doubts
    if not found.sampling:
        yield f"drive_torque.sampling: {found.why_sampling}; ask the drive's manual"
    if not (timing.is_separated or timing.is_declared):
        turned = 1.0e-3 * abs(float(np.median(one.crank()[1])))
        yield (
            f"lag: at one cadence, a torque that is late by 1 ms looks like {turned:.2g} rad of offset; "
            "record two cadences in one recording, 40 rpm apart, or declare drive.lag_s"
        )
    elif not timing.is_declared and _KNOWN_SIGMAS * timing.sigma_s > MAX_LAG_S:
        error = 1.0e3 * _KNOWN_SIGMAS * timing.sigma_s
        yield (
            f"lag: known to ± {error:.2g} ms only, more than the {1.0e3 * MAX_LAG_S:g} ms that are accepted, "
            "because clearances shift the torque's phase with the cadence; record cadences further apart"
        )
    ratio, is_exact = gear(found)
    if not is_exact:
        error = one.sigma["ratio"] / abs(one.ratio)
        away = error * abs(float(one.crank()[1].mean())) * 3600.0
        yield (
            f"crank.gear_ratio: {ratio:.7g} is known to ± {error * ratio:.2g}, so the crank angle drifts "
            f"by up to {away:.2g} rad in an hour; enter the ratio of the teeth"
        )
    scale, rest = one.sigma["gain"] / abs(one.gain), repeating(one)
    if scale > _ROUGH_SCALE:
        yield f"drive_torque.scale: known to ± {100.0 * scale:.0f} % only; record longer"
    elif rest > _ROUGH_REST:
        yield (
            f"drive_torque.scale: {100.0 * rest:.0f} % of the torque repeats but does not fit; the scale "
            f"may be wrong by the same fraction"
        )


def findings(found: Found, mechanism: Mechanism) -> Iterator[str]:
    """Quantities that do not fit, or that cannot be used as they are."""
    one = found.fit
    if "load" in one.linear:
        force, sigma = one.linear["load"] / one.gain, one.sigma["load"] / abs(one.gain)
        yield (
            f"a foot load of {force:.3g} N ± {sigma:.2g} N explains most of the torque that does not fit; "
            "the proposal corrects for this load; it is better to record with the foot in the air"
        )
    if not found.doubts:  # friction and phases say nothing about an unknown leg
        yield from _of_known_leg(found, mechanism)
    for unit, ratio in (("degrees", TURN / 360.0), ("turns", TURN)):
        if abs(one.gear_ratio * ratio - 1.0) < 2.0 * _gear_error(one):
            yield f"the joint's position seems to be in {unit}, not in radians: gear ratio {1.0 / ratio:.6g}"
    if found.motion.is_wrapped and gear(found)[0] != 1.0:
        yield (
            f"the joint's position is wrapped to a turn, but its gear ratio is {one.gear_ratio:.6g}: the "
            "monitor needs a continuous position"
        )


def _of_known_leg(found: Found, mechanism: Mechanism) -> Iterator[str]:
    one, timing = found.fit, found.timing
    rest = repeating(one)
    if rest > _NOTABLE_REST:
        yield (
            f"{100.0 * rest:.0f} % of the torque repeats with each turn and does not fit {mechanism.name}: "
            "other masses or lengths, a spring, a load, or impacts, if the sensor does not average"
        )
    friction, sigma = found.friction("friction")
    if friction < -_SURE * sigma and abs(friction) > _DRIVES * float(one.predicted.std() / abs(one.gain)):
        size = f"{-friction:.2g} ± {sigma:.1g} N m"
        yield f"a constant torque of {size} drives the crank: zero the torque sensor"
    late, most = timing.late_s, found.base.drive.largest_lag_s
    if abs(late) - _SURE * timing.error_s > most:
        yield (
            f"the torque is late by {1.0e3 * late:.3g} ms, more than the accepted {1.0e3 * MAX_LAG_S:g} ms "
            f"and the declared lag of the drive ({1.0e3 * most:.3g} ms)"
        )
    offsets = [offset_rad(found, number) for number in sorted(one.offset_rad)]
    if max(abs(math.remainder(each - offsets[0], TURN)) for each in offsets) >= _ANEW_RAD:
        each = ", ".join(f"{offset:.3f}" for offset in offsets)
        yield (
            f"the encoder starts at a different zero in each recording: the torque's phase gives the offsets "
            f"{each} rad; the proposed offset is from the last recording and is valid until the next boot"
        )


def notes(found: Found) -> Iterator[str]:
    """Further information for the operator."""
    joint, torque = found.choice.best.joint, found.choice.best.torque
    yield from found.choice.also
    ratio = gear(found)[0]
    if ratio != 1.0 and len(found.fit.offset_rad) == 1:
        yield (
            f"the encoder turns {ratio:.6g} times in a turn of the crank; if it starts at zero at each "
            "boot, the offset is valid until the next boot: set crank.zero to at_start"
        )
    for topic, name in ((joint.topic, "joint_states"), (torque.topic, "drive_torque")):
        if topic != f"/{name}" and not (name == "drive_torque" and topic == joint.topic):
            yield f"start the monitor with -r {name}:={topic}, replay with --{name.replace('_', '-')} {topic}"
    if torque.source == FLOAT64:
        yield "a Float64 has no stamp: the torque is stamped on arrival, so a late message looks like a lag"
    speeds = cadences_rpm(found.fit)
    if len(speeds) > 1:
        each = " and ".join(f"{speed:g}" for speed in speeds)
        yield (
            f"the leg walks at about {each} rpm; cadence.commanded_rpm is the most frequent one: "
            "set it to the cadence of its work"
        )
