"""The result of commissioning: parameters with their intervals, their file, and undetermined parameters."""

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from io import StringIO
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
from ruamel.yaml import YAML

from leg_wear_monitor.commissioning.evidence import cadence_rpm, late_sigma_s
from leg_wear_monitor.commissioning.search import SAME_GEAR, Choice
from leg_wear_monitor.configuration import part_document
from leg_wear_monitor.errors import LegWearError, printable
from leg_wear_monitor.estimate.drive import DriveFigures
from leg_wear_monitor.estimate.joint_motion import JointMotion
from leg_wear_monitor.estimate.torque_model import (
    FRICTION_ERROR,
    LOAD_FRICTION_ERROR,
    PHASE_ERROR_RAD,
    SCALE_ERROR,
    Fit,
    Terms,
    TorqueModel,
    fit,
    repeating,
)
from leg_wear_monitor.files import data_frame, json_text
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.inputs import FLOAT64, INTERFACE, WRENCH
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


# The measured quantities: the chosen fit again, with load friction and with errors.

# fraction of the torque's RMS, half of its energy: legs with clearance have 0.03 to 0.05 with averages, 0.3
# to 0.45 with instants at 50 to 200 Hz (full coordinates, 60 rpm)
_UNEXPLAINED = 0.7


@attrs.frozen(eq=False)
class Found:
    """Measured quantities from which the parameters are derived.

    Attributes
    ----------
    choice : Choice
    fit : Fit
    motion : JointMotion
        Motion of the chosen joint.
    declared : DriveFigures
    base : MonitorConfig
    """

    choice: Choice
    fit: Fit
    motion: JointMotion
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
        by_clearances = LOAD_FRICTION_ERROR * abs(one.gain)
        if name == "friction":
            by_clearances = FRICTION_ERROR * float(one.predicted.std())
        return one.linear[name] / one.gain, math.hypot(one.sigma[name], by_clearances) / abs(one.gain)


def found_of(choice: Choice, motion: JointMotion, model: TorqueModel, base: MonitorConfig) -> Found:
    """Everything that the recording says about the chosen joint and torque."""
    one = choice.best.fit
    again = fit(one.pair, model, one.refined, Terms(load_friction=True), with_errors=True)
    return Found(choice, again, motion, drive_figures(base.drive), base)


# A gear's ratio is the ratio of two numbers of teeth: a fraction of small numbers within the error.


_SURE = 3.0  # standard deviations
_DRIFT_RAD = 0.05  # phase shift by clearances over a recording
_LARGEST_DENOMINATOR = 20
_BY_CHANCE = 0.1  # number of fractions that may be within the error by chance


def exact_ratio(measured: float, error: float) -> float | None:
    """The nearest fraction of small numbers; None if it is not within a relative error, or by chance.

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
    found = Fraction(measured).limit_denominator(_LARGEST_DENOMINATOR)
    tried = found.denominator * (found.denominator + 1) / 2
    is_chance = 2.0 * error * measured * tried > _BY_CHANCE
    return float(found) if abs(found / measured - 1.0) <= error and not is_chance else None


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


def offset_rad(found: Found) -> float:
    """Crank angle at joint position 0, from -pi to pi."""
    one = found.fit
    # with the exact ratio, the phase in the middle of the recording stays the same
    middle = float(np.median(one.pair.position_rad))
    offset = one.offset_rad + (one.ratio - one.direction / gear(found)[0]) * middle
    return float((offset + math.pi) % TURN - math.pi)


def _offset_sigma_rad(found: Found) -> float:
    """Standard deviation of the offset, with the effect of clearances, a repeating residual and a lag."""
    one = found.fit
    angle, speed, _ = one.crank()
    # were all of the rest that repeats a shift of the phase, it would shift by this
    slope = np.gradient(one.predicted) / np.gradient(one.blocks.mean(angle))
    by_rest = repeating(one) * float(one.measured.std() / np.sqrt(np.mean(slope**2)))
    by_lag = late_sigma_s(one, found.base) * float(np.median(np.abs(speed)))
    return math.hypot(one.sigma["offset_rad"], PHASE_ERROR_RAD, by_rest, by_lag)


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
        value=round(offset_rad(found), 4),
        unit="rad",
        sigma=_offset_sigma_rad(found),
        remark="shifted by clearances and by a lag that is not declared",
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
        sigma=total / turns * math.hypot(one.sigma["gain"] / abs(one.gain), SCALE_ERROR),
        mismatch=one.mismatch,
        remark=f"measured scale times gear ratio: {total:.4g}",
    )
    yield CommissioningItem(name="drive_torque.gear_ratio", value=turns)
    yield CommissioningItem(
        name="drive_torque.sampling",
        value=found.base.drive_torque.sampling,
        remark="your value; the recording does not show it: look in the drive's manual",
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
    one, declared = found.fit, found.declared
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


# Sentences on undetermined parameters, on quantities that do not fit, and on further information.


_ROUGH_SCALE = 0.05
_ROUGH_REST = 0.15  # a repeating residual that may shift the scale more than twice as much as clearances
# Clearances of 0.3 mm in five joints of the default leg repeat with 0.03 to 0.17 of the torque
_NOTABLE_REST = 0.2
_DRIVES = 0.02  # a constant torque that drives the crank, as a fraction of the torque's size


def not_told(found: Found) -> Iterator[str]:
    """Parameters that the recording does not determine, and why."""
    one = found.fit
    yield from found.doubts
    if math.isnan(found.declared.lag_s):
        turned = 1.0e-3 * abs(float(np.median(one.crank()[1])))
        yield (
            f"lag: a torque that is late by 1 ms looks like {turned:.2g} rad of offset; declare drive.lag_s"
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
    one = found.fit
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


def notes(found: Found) -> Iterator[str]:
    """Further information for the operator."""
    joint, torque = found.choice.best.joint, found.choice.best.torque
    ratio = gear(found)[0]
    if ratio != 1.0:
        yield (
            f"the encoder turns {ratio:.6g} times in a turn of the crank; if it starts at zero at each "
            "boot, the offset is valid until the next boot: set crank.zero to at_start"
        )
    for topic, name in ((joint.topic, "joint_states"), (torque.topic, "drive_torque")):
        if topic != f"/{name}" and not (name == "drive_torque" and topic == joint.topic):
            yield f"start the monitor with -r {name}:={topic}, replay with --{name.replace('_', '-')} {topic}"
    if torque.source == FLOAT64:
        yield "a Float64 has no stamp: the torque is stamped on arrival, so a late message looks like a lag"
