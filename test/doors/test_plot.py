"""Pictures of a simulation, and tables of a study."""

from pathlib import Path

import pytest

import leg_wear_monitor as lw

pytest.importorskip("matplotlib")
PART = {"cycles": 0.25, "skip_cycles": 0.0}
LABELS = {
    "force": "force [N]",
    "torque": "drive torque [N m]",
    "displacement": "toe displacement error [mm]",
    "velocity": "toe velocity error [m/s]",
    "acceleration": "toe acceleration error [m/s²]",
    "portrait": "eccentricity rate [mm/s]",
    "poincare": "eccentricity rate [mm/s]",
}


@pytest.fixture(scope="module")
def result() -> lw.SimulationResult:
    return lw.simulate("bionic_leg", clearances=["G", "J"], trace=64, **PART)


@pytest.fixture(autouse=True)
def closed():
    """Pyplot keeps its figures until they are closed."""
    yield
    from matplotlib import pyplot

    pyplot.close("all")


@pytest.mark.parametrize("kind", [*LABELS, "wear"])
def test_each_kind_of_picture_is_saved_as_svg_and_pdf(result, tmp_path: Path, kind: str) -> None:
    which = {"joint": "J"} if kind in ("portrait", "poincare", "wear") else {}
    axes = lw.plot(result, kind=kind, **which)
    assert kind == "wear" or axes.get_ylabel() == LABELS[kind]
    for suffix, head in (("svg", b"<?xml"), ("pdf", b"%PDF")):
        axes.figure.savefig(tmp_path / f"picture.{suffix}")
        assert (tmp_path / f"picture.{suffix}").read_bytes().startswith(head)


def test_a_poincare_map_has_one_point_per_gait_cycle() -> None:
    result = lw.simulate("four_bar", clearances=["B"], cycles=2, skip_cycles=0.0, trace=8)
    lines = lw.plot(result, kind="poincare").get_lines()
    assert [len(line.get_xdata()) for line in lines] == [2, 2]
    assert lines[0].get_xdata() == pytest.approx(1e3 * result.trace.joints["B"].eccentricity_m[::8, 0])


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"kind": "phase"}, "kind: 'phase' is not one of force, portrait"),
        ({"kind": "wear", "joint": "A"}, "joint: 'A' has no clearance. Expected one of: G, J"),
    ],
)
def test_a_wrong_kind_or_joint_is_refused(result, how, said: str) -> None:
    with pytest.raises(lw.ConfigError) as refused:
        lw.plot(result, **how)
    assert said in str(refused.value)


def test_a_picture_of_a_trace_asks_for_one() -> None:
    with pytest.raises(lw.ConfigError) as refused:
        lw.plot(lw.simulate("four_bar", **PART), kind="portrait")
    assert "Expected a simulation with trace=N" in str(refused.value)
