"""Inputs of a healthy leg whose sensors or drivers fail: the input is named, and no joint is accused."""

import re
from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import leg_wear_monitor as lw

BAG = lw.share_directory() / "bags" / "healthy.mcap"
CRANK, TORQUE, LOAD, TURN = 0, 1, 2, 2.0 * np.pi


@attrs.frozen(eq=False)
class Walk:
    """Stamps [ns] and crank angles [rad], stamps and drive torques [N m] of the healthy recording."""

    crank_ns: np.ndarray
    angle: np.ndarray
    torque_ns: np.ndarray
    torque: np.ndarray

    def samples(self) -> np.ndarray:
        """All samples in the order of their stamps."""
        crank = lw.gait_samples(self.crank_ns, crank_angle_rad=self.angle)
        torque = lw.gait_samples(self.torque_ns, TORQUE, torque_nm=self.torque)
        both = np.concatenate([crank, torque])
        return both[np.argsort(both["stamp_ns"], kind="stable")]


@pytest.fixture(scope="module")
def walk() -> Walk:
    make_reader = pytest.importorskip("mcap.reader").make_reader
    decoder = pytest.importorskip("mcap_ros2.decoder").DecoderFactory()
    crank, torque = [], []
    with BAG.open("rb") as file:
        for _, channel, _, message in make_reader(file, decoder_factories=[decoder]).iter_decoded_messages():
            stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            if channel.topic == "/joint_states":
                crank.append((stamp_ns, message.position[list(message.name).index("crank")]))
            elif channel.topic == "/drive_torque":
                torque.append((stamp_ns, message.wrench.torque.z))
    (crank_ns, angle), (torque_ns, values) = zip(*crank, strict=True), zip(*torque, strict=True)
    return Walk(np.array(crank_ns), np.array(angle), np.array(torque_ns), np.array(values))


def replaced(share: float, value: float) -> Callable[[Walk], Walk]:
    """A function that replaces a fraction of the torques, at random, by a value."""

    def change(walk: Walk) -> Walk:
        is_spike = np.random.default_rng(9).random(len(walk.torque)) < share
        return attrs.evolve(walk, torque=np.where(is_spike, value, walk.torque))

    return change


def torques(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Walk], Walk]:
    """A function that changes the torques of a walk."""
    return lambda walk: attrs.evolve(walk, torque=change(walk.torque))


def angles(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Walk], Walk]:
    """A function that changes the continuous crank angles of a walk."""
    return lambda walk: attrs.evolve(walk, angle=change(np.unwrap(walk.angle)))


def from_half(torque: np.ndarray, value: float) -> np.ndarray:
    return np.where(np.arange(len(torque)) < len(torque) // 2, torque, value)


def arrival(ms: float) -> Callable[[Walk], Walk]:
    """A function that stamps samples when they arrive: later by a random time, in the same order."""

    def late(stamp_ns: np.ndarray) -> np.ndarray:
        delay_ns = np.random.default_rng(8).exponential(1.0e6 * ms, len(stamp_ns)).astype(np.int64)
        spacing = 50_000 * np.arange(len(stamp_ns))
        return np.maximum.accumulate(stamp_ns + delay_ns - spacing) + spacing

    return lambda walk: attrs.evolve(walk, crank_ns=late(walk.crank_ns), torque_ns=late(walk.torque_ns))


def coarse(ms: int) -> Callable[[Walk], Walk]:
    """A function that rounds the stamps down."""
    step_ns = 1_000_000 * ms
    return lambda walk: attrs.evolve(
        walk, crank_ns=walk.crank_ns // step_ns * step_ns, torque_ns=walk.torque_ns // step_ns * step_ns
    )


def held(walk: Walk) -> Walk:
    """The crank angle changes with every tenth sample only."""
    first = np.arange(len(walk.angle)) // 10 * 10
    return attrs.evolve(walk, angle=walk.angle[first])


def jumps(walk: Walk) -> Walk:
    """The encoder loses a quarter of a turn at half of the walk."""
    return attrs.evolve(walk, angle=walk.angle + from_half(0.0 * walk.angle, 0.25 * TURN))


CASES: dict[str, tuple[Callable[[Walk], Walk], str]] = {
    "zero": (torques(lambda torque: 0.0 * torque), "TORQUE_CONSTANT"),
    "constant": (torques(lambda torque: 0.0 * torque + 3.7), "TORQUE_CONSTANT"),
    "denormal": (torques(lambda torque: 1.0e-308 * torque), "TORQUE_CONSTANT"),
    "frozen": (torques(lambda torque: from_half(torque, torque[len(torque) // 2])), "TORQUE_CONSTANT"),
    "dead": (torques(lambda torque: from_half(torque, 0.0)), "TORQUE_CONSTANT"),
    "saturated": (torques(lambda torque: np.clip(torque, -5.0, 5.0)), "TORQUE_SATURATED"),
    "spikes": (replaced(0.005, 600.0), "NONE"),
    "overflow": (replaced(0.015, -32767.0), "NONE"),
    "constant with noise": (
        torques(lambda torque: 3.7 + 1.0e-3 * np.random.default_rng(1).standard_normal(len(torque))),
        "TORQUE_CONSTANT",
    ),
    "sine": (
        torques(lambda torque: 5.0 * np.sin(0.0534 * np.arange(len(torque)))),
        "TORQUE_NOT_OF_GAIT",
    ),
    "torque held": (torques(lambda torque: torque[np.arange(len(torque)) // 8 * 8]), "TORQUE_HELD"),
    "1e300": (replaced(0.08, 1.0e300), "TORQUE_SPIKES"),
    "every second is NaN": (
        torques(lambda torque: np.where(np.arange(len(torque)) % 2, torque, np.nan)),
        "BAD_INPUT",
    ),
    "noise": (
        torques(lambda torque: 8.0 * np.random.default_rng(1).standard_normal(len(torque))),
        "TORQUE_NOT_OF_GAIT",
    ),
    "arrival 1 ms": (arrival(1.0), "CRANK_STAMPS"),
    "arrival 2 ms": (arrival(2.0), "CRANK_STAMPS"),
    "arrival 4 ms": (arrival(4.0), "CRANK_STAMPS"),
    "coarse clock": (coarse(10), "CRANK_STAMPS"),
    "held": (held, "CRANK_HELD"),
    "jump": (jumps, "CRANK_JUMP"),
    "turns": (angles(lambda angle: angle / TURN), "CRANK_UNIT"),
    "wrapped turns": (angles(lambda angle: angle / TURN % 1.0), "CRANK_UNIT"),
    "wrapped degrees": (angles(lambda angle: np.degrees(angle) % 360.0), "TRACKING_LOST"),
    "none": (lambda walk: walk, "NONE"),
}

# What the sentence of a case says, and the numbers in it by the way in which the case was made.
NUMBERS: dict[str, tuple[str, tuple[float, ...]]] = {
    "constant": (r"stays at ([\d.]+) N m", (3.7,)),
    "saturated": (r"range .* \(([\d.]+) N m\)", (5.0,)),
    "torque held": (r"every ([\d.]+)th sample, at ([\d.]+) Hz", (8.0, 25.0)),
    "1e300": (r"^([\d.]+) % of the drive torques are spikes", (8.0,)),
    "every second is NaN": (r"(\d+) of .* infinite \((\d+) of drive_torque\)", (102.0, 102.0)),
    "arrival 1 ms": (r"scatter by ([\d.]+) ms \((\d+) % of the sampling period", (1.0, 20.0)),
    "coarse clock": (
        r"scatter by ([\d.]+) ms \((\d+) % of the sampling period",
        (2.89, 58.0),
    ),  # 10 / sqrt 12
    "held": (r"every ([\d.]+)th sample, at ([\d.]+) Hz", (10.0, 20.0)),
    "jump": (r"jumped by (\d+) mrad", (250.0 * TURN,)),
    "turns": (r"at ([\d.]+) of the commanded cadence: its unit seems to be turns", (1.0 / TURN,)),
}


def starts(standing_s: float) -> Callable[[Walk], Walk]:
    """A function that lets the leg stand before it walks."""

    def change(walk: Walk) -> Walk:
        before = np.arange(-round(200.0 * standing_s), 0)
        crank_ns, torque_ns = (all_ns[0] + 5_000_000 * before for all_ns in (walk.crank_ns, walk.torque_ns))
        torque = walk.torque[0] + 0.1 * np.random.default_rng(1).standard_normal(len(before))
        return Walk(
            np.append(crank_ns, walk.crank_ns),
            np.append(np.full(len(before), walk.angle[0]), walk.angle),
            np.append(torque_ns, walk.torque_ns),
            np.append(torque, walk.torque),
        )

    return change


def strayed(walk: Walk) -> Walk:
    """One of fifty crank angles is anywhere."""
    random = np.random.default_rng(5)
    is_stray = random.random(len(walk.angle)) < 0.02
    return attrs.evolve(walk, angle=np.where(is_stray, random.uniform(-3.0, 3.0, len(is_stray)), walk.angle))


FAULTS = {code for _, code in CASES.values()} - {"NONE"}
SOUND = {
    "outliers of the angle": strayed,
    **{f"stands for {s} s": starts(s) for s in (3.1, 3.2, 3.3, 3.4)},
    "torque in steps of 2 N m": torques(lambda torque: 2.0 * np.round(torque / 2.0)),
}


@pytest.mark.parametrize("case", SOUND)
def test_a_sound_input_is_never_named(leg: lw.Mechanism, walk: Walk, case: str) -> None:
    config = lw.load_config(BAG.with_suffix(".yaml"))
    monitor = lw.WearMonitor(
        leg, attrs.evolve(config, diagnosis=attrs.evolve(config.diagnosis, enabled=False))
    )
    found: set[str] = set()
    for part in np.array_split(SOUND[case](walk).samples(), 30):
        monitor.update(part)
        found.add(monitor.verdict.verdict.fault_code)
    assert not found & FAULTS


@pytest.mark.parametrize("case", CASES)
def test_the_input_is_named_and_no_joint_is_accused(leg: lw.Mechanism, walk: Walk, case: str) -> None:
    change, code = CASES[case]
    monitor = lw.WearMonitor(leg, lw.load_config(BAG.with_suffix(".yaml")))
    monitor.update(change(walk).samples())
    verdict = monitor.state.verdict
    assert (verdict.fault_code, verdict.joints) == (code, ())
    assert verdict.state.value not in ("stop", "inspect")
    if case in NUMBERS:
        pattern, numbers = NUMBERS[case]
        said = re.search(pattern, verdict.why)
        assert said and list(map(float, said.groups())) == pytest.approx(numbers, rel=0.15), verdict.why
    if case == "1e300":
        assert monitor.lost.torque_outliers > 50
    raised = [alarm for alarm in monitor.alarms.alarms if alarm.level.name == "ERROR"]
    assert {alarm.kind for alarm in raised} <= {"input_torque", "input_samples", "input_gaps", "input_rate"}


RECOVERS = ("zero", "frozen", "saturated", "arrival 2 ms", "held", "turns")
ELEVEN_TURNS_NS = 11 * 10**9
NO_FAULT = {"NO_GAIT_CYCLE", "TORQUE_NOT_COMPARED", "NONE"}


@pytest.mark.parametrize("case", RECOVERS)
def test_a_fault_that_begins_and_ends_is_named_alone(leg: lw.Mechanism, walk: Walk, case: str) -> None:
    """The leg walks, its input fails for eleven turns, and the leg walks on."""
    change, code = CASES[case]
    config = lw.load_config(BAG.with_suffix(".yaml"))
    config = attrs.evolve(config, diagnosis=attrs.evolve(config.diagnosis, enabled=False))
    monitor = lw.WearMonitor(leg, config)
    found: list[set[str]] = [set(), set(), set()]
    for number, codes in enumerate(found):
        samples = (change(walk) if number == 1 else walk).samples()
        samples = samples[samples["stamp_ns"] < walk.crank_ns[0] + ELEVEN_TURNS_NS]
        samples["stamp_ns"] += number * ELEVEN_TURNS_NS
        for piece in np.array_split(samples, 44):
            monitor.update(piece)
            codes.add(monitor.verdict.verdict.fault_code)
    before, during, after = found
    assert before <= NO_FAULT
    assert code in during <= NO_FAULT | {code}
    assert after <= NO_FAULT | {code, "ALARM"}  # an alarm stays until it is acknowledged
    assert monitor.verdict.verdict.fault_code in NO_FAULT | {"ALARM"}


@pytest.mark.parametrize("share", [0.03, 0.045])
def test_spikes_that_are_many_at_times_do_not_flicker(leg: lw.Mechanism, walk: Walk, share: float) -> None:
    """They are left out, or named until they are few; a torque that came is never missing."""
    monitor, codes = lw.WearMonitor(leg, lw.load_config(BAG.with_suffix(".yaml"))), ["NO_GAIT_CYCLE"]
    for part in np.array_split(replaced(share, 600.0)(walk).samples(), 40):
        monitor.update(part)
        code = monitor.verdict.verdict.fault_code
        codes += [code] if code != codes[-1] else []
    assert "NO_DRIVE_TORQUE" not in codes
    assert codes.count("TORQUE_SPIKES") <= 1


def rewritten(
    path: Path, change: Callable[[str, bytes], bytes], logged: Callable[[int], int] = lambda ns: ns
) -> Path:
    """The recording with changed messages, and changed log times [ns], in a new file."""
    make_reader = pytest.importorskip("mcap.reader").make_reader
    writer_of = pytest.importorskip("mcap.writer").Writer
    with BAG.open("rb") as source, path.open("wb") as file:
        writer, channels = writer_of(file), {}
        writer.start()
        for schema, channel, message in make_reader(source).iter_messages():
            if channel.topic not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, "cdr", number)
            data = change(channel.topic, message.data)
            log_ns = logged(message.log_time)
            writer.add_message(channels[channel.topic], log_ns, data, message.publish_time)
        writer.finish()
    return path


def about_x(topic: str, data: bytes) -> bytes:
    """The torque about z becomes the one about x; the one about z is 0."""
    return data[:-24] + data[-8:] + bytes(16) if topic == "/drive_torque" else data


def test_a_torque_about_a_different_axis_names_the_axis(tmp_path: Path) -> None:
    result = lw.replay(rewritten(tmp_path / "about_x.mcap", about_x), BAG.with_suffix(".yaml"))
    summary = result.summary()
    assert summary.verdict.fault_code == "TORQUE_CONSTANT" and summary.verdict.joints == ()
    (finding,) = (one.text for one in summary.recording.findings)
    assert "the torque about z does not change, but about x it does" in finding
    assert "set drive_torque.axis to x" in finding


def named_twice(topic: str, data: bytes) -> bytes:
    """CDR of a message with two joints of the same name, in place of one."""
    if topic != "/joint_states":
        return data
    header, name, position, none = data[:20], data[24:36], data[44:52], bytes(4)
    two = (2).to_bytes(4, "little")
    return header + two + name + name + two + position + position + none + none


def test_a_joint_that_is_named_twice_is_refused(tmp_path: Path) -> None:
    path = rewritten(tmp_path / "twice.mcap", named_twice)
    with pytest.raises(lw.LegWearError, match="joints 1 and 2 of joint_states are both named 'crank'"):
        lw.replay(path, BAG.with_suffix(".yaml"))


WEEK_S = 7 * 86400


@pytest.mark.parametrize("as_bag", [True, False])
def test_a_pause_inside_a_file_is_reported_and_left_out(tmp_path: Path, walk: Walk, as_bag: bool) -> None:
    """A week passes at half of the walk, or the clock is set: alike in a bag and in a table."""
    half_ns = int(np.median(walk.crank_ns))

    def later(topic: str, data: bytes) -> bytes:
        second = int.from_bytes(data[4:8], "little")
        is_late = 10**9 * second + int.from_bytes(data[8:12], "little") > half_ns
        return data[:4] + (second + is_late * WEEK_S).to_bytes(4, "little") + data[8:]

    if as_bag:
        path = rewritten(tmp_path / "paused.mcap", later, lambda ns: ns + (ns > half_ns) * WEEK_S * 10**9)
        summary = lw.replay(path, BAG.with_suffix(".yaml")).summary()
    else:
        time_s = 1.0e-9 * walk.crank_ns + (walk.crank_ns > half_ns) * WEEK_S
        torque = np.interp(walk.crank_ns, walk.torque_ns, walk.torque)
        table = {"time": time_s, "crank_angle": walk.angle, "drive_torque": torque}
        summary = lw.replay(table).summary()
    assert summary.recording.duration_s == pytest.approx(1.0e-9 * np.ptp(walk.crank_ns), abs=0.1)
    texts = [one.text for one in summary.recording.findings]
    assert any("has no samples for 7 days" in text for text in texts), texts


def test_a_clock_that_is_set_back_is_reported_alike_in_a_bag_and_in_a_table(
    tmp_path: Path, walk: Walk
) -> None:
    """Two parts of the walk have the same times; only where log times repeat as well, they are mixed."""
    half_ns, step_ns = int(np.median(walk.crank_ns)), 3 * 10**9

    def earlier(topic: str, data: bytes) -> bytes:
        second = int.from_bytes(data[4:8], "little")
        is_late = 10**9 * second + int.from_bytes(data[8:12], "little") > half_ns
        return data[:4] + (second - is_late * step_ns // 10**9).to_bytes(4, "little") + data[8:]

    torque = np.interp(walk.crank_ns, walk.torque_ns, walk.torque)
    stamps = walk.crank_ns - (walk.crank_ns > half_ns) * step_ns
    table = {"time": 1.0e-9 * stamps, "crank_angle": walk.angle, "drive_torque": torque}
    stamped = rewritten(tmp_path / "stamped.mcap", earlier)
    logged = rewritten(tmp_path / "logged.mcap", earlier, lambda ns: ns - (ns > half_ns) * step_ns)
    texts = []
    for recording in (stamped, table, logged):
        summary = lw.replay(recording, BAG.with_suffix(".yaml")).summary()
        (finding,) = (one.text for one in summary.recording.findings)
        assert "has stamps that go back by 3 s after 2026-" in finding
        texts.append(finding)
        if recording is not logged:
            assert summary.cycles >= 8
            faults = lw.commission(recording, config=BAG.with_suffix(".yaml")).faults
            assert finding in [one.text for one in faults]
    assert len(set(texts)) == 1
    with pytest.raises(lw.LegWearError, match="the clock was set back, also for the log times"):
        lw.commission(logged, config=BAG.with_suffix(".yaml"))


SIGNALS = {
    "zero": lambda angle: 0.0 * angle,
    "constant": lambda angle: 0.0 * angle + 3.7,
    "tiny": lambda angle: 1.0e-308 * np.sin(angle),
    "huge": lambda angle: 1.0e300 * np.sin(angle),
    "infinite": lambda angle: np.where(np.sin(angle) > 0.5, np.inf, angle),
    "missing": lambda angle: np.where(np.sin(angle) > 0.0, np.nan, angle),
    "repeated": lambda angle: np.repeat(angle[::8], 8)[: len(angle)],
    "noise": lambda angle: np.random.default_rng(1).standard_normal(len(angle)),
    "sound": lambda angle: 9.0 * np.sin(angle),
    "angle": lambda angle: angle,
}


signals = st.sampled_from(sorted(SIGNALS))


@settings(max_examples=12, deadline=None)
@given(
    angles=st.lists(signals, min_size=1, max_size=3), torque=signals, load=signals, is_watched=st.booleans()
)
def test_nothing_that_arrives_ends_the_monitor(
    leg: lw.Mechanism, parameters, angles: list[str], torque: str, load: str, is_watched: bool
) -> None:
    """Nor its search for the crank's zero, its encoders and its foot load, after a crank that is sound."""
    watched = {
        "crank__zero": "at_start",
        "encoders__names": ["hip", "knee"],
        "encoders__joints": ["B", "G"],
        "foot_load__source": "wrench",
        "load__model": "measured",
        "diagnosis__enabled": False,
    }
    config = lw.load_config(parameters(**watched)) if is_watched else lw.MonitorConfig()
    monitor, angle = lw.WearMonitor(leg, config), TURN * np.arange(600) / 100.0
    for number, name in enumerate(["angle", *angles] if is_watched else angles):
        stamp_ns = 10**18 + 10_000_000 * (number * len(angle) + np.arange(len(angle)))
        crank = lw.gait_samples(stamp_ns, crank_angle_rad=SIGNALS[name](angle))
        crank["encoder_rad"][:, 0], crank["encoder_rad"][:, 1] = SIGNALS[name](angle), angle
        drive = lw.gait_samples(stamp_ns + 1000, TORQUE, torque_nm=SIGNALS[torque](angle))
        foot = lw.gait_samples(stamp_ns + 2000, LOAD)
        foot["foot_force_n"][:] = SIGNALS[load](angle)[:, None]
        with np.errstate(over="ignore", invalid="ignore"):
            monitor.update(np.stack([crank, drive, foot], axis=1).ravel())
    assert monitor.state.verdict.joints == ()
    assert np.isfinite(monitor.clearances_m).all()


@settings(max_examples=10, deadline=None)
@given(angle=signals, torque=signals)
def test_commission_proposes_or_says_why_not(angle: str, torque: str) -> None:
    turned = TURN * np.arange(1200) / 100.0
    columns = {"crank_angle": SIGNALS[angle](turned), "drive_torque": SIGNALS[torque](turned)}
    try:
        result = lw.commission({"time": 1.0e9 + 0.01 * np.arange(1200), **columns})
    except lw.LegWearError as error:
        assert str(error)
        return
    assert result.not_told if result.config is None else np.isfinite(result.config.crank.offset_rad)
