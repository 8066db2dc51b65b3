"""simulate: what is counted, and that its figures are those of the parts below it."""

import json
import math

import attrs
import numpy as np
import pytest

import leg_wear_monitor as lw
from leg_wear_monitor import ConfigError, load_mechanism, simulate

TURN = 2.0 * math.pi
FULL = {"model": "full"}


@pytest.fixture(scope="module")
def worn_leg(leg):
    """Half a cycle counted after a quarter skipped, wear opening the clearances, with a trace."""
    return simulate(leg, cycles=0.5, skip_cycles=0.25, wear=True, trace=40, **FULL)


def test_without_clearances_it_is_the_ideal_cycle(leg, data):
    """Computed independently, at every tenth of a degree of the crank."""
    result, wanted = (
        simulate(leg, clearances=(), cycles=2, trace=36),
        json.loads((data / "ideal_60rpm.json").read_text()),
    )
    assert result.model == "ideal"
    torque, force = wanted["drive_torque_nm"], wanted["joint_force_n"]
    assert result.trace.drive_torque_nm == pytest.approx(np.tile(torque, 2), abs=1.0e-6 * np.ptp(torque))
    toe = np.array(wanted["toe_m"])
    np.testing.assert_allclose(result.trace.toe_x_m[:36], toe[:, 0], atol=1.0e-6 * np.ptp(toe[:, 0]))
    np.testing.assert_allclose(result.trace.toe_y_m[:36], toe[:, 1], atol=1.0e-6 * np.ptp(toe[:, 1]))
    for name in leg.joints:
        np.testing.assert_allclose(
            result.trace.force_n[name][:36], force[name], atol=1.0e-6 * np.ptp(force[name])
        )
        assert result.joints[name].mean_force_n == pytest.approx(np.mean(force[name]), rel=0.01)
    assert result.trace.crank_angle_rad == pytest.approx(np.arange(72) * TURN / 36)


def test_backwards_the_ideal_trace_runs_backwards(leg):
    forth, back = (simulate(leg, clearances=(), cycles=1, trace=8, speed_rpm=rpm) for rpm in (60.0, -60.0))
    assert back.speed_rpm == pytest.approx(-60.0)
    assert back.trace.crank_angle_rad == pytest.approx(-forth.trace.crank_angle_rad)
    assert back.trace.toe_x_m[1:] == pytest.approx(forth.trace.toe_x_m[:0:-1])
    for joint in leg.joints:
        assert back.trace.force_n[joint][1:] == pytest.approx(forth.trace.force_n[joint][:0:-1])


def test_backwards_with_clearances(leg):
    result = simulate(leg, clearances=("G",), cycles=0.25, skip_cycles=0.0, speed_rpm=-60.0, trace=16, **FULL)
    assert result.speed_rpm == pytest.approx(-60.0)
    assert result.trace.crank_angle_rad == pytest.approx(np.arange(4) * -TURN / 16, abs=1.0e-6)
    assert result.joints["G"].mean_force_n > 10.0


def test_what_is_counted(worn_leg):
    assert worn_leg.cycles == pytest.approx(0.5)
    assert worn_leg.simulated_s == pytest.approx(0.75)
    assert worn_leg.speed_rpm == pytest.approx(60.0)
    assert len(worn_leg.trace.crank_angle_rad) == 20
    assert worn_leg.trace.crank_angle_rad == pytest.approx(TURN * np.arange(10, 30) / 40, abs=1.0e-6)


def test_standard_errors_are_those_of_the_cycles_one_by_one():
    """Three cycles at once and one after the other are the same motion, at any resolution."""
    kept = {"wear": True, "intervals": 1024}
    whole = simulate("four_bar", cycles=3, skip_cycles=1, **kept)
    single = [simulate("four_bar", cycles=1, skip_cycles=skip, **kept) for skip in (1, 2, 3)]
    for path in (
        "drive_torque_nm.rms",
        "energy_j.residual",
        "joints.A.p99_force_n",
        "joints.B.wear_depth_m_per_cycle.bushing_mean",
        "joints.C.archard_integral_j_per_cycle",
    ):
        values = [value_at(result, path) for result in single]
        of_sum = 3.0 if path.startswith("energy_j") else 1.0
        expected = of_sum * np.std(values, ddof=1) / math.sqrt(3.0)
        assert whole.standard_error[path] == pytest.approx(expected, rel=1.0e-6)
    assert all(one.standard_error is None for one in single)
    finer = simulate("four_bar", cycles=1, skip_cycles=0, intervals=8192)
    usual = simulate("four_bar", cycles=1, skip_cycles=0)
    assert finer.drive_torque_nm.rms == pytest.approx(usual.drive_torque_nm.rms, rel=0.1)
    assert finer.energy_j != usual.energy_j


def value_at(result, path):
    """The value of a result at a path."""
    value = result
    for name in path.split("."):
        value = value[name] if isinstance(value, dict) else getattr(value, name)
    return value


def test_impacts_follow_one_another(worn_leg):
    for name in worn_leg.clearance_joints:
        impacts = worn_leg.impacts[name]
        assert impacts
        ends = [impact.end_s for impact in impacts[:-1]]
        assert all(0.0 < impact.speed_mps < 10.0 for impact in impacts)
        assert all(impact.begin_s < impact.end_s for impact in impacts[:-1])
        assert all(end <= after.begin_s for end, after in zip(ends, impacts[1:], strict=True))
        assert worn_leg.joints[name].max_force_n >= max(impact.peak_n for impact in impacts) > 0.0


def test_wear_is_archards_and_opens_the_clearance(leg, worn_leg):
    for name in worn_leg.clearance_joints:
        figures, settings = worn_leg.joints[name], leg.clearances[name]
        area = TURN * settings.bushing_radius * settings.width
        for side, k in zip(("bushing", "journal"), settings.wear_coefficient, strict=True):
            mean = getattr(figures.wear_depth_m_per_cycle, f"{side}_mean")
            assert mean * area == pytest.approx(k * figures.archard_integral_j_per_cycle, rel=1.0e-9)
        opened = np.array(attrs.astuple(figures.clearance_m)) - settings.radial_clearance
        assert 0.0 < opened[0] < opened[1] < 1.0e-9


def test_statistics_hang_together(worn_leg):
    for figures in worn_leg.joints.values():
        mean, rms, p99, peak = (getattr(figures, f"{key}_force_n") for key in ("mean", "rms", "p99", "max"))
        assert 0.0 < mean <= rms <= peak
        assert mean < p99 <= peak * 1.01
    torque = worn_leg.drive_torque_nm
    assert torque.min < torque.mean < torque.p99 <= torque.max * 1.01


def test_an_impact_of_the_first_cycle_can_be_counted():
    """With a duration nothing is skipped: the slider-crank's first impact is there."""
    result = simulate(load_mechanism("slider_crank"), duration_s=3.0e-4, **FULL)
    assert len(result.impacts["B"]) == 1
    assert result.impacts["B"][0].begin_s == pytest.approx(2.2729e-4, abs=1.0e-8)


def test_the_joint_on_the_crank_bears_the_largest_drive_torque(leg):
    """About a hinge without clearance, the torque of every instant is that of the coupler and the weight."""
    result, crank = simulate(leg, clearances=("G", "I", "J"), cycles=2), leg.bodies["crank"]
    needed = result.drive_torque_nm.max_abs - 9.81 * crank.mass * math.hypot(*crank.com)
    arm = math.dist(crank.points["A"], crank.points["C"])
    assert result.joints["C"].max_force_n * arm > 0.97 * needed


def test_a_part_of_an_ideal_cycle_is_counted_as_such(leg):
    """Backwards as well, after a part that is skipped; and beside whole cycles."""
    whole = simulate(leg, clearances=(), cycles=1, skip_cycles=0, speed_rpm=-60.0, trace=1440)
    every = whole.trace.drive_torque_nm
    torque = every[180 : 180 + 360]
    part = {"clearances": (), "skip_cycles": 0.125, "speed_rpm": -60.0}
    result = simulate(leg, cycles=0.25, trace=8, **part)
    assert result.drive_torque_nm.mean == pytest.approx(torque.mean(), abs=1.0e-9)
    assert result.drive_torque_nm.max == pytest.approx(torque.max(), abs=1.0e-9)
    assert result.trace.crank_angle_rad == pytest.approx(TURN * np.array([7, 6]) / 8)
    more = simulate(leg, cycles=2.25, **part).drive_torque_nm.mean
    assert more == pytest.approx((8.0 * every.mean() + torque.mean()) / 9.0, abs=1.0e-9)
    whole = simulate(leg, cycles=1, **part)
    assert whole.drive_torque_nm.mean == pytest.approx(every.mean(), abs=1.0e-9)


def test_an_energy_that_does_not_close_is_reported(leg):
    """With clearances of a third of the radius; not with one cycle, which has no standard error."""
    with pytest.warns(UserWarning, match=r"the energy balance does not close: .*--model full"):
        simulate(leg, clearance_m=3.0e-3, cycles=6)
    simulate(leg, clearance_m=3.0e-3, cycles=1)


def test_an_energy_with_hardly_any_losses_closes(leg):
    """At 0.6 rpm, sliding is too slow for friction, and a residual of no weight is beyond the losses."""
    energy = simulate(leg, speed_rpm=0.6, cycles=2).energy_j
    assert abs(energy.residual) > 0.02 * (energy.friction_loss + energy.contact_loss)


def by_torque(leg, torque_nm, **changes):
    """The leg with a constant torque at its crank, from rest."""
    return attrs.evolve(
        leg, drive=attrs.evolve(load_mechanism("andrews").drive, body="crank", torque=torque_nm), **changes
    )


def test_a_torque_turns_the_crank_its_own_way(leg):
    speeds = [simulate(by_torque(leg, torque), duration_s=0.1).speed_rpm for torque in (-30.0, 30.0)]
    assert speeds[0] < -10.0
    assert speeds[1] > 10.0


def test_a_crank_that_swings_has_no_gait_cycle(leg):
    with pytest.warns(UserWarning, match=r"the crank swings back and forth"):
        simulate(by_torque(leg, 0.0), duration_s=2.0)


def test_a_torque_drive_has_no_cycles():
    with pytest.raises(ConfigError, match=r"andrews.yaml: drive\.torque: .*Expected --duration"):
        simulate(load_mechanism("andrews"), cycles=1)


@pytest.mark.parametrize("points", [7, 64])
def test_a_trace_does_not_change_the_motion(leg, points):
    span = {"clearances": ("A", "G"), "cycles": 0.5, "skip_cycles": 0.1, "wear": True}
    plain, traced = (simulate(leg, **span, trace=n) for n in (0, points))
    with_trace = traced.to_dict()
    trace = with_trace.pop("trace")
    assert with_trace == plain.to_dict()
    np.testing.assert_array_equal(traced.surfaces.depth, plain.surfaces.depth)
    wanted = TURN * (0.1 + np.arange(math.ceil(points / 2)) / points)
    np.testing.assert_allclose(trace["crank_angle_rad"], wanted, atol=TURN / 2048.0)


def test_a_trace_lies_on_the_motion(leg):
    """Samples of two traces at the same instants agree."""
    span = {"clearances": ("G",), "cycles": 0.25, "skip_cycles": 0.0}
    few, many = (simulate(leg, **span, trace=n).trace for n in (24, 72))
    for name in ("toe_x_m", "toe_y_m", "drive_torque_nm"):
        np.testing.assert_allclose(getattr(few, name), getattr(many, name)[::3], rtol=1e-6, atol=1e-9)


def test_the_largest_magnitude_of_the_torque_stands_beside_its_signed_percentile(leg):
    for clearances in ((), ("G",)):
        torque = simulate(leg, clearances=clearances, cycles=0.5, skip_cycles=0.0).drive_torque_nm
        assert torque.max_abs == max(-torque.min, torque.max) > 0.0
        assert torque.p99 <= torque.max


def test_a_mechanism_can_be_given_by_name_and_by_path(leg, tmp_path):
    (tmp_path / "my leg.yaml").write_text(
        (lw.share_directory() / "config/mechanisms/bionic_leg.yaml").read_text()
    )
    wanted = simulate(leg, clearances=(), cycles=1).to_dict()
    for given in ("bionic_leg", tmp_path / "my leg.yaml"):
        assert simulate(given, clearances=(), cycles=1).to_dict() == wanted


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"mechanism": "bionik_leg"}, "did you mean bionic_leg?"),
        ({"mechanism": 7}, "mechanism: 7 is not a Mechanism, a name or a file"),
        ({"model": "guess"}, "'guess' is not one of"),
        ({"model": ["full"]}, "is not one of clearance, full"),
        ({"cycles": 0.0}, "cycles: 0 is not"),
        ({"cycles": "5"}, "cycles: '5' is not a number"),
        ({"cycles": True}, "cycles: True is not a number"),
        ({"duration_s": float("nan")}, "duration: nan s is not"),
        ({"duration_s": "1"}, "duration: '1' is not a number"),
        ({"skip_cycles": -1.0}, "skip-cycles: -1"),
        ({"skip_cycles": "1"}, "skip-cycles: '1' is not a number"),
        ({"speed_rpm": 0.0}, "does not turn the crank"),
        ({"speed_rpm": "60"}, "speed-rpm: '60' is not a number"),
        ({"clearances": "AB"}, "clearances: 'AB' is a text. Expected a list of names"),
        ({"clearances": 5}, "clearances: 5 is not a list of names"),
        ({"clearances": [1]}, "clearances: 1 is not the name of a joint"),
        ({"clearances": ("A", "A")}, "names a joint twice"),
        ({"clearances": ["g"]}, "did you mean G?"),
        ({"clearance_m": -1.0}, "is not above 0 m"),
        ({"clearance_m": 0.02}, "bushing"),
        ({"clearance_m": "3e-4"}, "clearance-m: '3e-4' is not a number"),
        ({"normal_law": "soft"}, "'soft' is not one of"),
        ({"normal_law": 3}, "is not one of hertz"),
        ({"trace": -1}, "trace: -1"),
        ({"trace": 1.5}, "trace: 1.5 is not a whole number"),
        ({"intervals": 100}, "intervals: 100 is out of bounds. Expected 1024 to 65536"),
        ({"intervals": 4096, "model": "full"}, "intervals: 4096 is for model clearance"),
        ({"wear": "off"}, "wear: 'off' is not true or false"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(given, said):
    with pytest.raises(ConfigError) as error:
        simulate(**{"mechanism": "bionic_leg", **given})
    assert said in str(error.value)
    assert "\n" not in str(error.value)
