"""A stream of samples through the monitor: cuts, order, faults, gaps and the time of day change nothing."""

from collections.abc import Callable, Iterable

import attrs
import numpy as np
import pytest

import leg_wear_monitor as lw

START_NS, SECOND, RATE_HZ = 1_700_000_000_123_456_789, 10**9, 200
CRANK, TORQUE, EMPTY = 0, 1, 1

Monitor = Callable[..., lw.WearMonitor]


@pytest.fixture(scope="session")
def monitor_of(leg, parameters) -> Monitor:
    """A new monitor of the default leg; names of parameters have ``__`` for their dots."""
    return lambda **values: lw.WearMonitor(leg, lw.load_config(parameters(**values)))


def walk(seconds: float, begin_s: float = 0.0, rpm: float = 60.0, noise_rad: float = 1.0e-3) -> np.ndarray:
    """Samples of the crank in a steady gait, with noise of the encoder."""
    n = np.arange(round(begin_s * RATE_HZ), round((begin_s + seconds) * RATE_HZ))
    noise = noise_rad * np.random.default_rng(0).standard_normal(len(n))
    angle = (2.0 * np.pi * rpm / 60.0 * n / RATE_HZ + noise) % (2.0 * np.pi)
    return lw.gait_samples(START_NS + n * (SECOND // RATE_HZ), crank_angle_rad=angle)


def with_torque(crank: np.ndarray) -> np.ndarray:
    torque = lw.gait_samples(
        crank["stamp_ns"] + 1000, TORQUE, torque_nm=9.0 * np.sin(crank["crank_angle_rad"])
    )
    return np.stack([crank, torque], axis=1).ravel()


def messy() -> np.ndarray:
    """Eight seconds with repeats, late and faulty samples, gaps, a stray stamp and a step back."""
    stream = with_torque(walk(8.0))
    stream = np.concatenate([stream[:600], stream[590:600], stream[800:900], stream[1200:]])
    stream["fault"][100:140:7] = EMPTY
    stream[[200, 203]] = stream[[203, 200]]
    stream["stamp_ns"][450] += 10**15
    stream["stamp_ns"][700:] -= 5 * SECOND
    stream["crank_angle_rad"][300:310] = np.nan
    return stream


def reported(monitor: lw.WearMonitor, blocks: Iterable[np.ndarray]) -> list[object]:
    """All that a monitor reports of some blocks, comparable: a NaN has its repr."""
    reports = [monitor.update(block) for block in blocks]
    names = [field.name for field in attrs.fields(type(reports[0].samples))]
    columns = [np.concatenate([getattr(each.samples, name) for each in reports]) for name in names]
    return [
        [column.tobytes() for column in columns],
        [repr(cycle) for each in reports for cycle in each.cycles],
        [repr(change) for each in reports for change in each.alarms],
        [repr(change) for each in reports for change in each.verdicts],
        [state.state.to_json() for each in reports for state in each.states],
        repr(reports[-1].lost),
        monitor.wear_depth_m.tobytes(),
    ]


def test_reports_do_not_depend_on_the_blocks(monitor_of) -> None:
    stream, limits = (
        messy(),
        {"limits__impact_force_n": 3000.0, "limits__clearance_m": 3.5e-4, "alarms__on_delay_cycles": 2},
    )
    whole = reported(monitor_of(**limits), [stream])
    assert len(whole[1]) >= 2 and len(whole[2]) >= 3  # there were gait cycles and alarms
    random = np.random.default_rng(7)
    for cuts in (
        range(1, len(stream), 97),
        np.sort(random.integers(0, len(stream), 12)),
        range(400, 800),  # blocks of one sample
    ):
        blocks = [block for block in np.split(stream, list(cuts)) if len(block)]
        assert reported(monitor_of(**limits), blocks) == whole


def test_repeats_and_the_order_within_the_window_change_nothing(monitor_of) -> None:
    stream = with_torque(walk(3.0))
    mixed = np.concatenate([stream, stream[100:110]])
    mixed["stamp_ns"][-10:] = stream["stamp_ns"][100:110]
    mixed = mixed[np.argsort(mixed["stamp_ns"] + (np.arange(len(mixed)) % 3 - 1) * 6_000_000, kind="stable")]
    monitor, other = monitor_of(), monitor_of()
    monitor.update(stream), other.update(mixed)
    assert other.wear_depth_m.tobytes() == monitor.wear_depth_m.tobytes()
    assert other.lost.duplicates == 10


def test_every_sample_is_used_or_counted_as_lost(monitor_of) -> None:
    """The last ones wait for the window of the order."""
    stream, monitor = messy(), monitor_of()
    monitor.update(stream)
    lost = monitor.lost
    assert lost.faulty["empty"] == np.count_nonzero(stream["fault"])
    assert lost.stray_stamps >= 1 and lost.duplicates == 10
    left = len(stream) - sum(monitor.used.values()) - sum(lost.faulty.values())
    left -= lost.duplicates + lost.late + lost.stray_stamps + lost.outliers + lost.already_counted
    assert 0 <= left < 40


@pytest.mark.parametrize(("gap_s", "is_lost"), [(0.2, False), (2.0, True)])
def test_a_short_gap_is_bridged_and_a_long_one_costs_its_time(
    monitor_of, gap_s: float, is_lost: bool
) -> None:
    monitor = monitor_of()
    monitor.update(walk(3.0))
    worn = monitor.wear_depth_m
    monitor.update(walk(3.0, begin_s=3.0 + gap_s))
    assert (monitor.lost.gaps_lost, monitor.lost.gaps_bridged) == ((1, 0) if is_lost else (0, 1))
    assert (monitor.lost.unmonitored_s > gap_s) == is_lost
    assert monitor.wear_of("A").moving_s == pytest.approx(6.0 if is_lost else 6.0 + gap_s, abs=0.7)
    assert (monitor.wear_depth_m >= worn).all()


def test_the_leg_does_not_depend_on_the_date(monitor_of) -> None:
    early, late = walk(3.0), walk(3.0)
    late["stamp_ns"] += 10**9 * SECOND // 10
    monitor, other = monitor_of(), monitor_of()
    cycles, others = monitor.update(early).cycles, other.update(late).cycles
    assert [each.joints for each in cycles] == [each.joints for each in others]
    assert [each.stamp_ns + 10**9 * SECOND // 10 for each in cycles] == [each.stamp_ns for each in others]
    assert other.wear_depth_m.tobytes() == monitor.wear_depth_m.tobytes()


@pytest.mark.chaotic
def test_a_steady_gait_wears_as_a_steady_simulation(monitor_of, leg) -> None:
    """Bounds: five sigma of a mean over ten gait cycles (test_sample_bags)."""
    monitor = monitor_of()
    reports = monitor.update(walk(14.0, noise_rad=0.0))
    cycles = reports.cycles[2:]
    steady = lw.simulate(leg, cycles=10, skip_cycles=2)
    assert [cycle.cadence_rpm for cycle in cycles] == pytest.approx([60.0] * len(cycles), abs=0.1)
    for k, (joint, bound) in enumerate({"A": 0.03, "B": 0.16, "G": 0.15}.items()):
        force_n = np.mean([cycle.joints[k].mean_force_n for cycle in cycles])
        assert force_n == pytest.approx(steady.joints[joint].mean_force_n, rel=0.03)
        opened_m = (cycles[-1].joints[k].clearance_m - cycles[0].joints[k].clearance_m) / (len(cycles) - 1)
        worn = steady.joints[joint].wear_depth_m_per_cycle
        assert opened_m == pytest.approx(worn.bushing_mean + worn.journal_mean, rel=2.0 * bound)
        assert monitor.clearances_m[k] == pytest.approx(
            3.0e-4 + monitor.wear_depth_m[k].mean(axis=1).sum(), rel=1.0e-9
        )


def test_a_leg_at_rest_does_not_wear(monitor_of) -> None:
    """Until its journals lie in their bushings, they may slide."""
    n = np.arange(6 * RATE_HZ)
    still = lw.gait_samples(START_NS + n * (SECOND // RATE_HZ), crank_angle_rad=np.full(len(n), 0.7))
    monitor = monitor_of()
    monitor.update(still[: 3 * RATE_HZ])
    settled, moving_s = monitor.wear_depth_m, monitor.wear_of("A").moving_s
    reports = monitor.update(still[3 * RATE_HZ :])
    assert not reports.cycles and monitor.wear_of("A").moving_s == moving_s
    assert monitor.wear_depth_m == pytest.approx(settled, abs=1.0e-15)


def test_a_worn_joint_is_new_after_a_reset_and_the_others_stay(monitor_of) -> None:
    monitor = monitor_of(wear_acceleration=1.0e5, diagnosis__enabled=False)
    monitor.update(walk(3.0))
    worn, k = monitor.wear_depth_m, monitor.clearance_joints.index("G")
    assert (worn.max(axis=(1, 2)) > 0.0).all()
    monitor.reset_wear("G", START_NS + 3 * SECOND, "ann")
    now = monitor.wear_depth_m
    assert not now[k].any()
    assert np.delete(now, k, axis=0).tobytes() == np.delete(worn, k, axis=0).tobytes()
    parts = {joint: monitor.wear_of(joint) for joint in monitor.clearance_joints}
    assert all(part.name == joint for joint, part in parts.items())
    assert [joint for joint, part in parts.items() if part.moving_s == 0.0] == ["G"]
    with pytest.raises(lw.LegWearError, match="Q"):
        monitor.reset_wear("Q", START_NS, "ann")


@pytest.mark.chaotic
def test_an_alarm_comes_after_its_delay_and_stays_until_it_is_acknowledged(monitor_of, parameters) -> None:
    monitor = monitor_of(
        limits__clearance_m=2.0e-4, alarms__on_delay_cycles=2
    )  # below the clearance when new
    reports = monitor.update(walk(6.0))
    (rises, *_) = (
        change.stamp_ns
        for change in reports.alarms
        for alarm in change.alarms
        if alarm.name == "clearance G" and alarm.level == 2
    )
    assert reports.cycles[1].stamp_ns <= rises < reports.cycles[2].stamp_ns
    monitor.configure(lw.load_config(parameters()))
    monitor.update(walk(3.0, begin_s=6.0))

    def alarm() -> object:
        return next(each for each in monitor.alarms.alarms if each.name == "clearance G")

    assert (alarm().present, alarm().level, alarm().acknowledged) == (0, 2, False)  # latched
    assert monitor.verdict.verdict.state.value in ("inspect", "stop")
    cleared, kept = monitor.acknowledge(START_NS + 9 * SECOND)
    assert "clearance G" in {each.name for each in cleared} - {each.name for each in kept}
    assert alarm().level == 0


@pytest.mark.chaotic
def test_a_present_alarm_is_acknowledged_and_stays(monitor_of) -> None:
    monitor = monitor_of(limits__impact_force_n=50.0)
    monitor.update(walk(4.0))
    cleared, kept = monitor.acknowledge(START_NS + 4 * SECOND)
    assert "impact_force A" in {each.name for each in kept} - {each.name for each in cleared}
    alarm = next(each for each in monitor.alarms.alarms if each.name == "impact_force A")
    assert (alarm.level, alarm.acknowledged) == (2, True)


@pytest.mark.chaotic
def test_an_alarm_outlives_a_restart(leg, parameters, tmp_path) -> None:
    file = parameters(limits__impact_force_n=50.0, ledger__path=str(tmp_path / "wear.ledger"))
    config = lw.load_config(file)
    monitor = lw.WearMonitor(leg, config, lw.open_ledger(leg, config))
    monitor.update(walk(4.0))
    levels = {alarm.name: alarm.level for alarm in monitor.alarms.alarms}
    assert levels["impact_force A"] == 2
    monitor.close()
    again = lw.WearMonitor(leg, config, lw.open_ledger(leg, config))
    assert {alarm.name: alarm.level for alarm in again.alarms.alarms} == levels
    again.close()


@pytest.mark.chaotic
def test_a_measured_clearance_beyond_its_limit_keeps_its_alarm_while_the_leg_walks(monitor_of) -> None:
    """Also a measurement that contradicts the model, and so does not count for the forecast."""
    monitor = monitor_of()
    monitor.update(walk(3.0))
    assert not monitor.measure("G", 3.0e-3, 5.0e-6, START_NS + 3 * SECOND, "ann").measurement.counts
    assert monitor.update(walk(3.0, begin_s=3.0)).cycles
    alarm = next(each for each in monitor.alarms.alarms if each.name == "clearance G")
    assert (alarm.present, alarm.value) == (2, 3.0e-3)


@pytest.mark.parametrize(
    ("joint", "clearance_m", "sigma_m", "said"),
    [
        ("g", 9.0e-4, 5.0e-6, "'g' is not a clearance joint. Expected one of A, B, G, I, J; did you mean G?"),
        ("G", 4.2e-7, 5.0e-6, "0.00042 mm is not between 0.003 mm, 1 % of the new clearance of joint G"),
        ("G", -1.0, 5.0e-6, "-1000 mm is not between"),
        ("G", np.nan, 5.0e-6, "nan mm is not between"),
        ("G", 9.0e-4, 0.0, "0 mm is not a standard deviation from 0.0001 mm to 0.9 mm"),
        ("G", 9.0e-4, np.nan, "nan mm is not a standard deviation"),
        ("G", 9.0e-4, 1.0e-2, "10 mm is not a standard deviation from 0.0001 mm to 0.9 mm"),
    ],
)
def test_a_clearance_that_cannot_be_measured_is_refused(
    monitor_of, joint, clearance_m, sigma_m, said
) -> None:
    with pytest.raises(lw.ConfigError) as refused:
        monitor_of().measure(joint, clearance_m, sigma_m, START_NS, "ann")
    assert said in str(refused.value) and "\n" not in str(refused.value)


def test_counts_of_an_encoder_are_read_as_its_angle(parameters) -> None:
    counts, per_turn = np.arange(600) * 4096 // RATE_HZ, 4096
    columns = {"time": np.arange(600) / RATE_HZ, "drive_torque": np.zeros(600)}
    inputs = {"table__units__crank_angle": "counts", "table__counts_per_turn": float(per_turn)}
    counted = lw.replay({**columns, "crank_angle": counts % per_turn}, parameters(**inputs)).summary()
    angles = 2.0 * np.pi * (counts % per_turn) / per_turn
    of_angles = lw.replay({**columns, "crank_angle": angles}).summary()
    assert counted.cycles == of_angles.cycles >= 1


@pytest.mark.chaotic
def test_the_forecast_holds_the_time_that_a_worn_joint_then_takes(monitor_of) -> None:
    """All joints wear at half a millionth of an hour's pace; A's growth is steady, so is its forecast."""
    limit_m = 3.5e-4  # beyond the error of a new clearance
    monitor = monitor_of(
        wear_acceleration=1.0e5,
        limits__clearance_m=limit_m,
        diagnosis__enabled=False,
    )
    at_limit: dict[str, int] = {}
    forecasts: dict[str, list[tuple[int, object]]] = {joint: [] for joint in monitor.clearance_joints}
    for begin_s in range(0, 40, 4):
        for cycle in monitor.update(walk(4.0, begin_s=begin_s)).cycles:
            for joint in cycle.joints:
                if joint.clearance_m >= limit_m:
                    at_limit.setdefault(joint.joint, cycle.cycle)
                elif joint.forecast and joint.forecast.cycles:
                    forecasts[joint.joint].append((cycle.cycle, joint.forecast.cycles))
    assert "A" in at_limit
    for joint, then in at_limit.items():
        held = [life.p10 <= then - cycle <= life.p90 for cycle, life in forecasts[joint]]
        assert len(held) >= 3 and np.mean(held) > 0.7, joint
