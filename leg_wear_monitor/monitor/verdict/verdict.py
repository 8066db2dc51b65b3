"""The verdict: its table in config/verdict.yaml, the worst of several findings, and advice for operators.

The table has the sentences and columns of each rule, the words of each cause, and measured accuracies.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache

import attrs

from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.estimate.cause import Cause
from leg_wear_monitor.monitor.alarms import amount, guide_of
from leg_wear_monitor.monitor.sentences import TABLE_FILE, verdict_document
from leg_wear_monitor.state import Evidence, Figure, LegState, Level, State, Verdict

ALARM, NONE, NO_GAIT_CYCLE = "ALARM", "NONE", "NO_GAIT_CYCLE"
_HUNDRED = 100


@attrs.frozen(kw_only=True)
class Rule:
    """A rule; the sentences have words of its cases in braces.

    Attributes
    ----------
    state : State
    fault : str
        Fault of a sensor, ``{fault}`` in ``why``; its status says it as well.
    why, do : str
        In ``do``, ``{joints}`` names all joints of the cases with their labels, and ``{joint}`` is the first
        one as commands take it.
    not_valid : tuple of Figure
        Kinds of values that are not valid while the rule applies.
    rests_on : str
        Kind of the samples that show it. A case that began after a fault of these samples does not count.
    advice : str
        Its row of `VerdictTable.advice`.
    soon, sure : str
        Instead of those of the advice.
    measured : tuple of str
        Names of the measured values that say how often it is right.
    """

    state: State
    fault: str = ""
    why: str
    do: str
    not_valid: tuple[Figure, ...] = ()
    rests_on: str = ""
    advice: str
    soon: str = ""
    sure: str = ""
    measured: tuple[str, ...] = ()


@attrs.frozen(kw_only=True)
class Advice:
    """Columns that several rules share.

    Attributes
    ----------
    if_wrong : str
        Cost of following a false verdict, and of ignoring a true one.
    check : str
        The one check that settles it.
    soon : str
        How soon to act; empty if only the state decides.
    sure : str
        How sure the verdict is without a measured value, a key of `VerdictTable.how_sure`.
    """

    if_wrong: str
    check: str
    soon: str = ""
    sure: str = "not_measured"


@attrs.frozen(kw_only=True)
class CauseWords:
    """Words of a cause of a deviating drive torque.

    Attributes
    ----------
    name, unit : str
        Of its value, as evidence.
    why : str
        The sentence; the drive torque is *it*. ``{value}`` and ``{size}`` are the value with and without its
        sign, ``{percent}`` is the size in percent, ``{subject}`` the body, ``{way}`` one of `ways`.
    do : str
        Action of the operator.
    ways : tuple of str
        Words for a negative and for a positive value.
    """

    name: str
    unit: str = ""
    why: str
    do: str
    ways: tuple[str, ...] = ("fallen", "risen")


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
        True if the legs walked on the ground, False in the air; None if it makes no difference.
    needs_sure_names : bool
        True if the cases had a model that fits the leg, so that the names of joints were sure.
    needs_diagnosis : bool
        True if the drive torque showed the modelled clearances before the case.
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
        """Such as ``99 of 100 such verdicts were right in tests on simulated legs``."""
        is_long = self.of is not None and self.of > _HUNDRED and self.right != self.of
        counted = f"{int(_HUNDRED * self.right / (self.of or 1))} of {_HUNDRED}" if is_long else self.counted
        return f"{counted} {self.words}"


@attrs.frozen(kw_only=True)
class VerdictTable:
    """The file.

    Attributes
    ----------
    phrases : dict of str to str
        Parts of the sentences in ``do``, which have their names in braces.
    how_soon : dict of str to str
        How soon to act, by state.
    how_sure : dict of str to str
    advice : dict of str to Advice
    rules : dict of str to Rule
        By code, in the order of precedence among equal states.
    causes : dict of str to CauseWords
        By the name of the cause.
    reasons : dict of str to str
        Sentences on an estimate from the drive torque that is missing or unsure, and on the next result.
    measured : dict of str to MeasuredFigure
    measurement : dict of str to str
        Sentences on a clearance that an operator has measured.
    codes : dict of str to str
        Codes of statuses that are neither a rule nor an alarm, and their meaning.
    samples : dict of str to str
        Sentences on samples that are not used.
    """

    phrases: dict[str, str]
    how_soon: dict[str, str]
    how_sure: dict[str, str]
    advice: dict[str, Advice]
    rules: dict[str, Rule]
    causes: dict[str, CauseWords]
    reasons: dict[str, str]
    measured: dict[str, MeasuredFigure]
    measurement: dict[str, str]
    codes: dict[str, str]
    samples: dict[str, str]


@cache
def table() -> VerdictTable:
    """The content of the file.

    Raises
    ------
    ConfigError
        If the file is damaged.
    """
    return structure(verdict_document(), VerdictTable, TABLE_FILE, "")


@cache
def rules() -> Mapping[str, Rule]:
    """The rules by code, with their phrases."""
    return {
        code: attrs.evolve(
            rule,
            why=rule.why.replace("{fault}", rule.fault),
            do=_with_phrases(rule.do),
        )
        for code, rule in table().rules.items()
    }


def _with_phrases(text: str) -> str:
    for name, phrase in reversed(table().phrases.items()):  # a phrase may contain earlier ones
        text = text.replace(f"{{{name}}}", phrase)
    return text


def words_of_cause(cause: Cause) -> CauseWords:
    """Texts for a cause other than a clearance."""
    return table().causes[cause.name]


# Findings of the rules, and their verdict.


_TIMING = "TORQUE_TIMING"


def level_of(verdict: Verdict) -> Level:
    """Level in diagnostics: a leg that has not walked yet is not a fault."""
    if verdict.state is State.HEALTHY:
        return Level.OK
    if verdict.state is State.WATCH or verdict.fault_code == NO_GAIT_CYCLE:
        return Level.WARN
    return Level.ERROR


def code_of_rule(verdict: Verdict) -> str:
    """The verdict's code without its joints: the rule's code, such as ``CLEARANCE_DETECTED``."""
    return verdict.fault_code.removesuffix("".join(f"_{joint}" for joint in verdict.joints))


def guide_to(verdict: Verdict) -> str:
    """Page with the remedy for a verdict's reason, as a path below the share directory."""
    return guide_of(code_of_rule(verdict))


def verdict_of(findings: Sequence[Verdict]) -> Verdict:
    """The verdict of at least one finding; the first of the most severe findings gives the reason."""
    lead = max(findings, key=lambda finding: finding.state.severity)
    evidence: dict[str, Evidence] = {}
    for each in (each for finding in (lead, *findings) for each in finding.evidence):
        evidence.setdefault(each.name, each)
    found = {figure for finding in findings for figure in finding.not_valid}
    why, blind = lead.why, [each for each in findings if each.state is State.NOT_MONITORED]
    if blind and lead.state is not State.NOT_MONITORED:
        why += f"; the leg is not monitored now: {blind[0].why}"
    inspected = [one for one in findings if one.state.severity >= State.INSPECT.severity]
    # a reason without a joint does not hide a joint, and a joint does not hide a wrong time of the torque
    also = [one for one in inspected if (one.fault_code == _TIMING if lead.joints else one.joints)]
    why += "".join(f"; also: {one.why}. To do: {one.do}" for one in also)
    not_valid = tuple(figure for figure in Figure if figure in found)
    return attrs.evolve(lead, why=why, evidence=tuple(evidence.values()), not_valid=not_valid)


def dated(findings: Iterable[Verdict], before: Iterable[Verdict], stamp_ns: int) -> tuple[Verdict, ...]:
    """Findings with their start: their own, the start of the same earlier finding, or the given stamp."""
    known = {each.fault_code: each.since_ns for each in before}
    return tuple(
        attrs.evolve(each, since_ns=each.since_ns or known.get(each.fault_code) or stamp_ns)
        for each in findings
    )


def has_changed(before: Verdict | None, after: Verdict) -> bool:
    """True if a verdict must be reported again; values alone change in each gait cycle."""
    return before is None or _identity(before) != _identity(after)


def _identity(verdict: Verdict) -> tuple[object, ...]:
    return (verdict.state, verdict.fault_code, verdict.not_valid)


# Values in the verdict's sentences: units that operators read, in three digits.


_KEYS = {"m/h": "m_per_hour", "N m": "nm"}


def with_unit(name: str, unit: str) -> str:
    """Key of a value in a status: a name that ends in the value's unit."""
    key = _KEYS.get(unit, unit.lower())
    return f"{name}_{key}" if key and not name.endswith(f"_{key}") else name


def estimate(value: float, sigma: float, unit: str) -> str:
    """A value [SI] and its standard deviation, such as ``0.62 mm ± 0.03 mm``."""
    return f"{amount(value, unit)} ± {amount(sigma, unit)}"


# How soon to act, how sure the verdict is, the check that settles it, and the cost of an error.
#
# Nothing here is stored: it follows from the code and the state of the verdict.


HOW_SURE = "How sure"


def _rule(state: LegState) -> Rule:
    return rules().get(code_of_rule(state.verdict), rules()[ALARM])  # an older ledger may have other codes


def _holds_for(figure: MeasuredFigure, state: LegState) -> bool:
    """True if a leg meets the conditions of the cases in which an accuracy was measured."""
    joint = state.clearances.get(state.verdict.joints[0]) if state.verdict.joints else None
    return (
        figure.on_ground in (None, bool(state.load.peak_n))
        and not (figure.needs_sure_names and state.diagnosis.reason)
        and not (figure.needs_diagnosis and state.diagnosis.state != "as_modelled")
        and (figure.by is None or (joint is not None and figure.by == joint.best_estimate_source))
    )


def figures_of(state: LegState) -> tuple[MeasuredFigure, ...]:
    """The measured values that say how often such a verdict is right on a leg like this; may be empty."""
    figures = (table().measured[name] for name in _rule(state).measured)
    return tuple(figure for figure in figures if _holds_for(figure, state))


def how_soon(state: LegState) -> str:
    """How soon to act on the verdict of a leg."""
    rule, known = _rule(state), table()
    return rule.soon or known.advice[rule.advice].soon or known.how_soon[state.verdict.state.value]


def how_sure(state: LegState) -> str:
    """How often such a verdict was right in tests, or a note if this was never measured on such a leg."""
    rule, known = _rule(state), table()
    measured = "; ".join(figure.text for figure in figures_of(state))
    return measured or known.how_sure[rule.sure or known.advice[rule.advice].sure]


def decision_of(state: LegState) -> list[tuple[str, str]]:
    """The verdict of a leg as lines for operators, each with its title."""
    advice = table().advice[_rule(state).advice]
    return [
        ("How soon", how_soon(state)),
        (HOW_SURE, how_sure(state)),
        ("Check", advice.check),
        ("If wrong", advice.if_wrong),
    ]
