"""The rules of the verdict, one entry each; the most severe one that holds decides, the first of equals.

docs/reference/monitor.md lists them; a test compares the two.
"""

from functools import partial

import attrs

from leg_wear_monitor.monitor import alarms
from leg_wear_monitor.monitor.input_health import INPUT_RULES
from leg_wear_monitor.monitor.verdict import conditions
from leg_wear_monitor.monitor.verdict.conditions import Condition, has_fault, noted, raised
from leg_wear_monitor.monitor.verdict.situation import Situation
from leg_wear_monitor.monitor.verdict.verdict import NO_GAIT_CYCLE, NONE
from leg_wear_monitor.state import Figure, Level, State, Verdict
from leg_wear_monitor.twin import CRANK, TORQUE

EVERYTHING = tuple(Figure)
OF_THE_GAIT = (Figure.GROWTH, Figure.IMPACT_FORCES)
OF_THE_MODEL = (*OF_THE_GAIT, Figure.FORECAST)


@attrs.frozen(kw_only=True)
class Rule:
    """A rule.

    Attributes
    ----------
    code : str
        Stable name.
    state : State
    hits : callable
        Its condition: the cases in a situation for which it holds.
    why, do : str
        Texts, with the words of a hit in braces; in ``do``, ``{joints}`` names all joints
        of the hits with their labels, and ``{joint}`` is the first one as commands take it.
    not_valid : tuple of Figure
        Kinds of values that are not valid while the rule applies.
    rests_on : tuple of int
        Kinds of the streams that show it. A case that began after a fault of such a stream does not count.
    """

    code: str
    state: State
    hits: Condition
    why: str
    do: str
    not_valid: tuple[Figure, ...] = ()
    rests_on: tuple[int, ...] = ()

    def found(self, situation: Situation) -> Verdict | None:
        """The verdict by this rule alone, with all of its cases; None if it does not hold."""
        hits = [hit for hit in self.hits(situation) if situation.is_trusted(self.rests_on, hit.since_ns)]
        if not hits:
            return None
        joints = tuple(dict.fromkeys(hit.joint for hit in hits if hit.joint))
        not_valid = {*self.not_valid, *(figure for hit in hits for figure in hit.not_valid)}
        words = {"joints": situation.joints_words(joints), **hits[0].words, "joint": hits[0].joint}
        return Verdict(
            fault_code="_".join((self.code, *joints)),
            state=max((self.state, *(hit.state for hit in hits)), key=lambda state: state.severity),
            joints=joints,
            why="; ".join(dict.fromkeys(self.why.format(**hit.words) for hit in hits)),
            do=self.do.format(**words),
            since_ns=min((hit.since_ns for hit in hits if hit.since_ns), default=0),
            evidence=tuple(each for hit in hits for each in hit.evidence),
            not_valid=tuple(figure for figure in Figure if figure in not_valid),
        )


_stop, _inspect, _not_monitored, _watch = (
    partial(Rule, state=state) for state in (State.STOP, State.INSPECT, State.NOT_MONITORED, State.WATCH)
)

_ACKNOWLEDGE = (
    "then acknowledge the alarms: `leg-wear-monitor acknowledge --config FILE --ledger FILE`, or "
    "`--node NAME`"
)
_COUNTED = "the status `input` of /diagnostics and `lost` of `replay --json` count its faults"
_MEASURE = "`leg-wear-monitor measure {joint} MM --sigma MM --config FILE --ledger FILE`, or `--node NAME`"
_ROCK = (
    "stop when it is safe, block the drive and rock joint {joints}; measure its radial clearance and enter "
    f"it: {_MEASURE}"
)
_ENTER_PART = (
    "replace the parts of joint {joints}, and enter that: `leg-wear-monitor reset {joint} --config FILE "
    "--ledger FILE`, or `--node NAME` while a monitor runs"
)
_REPLACE = (
    f"stop when it is safe, block the drive, and measure joint {{joints}}: {_MEASURE}; if the joint is at "
    f"its limit, {_ENTER_PART}"
)


def _cause(code: str, meaning: str, state: State = State.INSPECT, not_valid: tuple[Figure, ...] = ()) -> Rule:
    """Rule of a cause that explains a deviation of the drive torque."""
    return Rule(
        code=code,
        state=state,
        hits=conditions.has_cause(code),
        why=f"the drive torque differs from the prediction: {meaning}{{causes}}",
        do=f"{{remedy}}; {_ACKNOWLEDGE}",
        not_valid=not_valid,
        rests_on=(TORQUE,),
    )


_FOOT_LOAD = {
    alarms.STUCK: "check the sensor of the foot load",
    alarms.ZERO: "set the sensor's zero while the foot is in the air",
    alarms.SCALE: "correct foot_load.scale: forces are in newtons",
    alarms.EXCHANGED: "exchange the sensors, topics or columns of the two feet",
    alarms.SIGN: "correct foot_load.sign",
}


def _input(kind: int, state: State, not_valid: tuple[Figure, ...] = ()) -> tuple[Rule, ...]:
    """Rules of the faults of a stream: they come before the rules on the leg from this stream."""
    return tuple(
        Rule(
            code=one.code,
            state=state,
            hits=has_fault(one.code),
            why=one.why,
            do=one.do,
            not_valid=not_valid,
        )
        for one in INPUT_RULES
        if one.kind == kind
    )


def _foot_load(kind: str) -> Rule:
    """Rule of a fault of the foot load's sensor."""
    return _inspect(
        code=kind.upper(),
        hits=raised(kind, least=Level.ERROR),
        why=f"{alarms.FOOT_LOAD_WORDS[kind]} (the {{quantity}} is {{value}}, limit {{limit}})"
        "{past}{acts}",
        do=f"{_FOOT_LOAD[kind]}; {_ACKNOWLEDGE}",
        not_valid=OF_THE_MODEL,
    )


RULES = (
    _stop(
        code="CLEARANCE",
        hits=conditions.counted_at_limit,
        why="the {known} clearance of joint {joint} is {value} (limit {limit}){past}",
        do=_REPLACE,
    ),
    _stop(
        code="CLEARANCE_DETECTED",
        hits=conditions.seen_at_limit,
        why="according to {by}, the clearance of joint {joint} is {value} (limit {limit}){past}",
        do=_REPLACE,
        not_valid=EVERYTHING,
    ),
    _stop(
        code="CLEARANCE_ESTIMATED",
        hits=conditions.believed_at_limit,
        why="wear model and measurements together give a clearance of {value} in joint {joint} (limit "
        "{limit})",
        do=_REPLACE,
    ),
    _cause("TORQUE_SIGN", "its sign is reversed", not_valid=EVERYTHING),
    _cause("TORQUE_SCALE", "its size is wrong"),
    _inspect(
        code="CLEARANCE_CHANGED",
        hits=conditions.diagnosed,
        why="the drive torque shows a {change}",
        do=_ROCK,
        not_valid=EVERYTHING,
        rests_on=(TORQUE,),
    ),
    _inspect(
        code="CLEARANCE_CORRECTED",
        hits=conditions.corrected,
        why="the drive torque showed a {change}; the model uses it from now on",
        do=_ROCK,
    ),
    _inspect(
        code="CLEARANCE_DEPARTURE",
        hits=conditions.departing,
        why="the encoders show a clearance of joint {joint} that differs from the modelled one by {value} "
        "(limit {limit}){past}",
        do=f"{_ROCK}; {_ACKNOWLEDGE}",
        not_valid=(Figure.CLEARANCES, *OF_THE_GAIT),
    ),
    _cause("TORQUE_TIMING", "its time does not fit the crank angle"),
    _cause("TORQUE_MASS", "a body has a different mass", not_valid=EVERYTHING),
    _cause("MECHANISM_CHANGED", "it does not fit the model of this leg", not_valid=EVERYTHING),
    _cause("TORQUE_LOAD", "a load acts at the foot", State.WATCH, OF_THE_MODEL),
    _inspect(
        code="LOAD_NOT_OBSERVED",
        hits=conditions.load_not_observed,
        why="the load at the foot is not observable: the ground's force may have a different shape than in "
        "the model; {value} of the predicted RMS is not explained (limit {limit}){past}",
        do="measure the force at the foot (`foot_load.source`), or let the leg walk in the air with "
        f"`load.model: none`, where the torque shows the joints; {_ACKNOWLEDGE}",
        not_valid=EVERYTHING,
        rests_on=(TORQUE,),
    ),
    _inspect(
        code="TORQUE_MISMATCH",
        hits=conditions.mismatch,
        why="the drive torque does not fit the model of this leg, so the forecast is not valid: {value} of "
        "the predicted RMS is not explained (limit {limit}){past}{causes}",
        do="stop when it is safe, block the drive and rock each joint; measure the joint with play and enter "
        "it: `leg-wear-monitor measure JOINT MM --sigma MM --config FILE --ledger FILE`, or `--node NAME`; "
        f"if none has play, check the load at the foot and the torque sensor; {_ACKNOWLEDGE}",
        not_valid=EVERYTHING,
        rests_on=(TORQUE,),
    ),
    _cause("TORQUE_NOISE", "it has more or less noise than before", State.WATCH),
    _cause("TORQUE_BIAS", "it has a constant part that friction cannot cause"),
    _cause("FRICTION_CHANGED", "the friction has changed", State.WATCH),
    _inspect(
        code="IMPACT_FORCE",
        hits=raised("impact_force", least=Level.ERROR),
        why="the impact force in joint {joint} is {value} (limit {limit}){past}",
        do=f"{_ROCK}; check its lubrication and the cadence; {_ACKNOWLEDGE}",
        rests_on=(CRANK,),
    ),
    _inspect(
        code="GROWTH",
        hits=raised("growth", least=Level.ERROR),
        why="the clearance of joint {joint} grows by {value} (limit {limit}){past}",
        do=f"{_ROCK}; check its lubrication and for dirt; {_ACKNOWLEDGE}",
    ),
    _inspect(
        code="REMAINING_LIFE",
        hits=raised("remaining_life", least=Level.ERROR),
        why="joint {joint} reaches its limit within {value} with a probability of 10 % (limit {limit}){past}",
        do=f"{_ROCK}; plan its replacement; {_ACKNOWLEDGE}",
    ),
    _not_monitored(
        code=alarms.ALREADY_COUNTED,
        hits=noted(alarms.ALREADY_COUNTED),
        why="all received samples are in the ledger already, so no wear was added",
        do="nothing, if a recording was replayed again; for its report, replay it without a ledger; "
        "on a live leg, check the clock of the samples",
        not_valid=OF_THE_GAIT,
    ),
    *_input(CRANK, State.NOT_MONITORED, OF_THE_GAIT),
    _not_monitored(
        code=alarms.CRANK_ZERO,
        hits=noted(alarms.CRANK_ZERO),
        why="{cause}",
        do="let the leg walk steadily at the commanded cadence; if the zero is still not found, check the "
        "drive torque and its parameters, or set crank.zero to known and crank.offset_rad",
        not_valid=OF_THE_GAIT,
    ),
    _not_monitored(
        code="TRACKING_LOST",
        hits=noted("TRACKING_LOST"),
        why="{cause}",
        do=f"repair the input of the crank; {_COUNTED}",
        not_valid=OF_THE_GAIT,
    ),
    _not_monitored(
        code="BAD_INPUT",
        hits=conditions.blinding,
        why="the {quantity} is {value} (limit {limit}){causes}",
        do=f"repair the input; {_COUNTED}",
        not_valid=OF_THE_GAIT,
    ),
    _not_monitored(
        code="NOT_THIS_LEG",
        hits=noted("NOT_THIS_LEG"),
        why="the gait does not fit this leg: {cause}",
        do="compare the parameters with the leg: mechanism, cadence, crank and drive_torque; "
        "`leg-wear-monitor commission RECORDING` proposes them from a recording of the healthy leg",
        not_valid=EVERYTHING,
    ),
    _not_monitored(
        code=NO_GAIT_CYCLE,
        hits=conditions.no_cycle,
        why="the monitor has not received a whole gait cycle yet",
        do=f"let the leg walk; if it walks already: {_COUNTED}",
    ),
    *map(_foot_load, _FOOT_LOAD),
    *_input(TORQUE, State.WATCH),
    _watch(
        code="FOOT_LOAD_MISSING",
        hits=conditions.of_foot_load,
        why="the {quantity} is {value} (limit {limit}){acts}",
        do="repair the sensor of the foot load or its publisher, or set foot_load.source to none",
        not_valid=OF_THE_GAIT,
    ),
    _watch(
        code="MATERIAL_LIMIT",
        hits=raised("material_limit", least=Level.ERROR),
        why="joint {joint} is loaded {value} times the limits of its material{past}; its wear coefficient "
        "is not valid",
        do="compare the material of the mechanism file with the part, and load and cadence with its limits; "
        f"until then, measure the clearance of joint {{joints}} regularly; {_ACKNOWLEDGE}",
        not_valid=(Figure.GROWTH, Figure.FORECAST),
    ),
    _watch(
        code="PART_REPLACED",
        hits=conditions.replaced,
        why="joint {joint} was replaced on {when}, {cycles} gait cycles ago",
        do="let the leg walk on at the commanded cadence; the verdict then confirms the repair",
    ),
    _watch(
        code="NO_DRIVE_TORQUE",
        hits=conditions.no_torque,
        why="joints {joints} cannot be observed: there is no drive torque",
        do="provide the drive torque (drive_torque.source); until then, rock the joints by hand regularly",
    ),
    _watch(
        code="TORQUE_NOT_COMPARED",
        hits=conditions.not_compared,
        why="the comparison of the drive torque needs more gait cycles",
        do="let the leg walk on",
    ),
    _watch(
        code="NOT_OBSERVED",
        hits=conditions.not_observed,
        why="the drive torque does not show the clearances of joints {joints}{causes}",
        do="{then}rock these joints by hand regularly",
    ),
    _watch(
        code="CADENCE",
        hits=conditions.other_cadence,
        why="the leg does not walk at the commanded cadence: {cause}",
        do=f"walk at the commanded cadence, or set cadence.commanded_rpm; {_ACKNOWLEDGE}",
        not_valid=(Figure.FORECAST,),
    ),
    _watch(
        code="ENCODER",
        hits=noted("ENCODER"),
        why="encoder {cause}",
        do="repair the encoder, or remove it from encoders.names",
    ),
    _watch(
        code="CLEARANCE_NEAR",
        hits=raised("clearance", most=Level.WARN),
        why="the {known} clearance of joint {joint} is {value}, near its limit of {limit}{past}",
        do="order the journal and the bushing of joint {joints}; at the next stop, rock the joint, measure "
        f"its radial clearance and enter it: {_MEASURE}",
    ),
    _watch(
        code="ALARM",
        hits=raised(),
        why="alarm: the {quantity} is {value} (limit {limit}){past}",
        do=f"see the status of the joint or the input; {_ACKNOWLEDGE}",
    ),
    Rule(
        code=NONE,
        state=State.HEALTHY,
        hits=conditions.nothing_found,
        why="no alarm is raised, and {observed}",
        do=f"nothing now. {alarms.ADVICE}",
    ),
)
"""In the order of precedence among equal states."""


def findings(situation: Situation) -> tuple[Verdict, ...]:
    """Verdicts of all rules that hold, in the order of the table; a healthy leg's verdict only alone."""
    found = tuple(each for rule in RULES if (each := rule.found(situation)) is not None)
    return tuple(each for each in found if each.fault_code != NONE) or found
