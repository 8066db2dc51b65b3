"""How soon to act on a verdict, how sure it is, the check that settles it, and the cost of an error.

Nothing here is stored: it follows from the code and the state of the verdict.
"""

from leg_wear_monitor.monitor.verdict.table import ALARM, MeasuredFigure, Rule, rules, table
from leg_wear_monitor.monitor.verdict.verdict import code_of_rule
from leg_wear_monitor.state import LegState

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
    """How often such a verdict is right; says so if nothing was measured on a leg like this."""
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
