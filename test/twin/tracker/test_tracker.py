"""The crank tracker: whatever comes in, smooth motion comes out, and it is where the crank was."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from leg_wear_monitor.gait.config import GaitConfig, LoadConfig
from leg_wear_monitor.gait.leg import POINTS, Ground
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin import CRANK, LOAD, TORQUE
from leg_wear_monitor.twin.crank_motion import (
    EVALUATE,
    LEAVE,
    LOST_BY_OUTLIERS,
    LOST_IN_GAP,
    MOVE,
    MOVING,
    PUSH,
    REPORT,
    REST,
    REVERSED,
    START,
    STEP,
    STOPPED,
    Steps,
)
from leg_wear_monitor.twin.sample import REORDER_WINDOW_S, Samples, TrackerSettings, gait_samples
from leg_wear_monitor.twin.tracker import CrankTracker

START_NS = 1_700_000_000_123_456_789
S = 1_000_000_000


class Reported(NamedTuple):
    """All steps of a tracker, (m,) records of `STEP`."""

    steps: Steps

    def of(self, code: int) -> Steps:
        return self.steps[self.steps["code"] == code]

    def motion_at(self, moments: int = 5) -> np.ndarray:
        """Time since START_NS [s], angle, speed, acceleration (4, n) at some moments of every piece."""
        rows = []
        for step in self.of(MOVE):
            piece = Polynomial(step["motion"])
            for tau in np.linspace(0.0, 1.0e-9 * (step["end_ns"] - step["begin_ns"]), moments):
                since = 1.0e-9 * (step["begin_ns"] - START_NS) + tau
                angle = TURN * step["turns"] + piece(tau)
                rows.append((since, angle, piece.deriv()(tau), piece.deriv(2)(tau)))
        return np.array(rows).T


def track(blocks: Iterable[Samples], tracker: CrankTracker | None = None) -> Reported:
    tracker = tracker or CrankTracker(TrackerSettings())
    found = [np.zeros(0, STEP)]
    for block in blocks:
        for steps, n in tracker.update(block):
            found.append(steps[:n].copy())
    return Reported(np.concatenate(found))


def assert_same(one: Reported, other: Reported) -> None:
    """Bit for bit."""
    for name in STEP.names or ():
        np.testing.assert_array_equal(one.steps[name], other.steps[name], err_msg=name)


def cut(samples: Samples, at: Iterable[int]) -> list[Samples]:
    return [block for block in np.split(samples, sorted(at)) if len(block)]


def with_torque(samples: Samples, every: int = 1) -> Samples:
    """Torque samples between those of the crank."""
    torque = gait_samples(samples["stamp_ns"][::every] + 1_234_567, TORQUE, torque_nm=3.0)
    both = np.concatenate([samples, torque])
    return both[np.argsort(both["stamp_ns"], kind="stable")]


def start_stop_reverse(t: np.ndarray) -> np.ndarray:
    """Angle [rad] of a crank that runs for 3 s, rests, runs backwards from 5 s to 8 s, and rests."""
    speed = np.interp(
        t, [0.0, 0.2, 2.8, 3.0, 5.0, 5.2, 7.8, 8.0], TURN * np.array([0, 1, 1, 0, 0, -1, -1, 0])
    )
    return np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))])


def assert_all_but_the_first_are_used(
    steps: Reported, tracker: CrankTracker, whole: Reported, late_s: float
) -> None:
    """The motion is the same as far as it goes; torques are late until it is known that they come late."""
    late = tracker.state.counts.late
    assert late <= 200.0 * late_s + 1
    moves = steps.of(MOVE)
    np.testing.assert_array_equal(moves, whole.of(MOVE)[: len(moves)])
    looked = len(steps.of(EVALUATE)) + late
    assert looked >= len(whole.of(EVALUATE)) - 2 * 200.0 * late_s - 2


@pytest.mark.parametrize("late_s", [0.05, 0.3])
def test_a_topic_that_comes_later_is_waited_for(gait, late_s):
    samples = with_torque(gait(3.0))
    arrival = samples["stamp_ns"] + np.where(samples["kind"] == TORQUE, round(late_s * S), 0)
    tracker, whole = CrankTracker(TrackerSettings()), track([samples])
    delayed = track([samples[np.argsort(arrival, kind="stable")]], tracker)
    assert_all_but_the_first_are_used(delayed, tracker, whole, late_s)


@settings(max_examples=10)
@given(
    seed=st.integers(0, 100),
    rate_hz=st.sampled_from([50.0, 200.0, 1000.0]),
    dropped=st.floats(0.0, 0.3),
    noise_rad=st.floats(0.0, 2.0e-3),
)
def test_the_motion_is_smooth_and_true(gait, seed, rate_hz, dropped, noise_rad):
    """Angle, speed and acceleration are continuous, through starts, rests and reversals, and true."""
    samples = gait(8.0, rate_hz, start_stop_reverse, noise_rad, seed)
    kept = samples[np.random.default_rng(seed).random(len(samples)) >= dropped]
    steps = track([kept])
    time, angle, speed, acceleration = steps.motion_at()
    joins = np.flatnonzero(np.diff(time) < 1.0e-9)
    assert len(joins) > 100
    for values, small in ((angle, 1.0e-9), (speed, 1.0e-8), (acceleration, 1.0e-6)):
        assert np.abs(np.diff(values)[joins]).max() < small
    fine = np.arange(0.0, 8.0, 1.0e-3)
    truth = np.interp(time, fine, start_stop_reverse(fine))
    scatter = noise_rad * np.sqrt(200.0 / rate_hz / (1.0 - dropped))
    assert (
        np.abs(angle - truth - np.round((angle - truth) / TURN).mean() * TURN).max() < 0.012 + 4.0 * scatter
    )


@pytest.mark.parametrize("rate_hz, bound", [(50.0, 1.2), (200.0, 0.5), (1000.0, 0.25)])
def test_encoder_noise_makes_little_acceleration(gait, rate_hz, bound):
    """A thousandth of a radian, differentiated twice at 200 Hz, would be 100 rad/s^2."""
    time, _, speed, acceleration = track([gait(20.0, rate_hz)]).motion_at(9)
    steady = time > 1.0
    assert acceleration[steady].std() < bound
    assert speed[steady].std() < 0.02
    assert speed[steady].mean() == pytest.approx(TURN, rel=1.0e-4)


@pytest.mark.parametrize("lag_s, knot_interval_s", [(0.1, 0.025), (0.1, 0.005), (0.04, 0.025), (0.003, 0.01)])
def test_a_sample_waits_for_lag_window_and_the_next_node_at_most(gait, lag_s, knot_interval_s):
    """At 1 kHz, sample by sample; a node and the newest sample may each come a period late."""
    settings = TrackerSettings(lag_s=lag_s, knot_interval_s=knot_interval_s)
    tracker, period_ns, waited = CrankTracker(settings), S // 1000, []
    for sample in cut(gait(3.0, 1000.0), range(3000)):
        stamp = int(sample["stamp_ns"][0]) if len(sample) else 0
        for steps, n in tracker.update(sample):
            done = steps[:n][steps["code"][:n] == EVALUATE]["end_ns"]
            waited.extend((stamp - done).tolist() if stamp > START_NS + S else [])
    shortest = round(1.0e9 * (lag_s + REORDER_WINDOW_S))
    longest = shortest + round(1.0e9 * knot_interval_s)
    assert len(waited) > 1500
    assert shortest <= min(waited) + period_ns
    assert longest - 2 * period_ns <= max(waited) <= longest + 2 * period_ns


@pytest.mark.parametrize("rate_hz", [100.0, 1000.0])
def test_no_node_comes_before_its_due_stamp_and_each_at_it_or_a_period_later(gait, rate_hz):
    tracker, period_ns, nodes = CrankTracker(TrackerSettings()), round(S / rate_hz), 0
    for sample in cut(with_torque(gait(3.0, rate_hz)), range(int(6 * rate_hz))):
        due_ns = tracker.due_stamp_ns
        reached = sum(int((steps["code"][:n] == MOVE).sum()) for steps, n in tracker.update(sample))
        if due_ns and len(sample):
            late_ns = int(sample["stamp_ns"][0]) - due_ns
            assert not reached or 0 <= late_ns <= 2 * period_ns
            nodes += reached
    assert nodes >= 60


@pytest.mark.parametrize("times", [1, 2])
def test_speed_ripple_is_followed(gait, times):
    """Three percent, once or twice a turn, to a twentieth of it."""
    ripple = 0.03 * TURN
    w = times * TURN
    steps = track([gait(10.0, angle=lambda t: TURN * t + ripple / w * np.sin(w * t), noise_rad=0.0)])
    time, _, speed, acceleration = steps.motion_at(9)
    steady = time > 1.0
    off = speed - TURN - ripple * np.cos(w * time)
    assert np.abs(off[steady]).max() < 0.05 * ripple
    off = acceleration + ripple * w * np.sin(w * time)
    assert np.abs(off[steady]).std() < 0.1 * ripple * w


def test_a_crank_at_rest_stays_put(gait):
    """It rests from its stop to its next start, and no noise moves it meanwhile."""
    tracker = CrankTracker(TrackerSettings())
    steps = track([gait(10.0, angle=start_stop_reverse)], tracker)
    happened = [(row["detail"], round(1.0e-9 * (row["begin_ns"] - START_NS), 1)) for row in steps.of(REPORT)]
    assert [what for what, _ in happened] == [STOPPED, MOVING, REVERSED, STOPPED]
    assert happened[0][1] == pytest.approx(3.3, abs=0.15)
    assert happened[1][1] == pytest.approx(5.0, abs=0.15)
    rested = (steps.of(REST)["end_ns"] - steps.of(REST)["begin_ns"]).sum()
    assert rested == tracker.state.counts.standing_ns
    assert 3.0 * S < rested < 3.5 * S
    moves = steps.of(MOVE)
    resting = (moves["begin_ns"] > START_NS + 3.6 * S) & (moves["end_ns"] < START_NS + 4.8 * S)
    assert not resting.any()


@pytest.mark.parametrize("gap_s", [0.06, 0.3, 0.45])
def test_gaps_are_bridged_and_marked(gait, gap_s):
    samples = gait(4.0)
    since = 1.0e-9 * (samples["stamp_ns"] - START_NS)
    tracker = CrankTracker(TrackerSettings())
    steps = track([samples[(since < 2.0) | (since >= 2.0 + gap_s)]], tracker)
    time, angle, _, _ = steps.motion_at()
    np.testing.assert_allclose(angle, TURN * time + 0.5, atol=0.02 + 0.3 * gap_s**3)
    assert tracker.state.counts.gaps_bridged == 1
    assert tracker.state.counts.bridged_ns == pytest.approx(S * gap_s, abs=0.011 * S)
    assert not len(steps.of(LEAVE))


@pytest.mark.parametrize("rate_hz", [10.0, 20.0])
def test_slow_samples_are_no_gaps(gait, rate_hz):
    tracker = CrankTracker(TrackerSettings())
    time, angle, _, _ = track([gait(10.0, rate_hz)], tracker).motion_at()
    np.testing.assert_allclose(angle, TURN * time + 0.5, atol=0.01)
    assert tracker.state.counts.gaps_bridged == 0


def test_a_gap_of_the_crank_alone_is_one_too(gait):
    """Torque samples go on meanwhile: they are looked at without a leg."""
    samples = with_torque(gait(6.0))
    since = 1.0e-9 * (samples["stamp_ns"] - START_NS)
    steps = track([samples[(samples["kind"] == TORQUE) | (since < 2.0) | (since >= 4.0)]])
    assert len(steps.of(START)) == 2
    assert list(steps.of(LEAVE)["detail"]) == [LOST_IN_GAP]
    looked = steps.of(EVALUATE)
    assert (np.diff(looked["begin_ns"]) >= 0).all()
    assert ((looked["begin_ns"] > START_NS + 2.6 * S) & (looked["begin_ns"] < START_NS + 3.9 * S)).sum() > 200


@settings(max_examples=30)
@given(
    where=st.lists(st.integers(1, 599), min_size=1, max_size=5, unique=True),
    stamp=st.sampled_from([1, 5 * S, START_NS - 3600 * S, START_NS + 3600 * S, 2**63 - 1]),
)
def test_single_stray_stamps_change_nothing(gait, where, stamp):
    samples = gait(3.0)
    stray = np.insert(samples, where, gait_samples([stamp], crank_angle_rad=1.0)[0])
    tracker = CrankTracker(TrackerSettings())
    assert_same(track([stray], tracker), track([samples]))
    assert tracker.state.counts.stray_stamps + tracker.state.counts.duplicates == len(where)


def test_outliers_change_little_and_a_crank_that_is_elsewhere_is_found_again(gait):
    samples = gait(6.0)
    jumped = samples.copy()
    jumped["crank_angle_rad"][100::50] += 1.5
    tracker = CrankTracker(TrackerSettings())
    time, angle, _, _ = track([jumped], tracker).motion_at()
    np.testing.assert_allclose(angle, TURN * time + 0.5, atol=2.0e-3)
    assert tracker.state.counts.outliers == len(samples[100::50])
    jumped = samples.copy()
    jumped["crank_angle_rad"][600:] += 1.5
    steps = track([jumped])
    assert list(steps.of(LEAVE)["detail"]) == [LOST_BY_OUTLIERS]
    assert len(steps.of(START)) == 2


def with_ground_reaction(crank: Samples, rate_hz: float, transient: float = 0.0, spikes: int = 0) -> Samples:
    """The crank and a foot load: steps of 300 N that differ, 5 % of noise; every so many samples a spike."""
    config = GaitConfig(load=LoadConfig(ground_n=300.0, heel_strike_transient=transient))
    ground, random = Ground(load_mechanism("bionic_leg"), config), np.random.default_rng(1)
    t = 1.0e-9 * (crank["stamp_ns"][-1] - START_NS) * np.arange(0.01, 0.99, 0.05 / rate_hz)
    turned = t + 0.5 / TURN
    which = np.floor(turned - ground.swing).astype(int) + 1
    steps = np.array([ground.step(TURN) for _ in range(which.max() + 1)])
    force = steps[which, (turned % 1.0 * POINTS).astype(int)] + 15.0 * random.standard_normal((len(t), 2))
    if spikes:
        angle = TURN * random.random(len(force[spikes::spikes]))
        force[spikes::spikes] = 3000.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    load = gait_samples(START_NS + np.round(1.0e9 * t).astype(np.int64), LOAD, foot_force_n=force)
    both = np.concatenate([crank, load])
    return both[np.argsort(both["stamp_ns"], kind="stable")]


@pytest.mark.parametrize("rate_hz", [50.0, 100.0, 200.0, 1000.0])
@pytest.mark.parametrize("transient", [0.0, 0.5, 1.5])
def test_no_heel_strike_is_an_outlier(gait, rate_hz, transient):
    """At 100 Hz the transient of 20 ms may be one sample."""
    tracker, samples = CrankTracker(TrackerSettings()), with_ground_reaction(gait(20.0), rate_hz, transient)
    track([samples], tracker)
    assert tracker.state.counts.load_outliers == 0
    assert tracker.state.counts.used[LOAD] > 19.5 * rate_hz


@pytest.mark.parametrize("rate_hz", [25.0, 100.0, 1000.0])
def test_a_spike_of_the_foot_load_is_counted_and_does_not_push(gait, rate_hz):
    """Blocks change nothing."""
    samples, spikes = with_ground_reaction(gait(20.0), rate_hz, spikes=37), 37
    tracker, one = CrankTracker(TrackerSettings()), CrankTracker(TrackerSettings())
    found, counts = track([samples], tracker), tracker.state.counts
    number = np.count_nonzero(samples["stamp_ns"][samples["kind"] == LOAD] <= tracker.state.clock.released_ns)
    assert counts.load_outliers == len(range(spikes, number, spikes))
    assert counts.used[LOAD] == number - counts.load_outliers
    assert np.abs(found.of(PUSH)["motion"]).max() < 600.0
    parts = []
    for block in cut(samples, range(0, len(samples), 501)):
        parts.append(track([block], one).steps)
    assert_same(Reported(np.concatenate(parts)), found)


def test_a_force_of_two_samples_is_a_force(gait):
    samples = with_ground_reaction(gait(5.0), 100.0)
    struck = np.flatnonzero(samples["kind"] == LOAD)[200:202]
    samples["foot_force_n"][struck] = 0.0, 3000.0
    tracker = CrankTracker(TrackerSettings())
    assert track([samples], tracker).of(PUSH)["motion"].max() == 3000.0
    assert tracker.state.counts.load_outliers == 0


def test_velocity_helps_where_it_is_right_and_is_dropped_where_it_is_not(gait):
    samples = gait(20.0, rate_hz=50.0)
    with_velocity, wrong = samples.copy(), samples.copy()
    noise = 0.02 * np.random.default_rng(7).standard_normal(len(samples))
    with_velocity["crank_velocity_radps"] = TURN + noise
    wrong["crank_velocity_radps"] = 0.0  # as drivers do that know none
    tracker = CrankTracker(TrackerSettings())
    scatter = [
        track([block], one).motion_at()[3][100:].std()
        for block, one in ((samples, None), (with_velocity, None), (wrong, tracker))
    ]
    assert scatter[1] < 0.8 * scatter[0]
    assert scatter[2] == pytest.approx(scatter[0], rel=1.0e-9)
    assert tracker.state.counts.velocity_outliers > 990


@pytest.mark.parametrize("what", ["random", "coarse noise", "ten times too fast", "steps"])
def test_what_is_no_gait_moves_no_leg(gait, what):
    """Rather lost than made up."""
    samples, chance = gait(5.0), np.random.default_rng(0)
    t = 1.0e-9 * (samples["stamp_ns"] - START_NS)
    samples["crank_angle_rad"] = {
        "random": TURN * chance.random(len(t)),
        "coarse noise": TURN * t + 0.1 * chance.standard_normal(len(t)),
        "ten times too fast": 10.0 * TURN * t,
        "steps": TURN * np.floor(10.0 * t) / 10.0,
    }[what]
    steps = track([samples])
    moves = steps.of(MOVE)
    assert (moves["end_ns"] - moves["begin_ns"]).sum() < 0.1 * S


def test_a_fifth_of_the_samples_may_be_nonsense(gait):
    """What passes the gate by chance bends the motion a little."""
    samples, chance = gait(20.0), np.random.default_rng(0)
    glitch = chance.random(len(samples)) < 0.2
    samples["crank_angle_rad"][glitch] = TURN * chance.random(glitch.sum())
    time, angle, speed, _ = track([samples]).motion_at()
    assert np.ptp(time) > 19.0
    off = angle - TURN * time - 0.5
    assert np.abs(off - TURN * np.round(off / TURN)).max() < 0.15
    assert np.abs(speed / TURN - 1.0).max() < 0.5


_WEIRD = st.sampled_from([0.0, 1.0, -7.0, np.nan, np.inf, -np.inf, 1.0e300, -1.0e300, 1.0e6, 5.0e-324])


@settings(max_examples=200)
@given(
    rows=st.lists(
        st.tuples(
            st.integers(-5, 400) | st.sampled_from([-(2**62), 2**62]),
            st.integers(0, 3),
            st.sampled_from([0, 0, 0, 1, 8, 255]),
            _WEIRD | st.floats(0.0, TURN),
            _WEIRD,
            _WEIRD,
        ),
        max_size=60,
    )
)
def test_no_sequence_of_samples_breaks_it(rows):
    """Every sample is counted once; what comes out is finite, in order, and joins up."""
    samples = gait_samples(np.zeros(len(rows), dtype=np.int64))
    for sample, (stamp, kind, fault, *values) in zip(samples, rows, strict=True):
        sample["stamp_ns"] = START_NS + 10_000_000 * stamp if abs(stamp) < 1000 else max(stamp, -1)
        sample["kind"], sample["fault"] = kind, fault
        sample["crank_angle_rad"], sample["crank_velocity_radps"], sample["torque_nm"] = values
    tracker = CrankTracker(TrackerSettings())
    steps = track([samples], tracker)
    assert np.isfinite(steps.steps["motion"]).all()
    moves = steps.of(MOVE)
    assert (moves["begin_ns"] < moves["end_ns"]).all()
    counts, clock = tracker.state.counts, tracker.state.clock
    dropped = counts.duplicates + counts.late + counts.stray_stamps + counts.outliers
    settled = counts.used[CRANK] + dropped + counts.faults.sum()
    assert counts.received == len(rows)
    waiting = clock.waiting + (tracker.state.candidate.stamp_ns != 0)
    torques = len(rows) - (settled + waiting)
    # a crank sample may bring a torque, which counts as one, too
    brought = np.isfinite(samples["torque_nm"]) & (samples["kind"] == CRANK)
    assert 0 <= torques <= counts.used[TORQUE] <= torques + min(counts.used[CRANK], brought.sum())
