"""The table of alarms: the value and the limit that each alarm compares."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import attrs

from leg_wear_monitor.files import or_nan
from leg_wear_monitor.monitor.alarms import (
    BIAS,
    EXCHANGED,
    FOOT_LOAD_LIMITS,
    GAPS,
    LAG,
    SCALE,
    SIGN,
    STUCK,
    WARN_FRACTION,
    ZERO,
    Alarm,
    Limit,
)
from leg_wear_monitor.state import Figure
from leg_wear_monitor.twin import KINDS as SAMPLE_KINDS
from leg_wear_monitor.twin import LOAD

if TYPE_CHECKING:
    from leg_wear_monitor.monitor.config.settings import MonitorConfig


# The monitor's alarms, one entry each: board, units, status, command line and docs are derived from it.
#
# NaN is an unknown value and leaves its alarm unchanged. No slow import is allowed here, because ``--help``
# lists the kinds.


DEADBAND = 0.05  # fraction of a limit: a value near its limit must not switch the level in each gait cycle


@attrs.frozen(kw_only=True)
class AlarmSpec:
    """An alarm.

    Attributes
    ----------
    kind, subject : str
        The subject of an alarm of a clearance joint is the joint.
    unit : str
        Unit of value and limit.
    quantity : str
        Noun of the value, for sentences.
    meaning, limit_words : str
        For operators: meaning of the value, by default its noun and unit, and the parameters of its limit.
    value : callable
        Value from the evidence: a joint's report, the input's health or its guard; by default the value of
        this kind among the values of a gait cycle, its torque or its foot load, which are given by kind.
    limit : callable
        Limit of ERROR, from the parameters, the RMS of the predicted torque and the number of the joint.
    is_immediate : bool
        True if the level rises in the first gait cycle beyond, without `alarms.on_delay_cycles`.
    is_least : bool
        True if the limit is a lower bound: values below it are faults.
    is_count : bool
        True if the value is a count: ERROR begins at the limit, without WARN and deadband.
    is_latched : bool
        True if the alarm stays until it is acknowledged; the alarm of missing data ends when they return.
    far : float
        A value beyond so many times a limit raises the level at once.
    figure : Figure or None
        Kind of values of this alarm: its value is not shown while the verdict says they are not valid.
    """

    kind: str
    subject: str = ""
    unit: str = ""
    quantity: str
    meaning: str = attrs.field()
    limit_words: str
    value: Callable[[Any], float] = attrs.field()
    limit: Callable[["MonitorConfig", float, int], float]
    is_immediate: bool = False
    is_least: bool = False
    is_count: bool = False
    is_latched: bool = True
    far: float = math.inf
    figure: Figure | None = None

    @meaning.default
    def _by_quantity(self) -> str:
        return f"{self.quantity}, {self.unit}" if self.unit else self.quantity

    @value.default
    def _by_kind(self) -> Callable[[Any], float]:
        return lambda values: values[self.kind]

    def new(self, joint: str = "") -> Alarm:
        """The alarm in its initial state."""
        return Alarm(kind=self.kind, subject=self.subject or joint, unit=self.unit)

    def name(self, joint: str = "") -> str:
        """Name of the alarm, such as ``clearance A``."""
        return f"{self.kind} {self.subject or joint}".rstrip()

    def limits(self, config: "MonitorConfig", torque_size_nm: float, joint: int) -> Limit:
        """Limits of its levels."""
        error = self.limit(config, torque_size_nm, joint)
        if self.is_count:
            return Limit(error, error)
        first = error / WARN_FRACTION if self.is_least else WARN_FRACTION * error
        delay = 1 if self.is_immediate else config.alarms.on_delay_cycles
        return Limit(first, error, DEADBAND, delay, self.is_least, self.is_latched, self.far)


def _parameter(name: str) -> dict[str, Any]:
    """Limit of an alarm that is a parameter of the section ``limits``."""
    return {"limit_words": f"`limits.{name}`", "limit": lambda config, *_: getattr(config.limits, name)}


def _constant(limit: float, words: str = "") -> dict[str, Any]:
    """Limit of an alarm that is the same for all legs."""
    return {"limit_words": words or f"{limit:g}", "limit": lambda *_: limit}


IMPACT = AlarmSpec(
    kind="impact_force",
    unit="N",
    quantity="peak contact force",
    limit_words="`limits.impact_force_n`; from 1.1 times the commanded cadence on, times the square of the "
    "ratio",
    value=lambda joint: joint.peak_force_n,
    limit=lambda config, *_: config.limits.impact_force_n,
    is_immediate=True,  # the next impact may break the joint
    figure=Figure.IMPACT_FORCES,
)
CLEARANCE = AlarmSpec(
    kind="clearance",
    unit="m",
    quantity="mean radial clearance",
    meaning="mean radial clearance, modelled or, if larger, measured, m",
    limit_words="`limits.clearance_m`, `limits.joint_clearance_m`",
    value=lambda joint: joint.judged_clearance_m,
    limit=lambda config, _, joint: config.limits.of_joint_m(joint),
    figure=Figure.CLEARANCES,
)
GROWTH = AlarmSpec(
    kind="growth",
    unit="m/h",
    quantity="growth of the mean radial clearance",
    **_parameter("growth_m_per_hour"),
    value=lambda joint: math.nan if joint.growth_mps is None else 3600.0 * joint.growth_mps,
    figure=Figure.GROWTH,
)
LIFE = AlarmSpec(
    kind="remaining_life",
    unit="h",
    quantity="p10 of the remaining life",
    **_parameter("remaining_life_h"),
    value=lambda joint: joint.forecast.hours.p10 if joint.forecast and joint.forecast.hours else math.nan,
    is_least=True,
    figure=Figure.FORECAST,
)
MATERIAL = AlarmSpec(
    kind="material_limit",
    quantity="load over the limits of the material",
    meaning="largest of pressure (99th percentile), sliding speed and p v (means) of the gait cycle, as a "
    "fraction of the limits of the joint's material. Only with a material that has limits",
    **_constant(1.0, "1, the limits of the material"),
    value=lambda joint: or_nan(joint.load.fraction if joint.load else None),
)
DEPARTURE = AlarmSpec(
    kind="clearance_departure",
    unit="m",
    quantity="difference between the clearance from encoders and the modelled clearance",
    meaning="difference between the clearance from further encoders and the modelled clearance, m; 0 below "
    "four standard deviations. Only with `encoders.names`",
    **_constant(1.0e-4, "0.1 mm"),  # limit: a third of a new clearance
    value=lambda joint: joint.seen.surely_m if joint.seen else math.nan,
)
MISMATCH = AlarmSpec(
    kind="torque_mismatch",
    quantity="unexplained fraction of the drive torque",
    meaning="RMS of the torque that repeats over the last gait cycles, and that foot load, friction and lag "
    "do not explain, as a fraction of the predicted RMS",
    **_parameter("torque_mismatch"),
    # The scatter of impacts at 45 rpm reaches the limit once in some thousand gait cycles, three times in a
    # row once in 300 000, and 1.3 times the limit at most. A wrong received torque is known immediately
    far=1.5,
)
CADENCE = AlarmSpec(
    kind="cadence",
    unit="rpm",
    quantity="departure from the commanded cadence",
    limit_words="`cadence.tolerance_rpm`",
    limit=lambda config, *_: config.cadence.tolerance_rpm,
)
SOURCES = AlarmSpec(
    kind="input_sources",
    quantity="number of sources of the crank angle",
    **_constant(2.0, "2, at once"),
    value=lambda guard: float(guard.sources),
    is_count=True,
)

JOINT = (IMPACT, CLEARANCE, GROWTH, LIFE, MATERIAL)
ENCODERS = (DEPARTURE,)
TORQUE = (
    MISMATCH,
    AlarmSpec(
        kind=BIAS,
        unit="N m",
        quantity="constant drive torque beyond the bounds of friction",
        meaning="constant drive torque that friction cannot cause, N m: it drives, or exceeds 0.3 of the "
        "predicted RMS",
        limit_words="0.1 of the predicted RMS",
        limit=lambda _, torque_size_nm, *__: 0.1 * torque_size_nm,
    ),
    AlarmSpec(
        kind=LAG,
        unit="s",
        quantity="delay of the measured torque",
        limit_words="5 ms, and the declared lag and low-pass of the drive",
        limit=lambda config, *_: config.drive.largest_lag_s,
    ),
)
GAIT = (CADENCE,)


def _rate(name: str) -> AlarmSpec:
    """Rate of the used samples of a kind, by the kind's name."""
    return AlarmSpec(
        kind="input_rate",
        subject=name,
        unit="Hz",
        quantity=f"rate of usable {name} samples",
        **_constant(40.0, "40 Hz"),  # five samples per period of the tracker's bandwidth of 8 Hz
        value=lambda health: health[f"{name}_rate_hz"],
        is_least=True,
        is_latched=False,
    )


def _foot_load(kind: str, quantity: str, subject: str = "") -> AlarmSpec:
    """A fault of the sensor of the foot load, in a gait cycle."""
    return AlarmSpec(
        kind=kind,
        subject=subject,
        quantity=quantity,
        meaning=f"{quantity}. Only with `foot_load.source`",
        **_constant(FOOT_LOAD_LIMITS[kind]),
        is_latched=not subject,
    )


FOOT_LOAD_RATE = _rate(SAMPLE_KINDS[LOAD].name)
FOOT_LOAD = (
    _foot_load(GAPS, "fraction of time in gaps of more than 50 ms in the foot load", SAMPLE_KINDS[LOAD].name),
    _foot_load(STUCK, "constant fraction of the largest foot load"),
    _foot_load(ZERO, "median of the vertical foot load in swing, over its peak"),
    # a force beyond the valid range counts as well
    _foot_load(
        SCALE, "factor between the foot load and its estimate by the torque, or a step of 10 to 5000 N"
    ),
    _foot_load(
        EXCHANGED, "correlation of the foot load with stance of the other foot, minus that of this foot"
    ),
    _foot_load(SIGN, "largest pull of the foot load, over its largest force"),
)

INPUT = (
    *(_rate(kind.name) for code, kind in SAMPLE_KINDS.items() if code != LOAD),
    AlarmSpec(
        kind="input_samples",
        quantity="fraction of unusable samples",
        meaning="fraction of unusable samples: faulty, repeated, late, wrong stamp, outlier",
        **_constant(0.05),
        value=lambda health: health["bad_fraction"],
    ),
    AlarmSpec(
        kind="input_gaps",
        quantity="fraction of unmonitored time",
        **_constant(0.05),
        value=lambda health: health["lost_fraction"],
        is_latched=False,
    ),
    AlarmSpec(
        kind="input_torque",
        quantity="fraction of stuck or saturated torque samples",
        meaning="fraction of torque samples that repeat the largest or the smallest",
        **_constant(0.3),  # a torque that is not clipped repeats its extremes in a few samples only
        value=lambda health: health["stuck_torque_fraction"],
    ),
)

OF_INPUT = (*INPUT, SOURCES)
OF_FOOT_LOAD = (FOOT_LOAD_RATE, *FOOT_LOAD)
ALL = (*JOINT, *ENCODERS, *TORQUE, *GAIT, *OF_INPUT, *OF_FOOT_LOAD)

OF_TORQUE = frozenset((*(spec.name() for spec in TORQUE), "input_torque"))
"""Names of the alarms whose values need a drive torque."""

SILENCE = "input_silence"
"""Kind of the alarms of the node, which has a clock."""

INPUT_KINDS = tuple(dict.fromkeys(spec.kind for spec in OF_INPUT))
KINDS = {spec.kind: spec for spec in ALL}
"""The kinds of alarms, each with a spec: alarms of one kind have the same unit and figure."""


QUANTITIES = {
    **{spec.kind: spec.quantity for spec in (*JOINT, *ENCODERS)},
    **{spec.name(): spec.quantity for spec in (*TORQUE, *GAIT, *OF_INPUT, *OF_FOOT_LOAD)},
    **{f"{SILENCE} {kind.name}": f"time without {kind.name} samples" for kind in SAMPLE_KINDS.values()},
}
"""Nouns by the alarm's name; by its kind for an alarm of a joint. The last ones are alarms of the node."""
