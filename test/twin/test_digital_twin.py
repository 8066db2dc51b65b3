"""The twin: in step with a gait it wears as the simulation does, however the samples come in."""

import math

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import leg_wear_monitor as lw
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin import TORQUE
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.sample import Samples, TrackerSettings, TwinSettings, gait_samples
from leg_wear_monitor.twin.statistics import (
    CycleStatistics,
    SampleStatistics,
    Tracking,
    TwinEventKind,
    TwinUpdate,
)

S = 1_000_000_000


def start_stop_reverse(t: np.ndarray) -> np.ndarray:
    """Angle [rad] of a crank that runs for 2 s, rests, runs backwards from 3 s to 5.5 s, and rests."""
    speed = np.interp(
        t, [0.0, 0.2, 1.8, 2.0, 3.0, 3.2, 5.3, 5.5], TURN * np.array([0, 1, 1, 0, 0, -1, -1, 0])
    )
    return np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))])


@pytest.fixture(scope="module")
def eventful(gait) -> Samples:
    """A gait with stop, reversal, torque, a gap, an outlier and a backward jump."""
    one, two = gait(6.0, angle=start_stop_reverse), gait(3.0, seed=1, start_ns=1_600_000_000 * S)
    one["torque_nm"] = 2.0 * np.sin(np.arange(len(one)))  # brought along by the crank's samples
    one["crank_angle_rad"][700] += 2.0
    torque = gait_samples(two["stamp_ns"] + 777, TORQUE, torque_nm=5.0)
    rest = np.concatenate([two, torque])
    rest = rest[np.argsort(rest["stamp_ns"], kind="stable")]
    return np.concatenate([one[:800], one[850:], rest[:400], rest[700:]])


def run(twin: DigitalTwin, blocks: list[Samples]) -> TwinUpdate:
    """All that the blocks brought."""
    updates = [twin.update(block) for block in blocks]
    names = [field.name for field in attrs.fields(SampleStatistics)]
    samples = [np.concatenate([getattr(update.samples, name) for update in updates]) for name in names]
    cycles = [cycle for update in updates for cycle in update.cycles]
    return TwinUpdate(
        SampleStatistics(*samples), tuple(cycles), tuple(e for update in updates for e in update.events)
    )


def assert_same(one: TwinUpdate, other: TwinUpdate) -> None:
    """Bit for bit."""
    for field in attrs.fields(SampleStatistics):
        np.testing.assert_array_equal(getattr(one.samples, field.name), getattr(other.samples, field.name))
    assert len(one.cycles) == len(other.cycles)
    for cycle, expected in zip(one.cycles, other.cycles, strict=True):
        for field in attrs.fields(CycleStatistics):
            mine, wanted = getattr(cycle, field.name), getattr(expected, field.name)
            if field.name in ("torque", "torque_profile", "load") and mine is not None:
                mine, wanted = np.hstack(attrs.astuple(mine)), np.hstack(attrs.astuple(wanted))
            np.testing.assert_array_equal(mine, wanted, err_msg=field.name)
    assert one.events == other.events


@pytest.fixture(scope="module")
def in_one_go(_made, eventful) -> tuple[TwinUpdate, np.ndarray]:
    twin, new = _made
    twin.restore(new)
    update = run(twin, [eventful])
    return update, twin.depth


@settings(max_examples=3)
@given(cuts=st.lists(st.integers(0, 2000), max_size=100))
def test_any_split_into_blocks_gives_the_same(_made, eventful, in_one_go, cuts):
    twin, new = _made
    twin.restore(new)
    blocks = [block for block in np.split(eventful, sorted(cuts)) if len(block)]
    assert_same(run(twin, blocks), in_one_go[0])
    np.testing.assert_array_equal(twin.depth, in_one_go[1])


@settings(max_examples=4)
@given(where=st.integers(1, 1990))
def test_restored_it_goes_on_bit_for_bit(_made, gait, eventful, in_one_go, where):
    twin, new = _made
    twin.restore(new)
    before = run(twin, [eventful[:where]])
    snapshot = twin.snapshot()
    run(twin, [gait(0.5, seed=3)])  # astray
    twin.set_depth(twin.depth + 1.0e-6)
    twin.restore(snapshot)
    after = run(twin, [eventful[where:]])
    parts = [
        np.concatenate([getattr(before.samples, field.name), getattr(after.samples, field.name)])
        for field in attrs.fields(SampleStatistics)
    ]
    whole = TwinUpdate(SampleStatistics(*parts), before.cycles + after.cycles, before.events + after.events)
    assert_same(whole, in_one_go[0])
    np.testing.assert_array_equal(twin.depth, in_one_go[1])


@pytest.fixture(scope="module")
def heavier(leg) -> LegParameters:
    factors = np.random.default_rng(1).uniform(0.95, 1.05, (2, len(leg.bodies)))
    return LegParameters(factors[0], 1.0 + 0.1 * (factors[1] - 1.0), 1.5)


def test_with_other_parameters_it_is_the_twin_of_a_leg_that_has_them(twin, leg, gait, heavier):
    loaded = gait(2.5)
    loaded["torque_nm"] = 3.0
    twin.set_parameters(heavier)
    assert twin.parameters == heavier
    assert_same(run(twin, [loaded]), run(DigitalTwin(heavier.applied(leg)), [loaded]))


def test_parameters_that_change_underway_belong_to_a_snapshot(twin, gait, heavier):
    walk = gait(3.0)
    run(twin, [walk[:300]])
    before = twin.snapshot()
    twin.set_parameters(heavier)
    with_them = twin.snapshot()
    after = run(twin, [walk[300:]])
    twin.restore(before)
    as_of_file = run(twin, [walk[300:]])
    assert (after.cycles[-1].mean_force_n != as_of_file.cycles[-1].mean_force_n).all()
    twin.restore(with_them)
    assert_same(run(twin, [walk[300:]]), after)


def test_what_happens_is_reported(in_one_go):
    what = TwinEventKind
    assert [event.what for event in in_one_go[0].events] == [
        what.ACQUIRED, what.STOPPED, what.MOVING, what.REVERSED, what.STOPPED,
        what.BACKWARD_JUMP, what.ACQUIRED, what.LOST_IN_GAP, what.ACQUIRED,
    ]  # fmt: skip
    # forward it does not come from one 0 to the next, and a way there and back is no cycle
    assert [cycle.direction for cycle in in_one_go[0].cycles] == [-1]
    assert in_one_go[0].cycles[0].duration_s == pytest.approx(1.0, abs=1.0e-3)


def test_every_sample_used_is_looked_at_once_and_in_order(in_one_go):
    samples = in_one_go[0].samples
    jump = np.flatnonzero(np.diff(samples.stamp_ns) < 0)
    assert len(jump) == 1
    for part in np.split(np.arange(len(samples)), jump + 1):
        pairs = list(zip(samples.stamp_ns[part], samples.kind[part], strict=True))
        assert pairs == sorted(set(pairs))
    followed = ~np.isnan(samples.crank_angle_rad)
    assert np.isfinite(samples.predicted_torque_nm[followed]).all()
    assert np.isfinite(samples.contact_force_n[followed]).all()
    assert np.isnan(samples.contact_force_n[~followed]).all()
    assert np.isnan(samples.eccentricity_m[~followed]).all()
    assert followed.mean() > 0.7


def test_a_measured_torque_is_reported_with_its_sample_whether_the_leg_is_followed_or_not(
    in_one_go, eventful
):
    samples = in_one_go[0].samples
    given = {(one["stamp_ns"], one["kind"]): one["torque_nm"] for one in eventful}
    wanted = [given[key] for key in zip(samples.stamp_ns, samples.kind, strict=True)]
    np.testing.assert_array_equal(samples.measured_torque_nm, wanted)
    unfollowed = np.isnan(samples.crank_angle_rad)
    assert np.isfinite(samples.measured_torque_nm[unfollowed]).any()


def test_a_loaded_journal_is_pressed_into_its_bushing(in_one_go, leg):
    """Its eccentricity is the clearance and the penetration; a free journal is within its clearance."""
    samples = in_one_go[0].samples
    clearance_m = [leg.clearances[joint].radial_clearance for joint in leg.clearance_joints]
    e, force = np.linalg.norm(samples.eccentricity_m, axis=2) / clearance_m, samples.contact_force_n
    assert (e[force > 10.0] > 0.999).all()
    assert (e[np.isfinite(force)] < 1.1).all()
    assert (e[force == 0.0] < 1.01).all()


# Relative sigma of Archard's integral over five cycles of joints A, B, G, I, J: 32 runs, 2026-11-23
# (test/dynamics/clearance/test_sets.py).
SIGMA = np.array([0.0032, 0.0244, 0.0224, 0.0483, 0.0907])


@pytest.mark.chaotic
def test_a_steady_gait_wears_as_a_steady_simulation(leg, twin, gait):
    """Encoder noise and all, within 2 % and 5.3 sigma of the two means, which chaos scatters."""
    update = twin.update(gait(12.0))
    archard = np.array([cycle.archard_j for cycle in update.cycles])
    result = lw.simulate(leg, cycles=12, wear=True)
    wanted = [result.joints[name].archard_integral_j_per_cycle for name in twin.clearance_joints]
    sigma = SIGMA * math.sqrt(5.0 / len(archard) + 5.0 / 12.0)
    wrong = archard.mean(axis=0) / wanted - 1.0
    assert (np.abs(wrong) < 0.02 + 5.3 * sigma).all(), wrong
    assert twin.tracking is Tracking.IN_STEP
    assert twin.speed_radps == pytest.approx(TURN, rel=0.01)
    assert [event.what for event in update.events] == [TwinEventKind.ACQUIRED]
    for cycle in update.cycles:
        assert cycle.duration_s == pytest.approx(1.0, abs=1.0e-3)
        assert cycle.moving_s == pytest.approx(cycle.duration_s, abs=2.0e-4)


def test_the_leg_does_not_care_when_it_walks(twin, gait):
    """Beyond the stepper's change of its time base too, at two instants a century apart."""
    new, seen = twin.snapshot(), []
    for start_ns in (12_345, 4_900_000_000_000_000_003):
        twin.restore(new)
        seen.append((twin.update(gait(9.5, start_ns=start_ns)), twin.depth))
    for one, other in zip(seen[0][0].cycles, seen[1][0].cycles, strict=True):
        np.testing.assert_array_equal(one.archard_j, other.archard_j)
    np.testing.assert_array_equal(seen[0][1], seen[1][1])


@pytest.mark.chaotic
def test_a_start_makes_no_impacts_that_a_gait_does_not(twin, gait):
    """Wherever the crank is: the first impacts of centred journals are over, and have worn nothing.

    Largest impacts have a long tail: mostly, starts are compared by the ninth of twelve.
    """
    new, fresh, peaks = twin.snapshot(), twin.depth, []
    usual = np.max([cycle.peak_force_n for cycle in twin.update(gait(12.0)).cycles], axis=0)
    for phase in np.linspace(0.0, TURN, 12, endpoint=False):
        twin.restore(new)
        before = twin.update(gait(0.22, angle=lambda t, phase=phase: TURN * t + phase))
        np.testing.assert_array_equal(twin.depth, fresh)
        assert not before.cycles
        twin.update(gait(0.6, angle=lambda t, phase=phase: TURN * t + phase)[44:])
        peaks.append(twin.peak_force_n)
    # mean and sigma of the joint that is nearest to its bound, as a fraction of the usual
    # peak: 29 starts moved by 1e-12, 2026-11-23
    assert (np.median(peaks, axis=0) < 0.5 * usual).all()  # J: 0.14, 0.04
    assert (np.sort(peaks, axis=0)[8] < 1.3 * usual).all()  # B: 0.71, 0.08
    assert (np.max(peaks, axis=0) < 3.0 * usual).all()  # I: 1.02, 0.23; 1.6 in one of 150


def test_growth_adds_up_to_the_clearance(twin, gait):
    fresh = twin.clearance_mean_m
    update = twin.update(gait(6.0))
    assert all(cycle.growth_mean_m.min() > 0.0 for cycle in update.cycles)
    first, last = update.cycles[0], update.cycles[-1]
    grown = sum(cycle.growth_mean_m for cycle in update.cycles[1:])
    np.testing.assert_allclose(last.clearance_mean_m - first.clearance_mean_m, grown, rtol=1.0e-9)
    assert (twin.clearance_mean_m >= last.clearance_mean_m).all()
    assert (first.clearance_mean_m - first.growth_mean_m >= fresh).all()
    np.testing.assert_allclose(twin.clearance_max_m, 3.0e-4 + twin.depth.sum(axis=1).max(axis=1))


@pytest.mark.chaotic
@pytest.mark.parametrize("noise_rad, rate_hz", [(1.0e-3, 50.0), (3.0e-3, 200.0)])
def test_noise_of_the_encoder_is_no_wear(twin, gait, noise_rad, rate_hz):
    """Against the same gait without noise, by the joint that varies least and by the others together.

    By `SIGMA`, over six cycles each, the sigma of A is 0.004 and of the others 0.020; A is off by 0.005.
    """
    new, wear = twin.snapshot(), []
    for noise in (0.0, noise_rad):
        twin.restore(new)
        update = twin.update(gait(8.0, rate_hz, noise_rad=noise))
        wear.append(np.mean([cycle.archard_j for cycle in update.cycles], axis=0))
    assert wear[1][0] == pytest.approx(wear[0][0], rel=0.03)
    assert wear[1][1:].sum() == pytest.approx(wear[0][1:].sum(), rel=0.13)


def test_a_slow_gait_is_no_standstill(leg, gait):
    """At 0.6 rpm, below the speed at which a crank at 60 rpm has stopped."""
    speed = 0.01 * TURN
    tracker = TrackerSettings(commanded_speed_radps=speed)
    twin = DigitalTwin(leg, TwinSettings(tracker=tracker, clearance_joints=("A",)))
    update = twin.update(gait(20.0, rate_hz=50.0, angle=lambda t: speed * t, noise_rad=0.0))
    assert [event.what for event in update.events] == [TwinEventKind.ACQUIRED]
    assert twin.intake.standing_s == 0.0


def test_a_leg_at_rest_does_not_wear(twin, gait):
    """Nothing wears from the stop on, whatever the encoder's noise does."""
    run(twin, [gait(3.0, angle=start_stop_reverse)])
    assert twin.tracking is Tracking.STOPPED
    depth = twin.depth
    assert depth.any()
    standing = gait(
        60.0, angle=lambda t: np.full_like(t, start_stop_reverse(np.linspace(0, 3, 601))[-1]), seed=5
    )
    standing["stamp_ns"] += 3 * S
    update = run(twin, [standing])
    np.testing.assert_array_equal(twin.depth, depth)
    assert not update.cycles
    assert not update.events
    assert twin.intake.standing_s > 59.0
    assert np.isfinite(update.samples.contact_force_n).all()


def test_a_gap_costs_its_time_and_keeps_the_wear(twin, gait):
    samples = gait(6.0)
    twin.update(samples[:500])
    depth = twin.depth
    update = twin.update(samples[700:])
    assert [event.what for event in update.events] == [TwinEventKind.LOST_IN_GAP, TwinEventKind.ACQUIRED]
    assert (twin.depth >= depth).all()
    intake = twin.intake
    assert intake.lost == 1
    assert intake.unmonitored_s + intake.moving_s == pytest.approx(
        1.0e-9 * (intake.followed_stamp_ns - samples["stamp_ns"][0])
    )
    assert intake.out_s == 0.0


def test_a_leg_that_is_lost_is_told_to_be_out(twin, gait):
    samples = gait(6.0)
    samples["crank_angle_rad"][600:] = TURN * np.random.default_rng(0).random(600)
    twin.update(samples)
    assert twin.tracking is Tracking.STARTING
    assert twin.intake.out_s == pytest.approx(3.1, abs=0.2)


@pytest.mark.plain
def test_a_moment_of_a_leg_with_one_loose_joint(leg, gait):
    """From a little before crank angle 0 to a little after, with a torque that is compared."""
    twin = DigitalTwin(leg, TwinSettings(clearance_joints=("A",)))
    samples = gait(0.38, angle=lambda t: TURN * (t + 0.82), noise_rad=0.0)
    samples["torque_nm"] = 1.0
    update = twin.update(samples)
    followed = ~np.isnan(update.samples.crank_angle_rad)
    since = 1.0e-9 * (update.samples.stamp_ns[followed] - samples["stamp_ns"][0])
    off = update.samples.crank_angle_rad[followed] - TURN * (since + 0.82)
    np.testing.assert_allclose(off, TURN * np.round(off / TURN), atol=1.0e-3)
    assert since[-1] > 0.2
    assert (update.samples.contact_force_n[followed] > 50.0).any()
    assert not update.cycles


@pytest.mark.chaotic
def test_wear_goes_faster_by_its_acceleration(twin, gait):
    new, grown = twin.snapshot(), []
    for factor in (1.0, 50.0, 0.0):
        twin.restore(new)
        twin.wear_acceleration = factor
        twin.update(gait(2.5))
        grown.append(twin.clearance_mean_m - 3.0e-4)
    # 29 starts moved by 1e-12, mean and sigma, 2026-11-23
    assert grown[1][0] == pytest.approx(50.0 * grown[0][0], rel=0.03)  # -0.0003, 0.0057
    assert grown[1][1:].sum() == pytest.approx(50.0 * grown[0][1:].sum(), rel=0.2)  # 0.006, 0.036
    assert not grown[2].any()
    with pytest.raises(LegWearError, match="wear_acceleration: -1"):
        twin.wear_acceleration = -1.0


def test_a_new_part_has_fresh_surfaces(twin, gait):
    twin.update(gait(2.0))
    before = twin.depth
    twin.reset_wear("G")
    k = twin.clearance_joints.index("G")
    assert not twin.depth[k].any()
    np.testing.assert_array_equal(np.delete(twin.depth, k, axis=0), np.delete(before, k, axis=0))
    with pytest.raises(LegWearError, match="X: no clearance joint, expected one of A, B, G, I, J"):
        twin.reset_wear("X")
    with pytest.raises(LegWearError, match="depth: expected finite depths from 0 m up"):
        twin.set_depth(-before)


def test_a_leg_that_cannot_be_resolved_is_reported_and_goes_on(leg, gait):
    """Bushings like jelly: journals go through them; the wear stays, the time counts as unmonitored."""
    soft = {name: attrs.evolve(c, stiffness=10.0) for name, c in leg.clearances.items()}
    twin = DigitalTwin(attrs.evolve(leg, clearances=soft), TwinSettings(clearance_joints=("A", "G")))
    update = twin.update(gait(1.0))
    failed = [event for event in update.events if event.what is TwinEventKind.PUSHED_THROUGH]
    assert failed
    assert failed[0].joint in ("A", "G")
    intake = twin.intake
    assert intake.failures == len(failed)
    assert intake.unmonitored_s > 0.1
    assert np.isfinite(twin.depth).all()


def test_a_leg_without_loose_joints_is_refused(leg):
    with pytest.raises(ConfigError, match="no joint has clearance"):
        DigitalTwin(leg, TwinSettings(clearance_joints=()))


def test_it_can_walk_backwards_as_commanded(leg, gait):
    twin = DigitalTwin(
        leg, TwinSettings(tracker=TrackerSettings(commanded_speed_radps=-TURN), clearance_joints=("A",))
    )
    update = twin.update(gait(5.0, angle=lambda t: 1.0 - TURN * t))
    assert {cycle.direction for cycle in update.cycles} == {-1}
    assert len(update.cycles) in (3, 4)
    assert twin.tracking is Tracking.IN_STEP
    assert twin.intake.reversals == 0


def test_a_reset_of_a_wide_joint_sets_the_leg_in_motion_again(twin, gait) -> None:
    """Seen before: the journal was left 1.7 mm behind the new wall, and IMPACT_FORCE_G 108 409 N followed."""
    depth = twin.depth
    depth[twin.clearance_joints.index("G"), 0] += 1.75e-3
    twin.set_depth(depth)
    wide = twin.update(gait(3.0))
    twin.reset_wear("G")
    after = twin.update(gait(3.0 + 3.0)[600:])
    assert TwinEventKind.ACQUIRED in [event.what for event in after.events]
    # no more than the joint with its wide clearance: a new one is hit less hard
    assert np.nanmax(after.samples.contact_force_n) <= np.nanmax([c.peak_force_n for c in wide.cycles])
    assert all((cycle.peak_force_n < 1.0e4).all() for cycle in after.cycles)
