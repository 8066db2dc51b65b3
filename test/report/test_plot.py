"""What `plot` draws of each kind of result, and where."""

import attrs
import numpy as np
import pytest
from made_up_summary import made_up_summary
from matplotlib import pyplot

import leg_wear_monitor as lw
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.loader import parse_mechanism
from leg_wear_monitor.report import figure
from leg_wear_monitor.state import Figure

pytestmark = [pytest.mark.plain, pytest.mark.usefixtures("closed")]


def lines(axes):
    """Data of the lines by label, those without one left out."""
    found = {line.get_label(): line.get_xydata() for line in axes.get_lines()}
    return {label: data for label, data in found.items() if not label.startswith("_")}


@pytest.fixture
def life():
    depth = np.zeros((2, 1, 2, 4))
    column = np.array([[3e-4], [5e-4]])
    return Life(
        clearance_joints=("A",), cycles=np.array([0.0, 1e6]), clearance_m=column,
        clearance_max_m=2.0 * column, worst_sector_deg=column, peak_force_n=column, growth_m_per_cycle=column,
        growth_error_m_per_cycle=column, error_m=np.zeros(2), depth=depth,
        rubbing_j_per_cycle=column, period_s=1.0, duty=None, part_growth_m_per_cycle=column[:, None],
    )  # fmt: skip


def test_forces_over_the_turns_of_the_crank():
    result = lw.simulate("four_bar", clearances=[], cycles=1, trace=8)
    drawn = lines(lw.plot(result))
    assert set(drawn) == set(result.joints)
    assert drawn["B"][:, 1] == pytest.approx(np.maximum(result.trace.force_n["B"], 0.1))
    assert drawn["B"][4, 0] - drawn["B"][0, 0] == pytest.approx(0.5)


def test_forces_of_every_joint_without_a_trace():
    result = lw.simulate("four_bar", clearances=[], cycles=1)
    axes = lw.plot(result)
    heights = [bar.get_height() for bar in axes.patches]
    assert heights[: len(result.joints)] == [joint.mean_force_n for joint in result.joints.values()]
    assert max(heights) == max(joint.max_force_n for joint in result.joints.values())
    assert [text.get_text() for text in axes.get_xticklabels()] == list(result.joints)


def test_clearances_of_a_life(life):
    drawn = lines(lw.plot(life))
    assert drawn["A"].tolist() == pytest.approx(np.array([[0.0, 300.0], [1e6, 500.0]]))


def test_the_picture_of_a_life_says_what_each_line_is(life, monkeypatch):
    monkeypatch.setattr(figure, "png", lambda drawn: drawn)
    clearance, _, profile = figure.life_picture(life).axes
    assert [text.get_text() for text in clearance.get_legend().get_texts()] == ["A", "deepest"]
    assert "at fifths of the life, darker later" in profile.get_title()


def test_openings_of_a_replay():
    summary = made_up_summary()
    axes = lw.plot(summary)
    assert lines(axes)["B"][:, 1].tolist() == [0.0, 1000.0]  # mm
    assert axes.get_xlabel() == "time since the recording's begin [s]"


def test_a_replay_without_a_gait_cycle_draws_nothing():
    summary = made_up_summary()
    none = {joint: np.zeros(0) for joint in ("A", "B")}
    history = attrs.evolve(summary.history, stamp_ns=np.zeros(0, np.int64), counted_m=none)
    assert lines(lw.plot(attrs.evolve(summary, history=history))) == {}


def test_axes_that_are_given_are_drawn_on(life):
    _, axes = pyplot.subplots()
    assert lw.plot(life, axes) is axes and len(axes.get_lines()) == 2


def test_a_mechanism_to_scale_with_the_path_of_its_toe():
    axes = lw.plot(lw.load_mechanism("four_bar"))
    trace = lw.simulate("four_bar", clearances=[], cycles=1, trace=360).trace
    toe = np.column_stack([trace.toe_x_m, trace.toe_y_m])
    paths = [line.get_xydata() for line in axes.get_lines()]
    assert any(path.shape == (361, 2) and path[:360] == pytest.approx(toe, abs=1e-9) for path in paths)
    assert axes.get_aspect() == 1.0 and axes.get_ylabel() == "y [m]"


def test_what_is_no_result_is_named():
    with pytest.raises(TypeError, match=r"^dict has no picture, expected SimulationResult"):
        lw.plot({})


def test_openings_that_are_not_valid_are_dotted_and_named():
    summary = made_up_summary()
    for not_valid, style in (((), "-"), ((Figure.CLEARANCES,), ":")):
        verdict = attrs.evolve(summary.verdict, not_valid=not_valid)
        axes = lw.plot(attrs.evolve(summary, verdict=verdict))
        assert {line.get_linestyle() for line in axes.get_lines()} == {style}
        assert ("not valid: counted clearances" in axes.get_title()) is bool(not_valid)


def test_a_mechanism_that_does_not_close_is_drawn(document):
    long = document("four_bar")
    long["bodies"]["coupler"]["points"]["C"] = [0.5, 0.0]
    axes = lw.plot(parse_mechanism(long, "long.yaml"))
    assert any(text.get_text() == "200 mm" for text in axes.texts)
    assert "does not close" in axes.get_title()


def test_a_notebook_shows_a_verdict_with_its_names_as_text():
    why = "<script>alert(1)</script> in `joint A`"
    html = attrs.evolve(made_up_summary().verdict, why=why, not_valid=(Figure.CLEARANCES,))._repr_html_()
    assert "<script" not in html and "<code>joint A</code>" in html
    assert "not valid: counted clearances" in html
