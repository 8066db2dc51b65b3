"""How sure, how soon, check, cost of an error: constants per code, and measured values where they hold."""

import attrs
import pytest

from leg_wear_monitor.monitor.verdict.verdict import (
    HOW_SURE,
    decision_of,
    figures_of,
    rules,
    table,
)
from leg_wear_monitor.state import FootLoad, JointClearance, LegState, State, TorqueDiagnosis, Verdict


def state(code: str, by: str = "torque", on_ground: bool = False, doubt: str = "") -> LegState:
    joints = ("G",) if code != "NONE" else ()
    verdict = Verdict(
        state=State.INSPECT, joints=joints, why="", since_ns=0, do="", evidence=(), not_valid=(),
        fault_code="_".join((code, *joints)),
    )  # fmt: skip
    return LegState(
        verdict=verdict,
        clearances={"G": JointClearance(best_estimate_source=by, modelled_m=3e-4, new_m=3e-4, limit_m=6e-4)},
        load=FootLoad(source="estimated", peak_n=300.0) if on_ground else FootLoad(),
        diagnosis=TorqueDiagnosis(state="as_modelled" if code == "NONE" else "changed", reason=doubt),
    )


def test_every_rule_has_its_columns_and_every_measured_value_is_cited() -> None:
    assert {name for rule in rules().values() for name in rule.measured} == set(table().measured)
    for code in rules():
        assert all(text for _, text in decision_of(state(code)))


@pytest.mark.parametrize(
    ("code", "conditions", "cited"),
    [
        ("CLEARANCE_CHANGED", {}, ("torque_name", "false_findings")),
        ("CLEARANCE_CHANGED", {"doubt": "the model does not fit"}, ("false_findings",)),
        ("CLEARANCE_CHANGED", {"on_ground": True}, ("torque_name_on_ground",)),
        ("CLEARANCE_DETECTED", {}, ("torque_stop",)),
        ("CLEARANCE_DETECTED", {"by": "encoders"}, ("encoder_name",)),
        ("CLEARANCE_DETECTED", {"doubt": "the model does not fit"}, ()),
        ("CLEARANCE_DETECTED", {"on_ground": True}, ()),
        ("CLEARANCE", {"by": "modelled"}, ("life_interval",)),
        ("CLEARANCE", {"by": "measured"}, ()),
        ("NONE", {}, ("opened_found",)),
        ("NONE", {"on_ground": True}, ("opened_found_on_ground",)),
        ("MECHANISM_CHANGED", {}, ()),
    ],
)
def test_a_measured_value_is_cited_only_for_a_leg_that_meets_its_conditions(code, conditions, cited) -> None:
    leg = state(code, **conditions)
    assert figures_of(leg) == tuple(table().measured[name] for name in cited)
    assert (dict(decision_of(leg))[HOW_SURE] == table().how_sure["not_measured"]) == (
        not cited and code != "CLEARANCE"
    )


def test_without_a_comparison_of_the_torque_no_opening_is_promised() -> None:
    off = attrs.evolve(state("NONE"), diagnosis=TorqueDiagnosis(state="off"))
    assert figures_of(off) == ()
