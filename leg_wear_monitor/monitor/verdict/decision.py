"""How soon to act on a verdict, how sure it is, the check that settles it, and the cost of an error.

One table, with a row per code. Nothing here is kept: all of it follows from the verdict's code and state.
"""

from collections.abc import Mapping
from functools import cache

import attrs

from leg_wear_monitor.configuration.strict import read_document, structure
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.monitor.input_health import INPUT_RULES
from leg_wear_monitor.monitor.verdict.verdict import code_of_rule
from leg_wear_monitor.state import LegState, State
from leg_wear_monitor.twin import CRANK

# How often verdicts were right in cases with a known truth, from the one file with these values.


FIGURES_FILE = "config/certainty.yaml"
_HUNDRED = 100


@attrs.frozen(kw_only=True)
class MeasuredFigure:
    """How often a verdict was right in cases with a known truth, and the conditions of these cases.

    Attributes
    ----------
    right : float
        Number of right cases; without `of`, a value for itself.
    of : int or None
        Number of cases.
    words : str
        Sentence part after the number of cases.
    where : str
        Details of the cases.
    source : str
        Page with all results, below the share directory.
    date : str
        Date of the measurement.
    on_ground : bool or None
        Whether the legs walked on the ground (True) or in the air (False); None if it makes no difference.
    needs_sure_names : bool
        Whether the cases had a model that fits the leg, so that the names of joints were sure.
    needs_diagnosis : bool
        Whether the drive torque showed the modelled clearances before the case.
    by : str or None
        Source of the joint's clearance in these cases; None for any source.
    """

    right: float
    of: int | None = None
    words: str
    where: str
    source: str
    date: str
    on_ground: bool | None = None
    needs_sure_names: bool = False
    needs_diagnosis: bool = False
    by: str | None = None

    @property
    def counted(self) -> str:
        """Such as ``577 of 580``."""
        return f"{self.right:g}" if self.of is None else f"{self.right:g} of {self.of}"

    @property
    def text(self) -> str:
        """Such as ``99 of 100 such findings are right on simulated legs``."""
        is_long = self.of is not None and self.of > _HUNDRED and self.right != self.of
        counted = f"{int(_HUNDRED * self.right / (self.of or 1))} of {_HUNDRED}" if is_long else self.counted
        return f"{counted} {self.words}"

    def holds_for(self, state: LegState) -> bool:
        """Whether this leg meets the conditions of the cases."""
        joints = state.verdict.joints
        by = (
            state.clearances[joints[0]].best_estimate_source
            if joints and joints[0] in state.clearances
            else None
        )
        return (
            self.on_ground in (None, bool(state.load.peak_n))
            and not (self.needs_sure_names and state.diagnosis.reason)
            and not (self.needs_diagnosis and state.diagnosis.state != "as_modelled")
            and (self.by is None or self.by == by)
        )


@cache
def measured_figures() -> Mapping[str, MeasuredFigure]:
    """The measured values by name.

    Raises
    ------
    ConfigError
        If the file is damaged.
    """
    document = read_document(share_directory() / FIGURES_FILE, FIGURES_FILE)
    return structure(document, dict[str, MeasuredFigure], FIGURES_FILE, "")


# One row per code. The sentences are constants: the values are in the verdict's reason and its evidence.


HOW_SURE = "How sure"
NOT_MEASURED = "Not known: the accuracy of such a verdict has not been measured on a leg like this."
_KNOWN = "Sure: the monitor knows this from its input or its ledger."
_ENTERED = "Sure: an operator entered it."
_AS_MEASURED = "As sure as the measured clearance."

_ROCK = "Block the drive, rock the joint by hand, and measure its radial clearance."
_ROCK_ALL = "Block the drive, and rock each joint by hand."
_NEXT_STOP = "At the next stop."
_SOON: Mapping[State, str] = {
    State.STOP: "Stop when it is safe. Do not walk before this is settled.",
    State.INSPECT: "Before the next use: the leg may get worse faster than the forecast says.",
    State.NOT_MONITORED: "Before the next use: until then, the monitor cannot detect a loosening joint.",
    State.WATCH: _NEXT_STOP,
    State.HEALTHY: "Nothing is urgent. Look again after half of the shortest remaining life (p10), at most "
    "after a month.",
}
"""How soon to act, by state, for a code that has no sentence of its own."""


@attrs.frozen(kw_only=True)
class Advice:
    """The constant columns of a code.

    Attributes
    ----------
    if_wrong : str
        Cost of following a false verdict, and of ignoring a true one.
    check : str
        The one check that settles it.
    soon : str
        How soon to act; empty if only the state decides.
    sure : str
        How sure the verdict is without a measured value.
    measured : tuple of str
        Names of the measured values that say how often it is right.
    """

    if_wrong: str
    check: str
    soon: str = ""
    sure: str = NOT_MEASURED
    measured: tuple[str, ...] = ()


_AT_LIMIT = Advice(
    if_wrong="If this is a false alarm, you lose one stop. If it is real and ignored, the joint knocks "
    "harder with each gait cycle, and a broken part may let the leg fall.",
    check=_ROCK,
    sure=_AS_MEASURED,
    measured=("life_interval",),
)
_CHANGED = Advice(
    if_wrong="If this is a false alarm, you lose one stop. If it is real and ignored, a broken bushing wears "
    "to its limit and damages its neighbours.",
    check=_ROCK,
    measured=("torque_name", "torque_name_on_ground", "false_findings"),
)
_TORQUE_SENSOR = Advice(
    if_wrong="If this is false, you check parameters that are right. If it is true and ignored, the torque "
    "shows no joint, and a breaking bushing stays undetected.",
    check="Hold the leg still with a known weight on a known lever, and compare the reported torque.",
)
_OTHER_LEG = Advice(
    if_wrong="If this is a false alarm, you lose one stop. If it is real and ignored, a loose, bent or "
    "broken part stays undetected, and no modelled value is valid.",
    check=_ROCK_ALL,
)
_LOAD = Advice(
    if_wrong="If this is false, you check the foot and the drive for nothing. If it is true and ignored, "
    "joints wear faster than modelled, or the drive runs dry.",
    check="Let the leg walk in the air with a warm drive. The verdict ends if load or cold grease caused it.",
)
_FOOT_SENSOR = Advice(
    if_wrong="If this is false, you check the sensor for nothing. If it is true and ignored, forces, wear "
    "and remaining life belong to a wrong load.",
    check="Read the sensor with the foot in the air, and under a known weight.",
)
_WEAR = Advice(
    if_wrong="If this is false, you lose one measurement. If it is true and ignored, the joint reaches its "
    "limit before you have planned its replacement.",
    check=_ROCK,
)
_INPUT = Advice(
    if_wrong="If this is false, you check topics and cables for nothing. If it is true and ignored, the leg "
    "walks without a monitor.",
    check="Look at the messages that the reason names: `ros2 topic hz`, or `leg-wear-monitor check`.",
    sure=_KNOWN,
)
_GAIT = Advice(
    if_wrong="If this is false, you check parameters that are right. If it is true and ignored, the monitor "
    "models no wear, or the wear of a different gait.",
    check="Turn the crank to a known angle at a known cadence, and compare the reported values.",
    sure=_KNOWN,
)
_BLIND = Advice(
    if_wrong="If this is false, you rock joints for nothing. If it is true and ignored, a breaking bushing "
    "stays undetected.",
    check=_ROCK_ALL,
    sure=_KNOWN,
)
_NODE = Advice(
    if_wrong="If this is false, you check files and clocks for nothing. If it is true and ignored, wear is "
    "modelled twice or lost.",
    check="Check the file or the clock that the reason names.",
    sure=_KNOWN,
)
_ALARM = Advice(
    if_wrong="If this is false, you look once for nothing. If it is true and ignored, the fault of the alarm "
    "goes on.",
    check="Follow the guide of the alarm in the list of alarms.",
)
_LIFE_SOON = "Within the remaining life (p10) of the joint."

ADVICE: Mapping[str, Advice] = {
    "CLEARANCE": _AT_LIMIT,
    "CLEARANCE_DETECTED": attrs.evolve(
        _AT_LIMIT, sure=NOT_MEASURED, measured=("torque_stop", "encoder_name")
    ),
    "CLEARANCE_ESTIMATED": _AT_LIMIT,
    "CLEARANCE_CHANGED": _CHANGED,
    "CLEARANCE_CORRECTED": _CHANGED,
    "CLEARANCE_DEPARTURE": attrs.evolve(_CHANGED, measured=("encoder_name",)),
    "TORQUE_SIGN": _TORQUE_SENSOR,
    "TORQUE_SCALE": _TORQUE_SENSOR,
    "TORQUE_TIMING": _TORQUE_SENSOR,
    "TORQUE_NOISE": _TORQUE_SENSOR,
    "TORQUE_BIAS": _TORQUE_SENSOR,
    "TORQUE_MASS": _OTHER_LEG,
    "MECHANISM_CHANGED": _OTHER_LEG,
    "TORQUE_MISMATCH": _OTHER_LEG,
    "LOAD_NOT_OBSERVED": _LOAD,
    "TORQUE_LOAD": attrs.evolve(_LOAD, measured=("load_name",)),
    "FRICTION_CHANGED": _LOAD,
    "FOOT_LOAD_STUCK": _FOOT_SENSOR,
    "FOOT_LOAD_ZERO": _FOOT_SENSOR,
    "FOOT_LOAD_SCALE": _FOOT_SENSOR,
    "FOOT_LOAD_EXCHANGED": _FOOT_SENSOR,
    "FOOT_LOAD_SIGN": _FOOT_SENSOR,
    "FOOT_LOAD_MISSING": attrs.evolve(_FOOT_SENSOR, sure=_KNOWN),
    "IMPACT_FORCE": _WEAR,
    "GROWTH": attrs.evolve(_WEAR, soon=_LIFE_SOON, measured=("growth_interval",)),
    "REMAINING_LIFE": attrs.evolve(_WEAR, soon=_LIFE_SOON, measured=("life_interval",)),
    "CLEARANCE_NEAR": attrs.evolve(_WEAR, sure=_AS_MEASURED, measured=("life_interval",)),
    "MATERIAL_LIMIT": _WEAR,
    "PART_REPLACED": Advice(
        if_wrong="If this is false, you lose some gait cycles. If it is true and ignored, a wrong or badly "
        "mounted part stays undetected.",
        check="Let the leg walk for 20 gait cycles at the commanded cadence, and read the verdict again.",
        soon="With the next gait cycles: until then, the monitor knows nothing of the new part.",
        sure=_ENTERED,
    ),
    "BAD_INPUT": _INPUT,
    "NO_GAIT_CYCLE": _INPUT,
    "ALREADY_COUNTED": _NODE,
    "CRANK_ZERO": _GAIT,
    "TRACKING_LOST": _GAIT,
    "NOT_THIS_LEG": _GAIT,
    "CADENCE": _GAIT,
    "NO_DRIVE_TORQUE": _BLIND,
    "TORQUE_NOT_COMPARED": _BLIND,
    "NOT_OBSERVED": _BLIND,
    "ENCODER": _BLIND,
    "ALARM": _ALARM,
    **{
        rule.code: _INPUT if rule.kind == CRANK else attrs.evolve(_TORQUE_SENSOR, sure=_KNOWN)
        for rule in INPUT_RULES
    },
    "NONE": Advice(
        if_wrong="A loosening joint stays undetected until the torque or the encoders show it.",
        check=f"{_ROCK_ALL} No joint has more play than when it was new: twice its radial clearance.",
        measured=("opened_found", "opened_found_on_ground"),
    ),
}
"""The advice by the code of the rule."""


def figures_of(state: LegState) -> tuple[MeasuredFigure, ...]:
    """The measured values that say how often such a verdict is right on a leg like this; may be empty."""
    figures = measured_figures()
    rows = (figures[name] for name in _advice(state).measured)
    return tuple(row for row in rows if row.holds_for(state))


def _advice(state: LegState) -> Advice:
    return ADVICE.get(code_of_rule(state.verdict), _ALARM)  # an older ledger may have other codes


def how_soon(state: LegState) -> str:
    """How soon to act on the verdict of a leg."""
    return _advice(state).soon or _SOON[state.verdict.state]


def how_sure(state: LegState) -> str:
    """How often such a verdict is right; says so if nothing was measured on a leg like this."""
    return "; ".join(figure.text for figure in figures_of(state)) or _advice(state).sure


def decision_of(state: LegState) -> list[tuple[str, str]]:
    """The verdict of a leg as lines for a person, each with its title."""
    advice = _advice(state)
    return [
        ("How soon", how_soon(state)),
        (HOW_SURE, how_sure(state)),
        ("Check", advice.check),
        ("If wrong", advice.if_wrong),
    ]
