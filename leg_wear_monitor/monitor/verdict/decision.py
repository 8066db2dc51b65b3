"""What a verdict asks of a person: how sure it is, how soon to act, what an error costs, and what settles it.

A view of a verdict: all of it follows from the verdict and the remaining life, and nothing is kept.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import PurePosixPath

import attrs

from leg_wear_monitor.configuration.strict import read_document, structure
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.monitor.alarms import amount
from leg_wear_monitor.monitor.forecast.forecast import three_digits
from leg_wear_monitor.monitor.verdict.verdict import code_of_rule, guide_to
from leg_wear_monitor.state import Figure, JointClearance, LegState, LifeHours, State, Verdict

# How often findings were right where the truth is known, from the one file that has these figures.


FIGURES_FILE = "config/certainty.yaml"
_HUNDRED = 100


@attrs.frozen(kw_only=True)
class MeasuredFigure:
    """How often something was right where the truth is known.

    Attributes
    ----------
    right : float
        Cases that were right; without `of`, a number for itself.
    of : int or None
        Cases in all.
    words : str
        What was right, after the number of cases.
    where : str
        More of what it was measured on.
    source : str
        Page with all results, below the share directory.
    date : str
        Of the measurement.
    """

    right: float
    of: int | None = None
    words: str
    where: str
    source: str
    date: str

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


@cache
def measured_figures() -> Mapping[str, MeasuredFigure]:
    """The figures by name.

    Raises
    ------
    ConfigError
        If the file is damaged.
    """
    document = read_document(share_directory() / FIGURES_FILE, FIGURES_FILE)
    return structure(document, dict[str, MeasuredFigure], FIGURES_FILE, "")


OF_CODE: Mapping[str, tuple[str, ...]] = {
    "CLEARANCE_SEEN": ("torque_stop", "false_findings"),
    "CLEARANCE_CHANGED": ("torque_name", "false_findings"),
    "CLEARANCE_CORRECTED": ("torque_name", "false_findings"),
    "CLEARANCE_DEPARTURE": ("encoder_name",),
    "CLEARANCE": ("life_interval",),
    "CLEARANCE_BELIEVED": ("life_interval",),
    "CLEARANCE_NEAR": ("life_interval",),
    "REMAINING_LIFE": ("life_interval",),
    "GROWTH": ("growth_interval",),
    "TORQUE_LOAD": ("load_name",),
    "NONE": ("opened_found",),
}
"""Figures that say how often a finding with this code is right."""

_ON_GROUND = "_on_ground"  # end of the name of a figure for legs that carry a load
_COUNTED_CODES = ("CLEARANCE", "CLEARANCE_BELIEVED", "CLEARANCE_NEAR")
# Guides whose codes say what the monitor knows of itself; the others are findings on the leg.
_KNOWN_OF_ITSELF = ("input", "node", "not_observed", "gait")
_REPLACED_CODE = "PART_REPLACED"
_ENTERED_CODES = (_REPLACED_CODE, "FOOT_LOAD_MISSING")


def figures_of(state: LegState) -> tuple[MeasuredFigure, ...]:
    """The figures that say how often such a verdict is right; empty where none was measured."""
    verdict, code = state.verdict, code_of_rule(state.verdict)
    joint = state.clearances.get(verdict.joints[0]) if verdict.joints else None
    by = joint.believed_by if joint else None
    if code in _COUNTED_CODES and by == "measured":
        return ()
    names = ("encoder_name",) if code == "CLEARANCE_SEEN" and by == "encoders" else OF_CODE.get(code, ())
    figures = measured_figures()
    if state.load.peak_n:
        names = tuple(name + _ON_GROUND if name + _ON_GROUND in figures else name for name in names)
    return tuple(figures[name] for name in names)


def _certainty(state: LegState) -> str:
    code, figures = code_of_rule(state.verdict), figures_of(state)
    if figures:
        return "; ".join(figure.text for figure in figures)
    if code in _COUNTED_CODES:
        return "as sure as the clearance that was measured"
    if code in _ENTERED_CODES or _guide(state.verdict) in _KNOWN_OF_ITSELF:
        return "sure: the monitor knows this of its input, or it was entered"
    return "not known: how often such a finding is right was not measured"


# What a wrong answer costs either way, and the one check that settles it, by guide.


@attrs.frozen
class _Stakes:
    """Cost of following a false finding, cost of not following a right one, and what tells the two apart."""

    if_false: str
    if_ignored: str
    check: str


_MEASURE_JOINT = "rock {joints} by hand with the drive blocked, and measure its radial clearance{limit}"
_OF_GUIDE: Mapping[str, _Stakes] = {
    "joint_at_limit": _Stakes(
        "a stop and a measurement for nothing",
        "the joint knocks harder with each gait cycle, and what it breaks may let the leg fall",
        _MEASURE_JOINT,
    ),
    "clearance_changed": _Stakes(
        "a stop and a measurement for nothing",
        "a broken bushing goes on to the limit, and wears its neighbours",
        _MEASURE_JOINT,
    ),
    "torque_sensor": _Stakes(
        "a look at parameters that are right",
        "no joint is observed by the torque: a bushing that breaks stays unnoticed",
        "hold the leg still with a known weight on a known lever, and compare the torque that is reported",
    ),
    "torque_mismatch": _Stakes(
        "a stop to rock the joints for nothing",
        "what is loose, bent or broken stays unnoticed, and nothing that is counted is valid",
        "rock each joint by hand with the drive blocked: play in one says which",
    ),
    "load_and_friction": _Stakes(
        "a look at foot and drive for nothing",
        "joints wear faster under the load than is counted, or the drive runs dry",
        "let the leg walk in the air with a warm drive: it ends if load or cold grease was the cause",
    ),
    "foot_load": _Stakes(
        "a look at the sensor for nothing",
        "forces, wear and remaining life are those of a wrong load",
        "read the sensor with the foot in the air, and under a known weight",
    ),
    "force_growth_life": _Stakes(
        "a measurement for nothing",
        "the joint reaches its limit before its replacement is planned",
        _MEASURE_JOINT,
    ),
    "input": _Stakes(
        "a look at topics and cables for nothing",
        "nothing is counted or observed while the leg walks",
        "look at the messages that the reason names: `ros2 topic hz`, or `leg-wear-monitor check`",
    ),
    "gait": _Stakes(
        "a look at parameters that are right",
        "nothing is counted, or for a gait that is not this leg's",
        "turn the crank to a known angle at a known cadence, and compare what is reported",
    ),
    "not_observed": _Stakes(
        "joints rocked by hand for nothing",
        "a bushing that breaks changes nothing that is received, and stays unnoticed",
        "rock each joint by hand with the drive blocked",
    ),
    "node": _Stakes(
        "a look at files and clocks for nothing",
        "wear is counted twice, or not kept",
        "look at the file or the clock that the reason names",
    ),
    "healthy": _Stakes(
        "an opening that the torque does not show yet goes on until it does",
        "",
        "rock each joint by hand with the drive blocked: none has play that you feel",
    ),
    "index": _Stakes(
        "a look for nothing", "what the alarm says goes on", "see the guide of the alarm in the list"
    ),
}
_REPLACED = _Stakes(
    "some gait cycles of walking",
    "a wrong part, or one that is mounted badly, stays unnoticed",
    "let the leg walk for 20 gait cycles at the commanded cadence, and see the verdict then",
)


# How soon, and when to look again.


_AT_LATEST_H = 240.0  # a month of eight hours a day: no forecast was tested on a real leg
_OF_WEAR = ("REMAINING_LIFE", "GROWTH")  # what wear does; a joint that opens at once does not wait for it
_LOOK_AT = 0.5  # of the time after which one leg in ten is at a limit


HOW_SURE = "How sure"


@attrs.frozen(kw_only=True)
class Decision:
    """A verdict as a decision.

    Attributes
    ----------
    certainty : str
        How often such a finding is right, and on what that was measured.
    urgency : str
        How soon to act.
    if_wrong : str
        What an error costs either way.
    check : str
        What settles it.
    again : str
        When to look again at a healthy leg; empty for another one.
    """

    certainty: str
    urgency: str
    if_wrong: str
    check: str
    again: str = ""

    @property
    def notes(self) -> list[tuple[str, str]]:
        """All of it as lines, each with its title."""
        lines = [
            ("How soon", self.urgency),
            ("Look again", self.again),
            (HOW_SURE, self.certainty),
            ("Check", self.check),
            ("If wrong", self.if_wrong),
        ]
        return [(title, text) for title, text in lines if text]


def decision_of(state: LegState, joint_words: Callable[[str], str]) -> Decision:
    """The verdict of a leg as a decision.

    Parameters
    ----------
    state : LegState
    joint_words : callable
        A joint with its label, such as ``G (knee)``.
    """
    verdict = state.verdict
    code = code_of_rule(verdict)
    stakes = _REPLACED if code == _REPLACED_CODE else _OF_GUIDE[_guide(verdict)]
    is_healthy = verdict.state is State.HEALTHY
    wrong = (
        stakes.if_false
        if is_healthy
        else f"false: {stakes.if_false}; right and not followed: {stakes.if_ignored}"
    )
    return Decision(
        certainty=_certainty(state),
        urgency=_urgency(verdict, _life(state), joint_words),
        if_wrong=wrong,
        check=_check(stakes, verdict, state.clearances, joint_words),
        again=_again(_life(state)) if is_healthy else "",
    )


def _guide(verdict: Verdict) -> str:
    return PurePosixPath(guide_to(verdict)).stem


def _life(state: LegState) -> LifeHours | None:
    """That of the verdict's joint that lasts shortest, without one of the leg; None where it is not valid."""
    if Figure.FORECAST in state.verdict.not_valid:
        return None
    named = [life for joint in state.verdict.joints or ("leg",) if (life := state.life.get(joint))]
    return min(named, key=lambda life: life.p10_h, default=None)


def _urgency(verdict: Verdict, life: LifeHours | None, joint_words: Callable[[str], str]) -> str:
    hours = f"within {_hours(life.p10_h)} of walking" if life else ""
    whose = joints_in_words(verdict.joints, joint_words)
    match verdict.state:
        case State.STOP:
            return "before the next use: stop when it is safe, and do not walk before it is settled"
        case State.INSPECT if hours and whose and code_of_rule(verdict) in _OF_WEAR:
            return f"{hours}: {whose} is at its limit by then with a probability of 10 %"
        case State.INSPECT if whose:
            return "before the next use: the joint may open faster than wear does, which the forecast counts"
        case State.INSPECT:
            return "before the next use: how long it can wait is not known"
        case State.NOT_MONITORED:
            return "before the next use: until then nobody sees a joint that opens"
        case State.WATCH if code_of_rule(verdict) == _REPLACED_CODE:
            return "with the next gait cycles: until then nothing is known of the new part"
        case State.WATCH:
            return f"at the next stop, {hours} at the latest" if hours else "at the next stop"
    return "nothing is urgent"


def _hours(hours: float) -> str:
    return f"about {three_digits(hours)} h" if hours >= 1.0 else "less than an hour"


def _again(life: LifeHours | None) -> str:
    if life is None:
        return "at the next stop: how long the leg lasts is not known"
    hours = _LOOK_AT * life.p10_h
    if hours >= _AT_LATEST_H:
        return f"after {_AT_LATEST_H:.0f} h of walking, a month of eight hours a day"
    return (
        f"after {_hours(hours)} of walking, half of the time after which a joint is at its limit with a "
        "probability of 10 %"
    )


def _check(
    stakes: _Stakes,
    verdict: Verdict,
    clearances: Mapping[str, JointClearance],
    joint_words: Callable[[str], str],
) -> str:
    joints = verdict.joints
    known = clearances.get(joints[0]) if joints else None
    limit = f" (limit {amount(known.limit_m, 'm')})" if known else ""
    return stakes.check.format(
        joints=joints_in_words(joints, joint_words) or "the joints",
        limit=limit,
    )


def joints_in_words(joints: Sequence[str], joint_words: Callable[[str], str]) -> str:
    """Such as ``joint G (knee)``; empty without joints."""
    return f"joint {', '.join(map(joint_words, joints))}" if joints else ""
