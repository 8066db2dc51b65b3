"""What a notebook shows: small, without scripts, with names as text; and `plot` as a method."""

import math

import attrs
import numpy as np
import pytest
from made_up_summary import made_up_summary

import leg_wear_monitor as lw
import leg_wear_monitor.state
from leg_wear_monitor.estimate.cause import Cause, Change
from leg_wear_monitor.mechanism.loader import parse_mechanism
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis, DiagnosisState, ExplainedTorque
from leg_wear_monitor.report.plot import notebook_html
from leg_wear_monitor.state import Figure

pytestmark = [pytest.mark.plain, pytest.mark.usefixtures("closed")]

EVIL = "<script>alert(1)</script>"


def test_a_mechanism_is_a_picture_and_its_name_is_text():
    html = attrs.evolve(lw.load_mechanism("four_bar"), name=EVIL)._repr_html_()
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in html
    assert "<script" not in html
    assert 'src="data:image/svg+xml;base64,' in html
    assert "closes, and the crank turns through" in html
    assert len(html) < 200_000


def test_a_mechanism_that_does_not_close_is_shown_and_plotted(document):
    long = document("four_bar")
    long["bodies"]["coupler"]["points"]["C"] = [0.5, 0.0]
    mechanism = parse_mechanism(long, "long.yaml")
    assert "is open by 200 mm" in mechanism._repr_html_()
    axes = mechanism.plot()
    assert any(text.get_text() == "200 mm" for text in axes.texts)
    assert "does not close" in axes.get_title()


def test_a_simulation_is_a_table_of_its_joints():
    result = lw.simulate("four_bar", clearances=[], cycles=1)
    html = attrs.evolve(result, mechanism=EVIL)._repr_html_()
    assert "<script" not in html
    assert html.count('<th scope="row">') == len(result.joints)
    assert f"<td>{result.joints['B'].max_force_n:.4g}</td>" in html
    assert result.plot().get_ylabel() == "force [N]"


def test_a_replay_is_its_verdict_and_clearances_only_where_valid():
    summary = made_up_summary()
    html = summary._repr_html_()
    assert summary.verdict.fault_code in html
    for each in summary.clearances.values():
        assert f"<td>{1e3 * each.believed_m:.4g}</td>" in html and "not valid</td>" not in html
    unknown = {
        joint: attrs.evolve(each, believed_m=None, believed_by=None)
        for joint, each in summary.clearances.items()
    }
    html = attrs.evolve(summary, clearances=unknown)._repr_html_()
    assert html.count("<td>not valid</td>") == len(unknown)
    for each in summary.clearances.values():
        assert f"<td>{1e3 * each.counted_m:.4g}</td>" not in html


def test_a_leg_is_a_picture_of_its_clearances_and_a_decision():
    state = made_up_summary()
    leg = lw.state.LegState(**{
        field.name: getattr(state, field.name) for field in attrs.fields(lw.state.LegState)
    })  # fmt: skip
    for shown in (state, leg):
        html = shown._repr_html_()
        assert 'src="data:image/svg+xml;base64,' in html and "Clearances against their limits: A" in html
        assert "how soon: " in html and "how sure: " in html and "<script" not in html
        assert len(html) < 100_000


def test_a_verdict_says_what_is_not_valid_and_a_material_has_its_sources():
    verdict = attrs.evolve(made_up_summary().verdict, why=EVIL, not_valid=(Figure.CLEARANCES,))
    html = verdict._repr_html_()
    assert "<script" not in html
    assert "not valid: counted clearances" in html
    pair = lw.load_material("steel-on-steel-greased-mild")
    html = attrs.evolve(pair, notes=EVIL)._repr_html_()
    assert "<script" not in html
    assert html.count('<th scope="row">') == len(list(pair.values()))


def test_large_numbers_have_no_exponent():
    result = lw.simulate("four_bar", clearances=[], cycles=1)
    joint = attrs.evolve(result.joints["B"], max_force_n=11642.3)
    html = attrs.evolve(result, joints={"B": joint})._repr_html_()
    assert "<td>11640</td>" in html


def test_what_is_no_result_is_named():
    with pytest.raises(TypeError, match="dict has no HTML"):
        notebook_html({})


def test_a_diagnosis_is_its_torque_with_estimates_and_odds():
    change = Change(
        cause=Cause.CLEARANCE, subject=EVIL, value=6.2e-4, sigma=3e-5, since_ns=5, counted=3e-4,
        log_odds=30.0 * math.log(10.0), runner_up="joint B", runner_up_log_odds=3.0 * math.log(10.0),
    )  # fmt: skip
    torque = ExplainedTorque(np.full(80, 2.0), np.full(80, 1.0), np.full(80, 1.5))
    found = Diagnosis(
        state=DiagnosisState.CHANGED, cycles=6, clearance_m=(6.2e-4, math.nan), sigma_m=(3e-5, math.nan),
        changes=(change,), joints=("A", "B"), torque=torque,
    )  # fmt: skip
    html = found._repr_html_()
    assert "<script" not in html
    assert "Diagnosis: the drive torque shows a change" in html
    assert "odds 10^30 to 1 against the leg as counted, 10^3 to 1 against joint B" in html
    assert "<td>0.62</td>" in html and html.count("<td>not observable</td>") == 2
    assert "1 N m RMS off the counted clearances, 0.5 N m RMS off the estimated ones" in html
    assert "<img" not in attrs.evolve(found, torque=None)._repr_html_()
    assert "<table" not in Diagnosis(reason="diagnosis.enabled is false")._repr_html_()


def test_the_diagnosis_of_a_replay_has_a_torque_that_its_estimates_explain(knocking):
    found = knocking.monitor.diagnosis
    assert found.joints == tuple("ABGIJ")
    off = [
        np.std(found.torque.measured_nm - each)
        for each in (found.torque.counted_nm, found.torque.estimated_nm)
    ]
    assert off[1] < off[0]  # the estimate is the nearest that clearances give
