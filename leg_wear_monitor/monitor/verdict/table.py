"""The table of the verdict: sentences and columns of each rule, words of each cause, measured accuracy.

All of them are data, in config/verdict.yaml.
"""

from collections.abc import Mapping
from functools import cache

import attrs

from leg_wear_monitor.configuration.strict import read_document, structure
from leg_wear_monitor.estimate.cause import Cause
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.monitor.alarms import FOOT_LOAD_WORDS
from leg_wear_monitor.monitor.input_health import INPUT_RULES
from leg_wear_monitor.state import Figure, State
from leg_wear_monitor.twin import CRANK, TORQUE

TABLE_FILE = "config/verdict.yaml"
ALARM, NONE, NO_GAIT_CYCLE = "ALARM", "NONE", "NO_GAIT_CYCLE"
_OF_INPUT = {"INPUT_CRANK": CRANK, "INPUT_TORQUE": TORQUE}
_HUNDRED = 100


@attrs.frozen(kw_only=True)
class Rule:
    """A rule; the sentences have words of its cases in braces.

    Attributes
    ----------
    state : State
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
    why: str = ""
    do: str = ""
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
        """Such as ``99 of 100 such findings are right on simulated legs``."""
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
    measured : dict of str to MeasuredFigure
    """

    phrases: dict[str, str]
    how_soon: dict[str, str]
    how_sure: dict[str, str]
    advice: dict[str, Advice]
    rules: dict[str, Rule]
    causes: dict[str, CauseWords]
    measured: dict[str, MeasuredFigure]


@cache
def table() -> VerdictTable:
    """The content of the file.

    Raises
    ------
    ConfigError
        If the file is damaged.
    """
    return structure(read_document(share_directory() / TABLE_FILE, TABLE_FILE), VerdictTable, TABLE_FILE, "")


@cache
def rules() -> Mapping[str, Rule]:
    """The rules by code; the faults of a stream of the input have the row of their stream."""
    found: dict[str, Rule] = {}
    for code, rule in table().rules.items():
        if code in _OF_INPUT:
            own = [one for one in INPUT_RULES if one.kind == _OF_INPUT[code]]
            found |= {one.code: attrs.evolve(rule, why=one.why, do=one.do) for one in own}
        else:
            why = rule.why.replace("{fault}", FOOT_LOAD_WORDS.get(code.lower(), ""))
            found[code] = attrs.evolve(rule, why=why, do=_with_phrases(rule.do))
    return found


def _with_phrases(text: str) -> str:
    for name, phrase in reversed(table().phrases.items()):  # a phrase may contain earlier ones
        text = text.replace(f"{{{name}}}", phrase)
    return text


def words_of_cause(cause: Cause) -> CauseWords:
    """Words of a cause other than a clearance."""
    return table().causes[cause.name]
