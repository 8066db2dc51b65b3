"""A rule of the verdict: condition, state and texts in one entry."""

from collections.abc import Callable, Mapping, Sequence

import attrs

from leg_wear_monitor.monitor.verdict.situation import Situation
from leg_wear_monitor.monitor.verdict.verdict import Evidence, Figure, Finding, State

EVERYTHING = tuple(Figure)
OF_THE_GAIT = (Figure.GROWTH, Figure.IMPACT_FORCES)
OF_THE_MODEL = (Figure.GROWTH, Figure.IMPACT_FORCES, Figure.FORECAST)


@attrs.frozen(kw_only=True)
class Hit:
    """One case for which the condition of a rule holds.

    Attributes
    ----------
    words : mapping of str to str
        Words for the braces of the rule's texts.
    joint : str
        The joint concerned, empty if it is none.
    since_ns : int
        Stamp since which it holds, 0 if it is not known.
    evidence : tuple of Evidence
    not_valid : tuple of Figure
        In addition to the rule's.
    state : State
        Where it is more severe than the rule's.
    """

    words: Mapping[str, str] = attrs.field(factory=dict)
    joint: str = ""
    since_ns: int = 0
    evidence: tuple[Evidence, ...] = ()
    not_valid: tuple[Figure, ...] = ()
    state: State = State.HEALTHY


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
    """

    code: str
    state: State
    hits: Callable[[Situation], Sequence[Hit]]
    why: str
    do: str
    not_valid: tuple[Figure, ...] = ()

    def found(self, situation: Situation) -> Finding | None:
        """The finding if the rule holds, with all of its cases."""
        hits = self.hits(situation)
        if not hits:
            return None
        joints = tuple(dict.fromkeys(hit.joint for hit in hits if hit.joint))
        since = [hit.since_ns for hit in hits if hit.since_ns]
        not_valid = {*self.not_valid, *(figure for hit in hits for figure in hit.not_valid)}
        words = {"joints": ", ".join(map(situation.joint_words, joints)), **hits[0].words}
        return Finding(
            code=self.code,
            state=max((self.state, *(hit.state for hit in hits)), key=lambda state: state.severity),
            joints=joints,
            why="; ".join(dict.fromkeys(self.why.format(**hit.words) for hit in hits)),
            do=self.do.format(**(words | {"joint": hits[0].joint})),
            since_ns=min(since, default=0),
            evidence=tuple(each for hit in hits for each in hit.evidence),
            not_valid=tuple(figure for figure in Figure if figure in not_valid),
        )
